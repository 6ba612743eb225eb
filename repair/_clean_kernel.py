"""Kernels of cleaning: which triangles stay together at edges and vertices that too many triangles use."""

from __future__ import annotations

import numpy as np
from numba import njit
from patchwright.models.arrays import Array, BoolArray, IntArray


@njit(cache=True)
def sector_partners(
    edges: IntArray, offsets: IntArray, users: IntArray, points: Array, triangles: IntArray
) -> tuple[IntArray, IntArray]:
    """Pairs of triangles that stay joined at edges used more than twice.

    `edges` (e, 2) the end vertices, `offsets` (e + 1,) and `users` the triangles around each. Around the edge the
    triangles are sorted by angle; two neighbours in that order that enclose material (each running the edge the other
    way, the material between them) are a pair. Returns (2, p): left, right.
    """
    left = np.empty(len(users), dtype=np.int64)
    right = np.empty(len(users), dtype=np.int64)
    count = 0
    for e in range(len(edges)):
        n = offsets[e + 1] - offsets[e]
        lo, hi = edges[e, 0], edges[e, 1]
        axis = points[hi] - points[lo]
        length = np.sqrt(axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2)
        if length == 0.0:
            continue
        axis = axis / length
        small = 0
        for k in range(3):
            if abs(axis[k]) < abs(axis[small]):
                small = k
        other = np.zeros(3)
        other[small] = 1.0
        x = np.cross(axis, other)
        x /= np.sqrt(x[0] ** 2 + x[1] ** 2 + x[2] ** 2)
        y = np.cross(axis, x)
        angle = np.empty(n)
        forward = np.empty(n, dtype=np.bool_)
        for i in range(n):
            t = users[offsets[e] + i]
            for k in range(3):
                v = triangles[t, k]
                if v != lo and v != hi:
                    w = points[v] - points[lo]
                    angle[i] = np.arctan2(
                        w[0] * y[0] + w[1] * y[1] + w[2] * y[2], w[0] * x[0] + w[1] * x[1] + w[2] * x[2]
                    )
                if v == lo and triangles[t, (k + 1) % 3] == hi:
                    forward[i] = True
                if v == hi and triangles[t, (k + 1) % 3] == lo:
                    forward[i] = False
        order = np.argsort(angle)
        # a triangle that runs lo -> hi has its normal on the side of growing angle: the material lies below it
        used = np.zeros(n, dtype=np.bool_)
        for i in range(n):
            p, q = order[i], order[(i + 1) % n]
            if not forward[p] and forward[q] and not used[p] and not used[q]:
                used[p] = used[q] = True
                left[count] = users[offsets[e] + p]
                right[count] = users[offsets[e] + q]
                count += 1
        # what is left: the two that continue each other best
        while True:
            best = -2.0
            bp = -1
            bq = -1
            for p in range(n):
                for q in range(p + 1, n):
                    if used[p] or used[q] or forward[p] == forward[q]:
                        continue
                    score = -np.cos(angle[p] - angle[q])
                    if score > best:
                        best = score
                        bp = p
                        bq = q
            if bp < 0:
                break
            used[bp] = used[bq] = True
            left[count] = users[offsets[e] + bp]
            right[count] = users[offsets[e] + bq]
            count += 1
    return left[:count].copy(), right[:count].copy()


@njit(cache=True)
def fans(triangles: IntArray, neighbours: IntArray, left: IntArray, right: IntArray, splits: BoolArray) -> IntArray:
    """(m, 3) label of the fan each corner belongs to: corners of one vertex joined through shared edges.

    `left`, `right` are further pairs of triangles joined at an edge; only vertices of `splits` are told apart, all
    corners of any other vertex are one fan. The label of a fan is its smallest corner number 3 t + k.
    """
    m = len(triangles)
    parent = np.arange(3 * m)
    first = np.full(len(splits), -1, dtype=np.int64)
    for t in range(m):
        for k in range(3):
            v = triangles[t, k]
            if not splits[v]:
                if first[v] < 0:
                    first[v] = 3 * t + k
                parent[3 * t + k] = first[v]
    total = 3 * m + len(left)
    for at in range(total):
        if at < 3 * m:
            t = at // 3
            s = neighbours[t, at % 3]
            if s < t:
                continue
            u = triangles[t, at % 3]
            w = triangles[t, (at % 3 + 1) % 3]
        else:
            t, s = left[at - 3 * m], right[at - 3 * m]
            u = -1
            w = -1
        for k in range(3):
            v = triangles[t, k]
            if u >= 0 and v != u and v != w:
                continue
            for j in range(3):
                if triangles[s, j] == v:
                    a, b = 3 * t + k, 3 * s + j
                    while parent[a] != a:
                        parent[a] = parent[parent[a]]
                        a = parent[a]
                    while parent[b] != b:
                        parent[b] = parent[parent[b]]
                        b = parent[b]
                    if a < b:
                        parent[b] = a
                    else:
                        parent[a] = b
    label = np.empty((m, 3), dtype=np.int64)
    for c in range(3 * m):
        a = c
        while parent[a] != a:
            a = parent[a]
        label[c // 3, c % 3] = a
    return label
