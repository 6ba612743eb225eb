"""Layouts in a file a person can read and change: JSON with vertices, quads, and the edges that are not straight.

    {"patchwright layout": 1,
     "vertices": [[x, y, z], …],
     "quads": [[a, b, c, d], …],                          counter-clockwise from outside, vertices counted from 0
     "tags": [0, …],                                      the part of each quad; may be left out
     "edges": [{"ends": [a, b], "sharp": true, "path": [[x, y, z], …]}, …]}

Edges that are not listed, or have no path, run straight; patches find the surface by projection all the same.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import CorruptFile, GeometryError
from patchwright.models.io.atomic import replacing
from patchwright.repair.layout.quad_layout import QuadLayout

MARK, VERSION = "patchwright layout", 1


def save_layout(path: Path | str, layout: QuadLayout) -> None:
    """Write a layout; `load_layout` gives it back bit for bit, its report apart.

    Raises
    ------
    ParameterError : the file cannot be written.
    """
    edges = [
        {"ends": layout.edges[i].tolist(), "sharp": bool(layout.sharp[i]), "path": layout.path(i)[1:-1].tolist()}
        for i in range(len(layout.edges))
    ]
    told = {
        MARK: VERSION,
        "vertices": layout.vertices.tolist(),
        "quads": layout.quads.tolist(),
        "tags": layout.tags.tolist(),
        "edges": edges,
    }
    with replacing(Path(path)) as beside:
        beside.write_text(json.dumps(told), encoding="utf-8")


def load_layout(path: Path | str) -> QuadLayout:
    """Read a layout.

    Raises
    ------
    CorruptFile : not such a file, or a number in it that means nothing; the message names it.
    GeometryError : an edge of more than two quads.
    """
    path = Path(path)
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise CorruptFile(f"{path}: no such layout") from None
    except (OSError, ValueError) as error:
        raise CorruptFile(f"{path}: cannot be read as JSON: {error}") from None
    if not isinstance(told, dict) or told.get(MARK) != VERSION:
        raise CorruptFile(f'{path}: is no layout; it needs "{MARK}": {VERSION}')
    vertices = _numbers(path, told, "vertices", 3, float)
    quads = _numbers(path, told, "quads", 4, int)
    if quads.min() < 0 or quads.max() >= len(vertices):
        raise CorruptFile(f"{path}: quads name vertices from {quads.min()} to {quads.max()}, there are {len(vertices)}")
    tags = np.asarray(told.get("tags", np.zeros(len(quads))), dtype=np.int64)
    if tags.shape != (len(quads),):
        raise CorruptFile(f"{path}: tags must be one number per quad, got {len(tags)} for {len(quads)} quads")
    edges, quad_edges, turned, sides = _edges(quads)
    paths, sharp = _lines(path, told.get("edges", []), vertices, edges)
    used, numbers = np.unique(quads, return_inverse=True)  # vertices no quad uses any more are left out
    renumber = np.full(len(vertices), -1)
    renumber[used] = np.arange(len(used))
    return QuadLayout(
        vertices=vertices[used],
        quads=numbers.reshape(-1, 4),
        edges=renumber[edges],
        quad_edges=quad_edges,
        edge_reversed=turned,
        edge_quads=sides,
        sharp=sharp,
        boundary=sides[:, 1] < 0,
        path_offsets=np.concatenate([[0], np.cumsum([len(p) for p in paths])]),
        path_points=np.concatenate(paths),
        triangle=np.full(len(used), -1),
        tags=tags,
    )


def _numbers(path: Path, told: dict[str, Any], key: str, width: int, kind: type) -> Any:
    """(n, width) array of one entry, n >= 1."""
    try:
        values = np.array(told[key], dtype=np.float64)
    except (KeyError, TypeError, ValueError):
        values = np.zeros(0)
    if values.ndim != 2 or values.shape[1] != width or not len(values) or not np.isfinite(values).all():
        raise CorruptFile(f"{path}: {key} must be a list of {width} numbers each")
    return values.astype(np.int64) if kind is int else values


def _edges(quads: IntArray) -> tuple[IntArray, IntArray, BoolArray, IntArray]:
    """Edges (e, 2) of the quads, the edge of every side, which sides run backward, and the quads of every edge."""
    start, end = quads, np.roll(quads, -1, axis=1)
    pairs = np.stack([np.minimum(start, end), np.maximum(start, end)], axis=-1).reshape(-1, 2)
    edges, where, uses = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    if uses.max() > 2:
        a, b = edges[int(uses.argmax())]
        raise GeometryError(f"{uses.max()} quads share the edge between the vertices {a} and {b}")
    where = where.reshape(-1)
    order = np.argsort(where, kind="stable")
    first = np.searchsorted(where[order], np.arange(len(edges)))
    sides = np.full((len(edges), 2), -1)
    sides[:, 0] = order[first] // 4
    two = uses == 2
    sides[two, 1] = order[first[two] + 1] // 4
    return edges, where.reshape(-1, 4), start > end, sides


def _lines(path: Path, told: Any, vertices: Array, edges: IntArray) -> tuple[list[Array], BoolArray]:
    """The polyline of every edge, straight where none is told, and whether it is sharp."""
    number = {(int(a), int(b)): i for i, (a, b) in enumerate(edges)}
    inner: list[Array] = [np.zeros((0, 3))] * len(edges)
    sharp = np.zeros(len(edges), dtype=bool)
    for k, entry in enumerate(told):
        try:
            a, b = (int(v) for v in entry["ends"])
            points = np.array(entry.get("path", []), dtype=np.float64).reshape(-1, 3)
            crease = bool(entry.get("sharp", False))
        except (AttributeError, KeyError, TypeError, ValueError):
            raise CorruptFile(f"{path}: edge {k} must have two ends and, if any, a path of x, y, z") from None
        if not np.isfinite(points).all():
            raise CorruptFile(f"{path}: the path of edge {k} holds a number that is not finite")
        at = number.get((min(a, b), max(a, b)))
        if at is None:
            continue  # an edge whose quads were deleted
        inner[at], sharp[at] = points if a < b else points[::-1], crease
    return [
        np.concatenate([vertices[a : a + 1], p, vertices[b : b + 1]]) for (a, b), p in zip(edges, inner, strict=True)
    ], sharp
