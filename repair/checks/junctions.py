"""T-junctions: seams whose two sides are meshed differently, so that a corner lies on the middle of an edge."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.checks.edges import edge_keys
from patchwright.repair.checks.examination import Examination
from patchwright.repair.checks.regions import plural, regional
from patchwright.repair.checks.registry import Finding, check

INNER = 0.02  # of an edge's length: nearer to an end, a vertex belongs to that end
SAG = 0.05  # of an edge's length: a vertex of the finer side lies off the coarser side's chord by that much
OPPOSED = 0.5  # cosine: the surfaces on both sides of a t-junction go on into each other
MOST_VERTICES = 200_000  # free edges up to which t-junctions are looked for


@check("t-junctions", looks="mesh", kinds=("t-junction",))
def t_junctions(exam: Examination) -> Finding:
    """Free edges with the corner of another free edge on them: a seam whose two sides are meshed differently."""
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
    """(k, 3) vertex, triangle of `body` and its edge 0..2 that the vertex lies on, along the rims."""
    from scipy.spatial import cKDTree

    body = exam.oriented.triangulation
    points, triangles = body.vertices, body.triangles
    free = exam.body_adjacency.free
    # the orientation turns triangles, so their edges are looked up afresh
    which, corner, start, end = _free_edges(triangles, exam.body_adjacency.edges[free], len(points))
    nothing = np.zeros((0, 3), dtype=np.int64)
    if not len(which) or len(which) > MOST_VERTICES:
        return nothing
    normal = body.normals[which]
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
    on = (t > INNER) & (t < 1.0 - INNER) & (apart <= reach[edge]) & (vertex != start[edge]) & (vertex != end[edge])
    on &= facing | (apart <= exam.tolerance.gap)
    on &= ~(triangles[which[edge]] == vertex[:, None]).any(axis=1)
    return np.stack([vertex[on], which[edge[on]], corner[edge[on]]], axis=1)


def _free_edges(triangles: IntArray, free: IntArray, count: int) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Triangle, corner, start and end of each free edge as its triangle runs it."""
    start, end = triangles.reshape(-1), triangles[:, [1, 2, 0]].reshape(-1)
    flat = np.flatnonzero(np.isin(edge_keys(start, end, count), edge_keys(free[:, 0], free[:, 1], count)))
    return flat // 3, flat % 3, start[flat], end[flat]
