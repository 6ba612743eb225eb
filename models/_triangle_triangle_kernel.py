"""Kernels of `triangle_triangle`: exact orientation signs and the test of pairs built on nothing but such signs.

The orientation predicates evaluate in double precision with a forward error bound and, where the bound does not decide,
exactly (`_exact_kernel`).

The test follows Guigue & Devillers, "Fast and robust triangle-triangle overlap test using orientation predicates",
Journal of Graphics Tools 8(1), 2003, in three dimensions, and separating edges where the triangles are coplanar.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import kernel, making
from patchwright.models._exact_kernel import determinant, difference_tail
from patchwright.models.arrays import Array, BoolArray, IntArray

PLANE_ERROR = 3.3306690738754716e-16  # (3 + 16 u) u, Shewchuk's bound of orient2d
SPACE_ERROR = 7.771561172376103e-16  # (7 + 56 u) u, of orient3d
TRUSTED = 1e-3  # share of its terms above which a rounded determinant has its value within 1e-12 of itself


@making
def volume(a: Array, b: Array, c: Array, d: Array, doubt: float) -> float:
    """det(a - d, b - d, c - d); exact, but for its last bits, where it is within `doubt` of the size of its terms."""
    adx, ady, adz = a[0] - d[0], a[1] - d[1], a[2] - d[2]
    bdx, bdy, bdz = b[0] - d[0], b[1] - d[1], b[2] - d[2]
    cdx, cdy, cdz = c[0] - d[0], c[1] - d[1], c[2] - d[2]
    p, q, r, s, t, u = bdx * cdy, cdx * bdy, cdx * ady, adx * cdy, adx * bdy, bdx * ady
    value = adz * (p - q) + bdz * (r - s) + cdz * (t - u)
    size = (abs(p) + abs(q)) * abs(adz) + (abs(r) + abs(s)) * abs(bdz) + (abs(t) + abs(u)) * abs(cdz)
    if abs(value) > doubt * size or size == 0.0:
        return value
    rows = np.empty((3, 3))
    tails = np.empty((3, 3))
    for k in range(3):
        rows[0, k], rows[1, k], rows[2, k] = a[k] - d[k], b[k] - d[k], c[k] - d[k]
        tails[0, k] = difference_tail(a[k], d[k], rows[0, k])
        tails[1, k] = difference_tail(b[k], d[k], rows[1, k])
        tails[2, k] = difference_tail(c[k], d[k], rows[2, k])
    return determinant(rows, tails)


@making
def orient3d(a: Array, b: Array, c: Array, d: Array) -> float:
    """det(a - d, b - d, c - d): positive where a, b, c turn clockwise seen from d; exact sign."""
    return volume(a, b, c, d, SPACE_ERROR)


@making
def orient2d(a: Array, b: Array, c: Array, x: int, y: int, exact: bool) -> float:
    """Twice the signed area of a, b, c in the coordinates x and y; exact sign, or 0 if undecided and not `exact`."""
    acx, acy, bcx, bcy = a[x] - c[x], a[y] - c[y], b[x] - c[x], b[y] - c[y]
    p, q = acx * bcy, acy * bcx
    size = abs(p) + abs(q)
    if abs(p - q) > PLANE_ERROR * size or size == 0.0:
        return p - q
    if not exact:
        return 0.0
    rows = np.zeros((3, 3))
    tails = np.zeros((3, 3))
    rows[0, 0], rows[0, 1], rows[1, 0], rows[1, 1], rows[2, 2] = acx, acy, bcx, bcy, 1.0
    tails[0, 0], tails[0, 1] = difference_tail(a[x], c[x], acx), difference_tail(a[y], c[y], acy)
    tails[1, 0], tails[1, 1] = difference_tail(b[x], c[x], bcx), difference_tail(b[y], c[y], bcy)
    return determinant(rows, tails)


@making
def dominant(p: Array) -> int:
    """The axis nearest a triangle's normal, such that its projection along it has area; -1 if it has none at all."""
    best, axis = -1.0, -1
    for k in range(3):
        area = abs(orient2d(p[0], p[1], p[2], (k + 1) % 3, (k + 2) % 3, True))
        if area > best:
            best, axis = area, k
    return axis if best > 0.0 else -1


