"""`PatchNetwork`: bicubic patches over a quad layout, neighbours sharing one boundary curve each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.triangulation import Triangulation
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.edge_curves import EdgeCurves
from patchwright.repair.patches.patch_nets import PatchNets
from patchwright.repair.patches.spline_space import DEGREE, knots


@dataclass(frozen=True, slots=True, eq=False)
class PatchNetwork:
    """Patches that join exactly.

    Parameters
    ----------
    layout : the quads
    edges : one curve per edge of the layout
    nets : one bicubic net per quad; their boundary rows are the edge curves
    invented : (m, 8, 8) bool, cells of an 8 x 8 split of each patch whose surface gap filling made
    deviation : (m,) largest distance of each patch from the data it approximates, nan where there is none
    """

    layout: QuadLayout
    edges: EdgeCurves
    nets: PatchNets
    invented: BoolArray
    deviation: Array

    def __len__(self) -> int:
        return len(self.nets)

    def surfaces(self) -> tuple[NurbsSurface, ...]:
        """One bicubic surface per patch, normals outward, domain [0, 1] x [0, 1]."""
        out: list[NurbsSurface | None] = [None] * len(self)
        for (m, n), which, nets in self.nets.groups():
            for patch, net in zip(which, nets, strict=True):
                out[patch] = NurbsSurface((DEGREE, DEGREE), (knots(m), knots(n)), net)
        return tuple(s for s in out if s is not None)

    def curve(self, edge: int) -> NurbsCurve:
        """The curve two patches share, from the first to the second vertex of an edge of the layout."""
        rows = slice(self.edges.offsets[edge], self.edges.offsets[edge + 1])
        return NurbsCurve(DEGREE, knots(int(self.edges.cells[edge])), self.edges.controls[rows])

    def invented_nodes(self, intervals: int) -> BoolArray:
        """(m, intervals + 1, intervals + 1) which of `points` lie on surface that gap filling made."""
        cell = _nearest_cell(intervals)
        return self.invented[:, cell][:, :, cell]

    def points(self, intervals: int) -> Array:
        """(m, intervals + 1, intervals + 1, 3) equidistant points; the sides are the edge curves' own points."""
        points = self.nets.sample(intervals + 1)
        _put_sides(self.layout, points, self.edges.sample(intervals + 1)[:, 1:-1], self.layout.vertices)
        return points

    def tessellate(self, intervals: int) -> Triangulation:
        """Watertight triangles with `intervals` along every side, stored and named as in `tessellation_within`."""
        points = self.points(intervals)
        index = self._node_numbers(intervals)
        vertices = np.empty((int(index.max()) + 1, 3))
        vertices[index.reshape(-1)] = points.reshape(-1, 3)
        a, b, c, d = index[:, :-1, :-1], index[:, 1:, :-1], index[:, 1:, 1:], index[:, :-1, 1:]
        corner = [vertices[q] for q in (a, b, c, d)]
        short = np.linalg.norm(corner[2] - corner[0], axis=-1) <= np.linalg.norm(corner[3] - corner[1], axis=-1)
        first = np.where(short[..., None], np.stack([a, b, c], -1), np.stack([a, b, d], -1))
        second = np.where(short[..., None], np.stack([a, c, d], -1), np.stack([b, c, d], -1))
        t = np.linspace(0.0, 1.0, intervals + 1)
        u, v = np.meshgrid(t, t, indexing="ij")
        node = np.stack([u, v], -1)
        na, nb, nc, nd = node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]
        uv_first = np.where(short[..., None, None], np.stack([na, nb, nc], 2)[None], np.stack([na, nb, nd], 2)[None])
        uv_second = np.where(short[..., None, None], np.stack([na, nc, nd], 2)[None], np.stack([nb, nc, nd], 2)[None])
        triangles = np.stack([first, second], axis=3).reshape(-1, 3)
        uv = np.stack([uv_first, uv_second], axis=3).reshape(-1, 3, 2)
        tags = np.repeat(np.arange(len(self)), 2 * intervals * intervals)
        names = tuple(f"patch-{i + 1}" for i in range(len(self)))
        return Triangulation(vertices, triangles, uv=uv, tags=tags, tag_names=names)

    def _node_numbers(self, intervals: int) -> IntArray:
        """(m, intervals + 1, intervals + 1) number of each node, shared across edges."""
        layout, inner = self.layout, intervals - 1
        vertex_count, edge_count = len(layout.vertices), len(layout.edges)
        on_edge = vertex_count + np.arange(edge_count * inner).reshape(edge_count, inner)
        inside = vertex_count + edge_count * inner + np.arange(len(self) * inner * inner).reshape(-1, inner, inner)
        index = np.empty((len(self), intervals + 1, intervals + 1), dtype=np.int64)
        index[:, 1:-1, 1:-1] = inside
        _put_sides(layout, index, on_edge, np.arange(vertex_count))
        return index


def _put_sides(layout: QuadLayout, nodes: Any, inner: Any, corners: Any) -> None:
    """Write shared values into the sides (edges' inner nodes (e, count, ...)) and corners of `nodes` (m, n, n, ...)."""
    for k, (i, j) in enumerate(((slice(1, -1), 0), (-1, slice(1, -1)), (slice(1, -1), -1), (0, slice(1, -1)))):
        side = inner[layout.quad_edges[:, k]]
        backward = layout.edge_reversed[:, k] != (k >= 2)
        side[backward] = side[backward][:, ::-1]
        nodes[:, i, j] = side
    for k, (i, j) in enumerate(((0, 0), (-1, 0), (-1, -1), (0, -1))):
        nodes[:, i, j] = corners[layout.quads[:, k]]


def _nearest_cell(intervals: int) -> IntArray:
    """(intervals + 1,) which of 8 equal cells each node of a side falls into."""
    return np.minimum(np.arange(intervals + 1) * 8 // intervals, 7)
