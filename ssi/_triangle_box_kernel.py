"""Kernel of `mesh_surface`: what of one box of a surface lies in one triangle, decided by bounds.

A triangle is four planes: its own, G = 0, and three through its sides, E >= 0 inside; on a Bezier piece each is a
polynomial in Bernstein form. Where G is strictly monotone along one parameter and changes sign at most once along each
of the two borders across it, G = 0 is one arc. Where each E has a sign on the arc or is monotone along it (the Jacobian
of G and E has a sign), the triangle cuts one interval out of the arc. Where G is convex, its least value is bounded
from below by a tangent plane: the surface stays off the triangle's plane or touches it in one point. Else: split.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

import numpy as np

from patchwright.models._compile_kernel import inner
from patchwright.models.arrays import Array
from patchwright.ssi._bernstein_kernel import (
    at,
    basis,
    bends,
    local,
    place,
    product,
    root,
    slopes,
    steepness,
    values,
)

SPLIT, EXCLUDED, ARC, POINT, TOUCH, COINCIDENT, LEFT, BUDGET = range(8)
ROW = 15  # of a finding: code, triangle, piece, spare, box (4), first end (2), last end (2), what is at the ends, side
BORDER = 3.0  # an arc ends at the box; 0, 1, 2 at a side of the triangle
TURN = 0.5  # least cosine between an arc's chord and its parts


@inner
def half_line(c: Array, sign: float, eps: float, line: Array, b: Array, ends: Array) -> bool:
    """Narrow `ends` to where sign * c <= 0 along a border; False where that may be more than one interval."""
    count = c.shape[0]
    first = 0.0
    last = 0.0
    changes = 0
    for i in range(count):
        x = sign * c[i]
        line[i] = x
        if abs(x) > eps:
            if first == 0.0:
                first = x
            elif (x > 0.0) != (last > 0.0):
                changes += 1
            last = x
    if changes > 1:
        return False
    if changes == 0:
        if first > 0.0:
            ends[1] = -1.0
        return True
    if abs(line[0]) <= eps:
        line[0] = math.copysign(eps, first)
    if abs(line[count - 1]) <= eps:
        line[count - 1] = math.copysign(eps, last)
    at = root(line, count, b)
    if first > 0.0:
        ends[0] = max(ends[0], at)
    else:
        ends[1] = min(ends[1], at)
    return True


@inner
def foot(G: Array, sign: float, t: float, eps: float, line: Array, b: Array) -> float:
    """s with G(t, s) = 0; sign * G rises with s."""
    n = G.shape[0]
    m = G.shape[1]
    for _ in range(2):
        basis(n, t, b)
        most = 0.0
        for j in range(m):
            x = 0.0
            for i in range(n):
                x += b[i] * G[i, j]
            line[j] = sign * x
            most = max(most, abs(x))
        if most > eps:
            break
        t += 1e-6 if t < 0.5 else -1e-6  # at a pole: the limit
    if line[0] >= 0.0:
        return 0.0
    if line[m - 1] <= 0.0:
        return 1.0
    return root(line, m, b)


@inner
def side_root(
    G: Array, E: Array, sign: float, ta: float, tb: float, ea: float, eb: float, eps: float, line: Array, b: Array
) -> float:  # fmt: skip
    """Where E changes sign along the arc G = 0 between ta and tb; an end where it is zero is the place."""
    if ea == 0.0:
        return ta
    if eb == 0.0:
        return tb
    low = ta
    high = tb
    f = ea
    g = eb
    side = 0
    for step in range(100):
        t = (low * g - high * f) / (g - f)
        if step % 4 == 3 or not low < t < high:
            t = 0.5 * (low + high)
            side = 0
        if t <= low or t >= high:
            break
        value = at(E, t, foot(G, sign, t, eps, line, b), line, b)
        if value == 0.0:
            return t
        if (value > 0.0) == (g > 0.0):
            high = t
            g = value
            if side == 1:
                f *= 0.5
            side = 1
        else:
            low = t
            f = value
            if side == -1:
                g *= 0.5
            side = -1
        if high - low < 1e-16:
            break
    return 0.5 * (low + high)


@inner
def point_like(net: Array, axis: int, last: bool, eps: float) -> bool:
    """Whether the border across an axis at its first or last value is one point: a pole."""
    n = net.shape[1] if axis == 0 else net.shape[0]
    k = (net.shape[0] + net.shape[1] - n - 1) if last else 0
    for i in range(1, n):
        for c in range(3):
            if axis == 0:
                x = net[k, i, c] / net[k, i, 3] - net[k, 0, c] / net[k, 0, 3]
            else:
                x = net[i, k, c] / net[i, k, 3] - net[0, k, c] / net[0, k, 3]
            if abs(x) > 16.0 * eps:
                return False
    return True


@inner
def straight(net: Array, G: Array, sign: float, axis: int, lo: float, hi: float, eps: float, size: float, work) -> bool:
    """Whether an arc's parts all run within the allowed turn of its chord."""
    line, b, d, x = work
    for k in range(5):
        t = lo + 0.25 * k * (hi - lo)
        s = foot(G, sign, t, eps, line, b)
        if axis == 1:
            place(net, t, s, x[k], b, d)
        else:
            place(net, s, t, x[k], b, d)
    chord = 0.0
    for c in range(3):
        chord += (x[4, c] - x[0, c]) ** 2
    chord = math.sqrt(chord)
    if chord <= 1e-9 * size:
        return True
    for k in range(4):
        dot = 0.0
        own = 0.0
        for c in range(3):
            w = x[k + 1, c] - x[k, c]
            dot += w * (x[4, c] - x[0, c])
            own += w * w
        if dot < TURN * math.sqrt(own) * chord:
            return False
    return True


