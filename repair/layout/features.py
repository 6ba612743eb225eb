"""Sharp edges, boundaries and corners of a triangulation, chained into curves that part it into smooth regions.

An edge is sharp where the triangles' normals, freed from noise and needles, turn by more than the angle; lines that
fade below it are followed down to `HYSTERESIS` of it as long as they go straight on. What no quad fits in is dropped:
specks, teeth that a line runs out and back along, pieces of next to no area, hooks at loose ends.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import GeometryError
from patchwright.models.triangulation import Triangulation
from patchwright.repair.layout.feature_cleaning import (
    CORNER_TURN,
    SPECK_SHARE,
    cut_teeth,
    incident_edges,
    merge_specks,
    not_slits,
    not_specks,
)
from patchwright.repair.layout.tips import find_tips

HYSTERESIS = 0.6  # of the angle: how far a sharp line may fade
SLIT = 1e-3  # of the diagonal, a quarter of the smallest quad: lines between the same ends that are nearer are one
SPECK = 2e-3  # of the diagonal, half of the smallest quad: smaller pieces between lines are no pieces of their own
NOISY_HEIGHT = 20.0  # times the noise: a lower triangle's own normal is off by degrees
NEEDLE_HEIGHT = 6.0  # times the noise: a lower triangle has no normal of its own
FOLLOWED, SHARP, BOUNDARY = 1, 2, 3  # kinds of curves: only followed, sharp, boundary


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """A triangulation with its feature curves.

    Parameters
    ----------
    body : the triangulation; vertices where it only touches itself are doubled, the triangles' order is the input's
    neighbours : (m, 3) triangle across the side from corner k to k + 1, -1 at the boundary
    normals : (m, 3) unit normals freed from noise
    side_curve : (m, 3) curve each side lies on, -1 for a smooth side
    region : (m,) number of the smooth piece between curves
    offsets : (c + 1,) rows of the curve arrays that belong to each curve
    vertices : (k,) vertices along each curve, both ends included; a closed curve ends where it begins
    along : (k,) arc length from the curve's start
    beside : (k, 2) triangles beside the segment that starts here, the second -1 at a boundary; the last row is as the
        one before
    kind : (c,) FOLLOWED, SHARP or BOUNDARY
    corners : (f,) vertices in which curves end, and tips, which stand alone
    noise : estimated scatter of the vertices off a smooth surface, a length
    """

    body: Triangulation
    neighbours: IntArray
    normals: Array
    side_curve: IntArray
    region: IntArray
    offsets: IntArray
    vertices: IntArray
    along: Array
    beside: IntArray
    kind: IntArray
    corners: IntArray
    noise: float

    @property
    def lengths(self) -> Array:
        """(c,) arc length of each curve."""
        return np.asarray(self.along[self.offsets[1:] - 1])

    def curve_edges(self, kind: int) -> IntArray:
        """(k, 2) vertex pairs along the curves of one kind."""
        owner = np.repeat(np.arange(len(self.kind)), np.diff(self.offsets))
        here = np.flatnonzero((owner[:-1] == owner[1:]) & (self.kind[owner[:-1]] == kind))
        return np.stack([self.vertices[here], self.vertices[here + 1]], axis=1)


def find_features(
    triangulation: Triangulation,
    *,
    angle: float = 30.0,
    frozen: IntArray | None = None,
    sharp_before: IntArray | None = None,
) -> Features:
    """The feature curves of an oriented 2-manifold.

    Parameters
    ----------
    triangulation : closed or with boundary
    angle : degrees; edges that turn more are sharp
    frozen : (k, 2) vertex pairs of further edges that curves must follow, or None
    sharp_before : (k, 2) vertex pairs of the sharp edges of an earlier search, which stay sharp, or None

    Raises
    ------
    GeometryError : no triangles, edges used by more than two triangles or in the same direction by two.
    """
    from patchwright.repair.layout import _feature_kernel as kernel

    if not len(triangulation):
        raise GeometryError("a layout needs at least one triangle")
    body, wanted, known = _split_touching(triangulation, frozen, sharp_before)
    adjacency = Adjacency.of(body)
    edges, sides = np.asarray(adjacency.edges), np.asarray(adjacency.triangle_edges)
    neighbours = np.ascontiguousarray(adjacency.neighbours, dtype=np.int64)
    free = np.asarray(adjacency.free)
    normals, noise = _normals(body, neighbours, edges)
    # both triangles of every inner edge
    first = np.zeros(len(edges), dtype=np.int64)
    second = np.zeros(len(edges), dtype=np.int64)
    t, k = np.nonzero(neighbours >= 0)
    first[sides[t, k]], second[sides[t, k]] = t, neighbours[t, k]
    cosine = np.einsum("ij,ij->i", normals[first], normals[second])
    cosine[free] = 1.0
    sharp = cosine < np.cos(np.radians(angle))
    weak = cosine < np.cos(np.radians(HYSTERESIS * angle))
    follow, stays = (np.isin(edges[:, 0] * len(body.vertices) + edges[:, 1], keys) for keys in (wanted, known))
    firm = free | follow
    points, length = body.vertices, np.linalg.norm(body.vertices[edges[:, 1]] - body.vertices[edges[:, 0]], axis=1)
    sharp &= not_specks(edges, sharp | firm, firm, length, body.diagonal)
    grown = sharp | firm
    offsets, incident = incident_edges(edges, len(points))
    kernel.grow_ends(points, edges, offsets, incident, grown, weak & ~free)
    sharp |= grown & ~firm
    width = max(NOISY_HEIGHT * noise, SLIT * body.diagonal)
    for _ in range(2):
        sharp &= not_slits(edges, sharp | firm, firm, length, cosine, points, width)
        sharp &= not_specks(edges, sharp | firm, firm, length, body.diagonal)
    cut_teeth(body, neighbours, normals, edges, sides, sharp, firm, length, width)
    least = max(width, SPECK * body.diagonal) ** 2
    if merge_specks(body, neighbours, normals, sides, sharp, firm, length, least, np.cos(np.radians(angle))):
        sharp &= not_specks(edges, sharp | firm, firm, length, body.diagonal)
    kind = np.where(free, BOUNDARY, np.where(sharp | stays, SHARP, np.where(follow, FOLLOWED, 0)))
    on_curve = np.zeros(len(points), dtype=bool)
    on_curve[edges[kind > 0]] = True
    tips = find_tips(body, normals, on_curve, angle, max(width, SPECK * body.diagonal))
    return _chains(body, neighbours, normals, noise, edges, sides, kind, first, second, width, tips)


def _chains(
    body: Triangulation,
    neighbours: IntArray,
    normals: Array,
    noise: float,
    edges: IntArray,
    sides: IntArray,
    kind: IntArray,
    first: IntArray,
    second: IntArray,
    width: float,
    tips: BoolArray,
) -> Features:
    """Curves through the feature edges (`kind` > 0), broken at branches, changes of kind and sharp turns."""
    from patchwright.repair.layout import _feature_kernel as kernel

    points = body.vertices
    picked = np.flatnonzero(kind > 0)
    ends = np.ascontiguousarray(edges[picked])
    offsets, incident = incident_edges(ends, len(points))
    degree = np.diff(offsets)
    low, high = np.full(len(points), 9), np.zeros(len(points), dtype=np.int64)
    for column in (0, 1):
        np.minimum.at(low, ends[:, column], kind[picked])
        np.maximum.at(high, ends[:, column], kind[picked])
    stop = (degree > 0) & ((degree != 2) | (low != high))
    starts, vertices, walked, _ = kernel.trace(ends, offsets, incident, stop)
    turn = np.ones(len(vertices))
    kernel.turning(points, starts, vertices, width, turn)
    owner, along = _arc_lengths(points, starts, vertices)
    rows = starts + np.arange(len(starts))
    length = along[rows[1:] - 1][owner]
    begin, finish = vertices[rows[:-1]][owner], vertices[rows[1:] - 1][owner]
    turns = turn < np.cos(np.radians(CORNER_TURN))
    # a line that turns just before its loose end is cut there
    hook = turns & (kind[picked[walked[starts[:-1]]]] == SHARP)[owner]
    tail = 0.5 * SPECK_SHARE * body.diagonal
    loose = _outside(
        owner, hook & (degree[begin] == 1) & (along < tail), hook & (degree[finish] == 1) & (length - along < tail)
    )
    if len(loose):
        kept = kind.copy()
        kept[picked[walked[loose - owner[loose]]]] = 0
        return _chains(body, neighbours, normals, noise, edges, sides, kept, first, second, width, tips)
    # no corner right beside another end
    apart = (along > np.where(stop[begin], width, -1.0)) & (length - along > np.where(stop[finish], width, -1.0))
    stop[vertices[turns & apart]] = True
    lo, hi = starts[:-1] + np.arange(len(starts) - 1), starts[1:] + np.arange(len(starts) - 1)
    for c in np.flatnonzero(vertices[lo] == vertices[hi]) if len(lo) else ():
        ring = vertices[lo[c] : hi[c]]
        if not stop[ring].any():
            stop[ring[np.argmin(turn[lo[c] : hi[c]])]] = True
    starts, vertices, walked, chain = kernel.trace(ends, offsets, incident, stop)
    count = len(starts) - 1
    rows = starts + np.arange(count + 1)
    owner, along = _arc_lengths(points, starts, vertices)
    segment = np.minimum(np.arange(len(vertices)) - owner, starts[1:][owner] - 1)
    edge = picked[walked[segment]]
    left = np.full(len(edges), -1, dtype=np.int64)
    right = left.copy()
    t = np.repeat(np.arange(len(body)), 3)
    left[sides.reshape(-1)] = t
    inner = np.flatnonzero(kind != BOUNDARY)
    left[inner], right[inner] = first[inner], second[inner]
    side_curve = np.full(len(edges), -1, dtype=np.int64)
    side_curve[picked] = chain
    on_sides = np.ascontiguousarray(side_curve[sides])
    return Features(
        body,
        neighbours,
        normals,
        on_sides,
        kernel.regions(neighbours, on_sides),
        rows,
        vertices,
        along,
        np.ascontiguousarray(np.stack([left[edge], right[edge]], axis=1)),
        kind[picked[walked[starts[:-1]]]],
        np.flatnonzero(stop | (tips & (degree == 0))),
        noise,
    )


def _arc_lengths(points: Array, starts: IntArray, vertices: IntArray) -> tuple[IntArray, Array]:
    """The chain of every row of `vertices` and its arc length from the chain's start."""
    rows = starts + np.arange(len(starts))
    owner = np.repeat(np.arange(len(starts) - 1), np.diff(rows))
    step = np.zeros(len(vertices))
    step[1:] = np.linalg.norm(np.diff(points[vertices], axis=0), axis=1)
    total = np.cumsum(step)
    return owner, total - total[rows[:-1]][owner] if len(vertices) else total


