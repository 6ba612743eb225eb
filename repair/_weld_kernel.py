"""Kernels of welding: exact merging, candidate pairs of free edges, the greedy matching and its disjoint sets."""

from __future__ import annotations

import numpy as np
from numba import njit
from patchwright.models.arrays import Array, IntArray

CANDIDATES = 6  # nearest free edges kept per free edge


@njit(cache=True)
def _mix(h: int) -> int:
    h ^= h >> 33
    h *= -49064778989728563
    h ^= h >> 29
    h *= -4265267296055464877
    h ^= h >> 32
    return h


@njit(cache=True)
def merge_exact(bits: IntArray) -> IntArray:
    """(n,) index of the first row with the same three 64-bit words, of (n, 3) `bits`."""
    n = len(bits)
    size = 16
    while size < 2 * n:
        size *= 2
    table = np.full(size, -1, dtype=np.int64)
    first = np.empty(n, dtype=np.int64)
    for i in range(n):
        slot = _mix(_mix(_mix(bits[i, 0]) ^ bits[i, 1]) ^ bits[i, 2]) & (size - 1)
        while True:
            other = table[slot]
            if other < 0:
                table[slot] = i
                first[i] = i
                break
            if bits[other, 0] == bits[i, 0] and bits[other, 1] == bits[i, 1] and bits[other, 2] == bits[i, 2]:
                first[i] = other
                break
            slot = (slot + 1) & (size - 1)
    return first


@njit(cache=True)
def bucket(keys: IntArray, size: int) -> tuple[IntArray, IntArray]:
    """Counting sort of `keys` by their hash: offsets (size + 1,) and the items of each slot in order."""
    offsets = np.zeros(size + 1, dtype=np.int64)
    for k in range(len(keys)):
        offsets[(_mix(keys[k]) & (size - 1)) + 1] += 1
    for s in range(size):
        offsets[s + 1] += offsets[s]
    fill = offsets[:-1].copy()
    items = np.empty(len(keys), dtype=np.int64)
    for k in range(len(keys)):
        s = _mix(keys[k]) & (size - 1)
        items[fill[s]] = k
        fill[s] += 1
    return offsets, items


@njit(cache=True)
def _cell(level: int, i: int, j: int, k: int) -> int:
    return _mix(_mix(_mix(level * 73856093 + i) ^ (j * 19349663)) ^ (k * 83492791))


