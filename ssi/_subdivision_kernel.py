"""Dual subdivision of two sets of Bezier pieces: every pair of boxes is excluded, explained or handed back.

A pair is judged over a common plane (`_graph_kernel`): f = z_a - z_b is bounded away from zero (excluded), strictly
monotone along one direction (at most one point per slice: one transversal arc, no loop), convex with its extremum at
zero (touch), a saddle at zero (branch point), a valley along zero (tangent curve), zero throughout (overlap) - or it is
split. What is left at the size of the tolerance is handed back.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

import numpy as np

from patchwright.models._compile_kernel import inner, kernel, making
from patchwright.models.arrays import Array, IntArray
from patchwright.ssi._graph_kernel import (
    difference,
    functional_range,
    graph_bounds,
    height_range,
    rotated,
    third_graph_bounds,
)
from patchwright.ssi._jet_kernel import FRAME, cross, dot, jets, slice_newton, unit

SPLIT, EXCLUDED, TRANSVERSAL, TOUCH, BRANCH, TANGENT, OVERLAP, SINGULAR, BUDGET = range(9)
BOX = 12  # columns of a node's numbers: u0 u1 v0 v1, box (6), size, direction of the next split
STEP = 1e-7  # Newton's last step: the next would be its square, round-off; what is left is asked for in any case
VAGUER = 4.0  # times less known a surface has to be to be split though it is the smaller one
ROW = 20  # columns of a finding: code, piece a, piece b, box a (4), box b (4), u v s t, x y z, gap, spare


@inner
def describe(net: Array, row: Array) -> None:
    """Box, size and direction of the next split of a node."""
    P = net.shape[0]
    Q = net.shape[1]
    for c in range(3):
        lo = math.inf
        hi = -math.inf
        for i in range(P):
            for j in range(Q):
                x = net[i, j, c] / net[i, j, 3]
                lo = min(lo, x)
                hi = max(hi, x)
        row[4 + 2 * c] = lo
        row[5 + 2 * c] = hi
    row[10] = math.sqrt((row[5] - row[4]) ** 2 + (row[7] - row[6]) ** 2 + (row[9] - row[8]) ** 2)
    along = 0.0
    for j in range(Q):
        length = 0.0
        for i in range(P - 1):
            d = 0.0
            for c in range(3):
                d += (net[i + 1, j, c] / net[i + 1, j, 3] - net[i, j, c] / net[i, j, 3]) ** 2
            length += math.sqrt(d)
        along = max(along, length)
    across = 0.0
    for i in range(P):
        length = 0.0
        for j in range(Q - 1):
            d = 0.0
            for c in range(3):
                d += (net[i, j + 1, c] / net[i, j + 1, 3] - net[i, j, c] / net[i, j, 3]) ** 2
            length += math.sqrt(d)
        across = max(across, length)
    row[11] = 0.0 if along >= across else 1.0


@inner
def widened(net: Array, M: Array, N: Array, row: Array, out: Array) -> None:
    """out = M net N^T: the net of the widened box; `row` (Q or more, 4) is scratch."""
    P = net.shape[0]
    Q = net.shape[1]
    for i in range(P):
        for j in range(Q):
            for c in range(4):
                row[j, c] = 0.0
            for k in range(P):
                m = M[i, k]
                for c in range(4):
                    row[j, c] += m * net[k, j, c]
        for j in range(Q):
            for c in range(4):
                out[i, j, c] = 0.0
            for k in range(Q):
                m = N[j, k]
                for c in range(4):
                    out[i, j, c] += m * row[k, c]


@inner
def halves(net: Array, axis: int, left: Array, right: Array) -> None:
    """De Casteljau at 1/2 along an axis."""
    P = net.shape[0]
    Q = net.shape[1]
    for i in range(P):
        for j in range(Q):
            for c in range(4):
                right[i, j, c] = net[i, j, c]
    if axis == 0:
        for j in range(Q):
            for c in range(4):
                left[0, j, c] = right[0, j, c]
                for r in range(1, P):
                    for i in range(P - r):
                        right[i, j, c] = 0.5 * (right[i, j, c] + right[i + 1, j, c])
                    left[r, j, c] = right[0, j, c]
    else:
        for i in range(P):
            for c in range(4):
                left[i, 0, c] = right[i, 0, c]
                for r in range(1, Q):
                    for j in range(Q - r):
                        right[i, j, c] = 0.5 * (right[i, j, c] + right[i, j + 1, c])
                    left[i, r, c] = right[i, 0, c]


@inner
def children(
    k: int, axis: int, used: int, nets: Array, wide: Array, rows: Array, links: IntArray, M: Array, N: Array,
    line: Array,
) -> int:  # fmt: skip
    """Make the two children of node k at `used` and `used` + 1; the new number of nodes."""
    halves(nets[k], axis, nets[used], nets[used + 1])
    for side in range(2):
        n = used + side
        for c in range(4):
            rows[n, c] = rows[k, c]
        mid = 0.5 * (rows[k, 2 * axis] + rows[k, 2 * axis + 1])
        rows[n, 2 * axis + 1 - side] = mid
        describe(nets[n], rows[n])
        widened(nets[n], M, N, line, wide[n])
        links[n, 0] = -1
        links[n, 1] = -1
    links[k, axis] = used
    return used + 2


@inner
def edge(net: Array, axis: int, q: Array) -> float:
    """The extent of a net's middle line of an axis along q."""
    P = net.shape[0]
    Q = net.shape[1]
    s = 0.0
    for c in range(3):
        if axis == 0:
            k = Q // 2
            s += q[c] * (net[P - 1, k, c] / net[P - 1, k, 3] - net[0, k, c] / net[0, k, 3])
        else:
            k = P // 2
            s += q[c] * (net[k, Q - 1, c] / net[k, Q - 1, 3] - net[k, 0, c] / net[k, 0, 3])
    return s


