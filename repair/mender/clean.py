"""Cleaning: collapsed and doubled triangles out, edges and vertices used too often taken apart.

Nothing moves. Every removal says which triangles went and why.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import BoolArray, IntArray
from patchwright.models.triangulation import Triangulation


@dataclass(frozen=True, slots=True, eq=False)
class Cleaned:
    """A triangulation after cleaning.

    Parameters
    ----------
    triangulation : what is left
    parents : (m,) int64, the triangle of the input each one is
    removed : (r,) int64, the triangles of the input that went
    """

    triangulation: Triangulation
    parents: IntArray
    removed: IntArray


def drop_collapsed(triangulation: Triangulation) -> Cleaned:
    """Without the triangles that use one vertex twice."""
    a, b, c = triangulation.triangles.T
    return _keep(triangulation, (a != b) & (b != c) & (c != a))


def drop_duplicates(triangulation: Triangulation) -> Cleaned:
    """Without doubled triangles (the same three vertices, either way round).

    A patch of doubles keeps one copy where that closes a surface, and none where it is a wall or a fin without
    thickness: where more of its border edges have their two triangles without it than lack one.
    """
    from patchwright.repair.mender._orient_kernel import walk
    from patchwright.repair.mender._weld_kernel import merge_exact

    count = len(triangulation)
    keep = np.ones(count, dtype=np.bool_)
    if not count:
        return _keep(triangulation, keep)
    key = np.sort(triangulation.triangles, axis=1)
    group = merge_exact(key)  # the first copy in the input's own order
    lead = group == np.arange(count)
    if lead.all():
        return _keep(triangulation, keep)
    size = np.bincount(group, minlength=count)
    double = size[group] > 1
    keep = lead.copy()
    # patches of doubles: one copy each, connected through edges among themselves
    patch_of = np.flatnonzero(lead & double)
    patch = triangulation.take(patch_of)
    own = Adjacency.of(patch)
    component, _, _ = walk(patch.triangles, own.neighbours)
    base = triangulation.take(np.flatnonzero(~double))
    uses = _use_count(base.triangles, patch.triangles)
    border = own.free[own.triangle_edges]
    walls = np.bincount(component, weights=(border & (uses == 2)).sum(axis=1))
    seams = np.bincount(component, weights=(border & (uses == 1)).sum(axis=1))
    keep[patch_of[(walls > seams)[component]]] = False
    return _keep(triangulation, keep)


def drop_hanging_flats(triangulation: Triangulation, height: float) -> Cleaned:
    """Without triangles of no area that only hang on the surface.

    A flat triangle that fills a T-junction has two neighbours at every edge and stays; one that hangs on an edge of two
    others, or ends free on two sides, bounds nothing.

    Parameters
    ----------
    height : up to this a triangle counts as flat, a length
    """
    from patchwright.repair.mender._clean_kernel import triangle_heights

    current, parents = triangulation, np.arange(len(triangulation))
    while len(current):
        flat = triangle_heights(current.vertices, current.triangles) <= height
        if not flat.any():
            break
        index = np.flatnonzero(flat)
        corner = np.zeros(len(current.vertices), dtype=np.bool_)
        corner[current.triangles[index]] = True
        # whatever shares an edge with one of them has two of these corners
        around = np.flatnonzero(np.count_nonzero(corner[current.triangles], axis=1) >= 2)
        adjacency = Adjacency.of(current.take(around))
        sides = adjacency.triangle_edges[np.searchsorted(around, index)]
        hangs = adjacency.non_manifold[sides].any(axis=1) | (adjacency.free[sides].sum(axis=1) >= 2)
        if not hangs.any():
            break
        left = np.ones(len(current), dtype=np.bool_)
        left[index[hangs]] = False
        current, parents = current.take(left), parents[left]
    gone = np.ones(len(triangulation), dtype=np.bool_)
    gone[parents] = False
    return Cleaned(current, parents, np.flatnonzero(gone))


def split_non_manifold(
    triangulation: Triangulation, adjacency: Adjacency | None = None, *, vertices: bool = True
) -> Triangulation:
    """The same triangles with own vertices where too many meet.

    At an edge used more than twice the triangles that enclose material between them stay joined and the others let go;
    with `vertices`, triangles that only touch in a point get own copies of it. `adjacency` of the same, where at hand.
    Where nothing is to be taken apart, the triangulation itself comes back.
    """
    from patchwright.repair.mender._clean_kernel import fans, sector_partners

    count = len(triangulation)
    if not count:
        return triangulation
    adjacency = Adjacency.of(triangulation) if adjacency is None else adjacency
    many = np.flatnonzero(adjacency.use_count > 2)
    splits = np.full(len(triangulation.vertices), vertices)
    splits[adjacency.edges[many]] = True
    if not splits.any():
        return triangulation
    offsets, around = adjacency.edge_triangles
    counts = adjacency.use_count[many]
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    index = np.repeat(offsets[many] - starts[:-1], counts) + np.arange(starts[-1])
    triangles = triangulation.triangles
    left, right = sector_partners(
        adjacency.edges[many], starts, np.asarray(around)[index], triangulation.vertices, triangles
    )
    label = fans(triangles, adjacency.neighbours, left, right, splits)
    own = label.reshape(-1) == np.arange(label.size)  # a fan's label is its first corner
    fan = np.flatnonzero(own)
    owner = triangles.reshape(-1)[fan]
    # the first fan of a vertex keeps its number, the others are appended
    at = np.full(len(triangulation.vertices), -1, dtype=np.int64)
    at[owner[::-1]] = np.arange(len(fan))[::-1]  # of several, the last one written stays: the first
    lead = at[owner] == np.arange(len(fan))
    if lead.all():
        return triangulation
    number = owner.copy()
    number[~lead] = len(triangulation.vertices) + np.arange(int(np.count_nonzero(~lead)))
    points = np.concatenate([triangulation.vertices, triangulation.vertices[owner[~lead]]])
    return replace(triangulation, vertices=points, triangles=number[(np.cumsum(own) - 1)[label]])


def _use_count(base: IntArray, asked: IntArray) -> IntArray:
    """(k, 3) how many triangles of `base` use each edge of the triangles `asked`."""
    both = np.concatenate([base, asked])
    start, end = both.reshape(-1), both[:, [1, 2, 0]].reshape(-1)
    key = np.minimum(start, end) * (int(both.max(initial=0)) + 1) + np.maximum(start, end)
    table = np.sort(key[: 3 * len(base)])
    wanted = key[3 * len(base) :]
    uses = np.searchsorted(table, wanted, side="right") - np.searchsorted(table, wanted, side="left")
    return np.asarray(uses.reshape(-1, 3), dtype=np.int64)


def _keep(triangulation: Triangulation, keep: BoolArray) -> Cleaned:
    if keep.all():
        return Cleaned(triangulation, np.arange(len(triangulation)), np.zeros(0, dtype=np.int64))
    kept = np.flatnonzero(keep)
    return Cleaned(triangulation.take(kept), kept, np.flatnonzero(~keep))
