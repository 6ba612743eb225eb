"""Rim edges and what they face: the measurements that tell gaps from openings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation

AHEAD = 0.5  # cosine: the way across leaves within 60 degrees of straight ahead
FOLD = -0.2  # cosine: a missing edge or corner of a box turns the surface by 90 degrees, two skins of a blade by 180
WIDE = 0.5  # of the smaller rim's diameter: rims farther apart than that are not two sides of one gap
SEAM = 0.1  # of the rim's edge length: closer, the way across is noise of the faceting
BEND = 1.5  # arc to chord: a right-angled corner has 1.41, the two ends of a circle's diameter 1.57
APART = 0.1  # of a rim's length: nearer along the rim, two of its places are the flanks of a tooth
SMOOTH = 0.04  # of a rim's length: the way ahead is a mean over so much to both sides, or saw teeth face each other
SAMPLES = (12, 400)  # fewest and most samples of one rim


@dataclass(frozen=True, slots=True, eq=False)
class RimEdges:
    """The edges of all rims, those of loop l at offsets[l]:offsets[l + 1]; each runs as its surface is wound.

    Parameters
    ----------
    offsets : (l + 1,)
    loop : (e,) the loop of each edge
    start, end : (e, 3)
    length : (e,)
    normal : (e, 3) the surface's unit normal at the edge
    outward : (e, 3) unit direction in which the surface would go on across the edge
    triangle : (e,) the triangle (or face) the edge belongs to
    """

    offsets: IntArray
    loop: IntArray
    start: Array
    end: Array
    length: Array
    normal: Array
    outward: Array
    triangle: IntArray


@dataclass(frozen=True, slots=True, eq=False)
class LoopFacts:
    """One row per loop."""

    low: Array
    high: Array
    diameter: Array
    perimeter: Array
    centre: Array
    area: Array
    continues: Array
    planar: Array


@dataclass(frozen=True, slots=True, eq=False)
class Facing:
    """Per loop: the share of its length that faces a rim, the rim it mostly faces (-1 none), the way there."""

    share: Array
    partner: IntArray
    width: Array
    widest: Array


def loop_facts(edges: RimEdges) -> LoopFacts:
    """Box, perimeter, centre, cap area, agreement of cap and surface normals, deviation from a plane."""
    at, loop = edges.offsets[:-1], edges.loop
    tiny = np.finfo(float).tiny
    low = np.minimum.reduceat(np.minimum(edges.start, edges.end), at)
    high = np.maximum.reduceat(np.maximum(edges.start, edges.end), at)
    start, end = edges.start - low[loop], edges.end - low[loop]
    perimeter = np.add.reduceat(edges.length, at)
    weight = edges.length / np.maximum(perimeter[loop], tiny)
    centre = np.add.reduceat(weight[:, None] * 0.5 * (start + end), at)
    a, b = start - centre[loop], end - centre[loop]
    vector = 0.5 * np.add.reduceat(np.cross(b, a), at)  # against the rim's winding: along the missing surface's normal
    area = np.linalg.norm(vector, axis=1)
    cap = vector / np.maximum(area, tiny)[:, None]
    continues = np.add.reduceat(weight * np.einsum("ij,ij->i", edges.normal, cap[loop]), at)
    moment = np.add.reduceat(weight[:, None, None] * a[:, :, None] * a[:, None, :], at)
    _, axes = np.linalg.eigh(moment)
    planar = np.maximum.reduceat(np.abs(np.einsum("ij,ij->i", a, axes[loop, :, 0])), at)
    diameter = np.linalg.norm(high - low, axis=1)
    return LoopFacts(low, high, diameter, perimeter, centre + low, area, continues, planar)


def what_faces(edges: RimEdges, facts: LoopFacts, near: float, sense: float) -> Facing:
    """What each loop faces ahead of its surface (`sense` 1) or behind it (-1)."""
    from patchwright.repair.mender._rims_kernel import facing

    loops, diameter = len(facts.diameter), facts.diameter
    counts = np.clip(np.diff(edges.offsets), *SAMPLES)
    owner = np.repeat(np.arange(loops), counts)
    # samples at equal steps of arc length
    begin = np.concatenate([[0.0], np.cumsum(edges.length)])
    rank = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    place = begin[edges.offsets[owner]] + (rank + 0.5) / counts[owner] * facts.perimeter[owner]
    edge = np.searchsorted(begin, place, side="right") - 1
    edge = np.clip(edge, edges.offsets[owner], edges.offsets[owner + 1] - 1)
    step = (place - begin[edge]) / np.maximum(edges.length[edge], np.finfo(float).tiny)
    points = edges.start[edge] + np.clip(step, 0.0, 1.0)[:, None] * (edges.end - edges.start)[edge]
    everywhere, halfway = np.arange(len(edges.loop)), 0.5 * (begin[:-1] + begin[1:])
    outward = sense * _way_ahead(edges, begin, facts.perimeter, halfway, everywhere)
    ahead = sense * _way_ahead(edges, begin, facts.perimeter, place, edge)
    reach = np.maximum(WIDE * diameter, near)
    found, way = facing(
        np.ascontiguousarray(points), ahead, owner, edge, edges.length[edge], place, edges.offsets, begin,
        np.ascontiguousarray(edges.start), np.ascontiguousarray(edges.end), outward, facts.low, facts.high,
        reach, *_within_reach(facts.low, facts.high, reach), near, SEAM, AHEAD, FOLD, BEND, APART,
    )  # fmt: skip
    met = found >= 0
    target = np.where(met, edges.loop[np.maximum(found, 0)], -1)
    # a small rim near a large one's side, or a large one far from a small one, are not two sides of one gap
    met &= (target == owner) | (way <= np.maximum(WIDE * np.minimum(diameter[owner], diameter[target]), near))
    share = np.bincount(owner[met], minlength=loops) / counts
    width, widest, partner = np.full(loops, np.inf), np.full(loops, np.inf), np.full(loops, -1, dtype=np.int64)
    index = np.flatnonzero(met)
    if len(index):
        order = index[np.lexsort((way[index], owner[index]))]
        groups, first, amount = np.unique(owner[order], return_index=True, return_counts=True)
        width[groups] = way[order[first + amount // 2]]
        widest[groups] = way[order[first + amount - 1]]
        pair, votes = np.unique(owner[index] * loops + target[index], return_counts=True)
        best = np.lexsort((votes, pair // loops))
        partner[pair[best] // loops] = pair[best] % loops
    return Facing(share, partner, width, widest)


def _within_reach(low: Array, high: Array, reach: Array) -> tuple[IntArray, IntArray]:
    """Offsets (l + 1,) and the boxes that each of `low`, `high` (l, 3) touches when it is widened by its `reach` (l,).

    A box is the box of a triangle over its two corners: what a tree of triangles finds.
    """
    loops = len(low)
    slack = (1.0 + 1e-12) * reach[:, None]
    trees = []
    for lowest, highest in ((low - slack, high + slack), (low, high)):
        corners = np.arange(loops)[:, None] + np.array([0, loops, loops])
        trees.append(Tree.of(Triangulation(np.concatenate([lowest, highest]), corners)))
    pairs = trees[0].pairs(trees[1])
    first = np.concatenate([[0], np.cumsum(np.bincount(pairs[:, 0], minlength=loops))]).astype(np.int64)
    return first, np.ascontiguousarray(pairs[:, 1])


def _way_ahead(edges: RimEdges, begin: Array, perimeter: Array, place: Array, edge: IntArray) -> Array:
    """(k, 3) unit way ahead at places (k,) given by arc length, on `edge`: the mean over a stretch of rim."""
    loop = edges.loop[edge]
    first, whole = begin[edges.offsets[loop]], perimeter[loop]
    travelled = np.concatenate([np.zeros((1, 3)), np.cumsum(edges.length[:, None] * edges.outward, axis=0)])
    round_trip = travelled[edges.offsets[loop + 1]] - travelled[edges.offsets[loop]]

    def integral(at: Array) -> Array:
        turns = np.floor((at - first) / np.maximum(whole, np.finfo(float).tiny))
        inside = at - turns * whole
        on = np.clip(np.searchsorted(begin, inside, side="right") - 1, edges.offsets[loop], edges.offsets[loop + 1] - 1)
        step = np.clip(inside - begin[on], 0.0, edges.length[on])
        return np.asarray(travelled[on] + step[:, None] * edges.outward[on] + turns[:, None] * round_trip)

    mean = (integral(place + SMOOTH * whole) - integral(place - SMOOTH * whole)) / np.maximum(
        2.0 * SMOOTH * whole, np.finfo(float).tiny
    )[:, None]
    size = np.linalg.norm(mean, axis=1, keepdims=True)
    # round a sharp tip the mean has no direction
    return np.where(size > 0.05, mean / np.maximum(size, np.finfo(float).tiny), edges.outward[edge])
