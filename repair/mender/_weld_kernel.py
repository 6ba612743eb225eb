"""Kernels of welding: exact merging, the greedy matching of free edges and its disjoint sets."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from patchwright.models._compile_kernel import filling, inner
from patchwright.models.arrays import Array, BoolArray, IntArray

_SAME_WAY = 4  # the bit of a pair's kind, see `_near_edges_kernel`

Indices = npt.NDArray[np.int32]


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
    _merge_exact(bits, np.full(_slots(len(bits)), -1, dtype=np.int32), first)
    return first


def _slots(n: int) -> int:
    """A power of two, at least twice `n`."""
    size = 16
    while size < 2 * n:
        size *= 2
    return size


@filling
def _merge_exact(bits: IntArray, table: Indices, first: IntArray) -> None:
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


def mean_places(
    points: Array, triangles: IntArray, clusters: IntArray, apart: BoolArray, place: Array
) -> tuple[int, float, float, float]:
    """Put clusters of vertices at the means of their corners.

    Parameters
    ----------
    points, triangles : (n, 3) and (m, 3); a vertex weighs as much as it has triangles
    clusters : (n,) the cluster of each vertex, 0..k-1
    apart : (n,) vertices that are not where the first of their cluster is: clusters without such stay where they are
    place : (k, 3) the first vertex of each, moved to the mean

    Returns
    -------
    How many vertices in use moved, the farthest move, the sum of squared moves by weight, its degrees of freedom.
    """
    uses = np.zeros(len(points), dtype=np.int32)
    busy = np.zeros(len(place), dtype=np.bool_)
    result = np.zeros(3)
    moved = _mean_places(points, triangles, clusters, apart, place, uses, busy, np.zeros((len(place), 4)), result)
    return moved, float(result[0]), float(result[1]), float(result[2])


@filling
def _mean_places(
    points: Array,
    triangles: IntArray,
    clusters: IntArray,
    apart: BoolArray,
    place: Array,
    uses: Indices,
    busy: BoolArray,
    sums: Array,
    result: Array,
) -> int:
    for t in range(len(triangles)):
        for k in range(3):
            uses[triangles[t, k]] += 1
    for i in range(len(points)):
        if apart[i] and uses[i] > 0:
            busy[clusters[i]] = True
    for i in range(len(points)):
        c = clusters[i]
        if busy[c] and uses[i] > 0:
            sums[c, 3] += uses[i]
            for d in range(3):
                sums[c, d] += uses[i] * (points[i, d] - place[c, d])
    for c in range(len(place)):
        if busy[c]:
            result[2] += sums[c, 3] - 1.0
            for d in range(3):
                place[c, d] += sums[c, d] / sums[c, 3]
    moved = 0
    for i in range(len(points)):
        if uses[i] == 0:
            continue
        c = clusters[i]
        square = 0.0
        for d in range(3):
            square += (place[c, d] - points[i, d]) * (place[c, d] - points[i, d])
        if square > 0.0:
            moved += 1
        if busy[c]:
            result[1] += uses[i] * square
        result[0] = max(result[0], np.sqrt(square))
    return moved


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
    order: IntArray,
    left: IntArray,
    right: IntArray,
    gaps: Array,
    kinds: IntArray,
    start: IntArray,
    end: IntArray,
    limit: float,
    points: Array,
    triangles: IntArray,
    offsets: IntArray,
    around: IntArray,
) -> tuple[IntArray, Array]:
    """Greedy one-to-one matching of edges in the order given; matched edges' ends are joined into clusters.

    Returns each vertex's root (n,) and the distances (k,) of the pairs that were matched.
    """
    parent, follow, last = _singles(len(points))
    mated = np.zeros(len(start), dtype=np.bool_)
    apart = np.empty(min(len(order), len(start) // 2))
    count = _match_edges(
        order, left, right, gaps, kinds, start, end, limit, points, triangles, offsets, around, parent, follow, last,
        mated, apart,
    )  # fmt: skip
    _settle(parent)
    return parent, apart[:count]


@filling
def _match_edges(
    order: IntArray,
    left: IntArray,
    right: IntArray,
    gaps: Array,
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
    mated: BoolArray,
    apart: Array,
) -> int:
    count = 0
    for rank in range(len(order)):
        at = order[rank]
        e = left[at]
        f = right[at]
        if mated[e] or mated[f]:
            continue
        a = _root(parent, start[e])
        b = _root(parent, end[e])
        c = _root(parent, start[f])
        d = _root(parent, end[f])
        if not kinds[at] & _SAME_WAY:
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
        mated[e] = True
        mated[f] = True
        apart[count] = gaps[at]
        count += 1
    return count


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