@making
def separated(p: Array, q: Array, axis: int, shared: IntArray, exact: bool, closed: bool) -> bool:
    """Whether a side of p has all of q beyond it in the projection along `axis`.

    `shared[j]` marks corners of q that are corners of p. With `closed` all of q must be strictly beyond;
    otherwise corners on the side's line do not matter when `exact`, and only shared ones may be there when not.
    """
    x, y = (axis + 1) % 3, (axis + 2) % 3
    turn = orient2d(p[0], p[1], p[2], x, y, True)
    if turn == 0.0:
        return False
    for i in range(3):
        a, b = p[i], p[(i + 1) % 3]
        beyond = True
        for j in range(3):
            on_line = shared[j] == i or shared[j] == (i + 1) % 3
            side = 0.0 if on_line else orient2d(a, b, q[j], x, y, exact)
            if turn < 0.0:
                side = -side
            weak = (on_line or exact) and not closed
            if side > 0.0 or (side == 0.0 and not weak):
                beyond = False
                break
        if beyond:
            return True
    return False


@making
def same_corners(p: Array, q: Array, shared: IntArray) -> int:
    """`shared[j]` becomes the corner of p equal to corner j of q, or -1; the number of equal ones."""
    found = 0
    for j in range(3):
        shared[j] = -1
        for i in range(3):
            if p[i, 0] == q[j, 0] and p[i, 1] == q[j, 1] and p[i, 2] == q[j, 2]:
                shared[j] = i
        found += shared[j] >= 0
    return found


@making
def alone(sign: Array) -> tuple[int, float]:
    """The corner by itself on its side of a plane, and which side: 1 (the others are not above) or -1.

    Signs neither all zero nor all strictly equal. A corner in the plane is alone against two strictly beside it.
    """
    for side in (1.0, -1.0):
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            if side * sign[i] > 0.0 and side * sign[j] <= 0.0 and side * sign[k] <= 0.0:
                return i, side
    for i in range(3):
        if sign[i] == 0.0:
            return i, -1.0 if sign[(i + 1) % 3] > 0.0 else 1.0
    return 0, 1.0


@making
def rotated(p: Array, first: int, swap: bool, out: Array) -> None:
    """The corners of p from `first` on, the last two swapped if asked."""
    j, k = (first + 1) % 3, (first + 2) % 3
    if swap:
        j, k = k, j
    for x in range(3):
        out[0, x], out[1, x], out[2, x] = p[first, x], p[j, x], p[k, x]


@making
def meet(p: Array, q: Array, proper: bool, above: Array, beside: Array, u: Array, v: Array, shared: IntArray) -> bool:
    """Whether two triangles with area have a point in common or, with `proper`, cross.

    They cross where they share a stretch, not merely a point, that is not on the border of both, or, in one plane,
    some area. `above` and `beside` become the signs of q's corners against p's plane and of p's against q's.
    """
    found = same_corners(p, q, shared)
    if not proper and found:
        return True
    axis = dominant(p)
    if found < 3 and separated(p, q, axis, shared, False, not proper):
        return False
    for j in range(3):
        above[j] = 0.0 if shared[j] >= 0 else orient3d(p[0], p[1], p[2], q[j])
    low, high = min(min(above[0], above[1]), above[2]), max(max(above[0], above[1]), above[2])
    if low > 0.0 or high < 0.0:
        return False
    if low == 0.0 and high == 0.0:
        if separated(p, q, axis, shared, True, not proper):
            return False
        for i in range(3):
            u[0, i] = -1.0
        for j in range(3):
            if shared[j] >= 0:
                u[0, shared[j]] = j
        a, b, c = shared[0], shared[1], shared[2]
        shared[0], shared[1], shared[2] = int(u[0, 0]), int(u[0, 1]), int(u[0, 2])
        apart = separated(q, p, axis, shared, True, not proper)
        shared[0], shared[1], shared[2] = a, b, c
        return not apart
    for i in range(3):
        common = shared[0] == i or shared[1] == i or shared[2] == i
        beside[i] = 0.0 if common else orient3d(q[0], q[1], q[2], p[i])
    low1, high1 = min(min(beside[0], beside[1]), beside[2]), max(max(beside[0], beside[1]), beside[2])
    if low1 > 0.0 or high1 < 0.0:
        return False
    if proper and not (low < 0.0 < high or low1 < 0.0 < high1):
        return False
    first_p, side_p = alone(beside)
    first_q, side_q = alone(above)
    if proper and (beside[first_p] == 0.0 or above[first_q] == 0.0):
        return False  # one touches the plane of the other in a single point
    # q's plane seen with u[0] on its positive side and p's plane with v[0] on its positive side
    rotated(p, first_p, side_q < 0.0, u)
    rotated(q, first_q, side_p < 0.0, v)
    k_before_j = orient3d(u[0], u[1], v[0], v[1])
    i_before_l = orient3d(u[0], u[2], v[2], v[0])
    if proper:
        return k_before_j < 0.0 and i_before_l < 0.0
    return k_before_j <= 0.0 and i_before_l <= 0.0


