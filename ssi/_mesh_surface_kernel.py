"""Kernel of `mesh_surface`: subdivision of a surface against triangles until every pair is excluded or explained.

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

from patchwright.models._compile_kernel import inner, kernel
from patchwright.models.arrays import Array, BoolArray, IntArray

SPLIT, EXCLUDED, ARC, POINT, TOUCH, COINCIDENT, LEFT, BUDGET = range(8)
ROW = 15  # of a finding: code, triangle, piece, spare, box (4), first end (2), last end (2), what is at the ends, side
BORDER = 3.0  # an arc ends at the box; 0, 1, 2 at a side of the triangle
DEEP = 160  # halvings at most: two parameters down to the last bit
TURN = 0.5  # least cosine between an arc's chord and its parts


@inner
def values(net: Array, plane: Array, flip: int, out: Array) -> None:
    """Bernstein coefficients of the plane's equation over a net, times the weight; `flip` 1 exchanges u and v."""
    for i in range(net.shape[0]):
        for j in range(net.shape[1]):
            c = plane[0] * net[i, j, 0] + plane[1] * net[i, j, 1] + plane[2] * net[i, j, 2] + plane[3] * net[i, j, 3]
            if flip == 1:
                out[j, i] = c
            else:
                out[i, j] = c


@inner
def slopes(c: Array, axis: int, out: Array) -> None:
    """Least and largest coefficient of the derivative along an axis."""
    n = c.shape[0]
    m = c.shape[1]
    low = math.inf
    high = -math.inf
    if axis == 0:
        for i in range(n - 1):
            for j in range(m):
                d = (n - 1) * (c[i + 1, j] - c[i, j])
                low = min(low, d)
                high = max(high, d)
    else:
        for i in range(n):
            for j in range(m - 1):
                d = (m - 1) * (c[i, j + 1] - c[i, j])
                low = min(low, d)
                high = max(high, d)
    out[0] = low
    out[1] = high


@inner
def steepness(g: Array, eps: float) -> float:
    """Least slope over the largest where both have one sign, but for round-off; 0 where not."""
    low = g[0]
    high = g[1]
    if low >= -eps and high > 4.0 * eps:
        return max(low, eps) / high
    if high <= eps and low < -4.0 * eps:
        return min(high, -eps) / low
    return 0.0


@inner
def product(a: float, b: float, c: float, d: float, out: Array) -> None:
    """Ends of the interval [a, b] times [c, d]."""
    out[0] = min(min(a * c, a * d), min(b * c, b * d))
    out[1] = max(max(a * c, a * d), max(b * c, b * d))


@inner
def bends(c: Array, out: Array) -> None:
    """Ranges of the second derivatives: uu, uv, vv."""
    n = c.shape[0]
    m = c.shape[1]
    for k in range(3):
        out[2 * k] = math.inf
        out[2 * k + 1] = -math.inf
    for i in range(n):
        for j in range(m):
            if i < n - 2:
                d = (n - 1) * (n - 2) * (c[i + 2, j] - 2.0 * c[i + 1, j] + c[i, j])
                out[0] = min(out[0], d)
                out[1] = max(out[1], d)
            if i < n - 1 and j < m - 1:
                d = (n - 1) * (m - 1) * (c[i + 1, j + 1] - c[i + 1, j] - c[i, j + 1] + c[i, j])
                out[2] = min(out[2], d)
                out[3] = max(out[3], d)
            if j < m - 2:
                d = (m - 1) * (m - 2) * (c[i, j + 2] - 2.0 * c[i, j + 1] + c[i, j])
                out[4] = min(out[4], d)
                out[5] = max(out[5], d)


@inner
def basis(count: int, t: float, b: Array) -> None:
    """Bernstein polynomials of degree count - 1 at t."""
    b[0] = 1.0
    for k in range(1, count):
        saved = 0.0
        for i in range(k):
            left = b[i]
            b[i] = saved + (1.0 - t) * left
            saved = t * left
        b[k] = saved


@inner
def along(c: Array, count: int, s: float, b: Array) -> float:
    """A polynomial of `count` coefficients at s."""
    basis(count, s, b)
    value = 0.0
    for i in range(count):
        value += b[i] * c[i]
    return value


@inner
def root(c: Array, count: int, b: Array) -> float:
    """Where a polynomial that changes sign once on [0, 1] does: regula falsi kept within a bracket, and bisection."""
    low = 0.0
    high = 1.0
    f = c[0]
    g = c[count - 1]
    if f == 0.0:
        return 0.0
    if g == 0.0:
        return 1.0
    side = 0
    for step in range(100):
        t = (low * g - high * f) / (g - f)
        if step % 4 == 3 or not low < t < high:
            t = 0.5 * (low + high)
            side = 0
        if t <= low or t >= high:
            break
        value = along(c, count, t, b)
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
def at(C: Array, t: float, s: float, line: Array, b: Array) -> float:
    """A polynomial at (t, s)."""
    n = C.shape[0]
    m = C.shape[1]
    basis(n, t, b)
    for j in range(m):
        x = 0.0
        for i in range(n):
            x += b[i] * C[i, j]
        line[j] = x
    return along(line, m, s, b)