@inner
def inside(w: Array, at: int, box: Array, share: float) -> bool:
    """Whether two parameters lie in a box widened by a share of its size."""
    mu = share * (box[1] - box[0])
    mv = share * (box[3] - box[2])
    return bool(box[0] - mu <= w[at] <= box[1] + mu and box[2] - mv <= w[at + 1] <= box[3] + mv)


@inner
def on_pieces(w: Array, ja: Array, jb: Array, tol: float) -> bool:
    """Whether four local parameters lie on their pieces within a length."""
    for k in range(4):
        d = ja[1 + k] if k < 2 else jb[k - 1]
        slack = min(tol / max(math.sqrt(dot(d, d)), 1e-300), 0.1)
        if not (-slack <= w[k] <= 1.0 + slack):
            return False
    return True


@inner
def judge(
    A: Array, B: Array, net_a: Array, net_b: Array, wide_a: Array, wide_b: Array, box_a: Array, box_b: Array,
    rational: bool, tol: float, small: float, found: Array, work: tuple[Array, ...], info: Array,
) -> tuple[int, int]:  # fmt: skip
    """The code of a pair and the number of points put into `found` (k, 8): u v s t x y z gap."""
    (
        F, c, w, p, f, RA, RB, WA, WB, DA, DB, SA, SB, GA, GB, KA, KB, EA, EB, HA, HB, TA, TB,
        bu, bv, h, ja, jb, ga, gb, frame, _,
    ) = work  # fmt: skip
    info[0] = 0.0
    info[1] = 0.0
    info[5] = 0.0
    info[6] = 0.0
    info[11] = -1.0
    # common plane from the normals at the middles
    jets(A, 0.5 * (box_a[0] + box_a[1]), 0.5 * (box_a[2] + box_a[3]), bu, bv, h, ja)
    jets(B, 0.5 * (box_b[0] + box_b[1]), 0.5 * (box_b[2] + box_b[3]), bu, bv, h, jb)
    cross(ja[1], ja[2], frame[0])
    cross(jb[1], jb[2], frame[1])
    big = box_a[10] <= small and box_b[10] <= small
    if unit(frame[0]) == 0.0 or unit(frame[1]) == 0.0:
        return (SINGULAR if big else SPLIT), 0
    side = 1.0 if dot(frame[0], frame[1]) >= 0.0 else -1.0
    for k in range(3):
        F[2, k] = frame[0, k] + side * frame[1, k]
        c[k] = 0.5 * (ja[0, k] + jb[0, k])
    unit(F[2])
    # x along the longest edge of the smaller box: long thin boxes then overlap in long thin rectangles
    longest = -1.0
    for i in range(2):
        jet, box = (ja, box_a) if box_a[10] <= box_b[10] else (jb, box_b)
        e = dot(jet[1 + i], jet[1 + i]) * (box[2 * i + 1] - box[2 * i]) ** 2
        if e > longest:
            longest = e
            lean = dot(jet[1 + i], F[2])
            for k in range(3):
                F[0, k] = jet[1 + i, k] - lean * F[2, k]
    if unit(F[0]) == 0.0:
        return (SINGULAR if big else SPLIT), 0
    cross(F[2], F[0], F[1])
    rotated(net_a, F, c, RA)
    rotated(net_b, F, c, RB)
    # separating directions: the normal, then the plane's
    a0, a1 = height_range(RA)
    b0, b1 = height_range(RB)
    if a0 > b1 + tol or b0 > a1 + tol:
        return EXCLUDED, 0
    a0, a1 = functional_range(RA, 1.0, 0.0)
    b0, b1 = functional_range(RB, 1.0, 0.0)
    if a0 > b1 + tol or b0 > a1 + tol:
        return EXCLUDED, 0
    x0 = max(a0, b0)
    x1 = min(a1, b1)
    a0, a1 = functional_range(RA, 0.0, 1.0)
    b0, b1 = functional_range(RB, 0.0, 1.0)
    if a0 > b1 + tol or b0 > a1 + tol:
        return EXCLUDED, 0
    y0 = max(a0, b0)
    y1 = min(a1, b1)
    if big:
        return SINGULAR, 0
    rotated(wide_a, F, c, WA)
    rotated(wide_b, F, c, WB)
    if not graph_bounds(WA, rational, DA, SA, GA, KA, EA, HA):
        return SPLIT, 0
    if not graph_bounds(WB, rational, DB, SB, GB, KB, EB, HB):
        return SPLIT, 0
    for i in range(4):
        K = KA if i < 2 else KB
        s = max(abs(K[i % 2, 0]), abs(K[i % 2, 1]))
        a0, a1 = functional_range(RA, K[i % 2, 0] / s, K[i % 2, 1] / s)
        b0, b1 = functional_range(RB, K[i % 2, 0] / s, K[i % 2, 1] / s)
        if a0 > b1 + 1.5 * tol or b0 > a1 + 1.5 * tol:
            return EXCLUDED, 0
    xm = 0.5 * (x0 + x1)
    ym = 0.5 * (y0 + y1)
    rx = 0.5 * abs(x1 - x0) + tol
    ry = 0.5 * abs(y1 - y0) + tol
    w[0] = 0.5 * (box_a[0] + box_a[1])
    w[1] = 0.5 * (box_a[2] + box_a[3])
    w[2] = 0.5 * (box_b[0] + box_b[1])
    w[3] = 0.5 * (box_b[2] + box_b[3])
    if not difference(A, B, w, xm, ym, F, c, box_a, box_b, bu, bv, h, ja, jb, ga, gb, f):
        return SPLIT, 0
    hxx0 = HA[0, 0] - HB[0, 1]
    hxx1 = HA[0, 1] - HB[0, 0]
    hxy0 = HA[1, 0] - HB[1, 1]
    hxy1 = HA[1, 1] - HB[1, 0]
    hyy0 = HA[2, 0] - HB[2, 1]
    hyy1 = HA[2, 1] - HB[2, 0]
    # what is not known of each surface's height over the common rectangle: the vaguer one is split
    info[5] = (HA[0, 1] - HA[0, 0]) * rx * rx + 2.0 * (HA[1, 1] - HA[1, 0]) * rx * ry + (HA[2, 1] - HA[2, 0]) * ry * ry
    info[6] = (HB[0, 1] - HB[0, 0]) * rx * rx + 2.0 * (HB[1, 1] - HB[1, 0]) * rx * ry + (HB[2, 1] - HB[2, 0]) * ry * ry
    g = math.sqrt(f[1] * f[1] + f[2] * f[2])
    slope = abs(f[1]) * rx + abs(f[2]) * ry
    for order in range(2, 4):
        if order == 3:  # only where what is not known of the curvature hides height and slope
            if abs(f[0]) + slope > 2.0 * (info[5] + info[6]):
                break
            third_graph_bounds(WA, rational, DA, SA, GA, KA, EA, HA, TA)
            third_graph_bounds(WB, rational, DB, SB, GB, KB, EB, HB, TB)
            s0 = max(abs(TA[0, 0] - TB[0, 1]), abs(TA[0, 1] - TB[0, 0]))
            s1 = max(abs(TA[1, 0] - TB[1, 1]), abs(TA[1, 1] - TB[1, 0]))
            s2 = max(abs(TA[2, 0] - TB[2, 1]), abs(TA[2, 1] - TB[2, 0]))
            s3 = max(abs(TA[3, 0] - TB[3, 1]), abs(TA[3, 1] - TB[3, 0]))
            hxx0 = max(hxx0, f[3] - s0 * rx - s1 * ry)
            hxx1 = min(hxx1, f[3] + s0 * rx + s1 * ry)
            hxy0 = max(hxy0, f[4] - s1 * rx - s2 * ry)
            hxy1 = min(hxy1, f[4] + s1 * rx + s2 * ry)
            hyy0 = max(hyy0, f[5] - s2 * rx - s3 * ry)
            hyy1 = min(hyy1, f[5] + s2 * rx + s3 * ry)
        mxx = max(abs(hxx0), abs(hxx1))
        mxy = max(abs(hxy0), abs(hxy1))
        myy = max(abs(hyy0), abs(hyy1))
        bend = 0.5 * (mxx * rx * rx + 2.0 * mxy * rx * ry + myy * ry * ry)
        # height above the plane is at least the distance times the cosines; 1e-15: round-off of unit-size coordinates
        if abs(f[0]) > slope + bend + tol + 4e-15:
            return EXCLUDED, 0
        if g > 0.0:
            gx = f[1] / g
            gy = f[2] / g
            sx = max(abs(gx * hxx0 + gy * hxy0), abs(gx * hxx1 + gy * hxy1))
            sx = max(sx, max(abs(gx * hxx0 + gy * hxy1), abs(gx * hxx1 + gy * hxy0)))
            sy = max(abs(gx * hxy0 + gy * hyy0), abs(gx * hxy1 + gy * hyy1))
            sy = max(sy, max(abs(gx * hxy0 + gy * hyy1), abs(gx * hxy1 + gy * hyy0)))
            if g > sx * rx + sy * ry + 1e-14:
                if abs(f[0]) > slope + bend + 4e-15:
                    return EXCLUDED, 0  # no zero here, however near the surfaces are
                return transversal(A, B, box_a, box_b, xm, ym, rx, ry, gx, gy, f[0] / g, tol, found, work)
    if abs(f[0]) + slope + bend <= max(0.01 * tol, 8e-15):
        centre = SINGULAR
        for k in range(3):
            info[8 + k] = c[k] + xm * F[0, k] + ym * F[1, k] + 0.5 * (ga[0] + gb[0]) * F[2, k]
        info[11] = max(rx, ry)
    else:
        centre = SPLIT
    e = 0.5 * math.atan2(2.0 * f[4], f[3] - f[5])
    wx = math.cos(e)
    wy = math.sin(e)
    if abs(f[3] * wx * wx + 2.0 * f[4] * wx * wy + f[5] * wy * wy) < abs(
        f[3] * wy * wy - 2.0 * f[4] * wx * wy + f[5] * wx * wx
    ):
        wx, wy = -wy, wx
    mid = 0.5 * (hxx0 + hxx1) * wx * wx + (hxy0 + hxy1) * wx * wy + 0.5 * (hyy0 + hyy1) * wy * wy
    half = 0.5 * (hxx1 - hxx0) * wx * wx + abs((hxy1 - hxy0) * wx * wy) + 0.5 * (hyy1 - hyy0) * wy * wy
    rt = abs(wy) * rx + abs(wx) * ry
    rw = abs(wx) * rx + abs(wy) * ry
    # where to cut: across the direction along which f's gradient is least known
    across = (abs(mid) + half) * rw
    spare = 0.5 * (hxx1 - hxx0) * wy * wy + abs((hxy1 - hxy0) * wx * wy) + 0.5 * (hyy1 - hyy0) * wx * wx
    along = (abs(0.5 * (hxx0 + hxx1) * wy * wy - (hxy0 + hxy1) * wx * wy + 0.5 * (hyy0 + hyy1) * wx * wx) + spare) * rt
    if across > 2.0 * along:
        info[1] = 1.0
        for k in range(3):
            info[2 + k] = wx * F[0, k] + wy * F[1, k]
    elif along > 2.0 * across:
        info[1] = 1.0
        for k in range(3):
            info[2 + k] = -wy * F[0, k] + wx * F[1, k]
    # overlap: zero at all of nine places, and with a gradient and curvature that say so
    r = max(rx, ry)
    reach = 4.0 * r + min(box_a[10], box_b[10])
    flat = r > 0.01 * info[7] and abs(f[0]) <= tol and g * r <= 8.0 * tol and r > 4.0 * tol and min(rx, ry) > 0.02 * r
    if flat and (abs(f[3]) + abs(f[4]) + abs(f[5])) * r * r <= 64.0 * tol:
        seen = 0
        worst = 0.0
        for i in range(-2, 3):
            for j in range(-2, 3):
                for k in range(4):
                    p[k] = w[k]
                if difference(
                    A, B, p, xm + 0.48 * i * rx, ym + 0.48 * j * ry, F, c, box_a, box_b, bu, bv, h, ja, jb, ga, gb, f
                ):
                    seen += 1
                    worst = max(worst, abs(f[0]))
        if seen >= 9 and worst <= tol:
            for k in range(4):
                found[0, k] = w[k]
            jets(A, w[0], w[1], bu, bv, h, ja)
            for k in range(3):
                found[0, 4 + k] = ja[0, k]
            found[0, 7] = worst
            return OVERLAP, 1
        difference(A, B, w, xm, ym, F, c, box_a, box_b, bu, bv, h, ja, jb, ga, gb, f)
    # the extremum or saddle
    p0, p1 = hxx0 * hyy0, hxx0 * hyy1
    p2, p3 = hxx1 * hyy0, hxx1 * hyy1
    det_low = min(min(p0, p1), min(p2, p3)) - mxy * mxy
    least = 0.0 if hxy0 <= 0.0 <= hxy1 else min(hxy0 * hxy0, hxy1 * hxy1)
    det_high = max(max(p0, p1), max(p2, p3)) - least
    definite = det_low > 0.0
    saddle = det_high < 0.0
    if definite or saddle:
        x = xm
        y = ym
        for k in range(4):
            p[k] = w[k]
        settled = False
        for _ in range(12):
            det = f[3] * f[5] - f[4] * f[4]
            if det == 0.0:
                break
            dx = -(f[5] * f[1] - f[4] * f[2]) / det
            dy = -(f[3] * f[2] - f[4] * f[1]) / det
            if abs(dx) > reach or abs(dy) > reach:
                break
            x += dx
            y += dy
            if not difference(A, B, p, x, y, F, c, box_a, box_b, bu, bv, h, ja, jb, ga, gb, f):
                break
            if abs(dx) + abs(dy) <= 1e-13 + 1e-9 * r:
                settled = True
                break
        if settled:
            turn = 1.0 if f[3] + f[5] > 0.0 else -1.0
            if definite and turn * f[0] > tol:
                return EXCLUDED, 0
            if abs(f[0]) <= tol:
                own = on_pieces(p, ja, jb, 4.0 * tol + 1e-13)
                for k in range(4):
                    found[0, k] = p[k]
                for k in range(3):
                    found[0, 4 + k] = 0.5 * (ja[0, k] + jb[0, k])
                found[0, 7] = abs(f[0])
                info[0] = r
                if definite:
                    return (TOUCH if own else EXCLUDED), 1
                if own:
                    return BRANCH, 1
        return centre, 0
    # a valley: strictly convex across, its bottom at zero
    if abs(mid) > half:
        seen = 0
        count = 0
        least = math.inf
        turn = 1.0 if mid > 0.0 else -1.0
        for i in range(-2, 3):
            x = xm - 0.5 * i * rt * wy
            y = ym + 0.5 * i * rt * wx
            for k in range(4):
                p[k] = w[k]
            ok = False
            for _ in range(12):
                if not difference(A, B, p, x, y, F, c, box_a, box_b, bu, bv, h, ja, jb, ga, gb, f):
                    break
                bent = f[3] * wx * wx + 2.0 * f[4] * wx * wy + f[5] * wy * wy
                if bent == 0.0:
                    break
                d = -(wx * f[1] + wy * f[2]) / bent
                if abs(d) > reach:
                    break
                if abs(d) <= 1e-13 + 1e-9 * r:
                    ok = True
                    break
                x += wx * d
                y += wy * d
            if ok:
                seen += 1
                least = min(least, turn * f[0])
                if abs(f[0]) <= tol:
                    if on_pieces(p, ja, jb, 4.0 * tol + 1e-13):
                        for k in range(4):
                            found[count, k] = p[k]
                        for k in range(3):
                            found[count, 4 + k] = 0.5 * (ja[0, k] + jb[0, k])
                        found[count, 7] = abs(f[0])
                        count += 1
                else:
                    seen -= 8
        if seen >= 3:
            if count > 0:
                return TANGENT, count
            if r < 1e-3:
                return EXCLUDED, 0  # the only zeros are bottoms of the valley beyond the pieces
        info[1] = 0.0
    return centre, 0


