"""The edges of a quad mesh and the path each takes on the triangulation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.layout.features import SHARP, Features
from patchwright.repair.layout.finer_quads import side_arcs
from patchwright.repair.layout.pairing import QuadMesh

PATH_POINTS = 9  # of a smooth edge
LEAP = 2.0  # times a chord's step: where the surface stands steeper than 60 degrees to it, the chord's feet leap
ROUND = 4.0  # times the chord: longest way round a bend; half a circle needs 1.6
BETWEEN = 3  # rounds, for strips of several edges that press against a feature
STRAIGHTENING = 60  # passes; each leaves cos(pi / 8) of the slowest bend of nine points, all together 1 %


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

    def middles(self) -> Array:
        """(e, 3) the points halfway along the paths."""
        from patchwright.repair.layout.resample import resample

        return np.ascontiguousarray(resample(self.path_points, self.path_offsets, 3)[:, 1])

    def led_along(self, edges: IntArray, paths: Array) -> LayoutEdges:
        """The same with other paths for smooth edges, (k, 2) ends and (k, PATH_POINTS, 3), from the lower ends."""
        n = int(self.edges.max()) + 1
        which = np.searchsorted(self.edges @ np.array([n, 1]), edges @ np.array([n, 1]))
        points = self.path_points.copy()
        points[self.path_offsets[which][:, None] + np.arange(PATH_POINTS)] = paths
        return replace(self, path_points=points)


def trace_paths(quad_mesh: QuadMesh, features: Features) -> LayoutEdges:
    """All edges with their paths: stretches of feature curves, or chords put on the surface."""
    from patchwright.repair.layout import _quad_kernel as kernel

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
    low, high = (np.ascontiguousarray(arc) for arc in side_arcs(quad_mesh).T)
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
    _go_round(quad_mesh, features, parents, quad_mesh.region[one], normals, inner)
    pressed = on_curves(ground, inner, triangle).any(axis=1)
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
    beside = np.flatnonzero(pressed & (two >= 0))
    _lead_between(quad_mesh, number, smooth[beside], edge_quads, triangle[beside], path_offsets, points)
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


def _go_round(
    quad_mesh: QuadMesh, features: Features, ends: IntArray, region: IntArray, normals: Array, inner: Array
) -> None:
    """Lead paths over the surface, in place, where the feet of the chord leap from one side of a bend to the other.

    The shortest way along edges of the triangulation is made straight on the surface: every point moves towards the
    middle of its two neighbours. `ends` (k, 2), `inner` (k, PATH_POINTS - 2, 3). A path whose way round is longer than
    ROUND chords, or crosses a feature, stays as it is.
    """
    from scipy.sparse.csgraph import dijkstra

    from patchwright.repair.layout import _quad_kernel as kernel
    from patchwright.repair.layout import _surface_walk_kernel as walker
    from patchwright.repair.layout.resample import resample
    from patchwright.repair.layout.ridges import Paths

    mesh, ground = quad_mesh.mesh, quad_mesh.ground
    begin, finish = mesh.X[ends[:, 0]], mesh.X[ends[:, 1]]
    steps = np.linalg.norm(np.diff(np.concatenate([begin[:, None], inner, finish[:, None]], axis=1), axis=1), axis=2)
    chord = np.linalg.norm(finish - begin, axis=1)
    leaps = np.flatnonzero(steps.max(axis=1) > LEAP * chord / (PATH_POINTS - 1))
    if not len(leaps):
        return
    tip = np.empty((2, len(leaps)), dtype=np.int64)  # the triangle each way begins and ends on
    for side in (0, 1):
        own = np.ascontiguousarray(ends[leaps, side : side + 1])
        at: IntArray = np.empty((len(leaps), 1), dtype=np.int64)
        kernel.land(mesh, ground, own, region[leaps], mesh.X[own], normals[leaps], np.empty((len(leaps), 1, 3)), at)
        tip[side] = at[:, 0]
    points = features.body.vertices
    free = np.ones(len(points), dtype=bool)
    free[features.vertices] = False
    surface = Paths.over(features)
    every = np.arange(len(points))
    between = surface.between(free)
    graph = between.graph(between.length, every)
    found, ways = [], []
    for row, (i, (start, end)) in enumerate(zip(leaps, tip.T, strict=True)):
        if start < 0 or end < 0:
            continue
        sources, goals = features.body.triangles[start], features.body.triangles[end]
        away, came, _ = dijkstra(
            graph, directed=False, indices=sources, min_only=True, limit=ROUND * chord[i], return_predecessors=True
        )
        goal = int(goals[np.argmin(away[goals] + np.linalg.norm(points[goals] - finish[i], axis=1))])
        if np.isfinite(away[goal]):
            way = [goal]
            while came[way[-1]] >= 0:
                way.append(int(came[way[-1]]))
            found.append(row)
            ways.append(np.concatenate([begin[i : i + 1], points[way[::-1]], finish[i : i + 1]]))
    if not found:
        return
    offsets = np.concatenate([[0], np.cumsum([len(way) for way in ways])])
    line = np.ascontiguousarray(resample(np.concatenate(ways), offsets, PATH_POINTS))
    triangle = np.empty((len(line), PATH_POINTS), dtype=np.int64)
    walker.walk_chain(line.copy(), tip[0, found], ground.v, ground.t, ground.nb, ground.block, line, triangle)
    line[:, 0], line[:, -1] = begin[leaps[found]], finish[leaps[found]]
    starts: IntArray = np.ascontiguousarray(triangle[:, 1:-1].reshape(-1))
    out, at = np.empty((len(starts), 3)), np.empty(len(starts), dtype=np.int64)
    for _ in range(STRAIGHTENING):
        middle = np.ascontiguousarray(0.5 * (line[:, :-2] + line[:, 2:])).reshape(-1, 3)
        walker.walk_many(middle, starts, ground.v, ground.t, ground.nb, ground.block, out, at)
        line[:, 1:-1] = out.reshape(len(line), -1, 3)
        starts, at = at, starts
    inner[leaps[found]] = line[:, 1:-1]


def on_curves(ground: Any, points: Array, triangle: IntArray) -> BoolArray:
    """Whether points (..., 3) of triangles (...,), -1 none, lie on a side that a feature curve blocks."""
    eps = 1e-9  # of the side: a walk that stops at a blocked side stops on it but for rounding
    corners = ground.v[ground.t[triangle]]
    out = np.zeros(triangle.shape, dtype=bool)
    for k in range(3):
        a, side = corners[..., k, :], corners[..., (k + 1) % 3, :] - corners[..., k, :]
        size = (side * side).sum(axis=-1)
        off = np.linalg.norm(np.cross(side, points - a), axis=-1)
        out |= (ground.block[triangle, k] >= 0) & (off <= eps * size)
    return np.asarray(out & (triangle >= 0))


def _lead_between(
    quad_mesh: QuadMesh,
    quad_edges: IntArray,
    which: IntArray,
    edge_quads: IntArray,
    triangle: IntArray,
    path_offsets: IntArray,
    points: Array,
) -> None:
    """Lead smooth edges that press against a feature through the middle between the opposite sides, in place.

    The chord of such an edge leaves its region where the feature bulges into it, and its feet all lie on the feature:
    no room is left for the patch between the two. The middle line of the Coons patch over both its quads keeps off.
    `triangle` (k, PATH_POINTS - 2) of the paths' inner points; `points` all paths.
    """
    from patchwright.repair.layout import _surface_walk_kernel as walker
    from patchwright.repair.layout.resample import resample

    if not len(which):
        return
    ground, quads = quad_mesh.ground, quad_mesh.quads
    x = quad_mesh.mesh.X
    share = np.linspace(0.0, 1.0, PATH_POINTS)[:, None]
    starts = np.ascontiguousarray(triangle.reshape(-1))
    out, at = np.empty((len(starts), 3)), np.empty(len(starts), dtype=np.int64)
    rows = path_offsets[which][:, None] + np.arange(PATH_POINTS)
    begin = points[rows[:, 0]]
    for _ in range(BETWEEN):
        lines = resample(points, path_offsets, PATH_POINTS)
        middle = np.zeros((len(which), PATH_POINTS, 3))
        for side in (0, 1):
            quad = edge_quads[which, side]
            own = (quad_edges[quad] == which[:, None]).argmax(axis=1)
            line = lines[quad_edges[quad, (own + 2) % 4]]
            # the opposite side's vertex next to this edge's first one
            forth = (x[quads[quad, own]] == begin).all(axis=1)
            near = np.where(forth, quads[quad, (own + 3) % 4], quads[quad, (own + 2) % 4])
            turned = (line[:, 0] != x[near]).any(axis=1)
            line[turned] = line[turned, ::-1]
            middle += 0.5 * line
        first, last = begin - middle[:, 0], points[rows[:, -1]] - middle[:, -1]
        middle += (1.0 - share) * first[:, None] + share * last[:, None]
        wanted = np.ascontiguousarray(middle[:, 1:-1]).reshape(-1, 3)
        walker.walk_many(wanted, starts, ground.v, ground.t, ground.nb, ground.block, out, at)
        points[rows[:, 1:-1]] = out.reshape(len(which), -1, 3)
        starts, at = at, starts


def quad_tags(quad_mesh: QuadMesh, features: Features) -> IntArray:
    """(m,) the input tag most of a 3 x 3 grid of points of each quad lies on; 0 where there are no tags."""
    from patchwright.repair.layout import _surface_walk_kernel as walker

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
