"""Slow, obvious definitions the mesh formats are tested against: files built by `struct`, equality of surfaces, area
of polygons."""

from __future__ import annotations

import struct
from collections.abc import Iterable

import numpy as np

from patchwright.models import Triangulation

TETRAHEDRON = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
TETRAHEDRON_FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def tetrahedron(scale: float = 1.0, shift: float = 0.0) -> Triangulation:
    """The unit corner tetrahedron: 4 vertices, 4 triangles, volume scale^3 / 6."""
    return Triangulation(scale * TETRAHEDRON + shift, TETRAHEDRON_FACES)


def binary_stl(corners: np.ndarray, count: int | None = None, head: bytes = b"") -> bytes:
    """A binary STL file of (m, 3, 3) corners; `count` overrides what the header says."""
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0) for triangle in corners)
    return head.ljust(80, b" ") + struct.pack("<I", len(corners) if count is None else count) + body


def ascii_stl(solids: Iterable[tuple[str, np.ndarray]]) -> str:
    """An ascii STL file of named (m, 3, 3) corners."""
    lines = []
    for name, corners in solids:
        lines.append(f"solid {name}")
        for triangle in corners.tolist():
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += [f"vertex {x!r} {y!r} {z!r}" for x, y, z in triangle]
            lines += ["endloop", "endfacet"]
        lines.append(f"endsolid {name}")
    return "\n".join(lines) + "\n"


def fortran(*records: bytes, order: str = "<", marker: str = "i") -> bytes:
    """Records between their lengths."""
    return b"".join((mark := struct.pack(order + marker, len(r))) + r + mark for r in records)


def plot3d_binary(
    blocks: list[np.ndarray],
    *,
    order: str = "<",
    width: int = 8,
    records: bool = True,
    many: bool = True,
    iblank: list[np.ndarray] | None = None,
    dimensions: int = 3,
) -> bytes:
    """A "whole" Plot3D file written value by value, i fastest, from (ni, nj, nk, 3) blocks."""
    parts = [struct.pack(order + "i", len(blocks))] if many else []
    parts.append(b"".join(struct.pack(f"{order}{dimensions}i", *b.shape[:dimensions]) for b in blocks))
    real = "d" if width == 8 else "f"
    for n, block in enumerate(blocks):
        body = b""
        for axis in range(dimensions):
            for k in range(block.shape[2]):
                for j in range(block.shape[1]):
                    for i in range(block.shape[0]):
                        body += struct.pack(order + real, block[i, j, k, axis])
        if iblank is not None:
            for k in range(block.shape[2]):
                for j in range(block.shape[1]):
                    for i in range(block.shape[0]):
                        body += struct.pack(order + "i", iblank[n][i, j, k])
        parts.append(body)
    return fortran(*parts, order=order) if records else b"".join(parts)


def same_surface(a: Triangulation, b: Triangulation) -> bool:
    """True when both have the same triangles in the same order, bit for bit."""
    return np.array_equal(a.corners, b.corners)
