"""Many kernel objects to arrays in one go, through the kernel's binary form instead of one call per number.

The layout is that of OpenCASCADE's BinTools format, version 4 (BinTools_ShapeSet::WriteTriangulation and
BinTools_SurfaceSet): little-endian, one section per kind, each headed by its name and count.
"""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.cad import kernel
from patchwright.models.errors import EngineError
from patchwright.models.nurbs_surface import NurbsSurface

RawMesh = tuple[Array, Array, IntArray]
"""Nodes (n, 3), their (u, v) (n, 2) and triangles (m, 3) wound along the surface's own normal."""

_SPLINE = 9  # the format's number of a B-spline surface
_KNOT = np.dtype([("value", "<f8"), ("count", "<i4")])


def triangulations(meshes: list[Any]) -> list[RawMesh]:
    """Distinct kernel triangulations, all with (u, v), as arrays."""
    data, at, count = _section([_bare(mesh) for mesh in meshes], b"Triangulations")
    _check(count, len(meshes))
    out: list[RawMesh] = []
    for _ in range(count):
        n, m = (int(k) for k in np.frombuffer(data, "<i4", 2, at))
        normals = data[at + 9]
        at += 10 + 8  # counts, has-uv, has-normals, deflection
        nodes = np.frombuffer(data, "<f8", 3 * n, at).reshape(n, 3)
        at += 24 * n
        uv = np.frombuffer(data, "<f8", 2 * n, at).reshape(n, 2)
        at += 16 * n
        triangles = np.frombuffer(data, "<i4", 3 * m, at).reshape(m, 3).astype(np.int64) - 1
        at += 12 * m + (12 * n if normals else 0)
        out.append((nodes, uv, triangles))
    return out


def spline_surfaces(surfaces: list[Any]) -> list[NurbsSurface]:
    """Distinct, not periodic kernel B-spline surfaces as NURBS."""
    data, at, count = _section([_bare(surface, 1e-7) for surface in surfaces], b"Surfaces")
    _check(count, len(surfaces))
    out = []
    for _ in range(count):
        if data[at] != _SPLINE or data[at + 3] or data[at + 4]:
            raise EngineError("the CAD kernel wrote its surfaces in a layout that is not known")
        rational = bool(data[at + 1] or data[at + 2])
        p, q = (int(x) for x in np.frombuffer(data, "<u2", 2, at + 5))
        n, m, k, l = (int(x) for x in np.frombuffer(data, "<i4", 4, at + 9))  # noqa: E741
        at += 25
        width = 4 if rational else 3
        net = np.frombuffer(data, "<f8", width * n * m, at).reshape(n, m, width)
        at += 8 * width * n * m
        pairs = np.frombuffer(data, _KNOT, k + l, at)
        at += 12 * (k + l)
        U = np.repeat(pairs["value"][:k], pairs["count"][:k])
        V = np.repeat(pairs["value"][k:], pairs["count"][k:])
        out.append(NurbsSurface((p, q), (U, V), net[..., :3], net[..., 3] if rational else None))
    return out


def _bare(*content: Any) -> Any:
    face = kernel.TopoDS_Face()
    kernel.BRep_Builder().MakeFace(face, *content)
    return face


def _section(faces: list[Any], name: bytes) -> tuple[bytes, int, int]:
    """The binary form of the faces, where the section begins in it, and how many items it has."""
    builder, block = kernel.BRep_Builder(), kernel.TopoDS_Compound()
    builder.MakeCompound(block)
    for face in faces:
        builder.Add(block, face)
    stream = BytesIO()
    kernel.BinTools.Write_s(block, stream)
    data = stream.getvalue()
    head = b"\n" + name + b" "
    marker = data.find(head)
    if marker < 0 or not data.lstrip().startswith(b"Open CASCADE Topology V4"):
        raise EngineError("the CAD kernel's binary form is not the one that is known (version 4)")
    start = data.find(b"\n", marker + 1) + 1
    return data, start, int(data[marker + len(head) : start])


def _check(found: int, wanted: int) -> None:
    if found != wanted:
        raise EngineError(f"the CAD kernel wrote {found} of {wanted} items")
