"""Kernels of `cut_triangles`: triangles cut along segments into smaller ones.

Seen along the axis nearest its normal, a triangle with the segments in it is a plane graph. Parts of it that hang free
are tied to the rest by an edge nothing crosses; then every face is one cycle, followed from edge to edge, and ears are
cut from it. Cutting ears always ends with a valid set of triangles over the given points, whatever rounding did to
their positions, so neighbours fit together by construction.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.models._triangle_triangle_kernel import orient2d
from patchwright.models.arrays import Array, IntArray

SLACK = 1.5e-8  # square root of the round-off: a face lost or followed twice is missing more of the area


@njit(cache=True, nogil=True)
def on_side(a: Array, b: Array, v: Array) -> bool:
    """Whether v lies exactly on the line through a and b."""
    flat = True
    for k in range(3):
        flat &= orient2d(a, b, v, (k + 1) % 3, (k + 2) % 3, True) == 0.0
    return flat


@njit(cache=True, nogil=True)
def sides_of(points: Array, triangles: IntArray, of: IntArray, v: IntArray) -> IntArray:
    """(n,) the side of triangle `of` that point v, which lies in the triangle, lies on; -1 if on none."""
    result = np.full(len(v), -1)
    for n in range(len(v)):
        t = triangles[of[n]]
        for k in range(3):
            if on_side(points[t[k]], points[t[(k + 1) % 3]], points[v[n]]):
                result[n] = k
                break
    return result


@njit(cache=True, nogil=True)
def plane_axes(p: Array, q: Array, r: Array) -> tuple[int, int]:
    """Two coordinates in which a triangle is seen counter-clockwise and largest."""
    best, axis, turned = -1.0, 0, False
    for k in range(3):
        x, y = (k + 1) % 3, (k + 2) % 3
        area = orient2d(p, q, r, x, y, True)
        if abs(area) > best:
            best, axis, turned = abs(area), k, area < 0.0
    x, y = (axis + 1) % 3, (axis + 2) % 3
    return (y, x) if turned else (x, y)


@njit(cache=True, nogil=True)
def between(a: Array, b: Array, c: Array, x: int, y: int) -> bool:
    """Whether c, on the line a b, lies strictly between them."""
    k = x if abs(b[x] - a[x]) >= abs(b[y] - a[y]) else y
    return (a[k] < c[k] < b[k]) or (b[k] < c[k] < a[k])


@njit(cache=True, nogil=True)
def crossings(points: Array, triangles: IntArray, offsets: IntArray, lines: IntArray) -> IntArray:
    """(k, 4) where segments inside a triangle meet: triangle row, first line, second line, point.

    Lines `offsets[i]:offsets[i + 1]` lie in triangle i. The point is the end of the second line that lies on the first,
    or -1 where they cross.
    """
    capacity = 64
    result = np.empty((capacity, 4), np.int64)
    filled = 0
    for i in range(triangles.shape[0]):
        x, y = plane_axes(points[triangles[i, 0]], points[triangles[i, 1]], points[triangles[i, 2]])
        for m in range(offsets[i], offsets[i + 1]):
            a, b = points[lines[m, 0]], points[lines[m, 1]]
            for n in range(offsets[i], offsets[i + 1]):
                if m == n:
                    continue
                c, d = points[lines[n, 0]], points[lines[n, 1]]
                apart = False
                for k in (x, y):
                    apart |= max(a[k], b[k]) < min(c[k], d[k]) or max(c[k], d[k]) < min(a[k], b[k])
                if apart:
                    continue
                oc, od = orient2d(a, b, c, x, y, True), orient2d(a, b, d, x, y, True)
                for end in range(3):
                    v = -1
                    if end < 2:
                        v = lines[n, end]
                        if (oc if end == 0 else od) != 0.0 or v == lines[m, 0] or v == lines[m, 1]:
                            continue
                        if not between(a, b, points[v], x, y):
                            continue
                    else:
                        if m > n or not (oc > 0.0 > od or oc < 0.0 < od):
                            continue
                        oa, ob = orient2d(c, d, a, x, y, True), orient2d(c, d, b, x, y, True)
                        shared = lines[m, 0] == lines[n, 0] or lines[m, 0] == lines[n, 1]
                        shared |= lines[m, 1] == lines[n, 0] or lines[m, 1] == lines[n, 1]
                        if shared or not (oa > 0.0 > ob or oa < 0.0 < ob):
                            continue
                    if filled == capacity:
                        capacity *= 2
                        grown = np.empty((capacity, 4), np.int64)
                        grown[:filled] = result
                        result = grown
                    result[filled, 0], result[filled, 1], result[filled, 2], result[filled, 3] = i, m, n, v
                    filled += 1
    return result[:filled].copy()


@njit(cache=True, nogil=True)
def blocked(points: Array, edges: IntArray, count: int, u: int, v: int, x: int, y: int) -> bool:
    """Whether an edge not at u or v meets the segment u v, or one at them runs along it."""
    a, b = points[u], points[v]
    for e in range(count):
        s, t = edges[e, 0], edges[e, 1]
        c, d = points[s], points[t]
        if s in (u, v) or t in (u, v):
            other = t if s in (u, v) else s
            if (
                other != u
                and other != v
                and orient2d(a, b, points[other], x, y, True) == 0.0
                and (between(a, b, points[other], x, y))
            ):
                return True
            continue
        if orient2d(a, b, c, x, y, True) * orient2d(a, b, d, x, y, True) > 0.0:
            continue
        if orient2d(c, d, a, x, y, True) * orient2d(c, d, b, x, y, True) > 0.0:
            continue
        return True
    return False


@njit(cache=True, nogil=True)
def clip_ears(points: Array, cycle: IntArray, size: int, x: int, y: int, out: IntArray, filled: int) -> int:
    """Cut the polygon `cycle[:size]` into size - 2 triangles, written to `out` from row `filled` on."""
    after = np.empty(size, np.int64)
    before = np.empty(size, np.int64)
    for i in range(size):
        after[i] = (i + 1) % size
        before[i] = (i - 1) % size
    at = 0
    left = size
    waited = 0
    relaxed = 0
    while left > 3:
        i, k = before[at], after[at]
        a, b, c = cycle[i], cycle[at], cycle[k]
        turn = orient2d(points[a], points[b], points[c], x, y, True)
        ear = turn > 0.0 and a != b and b != c and a != c
        if ear and relaxed == 0:
            j = after[k]
            while j != i:
                v = cycle[j]
                if v != a and v != b and v != c:
                    p = points[v]
                    if (
                        orient2d(points[a], points[b], p, x, y, True) >= 0.0
                        and orient2d(points[b], points[c], p, x, y, True) >= 0.0
                        and orient2d(points[c], points[a], p, x, y, True) >= 0.0
                    ):
                        ear = False
                        break
                j = after[j]
        if relaxed == 2:
            ear = a != b and b != c and a != c
        if relaxed == 3:
            ear = True
        if ear:
            out[filled, 0], out[filled, 1], out[filled, 2] = a, b, c
            filled += 1
            after[i], before[k] = k, i
            left -= 1
            waited = 0
            relaxed = 0
            at = after[k] if left > 3 else k
        else:
            at = k
            waited += 1
            if waited > left:
                waited = 0
                relaxed += 1
    i, k = before[at], after[at]
    out[filled, 0], out[filled, 1], out[filled, 2] = cycle[i], cycle[at], cycle[k]
    return filled + 1


@njit(cache=True, nogil=True)
def find(parent: IntArray, i: int) -> int:
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True, nogil=True)
def cut(points: Array, rim_offsets: IntArray, rims: IntArray, offsets: IntArray, lines: IntArray
        ) -> tuple[IntArray, IntArray, IntArray]:  # fmt: skip
    """Triangles (k, 3), the row each was cut from, and the rows whose graph did not come out plane.

    The border of row i, counter-clockwise from its first corner, is `rims[rim_offsets[i]:rim_offsets[i + 1]]`; the
    segments in it are `lines[offsets[i]:offsets[i + 1]]`.
    """
    rows = rim_offsets.shape[0] - 1
    capacity = 4 * (rims.shape[0] + 2 * lines.shape[0]) + 16 * rows
    out = np.empty((capacity, 3), np.int64)
    source = np.empty(capacity, np.int64)
    bad = np.empty(rows, np.int64)
    filled, failed = 0, 0
    for i in range(rows):
        rim = rims[rim_offsets[i] : rim_offsets[i + 1]]
        inner = lines[offsets[i] : offsets[i + 1]]
        r, s = rim.shape[0], inner.shape[0]
        nodes = np.unique(np.concatenate((rim, inner.reshape(-1))))
        n = nodes.shape[0]
        place = np.empty((n, 3))
        for k in range(n):
            place[k] = points[nodes[k]]
        area = np.zeros(3)
        o = points[rim[0]]
        for k in range(1, r - 1):
            p, q = points[rim[k]], points[rim[k + 1]]
            for m in range(3):
                u, v = (m + 1) % 3, (m + 2) % 3
                area[m] += (p[u] - o[u]) * (q[v] - o[v]) - (p[v] - o[v]) * (q[u] - o[u])
        axis = 0
        for m in range(1, 3):
            if abs(area[m]) > abs(area[axis]):
                axis = m
        x, y = (axis + 1) % 3, (axis + 2) % 3
        if area[axis] < 0.0:
            x, y = y, x
        # edges: the border, then the segments, then ties; components by union
        edges = np.empty((r + s + n, 2), np.int64)
        parent = np.arange(n)
        count = 0
        for k in range(r):
            edges[count, 0] = np.searchsorted(nodes, rim[k])
            edges[count, 1] = np.searchsorted(nodes, rim[(k + 1) % r])
            parent[find(parent, edges[count, 0])] = find(parent, edges[count, 1])
            count += 1
        for k in range(s):
            edges[count, 0] = np.searchsorted(nodes, inner[k, 0])
            edges[count, 1] = np.searchsorted(nodes, inner[k, 1])
            parent[find(parent, edges[count, 0])] = find(parent, edges[count, 1])
            count += 1
        order = np.argsort(place[:, x])
        for k in order:
            root = find(parent, k)
            if root == find(parent, edges[0, 0]):
                continue
            # the leftmost node of a free part: tie it to the nearest node of another part that it sees
            away = np.empty(n)
            for m in range(n):
                away[m] = (place[m, x] - place[k, x]) ** 2 + (place[m, y] - place[k, y]) ** 2
            for m in np.argsort(away):
                if find(parent, m) != root and not blocked(place, edges, count, k, m, x, y):
                    edges[count, 0], edges[count, 1] = k, m
                    parent[root] = find(parent, m)
                    count += 1
                    break
        # directed edges 2 e (forward) and 2 e + 1; around each node by angle
        angle = np.empty(2 * count)
        tail = np.empty(2 * count, np.int64)
        for e in range(count):
            a, b = edges[e, 0], edges[e, 1]
            angle[2 * e] = np.arctan2(place[b, y] - place[a, y], place[b, x] - place[a, x])
            angle[2 * e + 1] = np.arctan2(place[a, y] - place[b, y], place[a, x] - place[b, x])
            tail[2 * e], tail[2 * e + 1] = a, b
        turned = np.argsort(angle)
        around = turned[np.argsort(tail[turned], kind="mergesort")]
        first = np.searchsorted(tail[around], np.arange(n + 1))
        position = np.empty(2 * count, np.int64)
        position[around] = np.arange(2 * count)
        done = np.zeros(2 * count, np.bool_)
        cycle = np.empty(2 * count, np.int64)
        whole = 0.0
        fine = True
        start_filled = filled
        for start in range(2 * count):
            if done[start] or (start < 2 * r and start & 1):
                continue
            size = 0
            e = start
            while not done[e]:
                done[e] = True
                fine &= not (e < 2 * r and e & 1)
                cycle[size] = tail[e]
                size += 1
                back = e ^ 1
                node = tail[back]
                p = position[back] - 1
                if p < first[node]:
                    p = first[node + 1] - 1
                e = around[p]
            if size < 3:
                fine = False
                continue
            for k in range(size):
                a, b = place[cycle[k]], place[cycle[(k + 1) % size]]
                whole += (a[x] - place[0, x]) * (b[y] - place[0, y]) - (a[y] - place[0, y]) * (b[x] - place[0, x])
            if filled + size > capacity:
                fine = False
                break
            filled = clip_ears(place, cycle, size, x, y, out, filled)
        if not fine or abs(whole - abs(area[axis])) > SLACK * abs(area[axis]):
            bad[failed] = i
            failed += 1
        for k in range(start_filled, filled):
            source[k] = i
            for m in range(3):
                out[k, m] = nodes[out[k, m]]
    return out[:filled].copy(), source[:filled].copy(), bad[:failed].copy()