def _outside(owner: IntArray, before: BoolArray, after: BoolArray) -> IntArray:
    """Rows whose segment lies before the last marked row of its chain in `before`, or behind the first in `after`."""
    count = int(owner.max()) + 1 if len(owner) else 0
    last, first = np.full(count, -1), np.full(count, len(owner))
    np.maximum.at(last, owner[before], np.flatnonzero(before))
    np.minimum.at(first, owner[after], np.flatnonzero(after))
    row = np.flatnonzero(owner[:-1] == owner[1:])
    return row[(row < last[owner[row]]) | (row >= first[owner[row]])]


def _split_touching(triangulation: Triangulation, *asked: IntArray | None) -> tuple[Triangulation, IntArray, IntArray]:
    """One vertex per fan of triangles, unused vertices dropped; and the keys (lo * n + hi) of two sets of edges."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    adjacency = Adjacency.of(triangulation)
    if adjacency.non_manifold.any():
        bad = int(np.flatnonzero(adjacency.non_manifold)[0])
        where = triangulation.vertices[adjacency.edges[bad]].mean(axis=0).round(6).tolist()
        raise GeometryError(
            f"a layout needs a 2-manifold, but {int(adjacency.non_manifold.sum())} edges have more than two triangles, "
            f"one at {where}"
        )
    if adjacency.inconsistent.any():
        raise GeometryError(
            f"{int(adjacency.inconsistent.sum())} edges have triangles that disagree on which side is outside"
        )
    triangles = triangulation.triangles
    m = len(triangles)
    t, k = np.nonzero(np.asarray(adjacency.neighbours) >= 0)
    other = np.asarray(adjacency.neighbours)[t, k]
    i, j = [], []
    for corner in (k, (k + 1) % 3):
        match = triangles[other] == triangles[t, corner][:, None]
        i.append(3 * t + corner)
        j.append(3 * other + match.argmax(axis=1))
    rows, columns = np.concatenate(i), np.concatenate(j)
    graph = coo_matrix((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(3 * m, 3 * m))
    count, label = connected_components(graph, directed=False)
    vertices = np.empty((count, 3))
    vertices[label] = triangulation.vertices[triangles.reshape(-1)]
    body = replace(triangulation, vertices=vertices, triangles=label.reshape(-1, 3).astype(np.int64), uv=None)
    first, second = (_keys(triangulation, body.triangles, edges) for edges in asked)
    return body, first, second


def _keys(triangulation: Triangulation, new: IntArray, edges: IntArray | None) -> IntArray:
    """Keys, in the numbers of the corners `new` (m, 3), of edges given as vertex pairs (k, 2)."""
    if edges is None or not len(edges):
        return np.zeros(0, dtype=np.int64)
    old = np.sort(np.asarray(edges, dtype=np.int64), axis=1)
    n, count = len(triangulation.vertices), int(new.max()) + 1
    a, b = triangulation.triangles.reshape(-1), np.roll(triangulation.triangles, -1, axis=1).reshape(-1)
    asked = np.isin(np.minimum(a, b) * n + np.maximum(a, b), old[:, 0] * n + old[:, 1])
    c, d = new.reshape(-1)[asked], np.roll(new, -1, axis=1).reshape(-1)[asked]
    return (np.minimum(c, d) * count + np.maximum(c, d)).astype(np.int64)


def _normals(body: Triangulation, neighbours: IntArray, edges: IntArray) -> tuple[Array, float]:
    """Unit normals freed from noise and needles, and the noise."""
    from patchwright.repair.layout import _feature_kernel as kernel

    corners = body.corners
    side = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    longest = side.argmax(axis=1)
    areas = body.areas
    width = side.max(axis=1)
    height = np.divide(2.0 * areas, width, out=np.zeros_like(width), where=width > 0)
    normals = np.array(body.normals)
    noise = max(_noise(body, edges, normals), float(np.finfo(np.float64).eps) * float(np.abs(body.vertices).max()))
    order = np.argsort(-height, kind="stable")
    kernel.settle_needles(order, neighbours, longest, height, NEEDLE_HEIGHT * noise, normals)
    noisy = height < NOISY_HEIGHT * noise
    if noisy.any():
        flat = body.triangles.reshape(-1)
        fans = np.argsort(flat, kind="stable") // 3
        offsets = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=len(body.vertices)))])
        kernel.filter_normals(body.triangles, offsets, fans, areas, noisy, 0.5, 4, normals)
    return normals, noise


def _noise(body: Triangulation, edges: IntArray, normals: Array) -> float:
    """Scatter of the vertices: the double umbrella of a smooth surface is small, that of noise 1.36 times the noise."""
    n = len(body.vertices)
    flat = body.triangles.reshape(-1)
    mean = np.zeros((n, 3))
    np.add.at(mean, flat, np.repeat(body.area_vectors, 3, axis=0))
    size = np.linalg.norm(mean, axis=1, keepdims=True)
    mean = np.divide(mean, size, out=np.zeros_like(mean), where=size > 0)
    agree = np.full(n, 1.0)
    np.minimum.at(agree, flat, np.einsum("ij,ij->i", np.repeat(normals, 3, axis=0), mean[flat]))
    degree = np.bincount(edges.reshape(-1), minlength=n)

    def umbrella(x: Array) -> Array:
        total = np.zeros_like(x)
        np.add.at(total, edges[:, 0], x[edges[:, 1]])
        np.add.at(total, edges[:, 1], x[edges[:, 0]])
        return np.asarray(total / np.maximum(degree, 1)[:, None] - x)

    rough = np.abs(np.einsum("ij,ij->i", umbrella(umbrella(body.vertices)), mean))
    corners = body.triangles
    inner = np.bincount(flat, minlength=n) == degree
    calm = inner & (agree > 0.8)
    # a vertex counts only when its whole ring is calm as well
    restless = np.zeros(n, dtype=bool)
    restless[corners[~calm[corners].all(axis=1)].reshape(-1)] = True
    calm &= ~restless
    if calm.sum() < 12:
        return 0.0
    return float(np.median(rough[calm]) / 0.92)