@inner
def transversal(
    A: Array, B: Array, box_a: Array, box_b: Array, xm: float, ym: float, rx: float, ry: float,
    gx: float, gy: float, off: float, tol: float, found: Array, work: tuple[Array, ...],
) -> tuple[int, int]:  # fmt: skip
    """Points on the only arc the pair can hold: one inside, several where the pieces end."""
    F, c, w, p = work[:4]
    bu, bv, h, ja, jb = work[23:28]
    frame = work[30]
    scratch = work[31]
    border = False
    for k in range(2):
        border |= box_a[2 * k] <= 0.0 or box_a[2 * k + 1] >= 1.0 or box_b[2 * k] <= 0.0 or box_b[2 * k + 1] >= 1.0
    rt = abs(gy) * rx + abs(gx) * ry
    T = frame[7]
    for k in range(3):
        T[k] = -gy * F[0, k] + gx * F[1, k]
    base = dot(T, c) - gy * xm + gx * ym
    if not border:
        for k in range(4):
            p[k] = w[k]
        gap = slice_newton(A, B, p, T, base, 12, bu, bv, h, ja, jb, frame, STEP)
        if gap < 0.0 or gap > 1e-12 or not (inside(p, 0, box_a, 0.125) and inside(p, 2, box_b, 0.125)):
            return SPLIT, 0
        for k in range(4):
            found[0, k] = p[k]
        for k in range(3):
            found[0, 4 + k] = 0.5 * (ja[0, k] + jb[0, k])
        found[0, 7] = gap
        return TRANSVERSAL, 1
    count = 0
    signs = scratch[:4]
    out = scratch[4]
    d = scratch[5]
    ahead = scratch[6:8]  # where the slices next to the middle one lead to
    along = scratch[8:13]  # the parameters at the slices in order
    for k in range(4):
        signs[k, 0] = signs[k, 1] = out[k] = 0.0
    known = False
    solved = 0
    for k in range(4):
        p[k] = w[k]
    for slot in range(5):  # from the middle outward, each from its neighbour's point along the arc
        i = (slot + 1) // 2 if slot % 2 == 1 else -(slot // 2)
        if slot > 0 and known:
            for k in range(4):
                p[k] = ahead[slot % 2, k]
        elif slot > 0:
            for k in range(4):
                p[k] = w[k]
        gap = slice_newton(A, B, p, T, base + 0.5 * i * rt, 12, bu, bv, h, ja, jb, frame, STEP)
        if gap < 0.0 or gap > 1e-12 or not (inside(p, 0, box_a, 0.125) and inside(p, 2, box_b, 0.125)):
            if slot > 0:
                for k in range(4):
                    ahead[slot % 2, k] = w[k]
            continue
        solved += 1
        # the parameters' velocities along the arc
        tangent = frame[4]
        turn = 1.0 if dot(tangent, T) > 0.0 else -1.0
        velocity(ja, jb, tangent, d)
        step = 0.5 * rt / dot(tangent, T)
        for k in range(4):
            if slot == 0:
                ahead[0, k] = p[k] - step * d[k]
                ahead[1, k] = p[k] + step * d[k]
                known = True
            else:
                ahead[slot % 2, k] = p[k] + (step if i > 0 else -step) * d[k]
            if turn * d[k] > 0.0:
                signs[k, 0] = 1.0
            else:
                signs[k, 1] = 1.0
            if not (0.0 <= p[k] <= 1.0):
                out[k] = 1.0
            along[2 + i, k] = p[k]
        if on_pieces(p, ja, jb, 2.0 * tol):
            for k in range(4):
                found[count, k] = min(max(p[k], 0.0), 1.0)
            for k in range(3):
                found[count, 4 + k] = 0.5 * (ja[0, k] + jb[0, k])
            found[count, 7] = gap
            count += 1
    if count == 0:
        if solved == 5:  # the whole arc may pass by beyond a piece's end
            for k in range(4):
                d[k] = 0.0
                least = math.inf
                for i in range(5):
                    least = min(least, max(-along[i, k], along[i, k] - 1.0))
                    if (along[i, k] > 0.5) != (along[0, k] > 0.5):
                        least = -1.0
                    if 0 < i < 4:  # a parabola dips an eighth of this between samples
                        d[k] = max(d[k], abs(along[i - 1, k] - 2.0 * along[i, k] + along[i + 1, k]))
                jet = ja[1 + k] if k < 2 else jb[k - 1]
                if least > 0.25 * d[k] + 2.0 * tol / max(math.sqrt(dot(jet, jet)), 1e-300):
                    return EXCLUDED, 0
        return SPLIT, 0
    for k in range(4):  # an arc that bulges over the end of a piece may come back between the slices
        if out[k] > 0.0 and signs[k, 0] > 0.0 and signs[k, 1] > 0.0 and rt > 1e-5:
            return SPLIT, 0
    return TRANSVERSAL, count


