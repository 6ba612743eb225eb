"""Kernels of welding: exact merging, candidate pairs of free edges, the greedy matching and its disjoint sets."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import filling, inner
from patchwright.models.arrays import Array, IntArray

CANDIDATES = 6  # nearest free edges kept per free edge
NOWHERE = -10000  # level of the grid for an edge that reaches nowhere


@inner
def _mix(h: int) -> int:
    h ^= h >> 33
    h *= -49064778989728563
    h ^= h >> 29
    h *= -4265267296055464877
    h ^= h >> 32
    return h


def merge_exact(bits: IntArray) -> IntArray:
    """(n,) index of the first row with the same three 64-bit words, of (n, 3) `bits`."""
    first = np.empty(len(bits), dtype=np.int64)
    _merge_exact(bits, np.full(_slots(len(bits)), -1, dtype=np.int64), first)
    return first


def _slots(n: int) -> int:
    """A power of two, at least twice `n`."""
    size = 16
    while size < 2 * n:
        size *= 2
    return size


@filling
def _merge_exact(bits: IntArray, table: IntArray, first: IntArray) -> None:
    size = len(table)
    for i in range(len(bits)):
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


@inner
def _cell(level: int, i: int, j: int, k: int) -> int:
    return _mix(_mix(_mix(level * 73856093 + i) ^ (j * 19349663)) ^ (k * 83492791))


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
    along = b - a
    reach = np.minimum(distance, share * np.sqrt(along[:, 0] ** 2 + along[:, 1] ** 2 + along[:, 2] ** 2))
    level = np.full(n, NOWHERE)
    level[reach > 0.0] = np.ceil(np.log2(reach[reach > 0.0])).astype(np.int64)
    # every edge lies in the grid of its own level and in the next finer one, where a shorter partner looks for it
    levels = np.stack([level, level - 1], axis=1)
    sizes = np.exp2(levels + 1.0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        middle = 0.5 * (a + b)
        cells = np.floor(middle[:, None] / sizes[:, :, None])
        cells[level == NOWHERE] = 0.0
        corner = np.floor(middle / sizes[:, :1] - 0.5)
        corner[level == NOWHERE] = 0.0
    keys, items = np.empty((2, 2 * n), dtype=np.int64), np.empty(2 * n, dtype=np.int64)
    offsets = np.zeros(_slots(n) + 2, dtype=np.int64)
    places = np.empty((2 * n, 3))
    _sort_cells(levels.reshape(-1), cells.reshape(-1, 3).astype(np.int64), middle, keys, offsets, items, places)
    _edge_candidates(
        a, b, apex, tag, reach, level, corner.astype(np.int64), middle, keys[1], offsets, items, places, partner, gap,
        kind,
    )  # fmt: skip
    return partner, gap, kind


@filling
def _sort_cells(
    levels: IntArray, cells: IntArray, middle: Array, keys: IntArray, offsets: IntArray, items: IntArray, places: Array
) -> None:
    """Counting sort of the cells by the hash of their keys: those of slot s are items[offsets[s]:offsets[s + 1]].

    `keys[1]` and `places`, the edges' middles, stand in the order of the items: what is read together lies together.
    """
    slots = len(offsets) - 2
    for i in range(len(levels)):
        keys[0, i] = _cell(levels[i], cells[i, 0], cells[i, 1], cells[i, 2])
        offsets[(_mix(keys[0, i]) & (slots - 1)) + 2] += 1
    for s in range(slots):
        offsets[s + 2] += offsets[s + 1]
    for i in range(len(levels)):
        s = (_mix(keys[0, i]) & (slots - 1)) + 1
        at = offsets[s]
        items[at] = i
        keys[1, at] = keys[0, i]
        for d in range(3):
            places[at, d] = middle[i >> 1, d]
        offsets[s] = at + 1


@filling
def _edge_candidates(
    a: Array,
    b: Array,
    apex: Array,
    tag: IntArray,
    reach: Array,
    level: IntArray,
    first_cell: IntArray,
    middle: Array,
    keys: IntArray,
    offsets: IntArray,
    items: IntArray,
    places: Array,
    partner: IntArray,
    gap: Array,
    kind: IntArray,
) -> None:
    last = partner.shape[1] - 1
    slots = len(offsets) - 2
    for e in range(len(a)):
        if level[e] == NOWHERE:
            continue
        for corner in range(8):
            key = _cell(
                level[e],
                first_cell[e, 0] + (corner & 1),
                first_cell[e, 1] + ((corner >> 1) & 1),
                first_cell[e, 2] + (corner >> 2),
            )
            s = _mix(key) & (slots - 1)
            for at in range(offsets[s], offsets[s + 1]):
                if keys[at] != key:
                    continue
                # middles are no farther apart than the farther pair of ends; the factor is for rounding
                far = 0.0
                for d in range(3):
                    far += (middle[e, d] - places[at, d]) * (middle[e, d] - places[at, d])
                if far > 1.0001 * reach[e] * reach[e]:
                    continue
                f = items[at] >> 1
                if f == e:
                    continue
                cross = 0.0
                along = 0.0
                cross2 = 0.0
                along2 = 0.0
                for d in range(3):
                    ea = a[e, d]
                    eb = b[e, d]
                    fa = a[f, d]
                    fb = b[f, d]
                    cross += (ea - fb) * (ea - fb)
                    cross2 += (eb - fa) * (eb - fa)
                    along += (ea - fa) * (ea - fa)
                    along2 += (eb - fb) * (eb - fb)
                cross = np.sqrt(cross if cross > cross2 else cross2)
                along = np.sqrt(along if along > along2 else along2)
                same_way = along < cross
                best = along if same_way else cross
                if best > reach[e] or best > reach[f] or best >= gap[e, last]:
                    continue
                twice = False
                for m in range(last + 1):
                    if partner[e, m] == f:
                        twice = True
                if twice:
                    continue
                what = 0
                if same_way:
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
                    pf += t * (apex[f, d] - (a[f, d] if same_way else b[f, d]))
                pe = pe / ee
                pf = pf / ee
                dot = 0.0
                we = 0.0
                wf = 0.0
                for d in range(3):
                    t = b[e, d] - a[e, d]
                    u = apex[e, d] - a[e, d] - pe * t
                    v = apex[f, d] - (a[f, d] if same_way else b[f, d]) - pf * t
                    dot += u * v
                    we += u * u
                    wf += v * v
                if dot > 0.5 * np.sqrt(we * wf):
                    what += 1
                m = last  # insert by distance
                while m > 0 and gap[e, m - 1] > best:
                    gap[e, m] = gap[e, m - 1]
                    partner[e, m] = partner[e, m - 1]
                    kind[e, m] = kind[e, m - 1]
                    m -= 1
                gap[e, m] = best
                partner[e, m] = f
                kind[e, m] = what


@inner
def _square(points: Array, i: int, j: int) -> float:
    """Squared distance of points i and j."""
    x = points[i, 0] - points[j, 0]
    y = points[i, 1] - points[j, 1]
    z = points[i, 2] - points[j, 2]
    return x * x + y * y + z * z


@inner
def _root(parent: IntArray, i: int) -> int:
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@inner
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
            if _square(points, i, j) > limit * limit:
                return False
            j = follow[j]
        for at in range(offsets[i], offsets[i + 1]):
            for k in range(3):
                other = triangles[around[at], k]
                if other != i and _root(parent, other) == q:
                    return False
        i = follow[i]
    return True


@inner
def _join(p: int, q: int, parent: IntArray, follow: IntArray, last: IntArray) -> None:
    low = p if p < q else q
    high = q if p < q else p
    parent[high] = low
    follow[last[low]] = high
    last[low] = last[high]


@filling
def _settle(parent: IntArray) -> None:
    """Make `parent` the root of each; a root is the lowest of its cluster."""
    for i in range(len(parent)):
        parent[i] = parent[parent[i]]


def _singles(n: int) -> tuple[IntArray, IntArray, IntArray]:
    """Clusters of one vertex each: parent, follower, last of each cluster."""
    return np.arange(n), np.full(n, -1, dtype=np.int64), np.arange(n)


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
    parent, follow, last = _singles(len(points))
    mate = np.full(len(start), -1, dtype=np.int64)
    _match_edges(left, right, kinds, start, end, limit, points, triangles, offsets, around, parent, follow, last, mate)
    _settle(parent)
    return parent, mate


@filling
def _match_edges(
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
    parent: IntArray,
    follow: IntArray,
    last: IntArray,
    mate: IntArray,
) -> None:
    for at in range(len(left)):
        e = left[at]
        f = right[at]
        if mate[e] >= 0 or mate[f] >= 0:
            continue
        a = _root(parent, start[e])
        b = _root(parent, end[e])
        c = _root(parent, start[f])
        d = _root(parent, end[f])
        if not kinds[at] & 4:
            swap = c
            c = d
            d = swap
        if a == b or a == d or c == b or c == d:  # noqa: SIM109  (a tuple costs compile time)
            continue
        if a != c and not _may_join(a, c, limit, parent, follow, points, triangles, offsets, around):
            continue
        if b != d and not _may_join(b, d, limit, parent, follow, points, triangles, offsets, around):
            continue
        if a != c:
            _join(a, c, parent, follow, last)
        b = _root(parent, b)
        d = _root(parent, d)
        if b != d:
            if not _may_join(b, d, limit, parent, follow, points, triangles, offsets, around):
                continue
            _join(b, d, parent, follow, last)
        mate[e] = f
        mate[f] = e


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
    parent, follow, last = _singles(len(points))
    _match_points(left, right, limit, points, triangles, offsets, around, parent, follow, last)
    _settle(parent)
    return parent


@filling
def _match_points(
    left: IntArray,
    right: IntArray,
    limit: float,
    points: Array,
    triangles: IntArray,
    offsets: IntArray,
    around: IntArray,
    parent: IntArray,
    follow: IntArray,
    last: IntArray,
) -> None:
    for at in range(len(left)):
        p = _root(parent, left[at])
        q = _root(parent, right[at])
        if p != q and _may_join(p, q, limit, parent, follow, points, triangles, offsets, around):
            _join(p, q, parent, follow, last)


def contract(left: IntArray, right: IntArray, limit: float, points: Array) -> IntArray:
    """(n,) roots after joining pairs of vertices in the order given, no cluster wider than `limit`."""
    parent, follow, last = _singles(len(points))
    _contract(left, right, limit, points, parent, follow, last)
    _settle(parent)
    return parent


@filling
def _contract(
    left: IntArray, right: IntArray, limit: float, points: Array, parent: IntArray, follow: IntArray, last: IntArray
) -> None:
    for at in range(len(left)):
        p = _root(parent, left[at])
        q = _root(parent, right[at])
        if p == q:
            continue
        near = True
        i = p
        while i >= 0 and near:
            j = q
            while j >= 0:
                if _square(points, i, j) > limit * limit:
                    near = False
                    break
                j = follow[j]
            i = follow[i]
        if near:
            _join(p, q, parent, follow, last)
