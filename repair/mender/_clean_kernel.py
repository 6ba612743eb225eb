"""Kernels of cleaning: which triangles stay together at edges and vertices that too many triangles use."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import filling
from patchwright.models.arrays import Array, BoolArray, IntArray


def triangle_heights(points: Array, triangles: IntArray) -> Array:
    """(m,) the height of each triangle over its longest side: twice the area over that length, 0 without length."""
    heights = np.empty(len(triangles))
    _triangle_heights(points, triangles, heights)
    return heights


@filling
def _triangle_heights(points: Array, triangles: IntArray, heights: Array) -> None:
    for t in range(len(triangles)):
        a = triangles[t, 0]
        b = triangles[t, 1]
        c = triangles[t, 2]
        ux = points[b, 0] - points[a, 0]
        uy = points[b, 1] - points[a, 1]
        uz = points[b, 2] - points[a, 2]
        vx = points[c, 0] - points[a, 0]
        vy = points[c, 1] - points[a, 1]
        vz = points[c, 2] - points[a, 2]
        nx = uy * vz - uz * vy
        ny = uz * vx - ux * vz
        nz = ux * vy - uy * vx
        wx = vx - ux
        wy = vy - uy
        wz = vz - uz
        longest = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz)
        heights[t] = np.sqrt(nx * nx + ny * ny + nz * nz) / np.sqrt(longest) if longest > 0.0 else 0.0


def sector_partners(
    edges: IntArray, offsets: IntArray, users: IntArray, points: Array, triangles: IntArray
) -> tuple[IntArray, IntArray]:
    """Pairs of triangles that stay joined at edges used more than twice.

    `edges` (e, 2) the end vertices, `offsets` (e + 1,) and `users` the triangles around each. Around the edge the
    triangles are sorted by angle; two neighbours in that order that enclose material (each running the edge the other
    way, the material between them) are a pair. Returns (2, p): left, right.
    """
    left, right = np.empty(len(users), dtype=np.int64), np.empty(len(users), dtype=np.int64)
    most = int(np.diff(offsets).max(initial=0))
    count = _sector_partners(
        edges, offsets, users, points, triangles, np.zeros(most), np.zeros(most, dtype=np.bool_),
        np.empty(most, dtype=np.bool_), np.empty(most, dtype=np.int64), left, right,
    )  # fmt: skip
    return left[:count].copy(), right[:count].copy()


@filling
def _sector_partners(
    edges: IntArray,
    offsets: IntArray,
    users: IntArray,
    points: Array,
    triangles: IntArray,
    angle: Array,
    forward: BoolArray,
    used: BoolArray,
    order: IntArray,
    left: IntArray,
    right: IntArray,
) -> int:
    """The number of pairs; `angle`, `forward`, `used`, `order` have room for the triangles around one edge."""
    count = 0
    for e in range(edges.shape[0]):
        begin = offsets[e]
        n = offsets[e + 1] - begin
        lo = edges[e, 0]
        hi = edges[e, 1]
        px = points[lo, 0]
        py = points[lo, 1]
        pz = points[lo, 2]
        ax = points[hi, 0] - px
        ay = points[hi, 1] - py
        az = points[hi, 2] - pz
        length = np.sqrt(ax * ax + ay * ay + az * az)
        if length == 0.0:
            continue
        ax = ax / length
        ay = ay / length
        az = az / length
        # x = axis x the coordinate direction farthest from it, y = axis x x
        ux = abs(ax)
        uy = abs(ay)
        uz = abs(az)
        if uz < ux and uz < uy:
            ux, uy, uz = ay, -ax, 0.0
        elif uy < ux:
            ux, uy, uz = -az, 0.0, ax
        else:
            ux, uy, uz = 0.0, az, -ay
        length = np.sqrt(ux * ux + uy * uy + uz * uz)
        ux = ux / length
        uy = uy / length
        uz = uz / length
        vx = ay * uz - az * uy
        vy = az * ux - ax * uz
        vz = ax * uy - ay * ux
        for i in range(n):
            t = users[begin + i]
            angle[i] = 0.0
            forward[i] = False
            for k in range(3):
                v = triangles[t, k]
                after = triangles[t, 0 if k == 2 else k + 1]
                if v != lo and v != hi:
                    wx = points[v, 0] - px
                    wy = points[v, 1] - py
                    wz = points[v, 2] - pz
                    angle[i] = np.arctan2(wx * vx + wy * vy + wz * vz, wx * ux + wy * uy + wz * uz)
                elif v == lo and after == hi:
                    forward[i] = True
                elif v == hi and after == lo:
                    forward[i] = False
            used[i] = False
            j = i
            while j > 0 and angle[i] < angle[order[j - 1]]:
                order[j] = order[j - 1]
                j -= 1
            order[j] = i
        # a triangle that runs lo -> hi has its normal on the side of growing angle: the material lies below it
        for i in range(n):
            p = order[i]
            q = order[0 if i == n - 1 else i + 1]
            if not forward[p] and forward[q] and not used[p] and not used[q]:
                used[p] = True
                used[q] = True
                left[count] = users[begin + p]
                right[count] = users[begin + q]
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
            used[bp] = True
            used[bq] = True
            left[count] = users[begin + bp]
            right[count] = users[begin + bq]
            count += 1
    return count


def fans(triangles: IntArray, neighbours: IntArray, left: IntArray, right: IntArray, splits: BoolArray) -> IntArray:
    """(m, 3) label of the fan each corner belongs to: corners of one vertex joined through shared edges.

    `left`, `right` are further pairs of triangles joined at an edge; only vertices of `splits` are told apart, all
    corners of any other vertex are one fan. The label of a fan is its smallest corner number 3 t + k.
    """
    label = np.arange(3 * len(triangles))
    _fans(triangles, neighbours, left, right, splits, np.full(len(splits), -1, dtype=np.int64), label)
    return label.reshape(-1, 3)


@filling
def _fans(
    triangles: IntArray,
    neighbours: IntArray,
    left: IntArray,
    right: IntArray,
    splits: BoolArray,
    first: IntArray,
    parent: IntArray,
) -> None:
    m = len(triangles)
    for t in range(m):
        for k in range(3):
            v = triangles[t, k]
            if not splits[v]:
                if first[v] < 0:
                    first[v] = 3 * t + k
                parent[3 * t + k] = first[v]
    total = 3 * m + len(left)
    for at in range(total):
        u = -1
        w = -1
        if at < 3 * m:
            t = at // 3
            k = at - 3 * t
            s = neighbours[t, k]
            if s < t:
                continue
            u = triangles[t, k]
            w = triangles[t, 0 if k == 2 else k + 1]
        else:
            t = left[at - 3 * m]
            s = right[at - 3 * m]
        for k in range(3):
            v = triangles[t, k]
            if u >= 0 and v != u and v != w:
                continue
            for j in range(3):
                if triangles[s, j] == v:
                    a = 3 * t + k
                    b = 3 * s + j
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
    for c in range(3 * m):  # a root is the lowest of its set, so what comes before c is its root already
        parent[c] = parent[parent[c]]