@making
def fetch(vertices: Array, triangles: IntArray, t: int, out: Array) -> None:
    """Corners of triangle t."""
    for i in range(3):
        for k in range(3):
            out[i, k] = vertices[triangles[t, i], k]


@kernel
def with_area(vertices: Array, triangles: IntArray) -> BoolArray:
    """(m,) whether a triangle's corners are exactly not in one line."""
    p = np.empty((3, 3))
    good = np.empty(triangles.shape[0], np.bool_)
    for t in range(triangles.shape[0]):
        fetch(vertices, triangles, t, p)
        good[t] = dominant(p) >= 0
    return good


@kernel
def meeting(
    a_vertices: Array,
    a_triangles: IntArray,
    a_good: BoolArray,
    b_vertices: Array,
    b_triangles: IntArray,
    b_good: BoolArray,
    pairs: IntArray,
    proper: bool,
) -> BoolArray:
    """(k,) whether the pairs meet; a triangle without area meets nothing."""
    p, q, u, v = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    above, beside = np.empty(3), np.empty(3)
    shared = np.empty(3, np.int64)
    result = np.zeros(pairs.shape[0], np.bool_)
    for n in range(pairs.shape[0]):
        s, t = pairs[n, 0], pairs[n, 1]
        if a_good[s] and b_good[t]:
            fetch(a_vertices, a_triangles, s, p)
            fetch(b_vertices, b_triangles, t, q)
            result[n] = meet(p, q, proper, above, beside, u, v, shared)
    return result


@making
def stretch(p: Array, sign: Array, out: Array) -> None:
    """The two points in which the border of p crosses the plane its corners have the (signed) distances `sign` from."""
    first, _ = alone(sign)
    for n in range(2):
        other = (first + 1 + n) % 3
        span = sign[first] - sign[other]
        share = sign[first] / span if span != 0.0 else 0.0
        for k in range(3):
            out[n, k] = p[first, k] + share * (p[other, k] - p[first, k])


@kernel
def segments(
    a_vertices: Array,
    a_triangles: IntArray,
    b_vertices: Array,
    b_triangles: IntArray,
    pairs: IntArray,
    cross: BoolArray,
) -> Array:
    """(k, 2, 3) ends of the stretch two triangles share; NaN where they do not `cross` or lie in one plane."""
    p, q = np.empty((3, 3)), np.empty((3, 3))
    above, beside = np.empty(3), np.empty(3)
    shared = np.empty(3, np.int64)
    ends = np.empty((4, 3))
    at = np.empty(4)
    result = np.full((pairs.shape[0], 2, 3), np.nan)
    for n in range(pairs.shape[0]):
        if not cross[n]:
            continue
        fetch(a_vertices, a_triangles, pairs[n, 0], p)
        fetch(b_vertices, b_triangles, pairs[n, 1], q)
        same_corners(p, q, shared)
        low, high = np.inf, -np.inf
        for j in range(3):
            above[j] = 0.0 if shared[j] >= 0 else volume(p[0], p[1], p[2], q[j], TRUSTED)
            common = shared[0] == j or shared[1] == j or shared[2] == j
            beside[j] = 0.0 if common else volume(q[0], q[1], q[2], p[j], TRUSTED)
            low, high = min(low, above[j]), max(high, above[j])
        if low == 0.0 and high == 0.0:
            continue
        stretch(p, beside, ends[:2])
        stretch(q, above, ends[2:])
        far = 0  # the axis the stretch of p is longest in orders the four ends
        for k in range(1, 3):
            if abs(ends[1, k] - ends[0, k]) > abs(ends[1, far] - ends[0, far]):
                far = k
        for i in range(4):
            at[i] = ends[i, far]
        order = np.argsort(at)
        for k in range(3):
            result[n, 0, k], result[n, 1, k] = ends[order[1], k], ends[order[2], k]
    return result
