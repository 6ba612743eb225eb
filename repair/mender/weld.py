"""Welding: corners that are copies of one point become one vertex, without folding, collapsing or joining skins.

Copies with equal coordinates are merged first and keep them to the last bit. What is left is matched edge by edge, not
point by point: two free edges are one edge when both their ends lie within the distance, one edge has one partner, near
pairs go first, pairs that continue the surface go before pairs that fold back on it (so that the two skins of a thin
trailing edge stay apart), and pairs of one tag go before pairs of two. No two corners of one triangle ever merge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, BoolArray, IntArray, frozen
from patchwright.models.errors import ParameterError
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation

REACH_SHARE = 0.5  # of an edge's length: copies of a point are nearer to each other than to the edge's other end
ORIENTED = 0.2  # below this share of candidates that run the same way the triangles came oriented: they are chance
SPREAD = 1.5  # times the weld distance: the farthest copies of one point
WIDE_SPREAD = 2.2  # the same where they stand round their point in a ring, as the corners of a hexagon
PLATEAU = 3.0  # a tolerance this many times larger must find next to nothing more
PLATEAU_GAIN = 0.01  # "next to nothing": this share of what was found
WIDEST = 64.0  # times the fit tolerance: how far scatter is looked for


@dataclass(frozen=True, slots=True, eq=False)
class Welded:
    """A triangulation after welding: as many triangles in the same order, fewer vertices.

    Parameters
    ----------
    triangulation : over the merged vertices; a triangle that came with two equal corners still has them
    clusters : (n,) int64, the new vertex of each input vertex
    merged : how many vertices disappeared
    moved : how many input vertices lie elsewhere now
    largest_move : the farthest any of them went, model length unit
    noise : root mean square distance of a corner from its point, estimated from the scatter of the merged copies
    """

    triangulation: Triangulation
    clusters: IntArray
    merged: int
    moved: int
    largest_move: float
    noise: float


@dataclass(frozen=True, slots=True, eq=False)
class FreeEdges:
    """The edges used by one triangle only, as that triangle runs them; all (e,) int64.

    `start`, `end` and `apex` are its corners, `triangle` its index, `tag` its tag (0 without tags).
    """

    start: IntArray
    end: IntArray
    apex: IntArray
    triangle: IntArray
    tag: IntArray

    def take(self, which: BoolArray) -> FreeEdges:
        """Those of a mask."""
        return FreeEdges(self.start[which], self.end[which], self.apex[which], self.triangle[which], self.tag[which])


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """Pairs of free edges: left < right, how far apart their ends are, and of what kind; all (k,)."""

    left: IntArray
    right: IntArray
    gap: Array
    kind: IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Copies:
    """Free edges of a triangulation that may be copies of each other: found once, for all distances up to one.

    Only the triangles at the rims matter to a weld; where they are few, all but `labels` and `vertices` is of them.

    Parameters
    ----------
    labels : (n,) the exact copies of the triangulation's vertices
    vertices : (k,) the vertices of the triangles at the rims, None for all
    points, rim : (k, 3) their places, (k,) whether a free edge ends there
    triangles, tags : (s, 3) and (s,) or None, the triangles at the rims, over those vertices
    offsets, around : the triangles round each vertex
    free, pairs : the free edges, and the candidates among them within `distance`
    """

    labels: IntArray
    vertices: IntArray | None
    points: Array
    rim: BoolArray
    triangles: IntArray
    tags: IntArray | None
    offsets: IntArray
    around: IntArray
    free: FreeEdges
    pairs: _Pairs
    distance: float

    @classmethod
    def of(
        cls, triangulation: Triangulation, distance: float, labels: IntArray | None = None, among: Copies | None = None
    ) -> Copies:
        """The candidates within `distance` (0: none).

        `labels` when it is known already which vertices are one; `among` what was found before some of them became one:
        free edges are only where free edges were.
        """
        points, tags = triangulation.vertices, triangulation.tags
        labels = exact_labels(points) if labels is None else labels
        triangles = triangulation.triangles
        if among is not None and among.vertices is not None:
            triangles, tags = among.vertices[among.triangles], among.tags
        triangles = labels[triangles]
        free = free_edges(triangles, tags)
        if among is not None and among.vertices is not None:
            before = np.zeros(len(points), dtype=np.bool_)
            before[among.vertices[among.rim]] = True
            free = free.take(before[free.start] & before[free.end])
        rim = np.zeros(len(points), dtype=np.bool_)
        rim[free.start] = rim[free.end] = True
        near: BoolArray = np.asarray(rim[triangles].any(axis=1))
        vertices = None
        if 2 * np.count_nonzero(near) < len(near):
            used = np.zeros(len(points), dtype=np.bool_)
            used[triangles[near]] = True
            vertices = np.flatnonzero(used)
            local = np.cumsum(used) - 1
            free = replace(free, start=local[free.start], end=local[free.end], apex=local[free.apex])
            triangles, tags = local[triangles[near]], None if tags is None else tags[near]
            points, rim = frozen(points[vertices], np.float64), rim[vertices]
        offsets, around = _around(triangles, len(points))
        pairs = _candidates(points, free, distance)
        return cls(labels, vertices, points, rim, triangles, tags, offsets, around, free, pairs, distance)

    def matched(self, distance: float, spread: float = SPREAD) -> tuple[IntArray, Array]:
        """Match the edges within a distance: each vertex's root (k,), and how far apart the matched pairs are.

        `spread` times the distance is the most that the copies of a point may be apart.
        """
        from patchwright.repair.mender._near_edges_kernel import trial_order
        from patchwright.repair.mender._weld_kernel import match_edges

        pairs, free = self.pairs, self.free
        order = trial_order(pairs.gap, pairs.kind, distance, ORIENTED)
        return match_edges(
            order, pairs.left, pairs.right, pairs.gap, pairs.kind, free.start, free.end, spread * distance, self.points,
            self.triangles, self.offsets, self.around,
        )  # fmt: skip


def reach_of(tolerance: Tolerance) -> float:
    """How far apart `weld_distance` looks for copies."""
    return PLATEAU * max(2.0 * tolerance.fit, tolerance.gap)


def weld(triangulation: Triangulation, distance: float, copies: Copies | None = None, spread: float = SPREAD) -> Welded:
    """Merge the copies of a point that lie within `distance` of each other (0: only equal ones).

    Parameters
    ----------
    copies : of the same triangulation, when they are at hand
    spread : times the distance: no copies of one point are farther apart

    Raises
    ------
    ParameterError : a distance that is negative or not finite.
    """
    if not (np.isfinite(distance) and distance >= 0.0):
        raise ParameterError(f"the weld distance must be a length of at least 0, got {distance}")
    first = exact_labels(triangulation.vertices) if copies is None else copies.labels
    root = first
    if copies is not None and copies.distance < distance:
        copies = None
    if distance > 0.0 and len(triangulation):
        known = None
        for turn in range(3):
            known = copies if turn == 0 and copies is not None else Copies.of(triangulation, distance, root, known)
            step = _weld_step(known, distance, spread)
            if step is None:
                break
            root = step[root]
    return _merge(triangulation, first, root)


def contract_short(triangulation: Triangulation, length: float) -> Welded:
    """Contract the free edges shorter than `length`: what is smaller than the noise cannot be told from it.

    Triangles collapse by that and come back with two equal corners. No cluster grows wider than 1.5 times the length.
    """
    from patchwright.repair.mender._weld_kernel import contract

    first = exact_labels(triangulation.vertices)
    points = triangulation.vertices
    free = free_edges(first[triangulation.triangles], None)
    size = np.linalg.norm(points[free.end] - points[free.start], axis=1)
    short = np.flatnonzero(size < length)
    short = short[np.argsort(size[short], kind="stable")]
    root = contract(free.start[short], free.end[short], 1.5 * length, points)[first]
    return _merge(triangulation, first, root)


def exact_labels(vertices: Array) -> IntArray:
    """(n,) index of the first vertex with the same coordinates (0.0 and -0.0 are the same)."""
    from patchwright.repair.mender._weld_kernel import merge_exact

    return np.asarray(merge_exact((np.ascontiguousarray(vertices) + 0.0).view(np.int64)))


def free_edge_curve(triangulation: Triangulation, distances: npt.ArrayLike, copies: Copies | None = None) -> IntArray:
    """How many edges are still used by one triangle only after welding within each of `distances` (k,).

    One matching serves all distances: a pair counts from the distance on at which its ends meet.
    """
    wanted = np.atleast_1d(np.asarray(distances, dtype=np.float64))
    free, gaps = _match_gaps(triangulation, float(wanted.max(initial=0.0)), copies)
    return free - 2 * np.searchsorted(np.sort(gaps), wanted * (1.0 + 1e-12), side="right").astype(np.int64)


def weld_distance(
    triangulation: Triangulation, tolerance: Tolerance, copies: Copies | None = None
) -> tuple[float, str]:
    """The weld distance the data itself shows, never below `tolerance.gap`, and why.

    The number of free edges falls with the distance and then stays: the copies of a point are all found. That start of
    a plateau is taken, if it moves no corner farther than the fit tolerance; what is farther apart is a gap.
    """
    most = 2.0 * tolerance.fit
    free, gaps = _match_gaps(triangulation, reach_of(tolerance), copies)
    gaps = np.sort(gaps)
    floor = int(np.searchsorted(gaps, tolerance.gap, side="right"))
    within = int(np.searchsorted(gaps, most * (1.0 + 1e-9), side="right"))
    why = f"round-off for this size and place ({tolerance.gap:.3g})"
    if within <= floor:
        return tolerance.gap, f"{why}; no copies farther apart up to {most:.3g}"
    beyond = np.searchsorted(gaps, PLATEAU * gaps[floor:within], side="right") - np.arange(floor + 1, within + 1)
    found = np.arange(1, within - floor + 1)
    flat = np.flatnonzero(beyond <= PLATEAU_GAIN * found)
    if not len(flat):
        return tolerance.gap, f"{why}; the number of free edges shows no plateau up to {most:.3g}"
    at = int(np.searchsorted(gaps[floor:within], PLATEAU * gaps[floor + flat[0]], side="right")) - 1
    share = 2.0 * (at + 1) / max(1, free - 2 * floor)
    distance = float(gaps[floor + at]) * (1.0 + 1e-9)
    if share < 0.05:
        return tolerance.gap, f"{why}; only {share:.1%} of the free edges meet up to {distance:.3g}"
    left = free - 2 * (floor + at + 1)
    return distance, (
        f"the number of free edges falls from {free} to {left} at {distance:.3g}"
        f" and stays up to {PLATEAU * distance:.3g}"
    )


def weld_shown(
    triangulation: Triangulation, distance: float, copies: Copies, tolerance: Tolerance
) -> tuple[Welded, float | None]:
    """Weld at the distance that the data shows (`weld_distance`), once more where the copies stand in rings.

    Returns
    -------
    The weld, and how far apart the copies are where that is more than the tolerance allows, else None.
    """
    welded = weld(triangulation, distance, copies)
    if not torn(copies, welded.triangulation, distance, tolerance):
        return welded, None
    if WIDE_SPREAD * distance <= 2.0 * tolerance.fit:
        welded = weld(triangulation, distance, copies, WIDE_SPREAD)
    failed = torn(copies, welded.triangulation, distance, tolerance)
    return welded, WIDE_SPREAD * distance if failed else None


def torn(copies: Copies, welded: Triangulation, distance: float, tolerance: Tolerance) -> bool:
    """Whether a weld joined less than half of the edges that lie within the distance: the copies spread too far."""
    free = len(copies.free.start)
    left = len(free_edges(welded.triangles, None).start)
    if 4 * left <= free:
        return False
    return free - left < int(np.count_nonzero(copies.matched(reach_of(tolerance))[1] <= distance))


def scatter_beyond(triangulation: Triangulation, tolerance: Tolerance) -> float | None:
    """How far apart the data shows the copies of a point to be, where that is more than the fit tolerance allows.

    None where it is not, or where nothing shows up to `WIDEST` times as much: what is apart then are no copies.
    """
    factor = 1.0
    while factor < WIDEST:
        factor *= 4.0
        wide = replace(tolerance, fit=factor * tolerance.fit)
        copies = Copies.of(triangulation, reach_of(wide))
        distance, _ = weld_distance(triangulation, wide, copies)
        if distance > 2.0 * tolerance.fit:
            welded = weld(triangulation, distance, copies).triangulation
            return WIDE_SPREAD * distance if torn(copies, welded, distance, wide) else distance
    return None


def _merge(triangulation: Triangulation, first: IntArray, root: IntArray) -> Welded:
    """Put each cluster at the mean of its corners; `first` are the exact copies, which alone move nothing."""
    from patchwright.repair.mender._weld_kernel import mean_places

    points = triangulation.vertices
    lead = np.zeros(len(root), dtype=np.bool_)
    lead[root] = True
    kept = np.flatnonzero(lead)
    clusters = (np.cumsum(lead) - 1)[root]
    place = points[kept]
    moved, largest, scatter, freedom = mean_places(points, triangulation.triangles, clusters, root != first, place)
    triangles = clusters[triangulation.triangles]
    place.flags.writeable = triangles.flags.writeable = False  # nobody else has them: no copy is needed
    return Welded(
        replace(triangulation, vertices=place, triangles=triangles),
        clusters,
        int(len(points) - len(kept)),
        moved,
        largest,
        float(np.sqrt(scatter / freedom)) if freedom > 0.0 else 0.0,
    )


def free_edges(triangles: IntArray, tags: IntArray | None) -> FreeEdges:
    """Edges used by exactly one triangle, collapsed triangles left out."""
    from patchwright.repair.mender._group_kernel import single_sides

    a, b, c = triangles.T
    whole = (a != b) & (b != c) & (c != a)
    index = None if whole.all() else np.flatnonzero(whole)
    corners = np.ascontiguousarray(triangles) if index is None else triangles[index]
    start = corners.reshape(-1)
    pick = single_sides(corners, int(triangles.max(initial=-1)) + 1)
    of, side = pick // 3, pick % 3
    owner = of if index is None else index[of]
    tag = np.zeros(len(pick), dtype=np.int64) if tags is None else tags[owner]
    return FreeEdges(start[pick], corners[of, (side + 1) % 3], corners[of, (side + 2) % 3], owner, tag)


def _candidates(points: Array, free: FreeEdges, distance: float) -> _Pairs:
    """Pairs of free edges whose ends lie within `distance`."""
    from patchwright.repair.mender._near_edges_kernel import near_edges

    if distance <= 0.0 or not len(free.start):
        nothing = np.zeros(0, dtype=np.int64)
        return _Pairs(nothing, nothing, np.zeros(0), nothing)
    return _Pairs(*near_edges(points, free.start, free.end, free.apex, free.tag, distance, REACH_SHARE))


def _around(triangles: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Offsets (n + 1,) and triangles around each vertex."""
    from patchwright.repair.mender._group_kernel import grouped

    offsets, order = grouped(triangles.reshape(-1), count)
    order //= 3
    return offsets, order


