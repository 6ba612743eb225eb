"""Triangles without area are taken out of a closed mesh: the neighbour along the longest side gets the middle corner.

A triangle whose corners lie exactly in one line covers nothing, yet it joins sides of its neighbours. With the middle
corner put on the neighbour's side those sides meet each other, and nothing has moved.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray

ROUNDS = 100


def without_flat(points: Array, triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Triangles (m, 3) with area over the same points, and (m,) the given triangle each is or is a piece of.

    Every edge is run as often one way more than the other as before. What is left after `ROUNDS` rounds stays.
    """
    from patchwright.models._triangle_triangle_kernel import with_area

    parent = np.arange(len(triangles))
    good = with_area(points, np.ascontiguousarray(triangles))
    for _ in range(ROUNDS):
        twice = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
        triangles, parent, good = triangles[~twice], parent[~twice], good[~twice]
        flat = np.flatnonzero(~good)
        if not len(flat):
            break
        rows, partner, side = _across(points, triangles, good, flat)
        if not len(rows):
            break
        middle = rows[:, 1]
        split = triangles[partner]
        at = np.arange(len(partner))
        a, b, apex = split[at, side], split[at, (side + 1) % 3], split[at, (side + 2) % 3]
        gone = np.zeros(len(triangles), dtype=np.bool_)
        gone[rows[:, 0]] = gone[partner] = True
        pieces = np.concatenate([np.stack([a, middle, apex], axis=1), np.stack([middle, b, apex], axis=1)])
        triangles = np.concatenate([triangles[~gone], pieces])
        parent = np.concatenate([parent[~gone], np.tile(parent[partner], 2)])
        good = np.concatenate([good[~gone], with_area(points, pieces)])
    order = np.argsort(parent, kind="stable")
    return triangles[order], parent[order]


def _across(points: Array, triangles: IntArray, good: BoolArray, flat: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """(k, 2) flat triangles and their middle corners, (k,) a triangle across the longest side, (k,) its side there.

    No triangle comes twice; neighbours with area go first, and a neighbour without area is taken by itself.
    """
    corners = points[triangles[flat]]
    longest = np.argmax(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2), axis=1)
    at = np.arange(len(flat))
    tail, head = triangles[flat[at], longest], triangles[flat[at], (longest + 1) % 3]
    middle = triangles[flat[at], (longest + 2) % 3]
    # sides that run from `head` to `tail`, those of triangles with area first
    start, stop = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    near = np.flatnonzero(np.isin(start, head) & np.isin(stop, tail))
    near = near[np.argsort(~good[near // 3], kind="stable")]
    keys, wanted = start[near] * len(points) + stop[near], head * len(points) + tail
    names, first = np.unique(keys, return_index=True)
    if not len(names):
        return np.zeros((0, 2), dtype=np.int64), near, near
    slot = np.minimum(np.searchsorted(names, wanted), len(names) - 1)
    there = names[slot] == wanted
    partner = near[first[slot]] // 3
    usable = np.flatnonzero(there & good[partner])
    usable = usable[np.unique(partner[usable], return_index=True)[1]]
    if not len(usable):
        usable = np.flatnonzero(there & (partner != flat))[:1]
    side = near[first[slot[usable]]] % 3
    return np.stack([flat[usable], middle[usable]], axis=1), partner[usable], side
