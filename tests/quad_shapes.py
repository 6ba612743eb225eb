"""Quad layouts with known surfaces under them, for the tests of the patch chain."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from patchwright.repair.layout.blocks import Blocks
from patchwright.repair.layout.quad_layout import QuadLayout


class SphereTarget:
    """A sphere answering like a `Tree` that numbers its triangles anew each time; a slit where |z - 0.3| < slit / 2."""

    def __init__(self, radius: float = 1.0, slit: float = 0.0) -> None:
        self.radius, self.slit = radius, slit
        self.triangulation = SimpleNamespace(normals=np.zeros((0, 3)))
        self.inside_slit = np.zeros(1, dtype=bool)

    def _mark(self, points):
        z = points[:, 2] / self.radius
        return np.abs(z - 0.3) < self.slit / 2

    def closest(self, points):
        r = np.linalg.norm(points, axis=1, keepdims=True)
        onto = points / r * self.radius
        self.inside_slit = self._mark(onto)
        self.triangulation = SimpleNamespace(normals=onto / self.radius)
        return SimpleNamespace(points=onto, distance=np.abs(r[:, 0] - self.radius), triangle=np.arange(len(points)))

    def all_hits(self, a, b):
        d = b - a
        qa, qb, qc = (d * d).sum(1), 2 * (a * d).sum(1), (a * a).sum(1) - self.radius**2
        disc = qb * qb - 4 * qa * qc
        root = np.sqrt(np.maximum(disc, 0))
        t = np.stack([(-qb - root) / (2 * qa), (-qb + root) / (2 * qa)], axis=1)
        ray, k = np.nonzero((disc >= 0)[:, None] & (t >= 0) & (t <= 1))
        points = a[ray] + t[ray, k, None] * d[ray]
        offsets = np.concatenate([[0], np.cumsum(np.bincount(ray, minlength=len(a)))])
        self.triangulation = SimpleNamespace(normals=points / self.radius)
        self.inside_slit = self._mark(points)
        return SimpleNamespace(
            offsets=offsets, t=t[ray, k], triangle=np.arange(len(ray)), barycentric=np.full((len(ray), 3), 1 / 3)
        )


class Marks:
    """Which triangles of the target's latest answer are invented: those in its slit."""

    def __init__(self, target: SphereTarget) -> None:
        self.target = target

    def __getitem__(self, triangle):
        return self.target.inside_slit[triangle]


def sphere_layout(n: int, radius: float = 1.0) -> QuadLayout:
    """6 n^2 quads of a cube blown up to a sphere, great-circle paths."""
    g = np.tan(np.linspace(-1, 1, n + 1) * np.pi / 4)
    index: dict[tuple[float, ...], int] = {}
    points, quads = [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            for i in range(n):
                for j in range(n):
                    quad = []
                    for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                        p = np.zeros(3)
                        p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = side, g[a], g[b]
                        key = tuple(np.round(p, 9) + 0.0)
                        if key not in index:
                            index[key] = len(points)
                            points.append(radius * p / np.linalg.norm(p))
                        quad.append(index[key])
                    quads.append(quad if side > 0 else quad[::-1])
    vertices = np.array(points)

    def arc(a, b, count=17):
        t = np.linspace(0, 1, count)[:, None]
        line = (1 - t) * vertices[a] + t * vertices[b]
        return radius * line / np.linalg.norm(line, axis=1, keepdims=True)

    return layout_from_quads(vertices, np.array(quads), arc)


def layout_from_quads(vertices, quads, path, sharp=()) -> QuadLayout:
    """A layout from plain quads; `path(a, b)` gives an edge's polyline, `sharp` holds vertex pairs."""
    start, end = quads, np.roll(quads, -1, axis=1)
    pairs = np.stack([np.minimum(start, end), np.maximum(start, end)], axis=-1).reshape(-1, 2)
    edges, where = np.unique(pairs, axis=0, return_inverse=True)
    quad_edges = where.reshape(-1, 4)
    sides = np.full((len(edges), 2), -1)
    for quad, row in enumerate(quad_edges):
        for edge in row:
            sides[edge, 0 if sides[edge, 0] < 0 else 1] = quad
    paths = [path(a, b) for a, b in edges]
    creases = {tuple(sorted(pair)) for pair in sharp}
    return QuadLayout(
        vertices=vertices,
        quads=quads,
        edges=edges,
        quad_edges=quad_edges,
        edge_reversed=start > end,
        edge_quads=sides,
        sharp=np.array([tuple(e) in creases for e in edges.tolist()]),
        boundary=sides[:, 1] < 0,
        path_offsets=np.concatenate([[0], np.cumsum([len(p) for p in paths])]),
        path_points=np.concatenate(paths),
        triangle=np.full(len(vertices), -1),
        tags=np.zeros(len(quads), dtype=np.int64),
    )


def sheet(columns: int, rows: int, holes: tuple[tuple[int, int], ...] = (), bend: bool = False) -> QuadLayout:
    """A flat sheet of unit quads, rolled into a tube in x when `bend`, without the quads in `holes`."""
    width = columns if bend else columns + 1
    i, j = np.meshgrid(np.arange(width), np.arange(rows + 1), indexing="ij")
    angle = 2 * np.pi * i / columns
    points = np.stack([np.cos(angle), j, np.sin(angle)], -1) if bend else np.stack([i, j, 0 * i], -1)
    quads = [
        [a % width * (rows + 1) + b for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
        for i in range(columns)
        for j in range(rows)
        if (i, j) not in holes
    ]
    vertices = points.reshape(-1, 3).astype(np.float64)
    return layout_from_quads(vertices, np.array(quads), lambda a, b: vertices[[a, b]])


def torus_layout(columns: int, rows: int) -> QuadLayout:
    """Quads round a torus, a regular grid that closes both ways; straight paths."""
    i, j = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    after, above = (i + 1) % columns, (j + 1) % rows
    number = np.stack([i * rows + j, after * rows + j, after * rows + above, i * rows + above], -1)
    u, v = i * 2 * np.pi / columns, j * 2 * np.pi / rows
    points = np.stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)], -1).reshape(-1, 3)
    return layout_from_quads(points, number.reshape(-1, 4), lambda a, b: points[[a, b]])


def assert_rectangles(layout: QuadLayout, blocks: Blocks) -> None:
    """Every block holds each of its places once, and its quads meet where their places do."""
    key = np.column_stack([blocks.block, blocks.place])
    assert len(np.unique(key, axis=0)) == len(layout) == blocks.shape.prod(axis=1).sum()
    assert (blocks.place < blocks.shape[blocks.block]).all()
    assert (layout.sharp | layout.boundary <= blocks.wall).all()
    inside = np.flatnonzero(~blocks.wall)
    one, two = layout.edge_quads[inside].T
    assert (blocks.block[one] == blocks.block[two]).all()
    assert (np.abs(blocks.place[one] - blocks.place[two]).sum(axis=1) == 1).all()