@njit(cache=True)
def edge_candidates(
    a: Array, b: Array, apex: Array, tag: IntArray, distance: float, share: float
) -> tuple[IntArray, Array, IntArray]:
    """For each free edge the nearest few free edges whose ends both lie within reach.

    `a`, `b` (e, 3) start and end, `apex` (e, 3) the triangle's third corner. Reach is `distance`, and at most `share`
    of the shorter edge. Returns partners (e, k), distances (e, k), kinds (e, k): bit 0 the triangles are folded on each
    other, bit 1 the tags differ, bit 2 both run the same way.
    """
    n = len(a)
    partner = np.full((n, CANDIDATES), -1, dtype=np.int64)
    gap = np.full((n, CANDIDATES), np.inf)
    kind = np.zeros((n, CANDIDATES), dtype=np.int64)
    reach = np.empty(n)
    level = np.empty(n, dtype=np.int64)
    for e in range(n):
        length = np.sqrt((b[e, 0] - a[e, 0]) ** 2 + (b[e, 1] - a[e, 1]) ** 2 + (b[e, 2] - a[e, 2]) ** 2)
        reach[e] = min(distance, share * length)
        level[e] = -10000
        if reach[e] > 0.0:
            level[e] = int(np.ceil(np.log2(reach[e])))
    # every edge lies in the grid of its own level and in the next finer one, where a shorter partner looks for it
    keys = np.empty(2 * n, dtype=np.int64)
    for e in range(n):
        for down in range(2):
            size = 2.0 ** (level[e] - down + 1)
            x = 0.5 * (a[e, 0] + b[e, 0]) / size
            y = 0.5 * (a[e, 1] + b[e, 1]) / size
            z = 0.5 * (a[e, 2] + b[e, 2]) / size
            keys[2 * e + down] = _cell(level[e] - down, int(np.floor(x)), int(np.floor(y)), int(np.floor(z)))
    slots = 16
    while slots < 2 * n:
        slots *= 2
    offsets, items = bucket(keys, slots)
    for e in range(n):
        if level[e] == -10000:
            continue
        size = 2.0 ** (level[e] + 1)
        x = 0.5 * (a[e, 0] + b[e, 0]) / size - 0.5
        y = 0.5 * (a[e, 1] + b[e, 1]) / size - 0.5
        z = 0.5 * (a[e, 2] + b[e, 2]) / size - 0.5
        i0, j0, k0 = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
        for corner in range(8):
            key = _cell(level[e], i0 + (corner & 1), j0 + ((corner >> 1) & 1), k0 + (corner >> 2))
            s = _mix(key) & (slots - 1)
            for at in range(offsets[s], offsets[s + 1]):
                if keys[items[at]] != key:
                    continue
                f = items[at] // 2
                if f == e:
                    continue
                near = min(reach[e], reach[f])
                cross = 0.0
                along = 0.0
                cross2 = 0.0
                along2 = 0.0
                for d in range(3):
                    cross += (a[e, d] - b[f, d]) ** 2
                    cross2 += (b[e, d] - a[f, d]) ** 2
                    along += (a[e, d] - a[f, d]) ** 2
                    along2 += (b[e, d] - b[f, d]) ** 2
                cross = np.sqrt(max(cross, cross2))
                along = np.sqrt(max(along, along2))
                best = min(cross, along)
                if best > near:
                    continue
                what = 0
                if along < cross:
                    what += 4
                if tag[e] != tag[f]:
                    what += 2
                # inward directions of both triangles, perpendicular to edge e
                ee = 0.0
                pe = 0.0
                pf = 0.0
                for d in range(3):
                    t = b[e, d] - a[e, d]
                    ee += t * t
                    pe += t * (apex[e, d] - a[e, d])
                    pf += t * (apex[f, d] - (a[f, d] if along < cross else b[f, d]))
                dot = 0.0
                we = 0.0
                wf = 0.0
                for d in range(3):
                    t = b[e, d] - a[e, d]
                    u = apex[e, d] - a[e, d] - pe / ee * t
                    v = apex[f, d] - (a[f, d] if along < cross else b[f, d]) - pf / ee * t
                    dot += u * v
                    we += u * u
                    wf += v * v
                if dot > 0.5 * np.sqrt(we * wf):
                    what += 1
                # insert by (distance)
                if best >= gap[e, CANDIDATES - 1]:
                    continue
                twice = False
                for m in range(CANDIDATES):
                    if partner[e, m] == f:
                        twice = True
                if twice:
                    continue
                m = CANDIDATES - 1
                while m > 0 and gap[e, m - 1] > best:
                    gap[e, m] = gap[e, m - 1]
                    partner[e, m] = partner[e, m - 1]
                    kind[e, m] = kind[e, m - 1]
                    m -= 1
                gap[e, m] = best
                partner[e, m] = f
                kind[e, m] = what
    return partner, gap, kind


@njit(cache=True)
def _root(parent: IntArray, i: int) -> int:
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True)
def _may_join(
    p: int,
    q: int,
    limit: float,
    parent: IntArray,
    follow: IntArray,
    points: Array,
    triangles: IntArray,
    offsets: IntArray,
    around: IntArray,
) -> bool:
    """Whether the clusters with roots p, q stay within `limit` and share no triangle."""
    i = p
    while i >= 0:
        j = q
        while j >= 0:
            d = 0.0
            for k in range(3):
                d += (points[i, k] - points[j, k]) ** 2
            if d > limit * limit:
                return False
            j = follow[j]
        for at in range(offsets[i], offsets[i + 1]):
            for k in range(3):
                other = triangles[around[at], k]
                if other != i and _root(parent, other) == q:
                    return False
        i = follow[i]
    return True