def _match_gaps(triangulation: Triangulation, distance: float, copies: Copies | None) -> tuple[int, Array]:
    """The number of free edges among exactly merged vertices, and the distances of the pairs that match."""
    if not len(triangulation):
        return 0, np.zeros(0)
    if copies is None or copies.distance < distance:
        copies = Copies.of(triangulation, distance)
    if distance <= 0.0 or not len(copies.free.start):
        return len(copies.free.start), np.zeros(0)
    return len(copies.free.start), copies.matched(distance)[1]


def _weld_step(copies: Copies, distance: float, spread: float) -> IntArray | None:
    """One round of edge matching, then of the rims' vertices; each vertex's new root, None when nothing merged."""
    from patchwright.repair.mender._weld_kernel import match_points

    points = copies.points
    if not len(copies.free.start):
        return None
    step, _ = copies.matched(distance, spread)
    triangles = step[copies.triangles]
    free = free_edges(triangles, copies.tags)
    true = copies.rim[free.start]  # where only the triangles at the rims are looked at, others end as well
    free = replace(free, start=free.start[true], end=free.end[true])
    left, right = _point_pairs(points, free, distance)
    if len(left):
        offsets, around = _around(triangles, len(points))
        step = match_points(left, right, spread * distance, points, triangles, offsets, around)[step]
    if np.array_equal(step, np.arange(len(step))):
        return None
    if copies.vertices is None:
        return step
    whole = np.arange(len(copies.labels))
    whole[copies.vertices] = copies.vertices[step]
    return whole


def _point_pairs(points: Array, free: FreeEdges, distance: float) -> tuple[IntArray, IntArray]:
    """Pairs of rim vertices within `distance` and within a share of their own free edges, nearest first."""
    from scipy.spatial import cKDTree

    rim = np.unique(np.concatenate([free.start, free.end]))
    if len(rim) < 2:
        return rim[:0], rim[:0]
    length = np.linalg.norm(points[free.end] - points[free.start], axis=1)
    shortest = np.full(len(points), np.inf)
    np.minimum.at(shortest, free.start, length)
    np.minimum.at(shortest, free.end, length)
    pairs = cKDTree(points[rim]).query_pairs(distance, output_type="ndarray").astype(np.int64)
    left, right = rim[pairs[:, 0]], rim[pairs[:, 1]]
    gap = np.linalg.norm(points[left] - points[right], axis=1)
    near = gap <= REACH_SHARE * np.minimum(shortest[left], shortest[right])
    order = np.argsort(gap[near], kind="stable")
    return left[near][order], right[near][order]
