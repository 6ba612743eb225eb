"""T-junctions: seams whose two sides are meshed differently, so that a corner lies on the middle of an edge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.checks.edges import edge_keys
from patchwright.repair.checks.examination import Examination
from patchwright.repair.checks.regions import plural, regional
from patchwright.repair.checks.registry import Finding, check

INNER = 0.02  # of an edge's length: nearer to an end, a vertex belongs to that end
SAG = 0.05  # of an edge's length: a vertex of the finer side lies off the coarser side's chord by that much
OPPOSED = 0.5  # cosine: the surfaces on both sides of a t-junction go on into each other
MEETS = 0.5  # of a vertex's distance from the edge: the edge's own ends are that near the other side, or it is a gap
STRAIGHT = 1.2  # arc to chord along one seam
MOST_VERTICES = 200_000  # free edges up to which t-junctions are looked for


@check("t-junctions", looks="mesh", kinds=("t-junction",))
def t_junctions(exam: Examination) -> Finding:
    """Free edges with the corner of another free edge on them: a seam whose two sides are meshed differently."""
    if np.count_nonzero(exam.body_adjacency.free) > MOST_VERTICES:
        return Finding(figures={"t_junctions": None, "t_junctions_why": "too many free edges to look along"})
    hits = exam.junctions
    if not len(hits):
        return Finding(figures={"t_junctions": 0})
    triangles = exam.oriented.triangulation.triangles
    start, end = triangles[hits[:, 1], hits[:, 2]], triangles[hits[:, 1], (hits[:, 2] + 1) % 3]
    elements = np.stack([start, end, hits[:, 0]], axis=1)

    def say(count: int, size: float) -> str:
        return f"{plural(count, 'corner')} on the middle of another triangle's free edge, along {exam.length(size)}"

    defects = regional(
        exam, "t-junction", "error", elements, exam.body.vertices[elements], exam.body_index[hits[:, 1]], say
    )
    return Finding(tuple(defects), {"t_junctions": len(hits)})


def find_junctions(exam: Examination) -> IntArray:
    """(k, 3) vertex, triangle of `body` and its edge 0..2 that the vertex lies on, along the rims.

    On the edge to round-off, or beside it by the sag of a coarser chord; then the edge's own ends lie on the other
    side. Two sides with a gap between them have no t-junctions, however narrow it is.
    """
    from scipy.spatial import cKDTree

    body = exam.oriented.triangulation
    points, triangles = body.vertices, body.triangles
    free = exam.body_adjacency.free
    # the orientation turns triangles, so their edges are looked up afresh
    which, corner, start, end = _free_edges(triangles, exam.body_adjacency.edges[free], len(points))
    nothing = np.zeros((0, 3), dtype=np.int64)
    if not len(which) or len(which) > MOST_VERTICES:
        return nothing
    normal = body.take(which).normals
    along = points[end] - points[start]
    length = np.linalg.norm(along, axis=1)
    outward = np.cross(along, normal)
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), np.finfo(float).tiny)
    rim, inverse = np.unique(np.concatenate([start, end]), return_inverse=True)
    ahead = np.stack([np.bincount(inverse, np.tile(outward[:, k], 2), minlength=len(rim)) for k in range(3)], axis=1)
    reach = np.maximum(exam.tolerance.gap, SAG * length)
    near = cKDTree(points[rim]).query_ball_point(0.5 * (points[start] + points[end]), 0.5 * length + reach)
    sizes = np.array([len(some) for some in near], dtype=np.int64)
    edge = np.repeat(np.arange(len(which)), sizes)
    if not len(edge):
        return nothing
    found = np.concatenate([np.asarray(some, dtype=np.int64) for some in near if len(some)])
    vertex = rim[found]
    local = points[vertex] - points[start[edge]]
    t = np.einsum("ij,ij->i", local, along[edge]) / np.maximum(length[edge] ** 2, np.finfo(float).tiny)
    apart: Array = np.linalg.norm(local - t[:, None] * along[edge], axis=1)
    facing = -np.einsum("ij,ij->i", ahead[found], outward[edge]) >= OPPOSED * np.linalg.norm(ahead[found], axis=1)
    close = apart <= exam.tolerance.gap
    # on the edge to round-off, a vertex that was not merged with an end does not belong to it
    inner = np.where(close, 0.0, INNER)
    strange = (vertex != start[edge]) & (vertex != end[edge])
    strange &= ~(triangles[which[edge]] == vertex[:, None]).any(axis=1)
    on = strange & (t > inner) & (t < 1.0 - inner) & (apart <= reach[edge]) & (facing | close)
    beside = np.flatnonzero(on & ~close)
    if len(beside):
        # how far the other side's edges pass by each rim vertex
        foot = local - np.clip(t, 0.0, 1.0)[:, None] * along[edge]
        passing = np.full(len(points), np.inf)
        np.minimum.at(passing, vertex[strange & facing], np.linalg.norm(foot, axis=1)[strange & facing])
        chains = _Chains.of(exam)
        for end_of in (start, end):
            tip = end_of[edge[beside]]
            meets = passing[tip] <= MEETS * apart[beside]
            on[beside] &= meets | chains.joined(tip, vertex[beside])
    return np.stack([vertex[on], which[edge[on]], corner[edge[on]]], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class _Chains:
    """Where the rims' vertices lie along their rims: (n,) rim (-1 for none) and arc length, (r,) perimeters."""

    points: Array
    rim: IntArray
    place: Array
    perimeter: Array

    @classmethod
    def of(cls, exam: Examination) -> _Chains:
        points = exam.body.vertices
        rim, place = np.full(len(points), -1, dtype=np.int64), np.zeros(len(points))
        for k, one in enumerate(exam.rims):
            step = np.linalg.norm(np.diff(points[one.loop], axis=0), axis=1)
            rim[one.loop], place[one.loop] = k, np.concatenate([[0.0], np.cumsum(step)])
        return cls(points, rim, place, np.array([one.perimeter for one in exam.rims]))

    def joined(self, a: IntArray, b: IntArray) -> BoolArray:
        """(k,) whether the rim leads from a to b nearly straight: they are neighbours on one seam."""
        same = (self.rim[a] >= 0) & (self.rim[a] == self.rim[b])
        way = np.abs(self.place[a] - self.place[b])
        way = np.minimum(way, self.perimeter[self.rim[a]] - way)
        return np.asarray(same & (way <= STRAIGHT * np.linalg.norm(self.points[a] - self.points[b], axis=1)))


def _free_edges(triangles: IntArray, free: IntArray, count: int) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Triangle, corner, start and end of each free edge as its triangle runs it."""
    start, end = triangles.reshape(-1), triangles[:, [1, 2, 0]].reshape(-1)
    flat = np.flatnonzero(np.isin(edge_keys(start, end, count), edge_keys(free[:, 0], free[:, 1], count)))
    return flat // 3, flat % 3, start[flat], end[flat]