@njit(cache=True)
def _join(p: int, q: int, parent: IntArray, follow: IntArray, last: IntArray) -> None:
    if q < p:
        p, q = q, p
    parent[q] = p
    follow[last[p]] = q
    last[p] = last[q]


@njit(cache=True)
def match_edges(
    left: IntArray,
    right: IntArray,
    kinds: IntArray,
    start: IntArray,
    end: IntArray,
    limit: float,
    points: Array,
    triangles: IntArray,
    offsets: IntArray,
    around: IntArray,
) -> tuple[IntArray, IntArray]:
    """Greedy one-to-one matching of edges in the order given; matched edges' ends are joined into clusters.

    Returns each vertex's root (n,) and each edge's partner (e,), -1 where it has none.
    """
    n = len(points)
    parent = np.arange(n)
    follow = np.full(n, -1, dtype=np.int64)
    last = np.arange(n)
    mate = np.full(len(start), -1, dtype=np.int64)
    for at in range(len(left)):
        e, f = left[at], right[at]
        if mate[e] >= 0 or mate[f] >= 0:
            continue
        a, b = _root(parent, start[e]), _root(parent, end[e])
        if kinds[at] & 4:
            c, d = _root(parent, start[f]), _root(parent, end[f])
        else:
            c, d = _root(parent, end[f]), _root(parent, start[f])
        if a in (b, d) or c in (b, d):
            continue
        if a != c and not _may_join(a, c, limit, parent, follow, points, triangles, offsets, around):
            continue
        if b != d and not _may_join(b, d, limit, parent, follow, points, triangles, offsets, around):
            continue
        if a != c:
            _join(a, c, parent, follow, last)
        b, d = _root(parent, b), _root(parent, d)
        if b != d:
            if not _may_join(b, d, limit, parent, follow, points, triangles, offsets, around):
                continue
            _join(b, d, parent, follow, last)
        mate[e] = f
        mate[f] = e
    for i in range(n):
        parent[i] = _root(parent, i)
    return parent, mate


@njit(cache=True)
def match_points(
    left: IntArray,
    right: IntArray,
    limit: float,
    points: Array,
    triangles: IntArray,
    offsets: IntArray,
    around: IntArray,
) -> IntArray:
    """(n,) roots after joining the pairs of vertices in the order given, where no triangle collapses."""
    n = len(points)
    parent = np.arange(n)
    follow = np.full(n, -1, dtype=np.int64)
    last = np.arange(n)
    for at in range(len(left)):
        p, q = _root(parent, left[at]), _root(parent, right[at])
        if p != q and _may_join(p, q, limit, parent, follow, points, triangles, offsets, around):
            _join(p, q, parent, follow, last)
    for i in range(n):
        parent[i] = _root(parent, i)
    return parent


@njit(cache=True)
def contract(left: IntArray, right: IntArray, limit: float, points: Array) -> IntArray:
    """(n,) roots after joining pairs of vertices in the order given, no cluster wider than `limit`."""
    n = len(points)
    parent = np.arange(n)
    follow = np.full(n, -1, dtype=np.int64)
    last = np.arange(n)
    for at in range(len(left)):
        p, q = _root(parent, left[at]), _root(parent, right[at])
        if p == q:
            continue
        near = True
        i = p
        while i >= 0 and near:
            j = q
            while j >= 0:
                if (
                    (points[i, 0] - points[j, 0]) ** 2
                    + (points[i, 1] - points[j, 1]) ** 2
                    + (points[i, 2] - points[j, 2]) ** 2
                ) > limit * limit:
                    near = False
                    break
                j = follow[j]
            i = follow[i]
        if near:
            _join(p, q, parent, follow, last)
    for i in range(n):
        parent[i] = _root(parent, i)
    return parent