@inner
def place(net: Array, u: float, v: float, x: Array, b: Array, d: Array) -> None:
    """(x, y, z, weight) at (u, v)."""
    basis(net.shape[0], u, b)
    basis(net.shape[1], v, d)
    for c in range(4):
        x[c] = 0.0
    for i in range(net.shape[0]):
        for j in range(net.shape[1]):
            for c in range(4):
                x[c] += b[i] * d[j] * net[i, j, c]
    for c in range(3):
        x[c] /= x[3]


@inner
def side_root(
    G: Array, E: Array, sign: float, ta: float, tb: float, ea: float, eb: float, eps: float, line: Array, b: Array
) -> float:  # fmt: skip
    """Where E changes sign along the arc G = 0 between ta and tb."""
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
def local(C: Array, u: float, v: float, out: Array, b: Array, rows: Array) -> None:
    """Value, first and second derivatives (., u, v, uu, uv, vv) of a polynomial of degree 2 or more in both."""
    n = C.shape[0]
    m = C.shape[1]
    for r in range(3):
        basis(n - r, u, b)
        for j in range(m):
            x = 0.0
            for i in range(n - r):
                if r == 0:
                    c = C[i, j]
                elif r == 1:
                    c = (n - 1) * (C[i + 1, j] - C[i, j])
                else:
                    c = (n - 1) * (n - 2) * (C[i + 2, j] - 2.0 * C[i + 1, j] + C[i, j])
                x += b[i] * c
            rows[r, j] = x
    for k in range(6):
        r = 0 if k == 0 or k == 2 or k == 5 else (2 if k == 3 else 1)
        s = 2 if k == 5 else (1 if k == 2 or k == 4 else 0)
        basis(m - s, v, b)
        x = 0.0
        for j in range(m - s):
            if s == 0:
                c = rows[r, j]
            elif s == 1:
                c = (m - 1) * (rows[r, j + 1] - rows[r, j])
            else:
                c = (m - 1) * (m - 2) * (rows[r, j + 2] - 2.0 * rows[r, j + 1] + rows[r, j])
            x += b[j] * c
        out[k] = x


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