@inner
def velocity(ja: Array, jb: Array, T: Array, d: Array) -> None:
    """d = rates of u, v, s, t along the direction T."""
    for side in range(2):
        j = ja if side == 0 else jb
        e = dot(j[1], j[1])
        f = dot(j[1], j[2])
        g = dot(j[2], j[2])
        det = e * g - f * f
        if det <= 0.0:
            d[2 * side] = 0.0
            d[2 * side + 1] = 0.0
            continue
        p = dot(j[1], T)
        q = dot(j[2], T)
        d[2 * side] = (g * p - f * q) / det
        d[2 * side + 1] = (e * q - f * p) / det


@making
def grown(a: Array) -> Array:
    """Twice the rows."""
    shape = a.shape
    out = np.empty((2 * shape[0], *shape[1:]), a.dtype)
    out[: shape[0]] = a
    return out


@kernel
def subdivide(
    nets_a: Array, nets_b: Array, Ma: Array, Na: Array, Mb: Array, Nb: Array, rational: bool, tol: float,
    small: float, budget: int,
) -> tuple[Array, IntArray]:  # fmt: skip
    """Findings (k, ROW) and counts (pairs judged, nodes of a, nodes of b, pairs left over) of all pairs of pieces."""
    ka, P, Q = nets_a.shape[0], nets_a.shape[1], nets_a.shape[2]
    kb, R, S = nets_b.shape[0], nets_b.shape[1], nets_b.shape[2]
    A = np.empty((2 * ka + 256, P, Q, 4))
    B = np.empty((2 * kb + 256, R, S, 4))
    wide_a = np.empty_like(A)
    wide_b = np.empty_like(B)
    rows_a = np.empty((A.shape[0], BOX))
    rows_b = np.empty((B.shape[0], BOX))
    links_a = np.empty((A.shape[0], 2), np.int64)
    links_b = np.empty((B.shape[0], 2), np.int64)
    line = np.empty((max(Q, S), 4))
    for k in range(ka):
        A[k] = nets_a[k]
        rows_a[k, 0] = rows_a[k, 2] = 0.0
        rows_a[k, 1] = rows_a[k, 3] = 1.0
        describe(A[k], rows_a[k])
        widened(A[k], Ma, Na, line, wide_a[k])
        links_a[k, 0] = -1
        links_a[k, 1] = -1
    for k in range(kb):
        B[k] = nets_b[k]
        rows_b[k, 0] = rows_b[k, 2] = 0.0
        rows_b[k, 1] = rows_b[k, 3] = 1.0
        describe(B[k], rows_b[k])
        widened(B[k], Mb, Nb, line, wide_b[k])
        links_b[k, 0] = -1
        links_b[k, 1] = -1
    used_a = ka
    used_b = kb
    stack = np.empty((1024, 2), np.int64)
    out = np.empty((256, ROW))
    n_out = 0
    judged = 0
    left = 0
    most = max(max(P, Q), max(R, S)) + 1
    found = np.empty((8, 8))
    info = np.zeros(12)
    q = np.empty(3)
    work = (
        np.empty((3, 3)), np.empty(3), np.empty(4), np.empty(4), np.empty(6), np.empty((P, Q, 4)),
        np.empty((R, S, 4)), np.empty((P, Q, 4)), np.empty((R, S, 4)), np.empty((9, 4, 2)), np.empty((9, 4, 2)),
        np.empty((3, 2)), np.empty((3, 2)), np.empty((9, 3, 2)), np.empty((9, 3, 2)), np.empty((2, 2)),
        np.empty((2, 2)), np.empty((6, 2)), np.empty((6, 2)), np.empty((3, 2)), np.empty((3, 2)), np.empty((4, 2)),
        np.empty((4, 2)), np.empty((3, most)), np.empty((3, most)), np.empty((6, 4)), np.empty((6, 3)),
        np.empty((6, 3)), np.empty(6), np.empty(6), np.empty((FRAME, 4)), np.empty((13, 4)),
    )  # fmt: skip
    for first in range(ka):
        for second in range(kb):
            info[7] = min(rows_a[first, 10], rows_b[second, 10])
            stack[0, 0] = first
            stack[0, 1] = second
            top = 1
            while top > 0:
                top -= 1
                a = stack[top, 0]
                b = stack[top, 1]
                ra = rows_a[a]
                rb = rows_b[b]
                if (
                    ra[4] > rb[5] + tol or rb[4] > ra[5] + tol or ra[6] > rb[7] + tol or rb[6] > ra[7] + tol
                    or ra[8] > rb[9] + tol or rb[8] > ra[9] + tol
                ):  # fmt: skip
                    continue
                judged += 1
                if judged > budget:
                    code = BUDGET
                    count = 0
                    left += 1
                else:
                    code, count = judge(
                        nets_a[first], nets_b[second], A[a], B[b], wide_a[a], wide_b[b], ra, rb, rational, tol,
                        small, found, work, info,
                    )  # fmt: skip
                if code == EXCLUDED:
                    continue
                if code == SPLIT:
                    cut = 0 if ra[10] >= rb[10] else 2
                    if info[5] > VAGUER * info[6]:
                        cut = 0
                    elif info[6] > VAGUER * info[5]:
                        cut = 2
                    cut += int(ra[11]) if cut == 0 else int(rb[11])
                    if (
                        info[1] > 0.0 and ra[10] < 4.0 * rb[10] and rb[10] < 4.0 * ra[10]
                    ):  # the longest edge along the direction asked for
                        q[:] = info[2:5]
                        longest = 0.0
                        for k in range(4):
                            e = abs(edge(A[a], k, q)) if k < 2 else abs(edge(B[b], k - 2, q))
                            if e > longest:
                                longest = e
                                cut = k
                    if cut < 2:
                        if links_a[a, cut] < 0:
                            if used_a + 2 > A.shape[0]:
                                A = grown(A)
                                wide_a = grown(wide_a)
                                rows_a = grown(rows_a)
                                links_a = grown(links_a)
                            used_a = children(a, cut, used_a, A, wide_a, rows_a, links_a, Ma, Na, line)
                        one = links_a[a, cut]
                        stack[top, 0] = one
                        stack[top, 1] = b
                        stack[top + 1, 0] = one + 1
                        stack[top + 1, 1] = b
                    else:
                        if links_b[b, cut - 2] < 0:
                            if used_b + 2 > B.shape[0]:
                                B = grown(B)
                                wide_b = grown(wide_b)
                                rows_b = grown(rows_b)
                                links_b = grown(links_b)
                            used_b = children(b, cut - 2, used_b, B, wide_b, rows_b, links_b, Mb, Nb, line)
                        one = links_b[b, cut - 2]
                        stack[top, 0] = a
                        stack[top, 1] = one
                        stack[top + 1, 0] = a
                        stack[top + 1, 1] = one + 1
                    top += 2
                    if top + 4 > stack.shape[0]:
                        stack = grown(stack)
                    continue
                if code == BUDGET and left > 4096:
                    continue
                for k in range(max(count, 1)):
                    if n_out == out.shape[0]:
                        out = grown(out)
                    row = out[n_out]
                    row[0] = code
                    row[1] = first
                    row[2] = second
                    for i in range(4):
                        row[3 + i] = ra[i]
                        row[7 + i] = rb[i]
                    for i in range(8):
                        row[11 + i] = found[k, i] if count > 0 else math.nan
                    row[19] = info[0]
                    if count == 0:
                        for i in range(3):
                            row[15 + i] = 0.25 * (ra[4 + 2 * i] + ra[5 + 2 * i] + rb[4 + 2 * i] + rb[5 + 2 * i])
                        row[18] = max(ra[10], rb[10])
                        if code == SINGULAR and info[11] > 0.0:
                            for i in range(3):
                                row[15 + i] = info[8 + i]
                            row[18] = info[11]
                    n_out += 1
    return out[:n_out].copy(), np.array([judged, used_a, used_b, left])