@inner
def crossing(
    net: Array, C: Array, axis: int, goes_on: bool, tol: float, eps: float, size: float, small: float, row: Array, work
) -> int:  # fmt: skip
    """The interval of the one arc that lies in the triangle. `C` (5, n, m): G, the three E, scratch."""
    line, b, d, x, ends, g, e = work
    G = C[0]
    R = C[4]
    t_axis = np.int64(0)
    s_axis = np.int64(1)
    n = G.shape[0]
    m = G.shape[1]
    slopes(G, s_axis, g[2:4])
    sign = 1.0 if g[2] + g[3] > 0.0 else -1.0
    # weakly monotone polynomials are strictly so unless constant: that may be at a pole only
    most = -math.inf
    pole = False
    for i in range(n):
        rise = sign * (G[i, m - 1] - G[i, 0])
        most = max(most, rise)
        if rise < -eps:
            return SPLIT
        if rise <= eps and (i == 0 or i == n - 1):
            if not point_like(net, 1 - axis, i > 0, eps):
                return SPLIT
            pole |= abs(G[i, 0]) <= eps
    if most <= 4.0 * eps:
        return SPLIT
    if goes_on:  # an arc along the far border is the next box's
        most = 0.0
        for i in range(n):
            most = max(most, abs(G[i, m - 1]))
        if most <= eps:
            return EXCLUDED
    ends[0] = 0.0
    ends[1] = 1.0
    if not half_line(G[:, 0], sign, eps, line, b, ends):
        return SPLIT
    if not half_line(G[:, m - 1], -sign, eps, line, b, ends):
        return SPLIT
    if ends[1] <= ends[0]:
        return SPLIT if pole else EXCLUDED
    slopes(G, t_axis, g[0:2])
    ta = ends[0]
    tb = ends[1]
    lo = ta
    hi = tb
    first = BORDER
    last = BORDER
    out = False
    grazes = False
    sa = foot(G, sign, ta, eps, line, b)
    sb = foot(G, sign, tb, eps, line, b)
    for k in range(1, 4):
        E = C[k]
        low = math.inf
        for i in range(n):
            for j in range(m):
                low = min(low, E[i, j])
        if low >= 0.0:
            continue
        slopes(E, t_axis, e[0:2])
        slopes(E, s_axis, e[2:4])
        # on the arc E is E - f G: with the right f its range is that of its bend only
        gt = 0.5 * (g[0] + g[1])
        gs = 0.5 * (g[2] + g[3])
        f = (0.5 * (e[0] + e[1]) * gt + 0.5 * (e[2] + e[3]) * gs) / (gt * gt + gs * gs)
        low = math.inf
        high = -math.inf
        for i in range(n):
            for j in range(m):
                R[i, j] = E[i, j] - f * G[i, j]
                low = min(low, R[i, j])
                high = max(high, R[i, j])
        if high < -tol:
            return EXCLUDED
        if low >= -tol:
            if high <= tol:
                row[14] = k - 1.0  # along the side
            continue
        slopes(R, t_axis, e[0:2])
        slopes(R, s_axis, e[2:4])
        # the Jacobian g_t e_s - g_s e_t
        product(g[0], g[1], e[2], e[3], x[0])
        product(g[2], g[3], e[0], e[1], x[1])
        if x[0, 0] - x[1, 1] <= 0.0 <= x[0, 1] - x[1, 0]:
            if high > tol:
                return SPLIT
            grazes = True
            continue
        ea = at(E, ta, sa, line, b)
        eb = at(E, tb, sb, line, b)
        if ea < 0.0 and eb < 0.0:
            if max(ea, eb) < -tol:
                return EXCLUDED
            out = True
            lo = hi = ta if ea > eb else tb
        elif ea < 0.0 or eb < 0.0:
            t = side_root(G, E, sign, ta, tb, ea, eb, eps, line, b)
            if ea < 0.0 and t > lo:
                lo = t
                first = k - 1.0
            elif eb < 0.0 and t < hi:
                hi = t
                last = k - 1.0
    if hi <= lo or out or grazes:
        # a point of the arc within tolerance of the triangle
        t = min(max(0.5 * (lo + hi), ta), tb)
        s = foot(G, sign, t, eps, line, b)
        for k in range(1, 4):
            if at(C[k], t, s, line, b) < -tol:
                return SPLIT if grazes and size > small else EXCLUDED
        row[8] = row[10] = t
        row[9] = row[11] = s
        return POINT
    if size > small and not straight(net, G, sign, axis, lo, hi, eps, size, (line, b, d, x)):
        return SPLIT
    row[8] = lo
    row[10] = hi
    for k in range(2):
        row[9 + 2 * k] = foot(G, sign, row[8 + 2 * k], eps, line, b)
    row[12] = first
    row[13] = last
    return ARC