@kernel
def meet(
    nets: Array, goes_on: BoolArray, first: IntArray, candidates: IntArray, planes: Array, boxes: Array, tol: float,
    eps: float, small: float, budget: int,
) -> tuple[Array, int]:  # fmt: skip
    """Findings (k, ROW) of all pieces and their candidates, and how many pairs were judged.

    Parameters
    ----------
    nets : (k, p + 1, q + 1, 4) homogeneous; weights near 1
    goes_on : (k, 2) whether there is surface beyond the far border in u, in v
    candidates : triangles of piece i are `candidates[first[i]:first[i + 1]]`
    planes : (m, 4, 4) the planes of each triangle, unit normals; boxes (m, 2, 3)
    tol, eps, small : lengths in the scale of the nets: of touch, of round-off, of the least box
    """
    P = nets.shape[1]
    Q = nets.shape[2]
    stack = np.empty((DEEP + 2, P, Q, 4))
    domain = np.empty((DEEP + 2, 4))
    spans = np.empty((DEEP + 2, 2), np.int64)
    lists = np.empty(4 * candidates.shape[0] + 1024, np.int64)
    out = np.empty((256, ROW))
    count = 0
    judged = 0
    most = max(P, Q) + 1
    C = np.empty((5, P, Q))  # the last is scratch
    F = np.empty((5, Q, P))
    row = np.empty(ROW)
    line = np.empty(most)
    b = np.empty(most)
    work = (line, b, np.empty(most), np.empty((5, 4)), np.empty(2), np.empty(4), np.empty(4))
    touch = (b, np.empty(6), np.empty(6), np.empty((3, most)))
    box = np.empty((2, 3))
    for piece in range(nets.shape[0]):
        if first[piece] == first[piece + 1]:
            continue
        total = first[piece + 1] - first[piece]
        for k in range(total):
            lists[k] = candidates[first[piece] + k]
        copied(nets[piece], stack[0])
        domain[0, 0] = domain[0, 2] = 0.0
        domain[0, 1] = domain[0, 3] = 1.0
        spans[0, 0] = 0
        spans[0, 1] = total
        top = 1
        while top > 0:
            top -= 1
            net = stack[top]
            low_list = spans[top, 0]
            high_list = spans[top, 1]
            light = math.inf
            heavy = 0.0
            for c in range(3):
                box[0, c] = math.inf
                box[1, c] = -math.inf
            for i in range(P):
                for j in range(Q):
                    w = net[i, j, 3]
                    light = min(light, w)
                    heavy = max(heavy, w)
                    for c in range(3):
                        x = net[i, j, c] / w
                        box[0, c] = min(box[0, c], x)
                        box[1, c] = max(box[1, c], x)
            size = math.sqrt((box[1, 0] - box[0, 0]) ** 2 + (box[1, 1] - box[0, 1]) ** 2 + (box[1, 2] - box[0, 2]) ** 2)
            if lists.shape[0] < 2 * high_list - low_list:
                wider = np.empty(2 * (2 * high_list - low_list), np.int64)
                for k in range(high_list):
                    wider[k] = lists[k]
                lists = wider
            on_u = goes_on[piece, 0] or domain[top, 1] < 1.0
            on_v = goes_on[piece, 1] or domain[top, 3] < 1.0
            kept = high_list
            for index in range(low_list, high_list):
                t = lists[index]
                apart = False
                for c in range(3):
                    apart |= box[0, c] > boxes[t, 1, c] + tol or boxes[t, 0, c] > box[1, c] + tol
                if apart:
                    continue
                judged += 1
                if judged > budget:
                    code = BUDGET
                else:
                    code = judge(
                        net, planes[t], C, F, light, heavy, tol, eps, size, small, on_u, on_v, row, work, touch
                    )  # fmt: skip
                if code == EXCLUDED:
                    continue
                if code == SPLIT:
                    if size > small and top + 2 < DEEP:
                        lists[kept] = t
                        kept += 1
                        continue
                    code = LEFT
                if code == BUDGET and judged > budget + 1:
                    continue
                if count == out.shape[0]:
                    wider_out = np.empty((2 * count, ROW))
                    for k in range(count):
                        for c in range(ROW):
                            wider_out[k, c] = out[k, c]
                    out = wider_out
                row[0] = code
                row[1] = t
                row[2] = piece
                for k in range(4):
                    row[4 + k] = domain[top, k]
                if ARC <= code <= TOUCH:
                    for k in range(4):
                        a = 2 * (k % 2)
                        row[8 + k] = domain[top, a] + row[8 + k] * (domain[top, a + 1] - domain[top, a])
                for k in range(ROW):
                    out[count, k] = row[k]
                count += 1
            if kept == high_list:
                continue
            # halve along the longer direction
            axis = 0 if reach(net, np.int64(0)) >= reach(net, np.int64(1)) else 1
            left = stack[top]
            right = stack[top + 1]
            halve(left, right, axis)
            for k in range(4):
                domain[top + 1, k] = domain[top, k]
            middle = 0.5 * (domain[top, 2 * axis] + domain[top, 2 * axis + 1])
            domain[top, 2 * axis + 1] = middle
            domain[top + 1, 2 * axis] = middle
            for k in range(2):
                spans[top + k, 0] = high_list
                spans[top + k, 1] = kept
            top += 2
    return out[:count], judged


@inner
def reach(net: Array, axis: int) -> float:
    """Longest row of the net along an axis."""
    n = net.shape[0] if axis == 0 else net.shape[1]
    longest = 0.0
    for j in range(net.shape[0] + net.shape[1] - n):
        total = 0.0
        for i in range(n - 1):
            d = 0.0
            for c in range(3):
                if axis == 0:
                    x = net[i + 1, j, c] / net[i + 1, j, 3] - net[i, j, c] / net[i, j, 3]
                else:
                    x = net[j, i + 1, c] / net[j, i + 1, 3] - net[j, i, c] / net[j, i, 3]
                d += x * x
            total += math.sqrt(d)
        longest = max(longest, total)
    return longest


@inner
def copied(net: Array, out: Array) -> None:
    """`net` in `out`."""
    for i in range(net.shape[0]):
        for j in range(net.shape[1]):
            for c in range(4):
                out[i, j, c] = net[i, j, c]


@inner
def halve(net: Array, right: Array, axis: int) -> None:
    """De Casteljau at 1/2: `net` becomes the first half."""
    P = net.shape[0]
    Q = net.shape[1]
    copied(net, right)
    if axis == 0:
        for j in range(Q):
            for c in range(4):
                for r in range(1, P):
                    for i in range(P - r):
                        right[i, j, c] = 0.5 * (right[i, j, c] + right[i + 1, j, c])
                    net[r, j, c] = right[0, j, c]
    else:
        for i in range(P):
            for c in range(4):
                for r in range(1, Q):
                    for j in range(Q - r):
                        right[i, j, c] = 0.5 * (right[i, j, c] + right[i, j + 1, c])
                    net[i, r, c] = right[i, 0, c]
