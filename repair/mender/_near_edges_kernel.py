"""Kernels of welding: pairs of free edges whose ends lie within reach of each other, and the order to try them in.

Edges lie in grids by the level of their reach; a slot of the table is a cell, and the cells of one block of 4 x 4 x 4
lie side by side in it: edges that are near each other in space are near each other in memory as well, and what one
edge read the next one reads again.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from patchwright.models._compile_kernel import filling, inner
from patchwright.models.arrays import Array, BoolArray, IntArray

CANDIDATES = 6  # nearest free edges kept per free edge
NEAR = 0.125  # of an edge's reach: what is so near and fits is its copy
FOLDED, STRANGE, SAME_WAY = 1, 2, 4  # kinds of pairs
_NOWHERE = -10000  # level of the grid for an edge that reaches nowhere
_LEVELS = 4096  # more than there are powers of two
_STEPS, _OCTAVES = 2, 40  # of the distances that pairs are ordered by: smaller ones count as equal

Indices = npt.NDArray[np.int32]


def near_edges(
    points: Array, start: IntArray, end: IntArray, apex: IntArray, tag: IntArray, distance: float, share: float
) -> tuple[IntArray, IntArray, Array, IntArray]:
    """Pairs of free edges whose ends both lie within reach, each once: left < right, the farther ends' distance, kind.

    `start`, `end` and `apex` (e,) are the corners of the edges' triangles in `points` (n, 3). Reach is `distance`, and
    at most `share` of the shorter edge; of each edge's pairs the nearest `CANDIDATES` count. Kinds are sums of `FOLDED`
    (the triangles are folded on each other), `STRANGE` (the tags differ) and `SAME_WAY` (both run the same way); pairs
    that are folded and run the same way are doubles and left out.

    Copies are mostly much nearer than what is in reach. Two edges nearest to each other, of kind 0 and within a
    fraction `NEAR` of their reach, have found each other, and only the others look farther.
    """
    near = _pairs_within(points, start, end, apex, tag, NEAR * distance, NEAR * share)
    settled = np.zeros(len(start), dtype=np.bool_)
    _settle_mutual(*near, np.full(len(start), np.inf), settled)
    kept = settled[near[0]] | settled[near[1]]
    some = np.flatnonzero(~settled)
    left, right, gap, kind = _pairs_within(points, start[some], end[some], apex[some], tag[some], distance, share)
    far = some[left], some[right], gap, kind
    left, right, gap, kind = (np.concatenate([one[kept], other]) for one, other in zip(near, far, strict=True))
    return left, right, gap, kind


@filling
def _settle_mutual(
    left: IntArray, right: IntArray, gap: Array, kind: IntArray, best: Array, settled: BoolArray
) -> None:
    """Mark the edges whose nearest partner has them as its nearest one, where that pair is of kind 0."""
    for at in range(len(left)):
        best[left[at]] = min(best[left[at]], gap[at])
        best[right[at]] = min(best[right[at]], gap[at])
    for at in range(len(left)):
        if kind[at] == 0 and gap[at] <= best[left[at]] and gap[at] <= best[right[at]]:
            settled[left[at]] = True
            settled[right[at]] = True


def _pairs_within(
    points: Array, start: IntArray, end: IntArray, apex: IntArray, tag: IntArray, distance: float, share: float
) -> tuple[IntArray, IntArray, Array, IntArray]:
    """All pairs of `near_edges`, near and far."""
    n = len(start)
    reach, middle, level = np.empty(n), np.empty((n, 3)), np.empty(n, dtype=np.int64)
    present = np.zeros(_LEVELS, dtype=np.bool_)
    _measure(points, start, end, distance, share, reach, middle, level, present)
    blocks = 1
    while 64 * blocks < n:
        blocks *= 2
    offsets = np.zeros(64 * blocks + 2, dtype=np.int32)
    slots = np.empty((n, 2), dtype=np.int32)
    items = np.empty(_count(level, middle, present, offsets, slots), dtype=np.int32)
    _place(slots, offsets, items)
    begin = np.zeros(n + 1, dtype=np.int64)
    partner, gaps, kinds = np.empty(CANDIDATES, dtype=np.int64), np.empty(CANDIDATES), np.empty(CANDIDATES, np.int64)
    room, done = n + 64, 0
    pairs, gap, kind = np.empty((room, 2), dtype=np.int64), np.empty(room), np.empty(room, dtype=np.int64)
    while True:
        done = _search(
            points, start, end, apex, tag, reach, level, middle, offsets, items, done, begin, partner, gaps, kinds,
            pairs, gap, kind,
        )  # fmt: skip
        if done == n:
            break
        room *= 2
        pairs, gap, kind = np.resize(pairs, (room, 2)), np.resize(gap, room), np.resize(kind, room)
    count = int(begin[n])
    return pairs[:count, 0].copy(), pairs[:count, 1].copy(), gap[:count].copy(), kind[:count].copy()


@filling
def _measure(
    points: Array,
    start: IntArray,
    end: IntArray,
    distance: float,
    share: float,
    reach: Array,
    middle: Array,
    level: IntArray,
    present: BoolArray,
) -> None:
    """Reach, middle and level of each edge, and which levels there are."""
    for e in range(len(start)):
        square = 0.0
        for d in range(3):
            a = points[start[e], d]
            b = points[end[e], d]
            middle[e, d] = 0.5 * (a + b)
            square += (b - a) * (b - a)
        reach[e] = min(distance, share * np.sqrt(square))
        level[e] = _NOWHERE
        if reach[e] > 0.0:
            level[e] = int(np.ceil(np.log2(reach[e])))
            present[level[e] + _LEVELS // 2] = True


@inner
def _slot(level: int, i: int, j: int, k: int, blocks: int) -> int:
    h = level * 73856093 + (i >> 2)
    h *= -49064778989728563
    h ^= h >> 29
    h = (h ^ ((j >> 2) * 19349663)) * -4265267296055464877
    h ^= h >> 32
    h = (h ^ ((k >> 2) * 83492791)) * -49064778989728563
    h ^= h >> 29
    return ((h & (blocks - 1)) << 6) | ((i & 3) << 4) | ((j & 3) << 2) | (k & 3)


@filling
def _count(level: IntArray, middle: Array, present: BoolArray, offsets: Indices, slots: Indices) -> int:
    """Note the slots of each edge, -1 for none, and count the edges of each slot, two places ahead; returns the sum.

    Every edge lies in the grid of its own level and in the next finer one, where a shorter partner looks for it.
    """
    blocks = (len(offsets) - 2) >> 6
    total = 0
    for e in range(len(level)):
        for finer in range(2):
            own = level[e] - finer
            slots[e, finer] = -1
            if level[e] == _NOWHERE or not present[own + _LEVELS // 2]:
                continue
            size = 2.0 ** (own + 1)
            i = int(np.floor(middle[e, 0] / size))
            j = int(np.floor(middle[e, 1] / size))
            k = int(np.floor(middle[e, 2] / size))
            s = _slot(own, i, j, k, blocks)
            slots[e, finer] = s
            offsets[s + 2] += 1
            total += 1
    for s in range(len(offsets) - 2):
        offsets[s + 2] += offsets[s + 1]
    return total


@filling
def _place(slots: Indices, offsets: Indices, items: Indices) -> None:
    """Put the edges into their slots: those of slot s are items[offsets[s]:offsets[s + 1]] then."""
    for e in range(len(slots)):
        for finer in range(2):
            s = slots[e, finer]
            if s >= 0:
                items[offsets[s + 1]] = e
                offsets[s + 1] += 1


@inner
def _kind(
    points: Array, start: IntArray, end: IntArray, apex: IntArray, tag: IntArray, e: int, f: int, same_way: bool
) -> int:
    what = 0
    if same_way:
        what += SAME_WAY
    if tag[e] != tag[f]:
        what += STRANGE
    # inward directions of both triangles, perpendicular to edge e
    a, b, c, p = start[e], end[e], apex[e], apex[f]
    q = start[f] if same_way else end[f]
    ee = 0.0
    pe = 0.0
    pf = 0.0
    for d in range(3):
        t = points[b, d] - points[a, d]
        ee += t * t
        pe += t * (points[c, d] - points[a, d])
        pf += t * (points[p, d] - points[q, d])
    pe = pe / ee
    pf = pf / ee
    dot = 0.0
    we = 0.0
    wf = 0.0
    for d in range(3):
        t = points[b, d] - points[a, d]
        u = points[c, d] - points[a, d] - pe * t
        v = points[p, d] - points[q, d] - pf * t
        dot += u * v
        we += u * u
        wf += v * v
    if dot > 0.5 * np.sqrt(we * wf):
        what += FOLDED
    return what


@filling
def _search(
    points: Array,
    start: IntArray,
    end: IntArray,
    apex: IntArray,
    tag: IntArray,
    reach: Array,
    level: IntArray,
    middle: Array,
    offsets: Indices,
    items: Indices,
    first: int,
    begin: IntArray,
    partner: IntArray,
    gaps: Array,
    kinds: IntArray,
    pairs: IntArray,
    gap: Array,
    kind: IntArray,
) -> int:
    """Write down the pairs of the edges from `first` on, as far as there is room; returns the edge to go on with.

    Those of edge e, with partners above it or with partners below it that do not know of e, are begin[e]:begin[e + 1].
    """
    last = len(partner) - 1
    blocks = (len(offsets) - 2) >> 6
    for e in range(first, len(level)):
        written = begin[e]
        if written + last + 1 > len(gap):
            return e
        begin[e + 1] = written
        if level[e] == _NOWHERE:
            continue
        found = 0
        size = 2.0 ** (level[e] + 1)
        limit = reach[e]
        round_it = 1.0001 * limit  # what is in reach lies in one or two cells along each axis
        i0 = int(np.floor((middle[e, 0] - round_it) / size))
        j0 = int(np.floor((middle[e, 1] - round_it) / size))
        k0 = int(np.floor((middle[e, 2] - round_it) / size))
        more_i = int(np.floor((middle[e, 0] + round_it) / size)) - i0
        more_j = int(np.floor((middle[e, 1] + round_it) / size)) - j0
        more_k = int(np.floor((middle[e, 2] + round_it) / size)) - k0
        for corner in range(8):
            i, j, k = corner & 1, (corner >> 1) & 1, corner >> 2
            if i > more_i or j > more_j or k > more_k:
                continue
            s = _slot(level[e], i0 + i, j0 + j, k0 + k, blocks)
            for at in range(offsets[s], offsets[s + 1]):
                f = items[at]
                # middles are no farther apart than the farther pair of ends; the factor is for rounding
                far = 0.0
                for d in range(3):
                    far += (middle[e, d] - middle[f, d]) * (middle[e, d] - middle[f, d])
                if far > 1.0001 * limit * limit or f == e:
                    continue
                cross = 0.0
                along = 0.0
                cross2 = 0.0
                along2 = 0.0
                for d in range(3):
                    ea = points[start[e], d]
                    eb = points[end[e], d]
                    fa = points[start[f], d]
                    fb = points[end[f], d]
                    cross += (ea - fb) * (ea - fb)
                    cross2 += (eb - fa) * (eb - fa)
                    along += (ea - fa) * (ea - fa)
                    along2 += (eb - fb) * (eb - fb)
                cross = np.sqrt(cross if cross > cross2 else cross2)
                along = np.sqrt(along if along > along2 else along2)
                same_way = along < cross
                best = along if same_way else cross
                if best > reach[e] or best > reach[f] or (found > last and best >= gaps[last]):
                    continue
                twice = False
                for m in range(found):
                    if partner[m] == f:
                        twice = True
                if twice:
                    continue
                m = found if found <= last else last  # insert by distance
                while m > 0 and gaps[m - 1] > best:
                    gaps[m] = gaps[m - 1]
                    partner[m] = partner[m - 1]
                    kinds[m] = kinds[m - 1]
                    m -= 1
                gaps[m] = best
                partner[m] = f
                kinds[m] = SAME_WAY if same_way else 0
                if found <= last:
                    found += 1
                if found > last:
                    limit = gaps[last]
        for m in range(found):
            f = partner[m]
            if f < e:
                known = False
                for at in range(begin[f], begin[f + 1]):
                    known = known or pairs[at, 1] == e
                if known:
                    continue
            one = e if e < f else f
            other = f if e < f else e
            what = _kind(points, start, end, apex, tag, one, other, kinds[m] == SAME_WAY)
            if what & FOLDED and what & SAME_WAY:
                continue
            pairs[written, 0] = one
            pairs[written, 1] = other
            gap[written] = gaps[m]
            kind[written] = what
            written += 1
        begin[e + 1] = written
    return len(level)


def trial_order(gap: Array, kind: IntArray, distance: float, oriented: float) -> IntArray:
    """The pairs within `distance` in the order to try them: by kind, then by distance in steps of sqrt(2), then as is.

    Steps, because pairs that were found one after the other lie near each other: tried in one go, what one read the
    next one reads again. Where less than a share `oriented` of the pairs runs the same way, those are left out.
    """
    counts = np.zeros((2, 8 * (_STEPS * _OCTAVES + 1) + 1), dtype=np.int64)
    within, same = _count_steps(gap, kind, distance, counts)
    skip = same < oriented * within
    order = np.empty(within - same if skip else within, dtype=np.int64)
    _sort_steps(gap, kind, distance, skip, counts, order)
    return order


@inner
def _step(gap: float, kind: int, distance: float) -> int:
    step = 0
    if gap > 0.0:
        step = int(np.floor(_STEPS * (np.log2(gap / distance) + _OCTAVES)))
        step = min(max(step, 0), _STEPS * _OCTAVES)
    return kind * (_STEPS * _OCTAVES + 1) + step


@filling
def _count_steps(gap: Array, kind: IntArray, distance: float, counts: IntArray) -> tuple[int, int]:
    within = 0
    same = 0
    for i in range(len(gap)):
        if gap[i] <= distance:
            within += 1
            if kind[i] & SAME_WAY:
                same += 1
            counts[0, _step(gap[i], kind[i], distance)] += 1
    return within, same


@filling
def _sort_steps(gap: Array, kind: IntArray, distance: float, skip: bool, counts: IntArray, order: IntArray) -> None:
    total = 0
    steps = _STEPS * _OCTAVES + 1
    for s in range(8 * steps):
        counts[1, s] = total
        if not (skip and (s // steps) & SAME_WAY):
            total += counts[0, s]
    for i in range(len(gap)):
        if gap[i] <= distance and not (skip and kind[i] & SAME_WAY):
            s = _step(gap[i], kind[i], distance)
            order[counts[1, s]] = i
            counts[1, s] += 1