@inner
def touching(C: Array, tol: float, row: Array, work) -> int:
    """Convex G, or concave: off the plane, or touching it at one place."""
    b, bend, jet, rows = work
    G = C[0]
    if G.shape[0] < 3 or G.shape[1] < 3:
        return SPLIT
    bends(G, bend)
    if bend[0] > 0.0 and bend[4] > 0.0:
        sign = 1.0
    elif bend[1] < 0.0 and bend[5] < 0.0:
        sign = -1.0
    else:
        return SPLIT
    most = max(abs(bend[2]), abs(bend[3]))
    if min(abs(bend[0]), abs(bend[1])) * min(abs(bend[4]), abs(bend[5])) <= most * most:
        return SPLIT
    u = 0.5
    v = 0.5
    h = 1e-3
    value = 0.0
    du = 0.0
    dv = 0.0
    for _ in range(20):
        local(G, u, v, jet, b, rows)
        value = sign * jet[0]
        du = sign * jet[1]
        dv = sign * jet[2]
        uu = sign * jet[3]
        uv = sign * jet[4]
        vv = sign * jet[5]
        det = uu * vv - uv * uv
        nu = u - (vv * du - uv * dv) / det
        nv = v - (uu * dv - uv * du) / det
        if nu < 0.0 or nu > 1.0:
            nu = min(max(nu, 0.0), 1.0)
            nv = v - (dv + uv * (nu - u)) / vv
        if nv < 0.0 or nv > 1.0:
            nv = min(max(nv, 0.0), 1.0)
            nu = min(max(u - (du + uv * (nv - v)) / uu, 0.0), 1.0)
        h = max(abs(nu - u), abs(nv - v))
        if h < 1e-14:
            break
        u = nu
        v = nv
    # convex: nowhere below the tangent plane
    least = value + min(-u * du, (1.0 - u) * du) + min(-v * dv, (1.0 - v) * dv)
    if least > tol:
        return EXCLUDED
    if least < -tol:
        return SPLIT
    row[8] = row[10] = u
    row[9] = row[11] = v
    return TOUCH


@inner
def judge(
    net: Array, planes: Array, C: Array, F: Array, light: float, heavy: float, tol: float, eps: float, size: float,
    small: float, on_u: bool, on_v: bool, row: Array, work, touch,
) -> int:  # fmt: skip
    """What of a box lies in one triangle.

    `light` and `heavy` are the least and largest weight; `on_u`, `on_v` whether the surface goes on beyond.
    """
    row[3] = 0.0
    row[14] = BORDER
    u_axis = np.int64(0)
    v_axis = np.int64(1)
    below = True
    above = True
    flat = True
    values(net, planes[0], u_axis, C[0])
    for i in range(net.shape[0]):
        for j in range(net.shape[1]):
            c = C[0, i, j]
            w = tol * net[i, j, 3]
            below &= c < -w
            above &= c > w
            flat &= -w <= c <= w
    if below or above:
        return EXCLUDED
    for k in range(1, 4):
        values(net, planes[k], u_axis, C[k])
        outside = True
        for i in range(net.shape[0]):
            for j in range(net.shape[1]):
                outside &= C[k, i, j] < -tol * heavy
        if outside:
            return EXCLUDED
    if flat:
        return COINCIDENT
    slopes(C[0], u_axis, work[5])
    in_u = steepness(work[5], eps)
    slopes(C[0], v_axis, work[5])
    in_v = steepness(work[5], eps)
    code = SPLIT
    for turn in range(2):
        axis = 1 if (in_v >= in_u) == (turn == 0) else 0
        if (in_v if axis == 1 else in_u) <= 0.0:
            continue
        if axis == 1:
            code = crossing(net, C, v_axis, on_v, tol * light, eps, size, small, row, work)
        else:
            for k in range(4):
                values(net, planes[k], v_axis, F[k])
            code = crossing(net, F, u_axis, on_u, tol * light, eps, size, small, row, work)
            row[8], row[9] = row[9], row[8]
            row[10], row[11] = row[11], row[10]
        if code != SPLIT:
            return code
    if in_u <= 0.0 and in_v <= 0.0:
        return touching(C, tol * light, row, touch)
    return SPLIT
