"""T-junctions: a rim vertex that lies on another free edge splits it, so that both sides share their edges.

Seams between patches that were tessellated one by one have their own points on each side. Every point is given to the
other side's edge; no vertex moves, an edge bends by at most the distance. The two sides then share their edges.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.arrays import BoolArray, IntArray
from patchwright.models.triangulation import Triangulation
from patchwright.repair.mender.weld import free_edges

HEIGHT_SHARE = 0.25  # of a triangle's height: its edge bends no farther
ROUNDS = 6  # a triangle gives one edge per round


@dataclass(frozen=True, slots=True, eq=False)
class Conformed:
    """A triangulation whose free edges have no vertex of another rim on them.

    Parameters
    ----------
    triangulation : pieces in the order of the triangles they come from
    parents : (m,) int64, the input triangle each is or was cut from
    cut : (m,) whether it is a piece only
    inserted : how many vertices were put on edges
    largest_bend : the farthest an edge moved, model length unit
    """

    triangulation: Triangulation
    parents: IntArray
    cut: BoolArray
    inserted: int
    largest_bend: float


def conform(triangulation: Triangulation, distance: float) -> Conformed:
    """Split the free edges at the rim vertices within `distance` of them."""
    parents = np.arange(len(triangulation))
    cut = np.zeros(len(triangulation), dtype=np.bool_)
    inserted, bend = 0, 0.0
    for _ in range(ROUNDS):
        step = _round(triangulation, distance)
        if step is None:
            break
        triangulation, parent, pieces, farthest, count = step
        parents, cut = parents[parent], cut[parent] | pieces
        inserted += count
        bend = max(bend, farthest)
    return Conformed(triangulation, parents, cut, inserted, bend)


def _round(
    triangulation: Triangulation, distance: float
) -> tuple[Triangulation, IntArray, BoolArray, float, int] | None:
    from patchwright.repair.mender._conform_kernel import nearest_edges

    points, triangles = triangulation.vertices, triangulation.triangles
    free = free_edges(triangles, None)
    if not len(free.start):
        return None
    rim = np.unique(np.concatenate([free.start, free.end]))
    edge, at, gap = nearest_edges(rim, points, free.start, free.end, free.apex, distance, HEIGHT_SHARE)
    hit = np.flatnonzero(edge >= 0)
    if not len(hit):
        return None
    # one edge per triangle and round: the one with the most points on it
    owner = free.triangle[edge[hit]]
    load = np.bincount(edge[hit], minlength=len(free.start))
    rank = np.lexsort((edge[hit], -load[edge[hit]], owner))
    lead = np.ones(len(hit), dtype=np.bool_)
    lead[1:] = owner[rank][1:] != owner[rank][:-1]
    chosen = np.full(len(triangles), -1, dtype=np.int64)
    chosen[owner[rank][lead]] = edge[hit][rank][lead]
    hit = hit[chosen[owner] == edge[hit]]
    # runs of points along each edge; equal places keep one point only
    run = np.lexsort((at[hit], edge[hit]))
    hit = hit[run]
    e, t = edge[hit], at[hit]
    same = np.zeros(len(hit), dtype=np.bool_)
    same[1:] = (e[1:] == e[:-1]) & (t[1:] - t[:-1] <= 1e-9)
    hit = hit[~same]
    e, p = edge[hit], rim[hit]
    head = np.ones(len(e), dtype=np.bool_)
    head[1:] = e[1:] != e[:-1]
    tail = np.roll(head, -1)
    # pieces (previous, point, apex) and, after the last point, (point, end, apex)
    previous = np.where(head, free.start[e], np.roll(p, 1))
    pieces = np.concatenate(
        [
            np.stack([previous, p, free.apex[e]], axis=1),
            np.stack([p[tail], free.end[e[tail]], free.apex[e[tail]]], axis=1),
        ]
    )
    source = np.concatenate([free.triangle[e], free.triangle[e[tail]]])
    keep = np.ones(len(triangles), dtype=np.bool_)
    keep[source] = False
    parents = np.concatenate([np.flatnonzero(keep), source])
    order = np.argsort(parents, kind="stable")
    rows = np.concatenate([triangles[keep], pieces])[order]
    parents = parents[order]
    tags = None if triangulation.tags is None else triangulation.tags[parents]
    result = replace(triangulation, triangles=rows, uv=None, tags=tags)
    return result, parents, ~keep[parents], float(gap[hit].max()), len(hit)
