"""Polygons into triangles: the loop of `polygons`."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

import numpy as np
from numba import njit

from patchwright.models.arrays import Array, IntArray


@njit(cache=True, nogil=True)
def _cross(p: Array, a: int, b: int, c: int) -> float:
    """Twice the signed area of the plane triangle of rows a, b, c of p."""
    doubled: float = (p[b, 0] - p[a, 0]) * (p[c, 1] - p[a, 1]) - (p[b, 1] - p[a, 1]) * (p[c, 0] - p[a, 0])
    return doubled


@njit(cache=True, nogil=True)
def _quality(p: Array, a: int, b: int, c: int) -> float:
    """Area over the sum of the squared edges: signed, greatest for an equilateral triangle."""
    edges = (p[a, 0] - p[b, 0]) ** 2 + (p[a, 1] - p[b, 1]) ** 2
    edges += (p[b, 0] - p[c, 0]) ** 2 + (p[b, 1] - p[c, 1]) ** 2
    edges += (p[c, 0] - p[a, 0]) ** 2 + (p[c, 1] - p[a, 1]) ** 2
    return _cross(p, a, b, c) / edges if edges > 0.0 else 0.0


@njit(cache=True, nogil=True)
def _flat(points: Array, corners: IntArray, first: int, k: int, p: Array) -> bool:
    """Writes k corners from `first` on into p (k, 2), seen along their area vector (x, y, z); False when it is zero."""
    o = corners[first]
    x, y, z = 0.0, 0.0, 0.0
    for i in range(first + 1, first + k - 1):
        b, c = corners[i], corners[i + 1]
        bx, by, bz = points[b, 0] - points[o, 0], points[b, 1] - points[o, 1], points[b, 2] - points[o, 2]
        cx, cy, cz = points[c, 0] - points[o, 0], points[c, 1] - points[o, 1], points[c, 2] - points[o, 2]
        x += by * cz - bz * cy
        y += bz * cx - bx * cz
        z += bx * cy - by * cx
    length = math.sqrt(x * x + y * y + z * z)
    if not 0.0 < length < np.inf:
        return False
    x, y, z = x / length, y / length, z / length
    # (ux, uy, uz) and its product with the normal span the plane; u leaves out the normal's smallest component
    ux, uy, uz = 0.0, -z, y
    if abs(y) <= abs(x) and abs(y) <= abs(z):
        ux, uy, uz = z, 0.0, -x
    elif abs(z) <= abs(x):
        ux, uy, uz = -y, x, 0.0
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / length, uy / length, uz / length
    for i in range(k):
        b = corners[first + i]
        bx, by, bz = points[b, 0] - points[o, 0], points[b, 1] - points[o, 1], points[b, 2] - points[o, 2]
        p[i, 0] = bx * ux + by * uy + bz * uz
        p[i, 1] = bx * (y * uz - z * uy) + by * (z * ux - x * uz) + bz * (x * uy - y * ux)
    return True


@njit(cache=True, nogil=True)
def _blocked(p: Array, after: IntArray, start: int, a: int, b: int, c: int) -> bool:
    """True when another corner of the remaining polygon lies in triangle a, b, c (its border counts, its corners
    not)."""
    v = start
    while True:
        if v != a and v != b and v != c:
            x, y = p[v, 0], p[v, 1]
            same = (x == p[a, 0] and y == p[a, 1]) or (x == p[b, 0] and y == p[b, 1]) or (x == p[c, 0] and y == p[c, 1])
            if not same and _cross(p, a, b, v) >= 0.0 and _cross(p, b, c, v) >= 0.0 and _cross(p, c, a, v) >= 0.0:
                return True
        v = after[v]
        if v == start:
            return False


@njit(cache=True, nogil=True)
def _put(
    triangles: IntArray, owners: IntArray, n: int, f: int, corners: IntArray, first: int, a: int, b: int, c: int
) -> int:
    """Writes triangle n: the polygon's corners a, b, c; returns n + 1."""
    triangles[n, 0], triangles[n, 1], triangles[n, 2] = corners[first + a], corners[first + b], corners[first + c]
    owners[n] = f
    return n + 1


@njit(cache=True, nogil=True)
def triangulate(points: Array, corners: IntArray, offsets: IntArray, triangles: IntArray, owners: IntArray) -> int:
    """Cuts polygon f, corners[offsets[f]:offsets[f + 1]], into its corners − 2 triangles, in the polygon's direction.

    Quads along the diagonal whose worse triangle is better; larger ones by cutting off the best ear each time.
    A polygon that crosses itself or has no area gets whatever triangles are left; they always are corners − 2.
    """
    n = np.int64(0)
    for f in range(len(offsets) - 1):
        first, k = offsets[f], offsets[f + 1] - offsets[f]
        if k < 3:
            continue
        zero = k - k  # not written 0: the callees would be compiled once more for each literal
        p = np.empty((k, 2))
        if k == 3 or not _flat(points, corners, first, k, p):
            for i in range(1, k - 1):
                n = _put(triangles, owners, n, f, corners, first, zero, i, i + 1)
            continue
        if k == 4:
            better = 0.0
            s = zero
            for d in range(2):
                worse = min(_quality(p, d, d + 1, d + 2), _quality(p, d, d + 2, (d + 3) % 4))
                # equal up to round-off: the first diagonal, whatever the quad's place
                if d == 0 or worse > better + 1e-12 * abs(better):
                    better = worse
                    s = d
            n = _put(triangles, owners, n, f, corners, first, s, s + 1, s + 2)
            n = _put(triangles, owners, n, f, corners, first, s, s + 2, (s + 3) % 4)
            continue
        after = np.empty(k, dtype=np.int64)
        before = np.empty(k, dtype=np.int64)
        quality = np.empty(k)
        for v in range(k):
            after[v] = v + 1 if v < k - 1 else 0
            before[v] = v - 1 if v > 0 else k - 1
            quality[v] = _quality(p, before[v], v, after[v])
        refused = np.zeros(k, dtype=np.int64)  # the corner count at which an ear was found blocked
        start = zero
        for left in range(k, 3, -1):
            best = start
            for _ in range(left):
                best = -1
                v = start
                while True:
                    if refused[v] != left and (best < 0 or quality[v] > quality[best]):
                        best = v
                    v = after[v]
                    if v == start:
                        break
                if best < 0 or quality[best] <= 0.0 or not _blocked(p, after, start, before[best], best, after[best]):
                    break
                refused[best] = left
            if best < 0:
                best = start
            a, c = before[best], after[best]
            n = _put(triangles, owners, n, f, corners, first, a, best, c)
            after[a], before[c] = c, a
            quality[a] = _quality(p, before[a], a, c)
            quality[c] = _quality(p, a, c, after[c])
            start = a
        a = start
        b = after[a]
        n = _put(triangles, owners, n, f, corners, first, a, b, after[b])
    return int(n)
