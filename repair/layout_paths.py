"""The edges of a quad mesh and the path each takes on the triangulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.features import SHARP, Features
from patchwright.repair.pairing import QuadMesh

PATH_POINTS = 9  # of a smooth edge


@dataclass(frozen=True, slots=True, eq=False)
class LayoutEdges:
    """Edges as in `QuadLayout`, and the share of the feature length they cover."""

    edges: IntArray
    quad_edges: IntArray
    edge_reversed: BoolArray
    edge_quads: IntArray
    sharp: BoolArray
    boundary: BoolArray
    path_offsets: IntArray
    path_points: Array
    coverage: float


def trace_paths(quad_mesh: QuadMesh, features: Features) -> LayoutEdges:
    """All edges with their paths: stretches of feature curves, or chords put on the surface."""
    from patchwright.repair import _quad_kernel as kernel

    mesh, ground, quads = quad_mesh.mesh, quad_mesh.ground, quad_mesh.quads
    n, m = len(mesh.X), len(quads)
    start, end = quads, np.roll(quads, -1, axis=1)
    key, number = np.unique(np.minimum(start, end) * n + np.maximum(start, end), return_inverse=True)
    number = number.reshape(m, 4)
    edges = np.stack([key // n, key % n], axis=1)
    e = len(edges)
    edge_quads = np.full((e, 2), -1, dtype=np.int64)
    flat = number.reshape(-1)
    order = np.argsort(flat, kind="stable")
    offsets = np.searchsorted(flat[order], np.arange(e + 1))
    edge_quads[:, 0] = order[offsets[:-1]] // 4
    twice = np.diff(offsets) > 1
    edge_quads[twice, 1] = order[offsets[:-1][twice] + 1] // 4
    # feature edges
    sides = quad_mesh.sides
    which = np.searchsorted(key, np.minimum(sides[:, 0], sides[:, 1]) * n + np.maximum(sides[:, 0], sides[:, 1]))
    curve = np.full(e, -1, dtype=np.int64)
    curve[which] = quad_mesh.side_curve
    kind = np.where(curve >= 0, features.kind[curve] if len(features.kind) else 0, 0)
    low = np.where(mesh.kind[sides[:, 0]] == 1, mesh.vs[sides[:, 0]], 0.0)
    high = np.where(mesh.kind[sides[:, 1]] == 1, mesh.vs[sides[:, 1]], features.lengths[quad_mesh.side_curve])
    arc_offsets = np.zeros(len(sides) + 1, dtype=np.int64)
    kernel.curve_paths(ground, quad_mesh.side_curve, low, high, arc_offsets, np.empty((0, 3)))
    stretch = np.empty((int(arc_offsets[-1]), 3))
    if len(stretch):
        kernel.curve_paths(ground, quad_mesh.side_curve, low, high, arc_offsets, stretch)
    # smooth edges
    smooth = np.flatnonzero(curve < 0)
    share = np.arange(1, PATH_POINTS - 1) / (PATH_POINTS - 1)
    inner = np.empty((len(smooth), len(share), 3))
    triangle = np.empty((len(smooth), len(share)), dtype=np.int64)
    one, two = edge_quads[smooth].T
    normals = quad_mesh.outward[one] + np.where((two >= 0)[:, None], quad_mesh.outward[two], 0.0)
    begin, finish = mesh.X[edges[smooth, 0]], mesh.X[edges[smooth, 1]]
    chord = begin[:, None] + share[None, :, None] * (finish - begin)[:, None]
    parents = np.ascontiguousarray(edges[smooth])
    kernel.land(mesh, ground, parents, quad_mesh.region[one], chord, normals, inner, triangle)
    # all paths in one array
    count = np.full(e, PATH_POINTS, dtype=np.int64)
    count[which] = np.diff(arc_offsets)
    path_offsets = np.concatenate([[0], np.cumsum(count)])
    points = np.empty((int(path_offsets[-1]), 3))
    points[path_offsets[smooth][:, None] + np.arange(1, PATH_POINTS - 1)] = inner
    backward = sides[:, 0] > sides[:, 1]
    row = np.repeat(np.arange(len(sides)), np.diff(arc_offsets))
    local = np.arange(len(stretch)) - arc_offsets[row]
    place = np.where(backward[row], count[which][row] - 1 - local, local)
    points[path_offsets[which][row] + place] = stretch
    points[path_offsets[:-1]] = mesh.X[edges[:, 0]]
    points[path_offsets[1:] - 1] = mesh.X[edges[:, 1]]
    total = float(features.lengths.sum())
    covered = float((high - low).sum())
    return LayoutEdges(
        edges,
        number,
        start > end,
        edge_quads,
        kind == SHARP,
        edge_quads[:, 1] < 0,
        path_offsets,
        points,
        covered / total if total > 0 else 1.0,
    )


def quad_tags(quad_mesh: QuadMesh, features: Features) -> IntArray:
    """(m,) the input tag most of a 3 x 3 grid of points of each quad lies on; 0 where there are no tags."""
    from patchwright.repair import _surface_walk_kernel as walker

    m = len(quad_mesh.quads)
    tags = features.body.tags
    if tags is None or not len(tags):
        return np.zeros(m, dtype=np.int64)
    mesh, ground = quad_mesh.mesh, quad_mesh.ground
    kinds = mesh.kind[quad_mesh.quads]
    corner = quad_mesh.quads[np.arange(m), np.argmin(kinds, axis=1)]
    starts = np.ascontiguousarray(mesh.vt[corner])
    t = np.array([0.2, 0.5, 0.8])
    u, v = (x.reshape(-1, 1) for x in np.meshgrid(t, t, indexing="ij"))
    p = mesh.X[quad_mesh.quads][:, :, None]
    points = (1 - u) * (1 - v) * p[:, 0] + u * (1 - v) * p[:, 1] + u * v * p[:, 2] + (1 - u) * v * p[:, 3]
    out, triangle = np.empty_like(points), np.empty(points.shape[:2], dtype=np.int64)
    walker.walk_chain(points, starts, ground.v, ground.t, ground.nb, ground.block, out, triangle)
    found = np.asarray(tags)[triangle]
    votes = (found[:, :, None] == found[:, None, :]).sum(axis=2)
    return np.asarray(found[np.arange(m), votes.argmax(axis=1)])
