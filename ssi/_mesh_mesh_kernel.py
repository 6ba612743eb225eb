"""Kernels of `mesh_mesh`: where two triangles meet, as points named by what meets there, decided exactly.

Every decision is the exact sign of an orientation determinant of given coordinates. A point is named by the least
features of the two triangles it lies on (corner, side or face), and these by vertex numbers: so every pair of triangles
that has the point gives it the same name, whether it is a common one or a corner on a side, and the stretches of
neighbouring pairs join without comparing coordinates.

Two triangles of different planes share an interval of the line in which the planes meet: the overlap of the intervals
each of them cuts from it. The order of the ends is an orientation of two sides in space (Guigue & Devillers, Journal
of Graphics Tools 8(1), 2003). In one plane, each side of one triangle is clipped by the other in the same way, and the
clipped sides bound the polygon they share.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.models._triangle_triangle_kernel import TRUSTED, dominant, orient2d, orient3d, volume
from patchwright.models.arrays import Array, IntArray

FACE = 6  # features: 0, 1, 2 corners; 3, 4, 5 the sides from corner 0, 1, 2 to the next; 6 the face
NAME = 5  # vertex numbers naming a point: (v), (side, side) or (side, face), filled with -1
# rows of the result: name of the start, name of the end, pair, flags
PAIR, FLAGS, WIDTH = 10, 11, 12
BELOW_B, ABOVE_B, BELOW_A, ABOVE_A, CROSSING, EDGES, PLANE, POINT = 1, 2, 4, 8, 16, 32, 64, 128


@njit(cache=True, nogil=True)
def line_ends(side: IntArray, ends: IntArray) -> bool:
    """`ends`: the features in which a line enters and leaves a triangle, and the one it runs in between.

    `side[i]` is -1 for a corner left of the line seen with the triangle counter-clockwise, 0 on it, 1 right of it.
    False if the line misses the triangle.
    """
    zeros = 0
    at = -1
    other = -1
    for i in range(3):
        if side[i] == 0:
            zeros += 1
            at = i
        else:
            other = i
    if zeros == 0:
        if side[0] == side[1] and side[1] == side[2]:
            return False
        ends[2] = FACE
        for i in range(3):
            if side[i] != side[(i + 1) % 3]:
                ends[0 if side[i] < 0 else 1] = 3 + i
        return True
    if zeros == 1:
        j, k = (at + 1) % 3, (at + 2) % 3
        if side[j] == side[k]:
            ends[0], ends[1], ends[2] = at, at, at
        elif side[j] < 0:
            ends[0], ends[1], ends[2] = 3 + j, at, FACE
        else:
            ends[0], ends[1], ends[2] = at, 3 + j, FACE
        return True
    j, k = (other + 1) % 3, (other + 2) % 3
    ends[2] = 3 + j
    if side[other] < 0:
        ends[0], ends[1] = j, k
    else:
        ends[0], ends[1] = k, j
    return True


@njit(cache=True, nogil=True)
def carrier(feature: int, side: IntArray) -> tuple[int, int]:
    """Two corners whose line passes through the feature, from below the plane the sides refer to, to above it."""
    if feature >= 3:
        i = feature - 3
        j = (i + 1) % 3
        return (i, j) if side[i] < 0 else (j, i)
    for j in range(3):
        if side[j] != 0:
            return (feature, j) if side[j] > 0 else (j, feature)
    return feature, feature


@njit(cache=True, nogil=True)
def equal(a: Array, b: Array) -> bool:
    """Whether two points have the same coordinates."""
    return a[0] == b[0] and a[1] == b[1] and a[2] == b[2]


@njit(cache=True, nogil=True)
def order3d(p: Array, f: int, p_side: IntArray, q: Array, g: int, q_side: IntArray) -> int:
    """1 if feature g of q lies after feature f of p on the line of the planes, along n_p x n_q; -1 before, 0 at it."""
    i, j = carrier(f, p_side)
    k, m = carrier(g, q_side)
    if equal(p[i], q[k]) or equal(p[i], q[m]) or equal(p[j], q[k]) or equal(p[j], q[m]):
        return 0
    value = orient3d(p[i], p[j], q[k], q[m])
    return -1 if value > 0.0 else (1 if value < 0.0 else 0)


@njit(cache=True, nogil=True)
def order2d(a: Array, b: Array, q: Array, g: int, q_side: IntArray, x: int, y: int, at: Array) -> int:
    """1 if feature g of q lies after the point `at` on the line a to b, -1 before, 0 at it.

    `q_side`: 1 for corners of q left of the line.
    """
    if g < 3:
        k = x if a[x] != b[x] else y
        way = 1 if b[k] > a[k] else -1
        if q[g, k] == at[k]:
            return 0
        return way if q[g, k] > at[k] else -way
    i = g - 3
    j = (i + 1) % 3
    if q_side[i] > 0:
        i, j = j, i
    value = orient2d(q[i], q[j], at, x, y, True)
    return 1 if value > 0.0 else (-1 if value < 0.0 else 0)


@njit(cache=True, nogil=True)
def sort2(a: int, b: int) -> tuple[int, int]:
    return (a, b) if a < b else (b, a)


@njit(cache=True, nogil=True)
def put_name(f: int, g: int, s: IntArray, t: IntArray, out: IntArray, at: int) -> None:
    """Write the name of the point on feature f of the triangle of vertices s and feature g of t."""
    for k in range(NAME):
        out[at + k] = -1
    if f < 3:
        out[at] = s[f]
        return
    if g < 3:
        out[at] = t[g]
        return
    if f == FACE:  # the side first
        f, g = g, f
        s, t = t, s
    i, j = sort2(s[f - 3], s[(f - 2) % 3])
    if g < FACE:
        k, m = sort2(t[g - 3], t[(g - 2) % 3])
        if k < i or (k == i and m < j):
            i, j, k, m = k, m, i, j
        out[at], out[at + 1], out[at + 2], out[at + 3] = i, j, k, m
        return
    k, m = sort2(t[0], t[1])
    m, n = sort2(m, t[2])
    k, m = sort2(k, m)
    out[at], out[at + 1], out[at + 2], out[at + 3], out[at + 4] = i, j, k, m, n


@njit(cache=True, nogil=True)
def same_name(row: IntArray) -> bool:
    """Whether a stretch ends where it begins."""
    same = True
    for k in range(NAME):
        same &= row[k] == row[NAME + k]
    return same


@njit(cache=True, nogil=True)
def is_common(v: int, s: IntArray, t: IntArray) -> bool:
    """Whether v is a vertex of both triangles."""
    return (v == s[0] or v == s[1] or v == s[2]) and (v == t[0] or v == t[1] or v == t[2])


@njit(cache=True, nogil=True)
def connected(row: IntArray, s: IntArray, t: IntArray) -> bool:
    """Whether a stretch or point is nothing but a side or corner two triangles of one mesh share."""
    only = True
    for end in range(0, 2 * NAME, NAME):
        only &= row[end + 1] < 0 and is_common(row[end], s, t)
    return only


@njit(cache=True, nogil=True)
def hinged(side: IntArray, shared: int) -> bool:
    """Whether triangles with common corners meet in these alone: the others lie strictly on one side of a plane."""
    zeros = 0
    total = 0
    for i in range(3):
        zeros += side[i] == 0
        total += side[i]
    return 0 < shared < 3 and zeros == shared and abs(total) == 3 - shared


@njit(cache=True, nogil=True)
def side_of(a: Array, b: Array, c: Array, d: Array) -> int:
    """1 if d lies above the plane of a, b, c, from where they turn counter-clockwise, -1 below, 0 in it; exact."""
    value = orient3d(a, b, c, d)
    return -1 if value > 0.0 else (1 if value < 0.0 else 0)


@njit(cache=True, nogil=True)
def in_space(p: Array, q: Array, s: IntArray, t: IntArray, p_side: IntArray, q_side: IntArray, scratch: IntArray,
             row: IntArray) -> bool:  # fmt: skip
    """Fill `row` with the stretch or point of two triangles that are not in one plane; False if they do not meet."""
    mine, theirs, turned = scratch[0], scratch[1], scratch[2]
    for i in range(3):
        turned[i] = -q_side[i]
    if not line_ends(p_side, mine) or not line_ends(turned, theirs):
        return False
    first = order3d(p, mine[1], p_side, q, theirs[0], q_side)  # p's exit to q's entry
    if first > 0:
        return False
    last = order3d(p, mine[0], p_side, q, theirs[1], q_side)  # p's entry to q's exit
    if last < 0:
        return False
    row[FLAGS] = 0
    if first == 0 or last == 0:
        f, g = (mine[1], theirs[0]) if first == 0 else (mine[0], theirs[1])
        put_name(f, g, s, t, row, 0)
        put_name(f, g, s, t, row, NAME)
        row[FLAGS] = POINT
        return True
    for end in range(2):
        later = order3d(p, mine[end], p_side, q, theirs[end], q_side)
        f, g = mine[end], theirs[end]
        if later != 0:
            if (later > 0) == (end == 0):
                f = mine[2]
            else:
                g = theirs[2]
        put_name(f, g, s, t, row, NAME * end)
    if same_name(row):
        row[FLAGS] = POINT
        return True
    if mine[2] == FACE and theirs[2] == FACE:
        row[FLAGS] = CROSSING
    elif mine[2] < FACE and theirs[2] < FACE:
        row[FLAGS] = EDGES
    elif mine[2] < FACE:
        row[FLAGS] = ABOVE_B if p_side[(mine[2] - 1) % 3] > 0 else BELOW_B
    else:
        row[FLAGS] = ABOVE_A if q_side[(theirs[2] - 1) % 3] > 0 else BELOW_A
    return True


@njit(cache=True, nogil=True)
def clipped_side(p: Array, q: Array, s: IntArray, t: IntArray, i: int, x: int, y: int, scratch: IntArray,
                 row: IntArray) -> bool:  # fmt: skip
    """Fill `row` with the part of side i of p that lies in q, both in one plane seen along the third axis."""
    side, turned, ends = scratch[0], scratch[1], scratch[2]
    a, b = p[i], p[(i + 1) % 3]
    turn = 1 if orient2d(q[0], q[1], q[2], x, y, True) > 0.0 else -1
    for j in range(3):
        value = orient2d(a, b, q[j], x, y, True)
        side[j] = 1 if value > 0.0 else (-1 if value < 0.0 else 0)
        turned[j] = -side[j] * turn
    if not line_ends(turned, ends):
        return False
    if order2d(a, b, q, ends[0], side, x, y, b) > 0 or order2d(a, b, q, ends[1], side, x, y, a) < 0:
        return False
    for end in range(2):
        corner = i if end == 0 else (i + 1) % 3
        later = order2d(a, b, q, ends[end], side, x, y, p[corner])
        f, g = corner, ends[end]
        if later != 0:
            if (later > 0) == (end == 0):
                f = 3 + i
            else:
                g = ends[2]
        elif order2d(a, b, q, ends[1 - end], side, x, y, p[corner]) == 0:
            g = ends[1 - end]
        if f >= 3 and g == FACE:
            return False
        put_name(f, g, s, t, row, NAME * end)
    # the whole clipped side may be the single point where it begins or ends
    if order2d(a, b, q, ends[0], side, x, y, b) == 0:
        put_name((i + 1) % 3, ends[0], s, t, row, 0)
        put_name((i + 1) % 3, ends[0], s, t, row, NAME)
    elif order2d(a, b, q, ends[1], side, x, y, a) == 0:
        put_name(i, ends[1], s, t, row, 0)
        put_name(i, ends[1], s, t, row, NAME)
    return True


@njit(cache=True, nogil=True)
def equal_ends(rows: IntArray, i: int, j: int) -> int:
    """1 if rows i and j run between the same points, -1 if in opposite directions, 0 otherwise."""
    same, opposite = True, True
    for k in range(NAME):
        same &= rows[i, k] == rows[j, k] and rows[i, NAME + k] == rows[j, NAME + k]
        opposite &= rows[i, k] == rows[j, NAME + k] and rows[i, NAME + k] == rows[j, k]
    return 1 if same else (-1 if opposite else 0)


@njit(cache=True, nogil=True)
def in_plane(p: Array, q: Array, s: IntArray, t: IntArray, scratch: IntArray, rows: IntArray) -> int:
    """Fill `rows` with the sides of the polygon shared by two triangles of one plane; how many.

    The sides carry PLANE and run counter-clockwise seen from the side to which the plane's normal points whose first
    component that is not zero is positive; without a common area there is one row, EDGES or POINT, or none.
    """
    axis = dominant(p)
    x, y = (axis + 1) % 3, (axis + 2) % 3
    opposite = (orient2d(p[0], p[1], p[2], x, y, True) > 0.0) != (orient2d(q[0], q[1], q[2], x, y, True) > 0.0)
    facing = 0.0
    for k in range(3):
        if facing == 0.0:
            facing = orient2d(p[0], p[1], p[2], (k + 1) % 3, (k + 2) % 3, True)
    found = 0
    touching = False
    for which in range(6):
        if which < 3:
            hit = clipped_side(p, q, s, t, which, x, y, scratch, rows[found])
        else:
            hit = clipped_side(q, p, t, s, which - 3, x, y, scratch, rows[found])
        if not hit:
            continue
        if (facing < 0.0) != (opposite and which >= 3):
            for k in range(NAME):
                m = rows[found, k]
                rows[found, k] = rows[found, NAME + k]
                rows[found, NAME + k] = m
        if same_name(rows[found]):
            if found == 0:
                for k in range(WIDTH):
                    rows[6, k] = rows[found, k]
                touching = True
            continue
        fresh = True
        for other in range(found):
            fresh &= equal_ends(rows, found, other) == 0
        if fresh:
            rows[found, FLAGS] = PLANE
            found += 1
    if found >= 3:
        return found
    if found >= 1:
        rows[0, FLAGS] = EDGES
        return 1
    if touching:
        for k in range(WIDTH):
            rows[0, k] = rows[6, k]
        rows[0, FLAGS] = POINT
        return 1
    return 0


@njit(cache=True, nogil=True)
def stretches(points: Array, first: IntArray, second: IntArray, pairs: IntArray, good: IntArray, own: bool) -> IntArray:
    """(k, 12) the stretches, polygon sides and points in which pairs of triangles meet.

    `first` and `second` (m, 3) are triangles over `points`; equal coordinates must have equal numbers. `good` (2, m)
    marks those with area. With `own` they are one mesh, and common sides and corners are no meeting.
    """
    capacity = max(64, 2 * pairs.shape[0])
    result = np.empty((capacity, WIDTH), np.int64)
    filled = 0
    p, q = np.empty((3, 3)), np.empty((3, 3))
    p_side, q_side = np.empty(3, np.int64), np.empty(3, np.int64)
    scratch = np.empty((3, 3), np.int64)
    rows = np.empty((7, WIDTH), np.int64)
    for n in range(pairs.shape[0]):
        if good[0, pairs[n, 0]] == 0 or good[1, pairs[n, 1]] == 0:
            continue
        s, t = first[pairs[n, 0]], second[pairs[n, 1]]
        for i in range(3):
            for k in range(3):
                p[i, k] = points[s[i], k]
                q[i, k] = points[t[i], k]
        low, high = 1, -1
        shared = 0
        for j in range(3):
            common = t[j] == s[0] or t[j] == s[1] or t[j] == s[2]
            shared += common
            q_side[j] = 0 if common else side_of(p[0], p[1], p[2], q[j])
            low, high = min(low, q_side[j]), max(high, q_side[j])
        if low > 0 or high < 0 or (own and hinged(q_side, shared)):
            continue
        found = 0
        if low == 0 and high == 0:
            found = in_plane(p, q, s, t, scratch, rows)
        else:
            low, high = 1, -1
            for i in range(3):
                common = s[i] == t[0] or s[i] == t[1] or s[i] == t[2]
                p_side[i] = 0 if common else side_of(q[0], q[1], q[2], p[i])
                low, high = min(low, p_side[i]), max(high, p_side[i])
            if own and hinged(p_side, shared):
                continue
            if low <= 0 and high >= 0 and in_space(p, q, s, t, p_side, q_side, scratch, rows[0]):
                found = 1
        if found == 1 and own and connected(rows[0], s, t):
            continue
        if filled + found > capacity:
            capacity = 2 * capacity + found
            grown = np.empty((capacity, WIDTH), np.int64)
            for i in range(filled):
                for k in range(WIDTH):
                    grown[i, k] = result[i, k]
            result = grown
        for i in range(found):
            for k in range(WIDTH):
                result[filled, k] = rows[i, k]
            result[filled, PAIR] = n
            filled += 1
    return result[:filled].copy()


@njit(cache=True, nogil=True)
def place(points: Array, names: IntArray, out: Array) -> None:
    """Coordinates of named points: always the same operations in the same order for the same name."""
    for n in range(names.shape[0]):
        i, j = names[n, 0], names[n, 1]
        if j < 0:
            for k in range(3):
                out[n, k] = points[i, k]
            continue
        a, b, c, d = points[i], points[j], points[names[n, 2]], points[names[n, 3]]
        if names[n, 4] >= 0:
            e = points[names[n, 4]]
            before, after = volume(c, d, e, a, TRUSTED), volume(c, d, e, b, TRUSTED)
        else:
            # two sides in one plane: the projection in which they cross at the largest angle
            axis, best = 0, -1.0
            for k in range(3):
                x, y = (k + 1) % 3, (k + 2) % 3
                turn = abs((b[x] - a[x]) * (d[y] - c[y]) - (b[y] - a[y]) * (d[x] - c[x]))
                if turn > best:
                    axis, best = k, turn
            x, y = (axis + 1) % 3, (axis + 2) % 3
            before, after = orient2d(c, d, a, x, y, True), orient2d(c, d, b, x, y, True)
        span = before - after
        # from the nearer end, so that a point at an end is that end
        if abs(before) <= abs(after):
            share = before / span if span != 0.0 else 0.5
            for k in range(3):
                out[n, k] = a[k] + share * (b[k] - a[k])
        else:
            share = after / span if span != 0.0 else 0.5
            for k in range(3):
                out[n, k] = b[k] + share * (b[k] - a[k])
