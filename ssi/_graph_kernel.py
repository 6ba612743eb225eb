"""Two pieces as graphs over a common plane: rigorous second-derivative bounds, and the difference f = z_a - z_b.

Where the normals of two pieces stay on one side of a plane, both are graphs z(x, y) over it and their intersection is
the zero set of f. Bernstein nets bound the derivatives of the pieces on widened boxes; interval arithmetic turns them
into bounds of the graphs' second derivatives, so f and its gradient are known to second order with a remainder.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

import numpy as np

from patchwright.models._compile_kernel import inner, kernel
from patchwright.models.arrays import Array
from patchwright.ssi._jet_kernel import dot, jets
from patchwright.ssi.bezier_pieces import MARGIN


@inner
def times(a0: float, a1: float, b0: float, b1: float) -> tuple[float, float]:
    """The product of two intervals."""
    p = a0 * b0
    q = a0 * b1
    r = a1 * b0
    s = a1 * b1
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))


@inner
def scaled(k: float, a: Array) -> tuple[float, float]:
    """The multiple of an interval."""
    if k >= 0.0:
        return k * a[0], k * a[1]
    return k * a[1], k * a[0]


@inner
def rotated(net: Array, frame: Array, c: Array, out: Array) -> None:
    """out[i, j] = homogeneous coordinates along the rows of frame, from the point c."""
    for i in range(net.shape[0]):
        for j in range(net.shape[1]):
            w = net[i, j, 3]
            x = net[i, j, 0] - w * c[0]
            y = net[i, j, 1] - w * c[1]
            z = net[i, j, 2] - w * c[2]
            for k in range(3):
                out[i, j, k] = frame[k, 0] * x + frame[k, 1] * y + frame[k, 2] * z
            out[i, j, 3] = w


@inner
def derivative_bounds(R: Array, rational: bool, D: Array, S: Array) -> bool:
    """D[0..4, c] = intervals of the derivatives u, v, uu, uv, vv of coordinate c over the net's box."""
    P = R.shape[0]
    Q = R.shape[1]
    p = float(P - 1)
    q = float(Q - 1)
    width = 4 if rational else 3
    for c in range(width):
        a0 = b0 = c0 = d0 = e0 = math.inf
        a1 = b1 = c1 = d1 = e1 = -math.inf
        for i in range(P):
            for j in range(Q):
                x = R[i, j, c]
                if i + 1 < P:
                    y = R[i + 1, j, c] - x
                    a0 = min(a0, y)
                    a1 = max(a1, y)
                    if j + 1 < Q:
                        z = R[i + 1, j + 1, c] - R[i, j + 1, c] - y
                        d0 = min(d0, z)
                        d1 = max(d1, z)
                    if i + 2 < P:
                        z = R[i + 2, j, c] - R[i + 1, j, c] - y
                        c0 = min(c0, z)
                        c1 = max(c1, z)
                if j + 1 < Q:
                    y = R[i, j + 1, c] - x
                    b0 = min(b0, y)
                    b1 = max(b1, y)
                    if j + 2 < Q:
                        z = R[i, j + 2, c] - R[i, j + 1, c] - y
                        e0 = min(e0, z)
                        e1 = max(e1, z)
        if P < 3:
            c0 = c1 = 0.0
        if Q < 3:
            e0 = e1 = 0.0
        D[0, c, 0] = p * a0
        D[0, c, 1] = p * a1
        D[1, c, 0] = q * b0
        D[1, c, 1] = q * b1
        D[2, c, 0] = p * (p - 1.0) * c0
        D[2, c, 1] = p * (p - 1.0) * c1
        D[3, c, 0] = p * q * d0
        D[3, c, 1] = p * q * d1
        D[4, c, 0] = q * (q - 1.0) * e0
        D[4, c, 1] = q * (q - 1.0) * e1
    if not rational:
        return True
    w0 = math.inf
    w1 = -math.inf
    for i in range(P):
        for j in range(Q):
            w0 = min(w0, R[i, j, 3])
            w1 = max(w1, R[i, j, 3])
    if w0 <= 0.2 * w1:
        return False
    for c in range(3):
        S[c, 0] = math.inf
        S[c, 1] = -math.inf
        for i in range(P):
            for j in range(Q):
                x = R[i, j, c] / R[i, j, 3]
                S[c, 0] = min(S[c, 0], x)
                S[c, 1] = max(S[c, 1], x)
    r0 = 1.0 / w1
    r1 = 1.0 / w0
    for c in range(3):
        for k in range(2):  # S_u = (X_u - S w_u) / w
            a0, a1 = times(S[c, 0], S[c, 1], D[k, 3, 0], D[k, 3, 1])
            D[k, c, 0], D[k, c, 1] = times(D[k, c, 0] - a1, D[k, c, 1] - a0, r0, r1)
        for k in range(3):  # S_uu = (X_uu - 2 S_u w_u - S w_uu) / w, S_uv with S_u w_v + S_v w_u
            f = 0 if k < 2 else 1
            g = 0 if k == 0 else 1
            a0, a1 = times(D[f, c, 0], D[f, c, 1], D[g, 3, 0], D[g, 3, 1])
            b0, b1 = times(D[g, c, 0], D[g, c, 1], D[f, 3, 0], D[f, 3, 1])
            c0, c1 = times(S[c, 0], S[c, 1], D[2 + k, 3, 0], D[2 + k, 3, 1])
            lo = D[2 + k, c, 0] - a1 - b1 - c1
            hi = D[2 + k, c, 1] - a0 - b0 - c0
            D[2 + k, c, 0], D[2 + k, c, 1] = times(lo, hi, r0, r1)
    return True


@inner
def graph_bounds(
    R: Array, rational: bool, D: Array, S: Array, G: Array, K: Array, E: Array, H: Array
) -> bool:  # fmt: skip
    """H[0..2] = intervals of z_xx, z_xy, z_yy over the box of the rotated net R; False where it is no graph.

    K = 2 x 2 inverse of the mid Jacobian of (x, y), which the parameters are first straightened with; E = intervals of
    z_x, z_y and of the derivatives a_x, a_y, b_x, b_y of the straightened parameters.
    """
    if not derivative_bounds(R, rational, D, S):
        return False
    xu = 0.5 * (D[0, 0, 0] + D[0, 0, 1])
    xv = 0.5 * (D[1, 0, 0] + D[1, 0, 1])
    yu = 0.5 * (D[0, 1, 0] + D[0, 1, 1])
    yv = 0.5 * (D[1, 1, 0] + D[1, 1, 1])
    det = xu * yv - xv * yu
    if det * det <= 1e-12 * (xu * xu + yu * yu) * (xv * xv + yv * yv) or det == 0.0:
        return False
    K[0, 0] = yv / det
    K[0, 1] = -xv / det
    K[1, 0] = -yu / det
    K[1, 1] = xu / det
    for c in range(3):  # G: derivatives by the straightened parameters a, b with (u, v) = K (a, b)
        for k in range(2):
            a0, a1 = scaled(K[0, k], D[0, c])
            b0, b1 = scaled(K[1, k], D[1, c])
            G[k, c, 0] = a0 + b0
            G[k, c, 1] = a1 + b1
        for k in range(3):
            f = 0 if k < 2 else 1
            g = 0 if k == 0 else 1
            a0, a1 = scaled(K[0, f] * K[0, g], D[2, c])
            b0, b1 = scaled(K[0, f] * K[1, g] + K[1, f] * K[0, g], D[3, c])
            c0, c1 = scaled(K[1, f] * K[1, g], D[4, c])
            G[2 + k, c, 0] = a0 + b0 + c0
            G[2 + k, c, 1] = a1 + b1 + c1
    p0, p1 = times(G[0, 0, 0], G[0, 0, 1], G[1, 1, 0], G[1, 1, 1])
    q0, q1 = times(G[1, 0, 0], G[1, 0, 1], G[0, 1, 0], G[0, 1, 1])
    d0 = p0 - q1
    d1 = p1 - q0
    if d0 < 0.1:
        return False
    r0 = 1.0 / d1
    r1 = 1.0 / d0
    # slopes z_x = (z_a y_b - z_b y_a) / D, z_y = (z_b x_a - z_a x_b) / D
    p0, p1 = times(G[0, 2, 0], G[0, 2, 1], G[1, 1, 0], G[1, 1, 1])
    q0, q1 = times(G[1, 2, 0], G[1, 2, 1], G[0, 1, 0], G[0, 1, 1])
    zx0, zx1 = times(p0 - q1, p1 - q0, r0, r1)
    p0, p1 = times(G[1, 2, 0], G[1, 2, 1], G[0, 0, 0], G[0, 0, 1])
    q0, q1 = times(G[0, 2, 0], G[0, 2, 1], G[1, 0, 0], G[1, 0, 1])
    zy0, zy1 = times(p0 - q1, p1 - q0, r0, r1)
    for k in range(3):  # W = z_aa - z_x x_aa - z_y y_aa, kept in G[2 + k, 2]
        p0, p1 = times(zx0, zx1, G[2 + k, 0, 0], G[2 + k, 0, 1])
        q0, q1 = times(zy0, zy1, G[2 + k, 1, 0], G[2 + k, 1, 1])
        G[2 + k, 2, 0] -= p1 + q1
        G[2 + k, 2, 1] -= p0 + q0
    ax0, ax1 = times(G[1, 1, 0], G[1, 1, 1], r0, r1)
    ay0, ay1 = times(-G[1, 0, 1], -G[1, 0, 0], r0, r1)
    bx0, bx1 = times(-G[0, 1, 1], -G[0, 1, 0], r0, r1)
    by0, by1 = times(G[0, 0, 0], G[0, 0, 1], r0, r1)
    E[0, 0], E[0, 1], E[1, 0], E[1, 1] = zx0, zx1, zy0, zy1
    E[2, 0], E[2, 1], E[3, 0], E[3, 1] = ax0, ax1, ay0, ay1
    E[4, 0], E[4, 1], E[5, 0], E[5, 1] = bx0, bx1, by0, by1
    for k in range(3):  # P^T W P
        f0, f1, g0, g1 = (ax0, ax1, bx0, bx1) if k < 2 else (ay0, ay1, by0, by1)
        s0, s1, t0, t1 = (ax0, ax1, bx0, bx1) if k == 0 else (ay0, ay1, by0, by1)
        p0, p1 = times(f0, f1, s0, s1)
        lo, hi = times(p0, p1, G[2, 2, 0], G[2, 2, 1])
        p0, p1 = times(f0, f1, t0, t1)
        q0, q1 = times(g0, g1, s0, s1)
        p0, p1 = times(p0 + q0, p1 + q1, G[3, 2, 0], G[3, 2, 1])
        lo += p0
        hi += p1
        p0, p1 = times(g0, g1, t0, t1)
        p0, p1 = times(p0, p1, G[4, 2, 0], G[4, 2, 1])
        H[k, 0] = lo + p0
        H[k, 1] = hi + p1
    return True


@inner
def third_derivative_bounds(R: Array, rational: bool, D: Array, S: Array) -> None:
    """D[5..8, c] = intervals of the derivatives uuu, uuv, uvv, vvv; D[0..4] and S are those of the lower ones."""
    P = R.shape[0]
    Q = R.shape[1]
    p = float(P - 1)
    q = float(Q - 1)
    width = 4 if rational else 3
    for c in range(width):
        for k in range(4):
            m = 3 - k
            D[5 + k, c, 0] = D[5 + k, c, 1] = 0.0
            if m >= P or k >= Q:
                continue
            lo = math.inf
            hi = -math.inf
            for i in range(P - m):
                for j in range(Q - k):
                    if k == 0:
                        x = R[i + 3, j, c] - R[i, j, c] - 3.0 * (R[i + 2, j, c] - R[i + 1, j, c])
                    elif k == 1:
                        x = R[i + 2, j + 1, c] - 2.0 * R[i + 1, j + 1, c] + R[i, j + 1, c]
                        x -= R[i + 2, j, c] - 2.0 * R[i + 1, j, c] + R[i, j, c]
                    elif k == 2:
                        x = R[i + 1, j + 2, c] - 2.0 * R[i + 1, j + 1, c] + R[i + 1, j, c]
                        x -= R[i, j + 2, c] - 2.0 * R[i, j + 1, c] + R[i, j, c]
                    else:
                        x = R[i, j + 3, c] - R[i, j, c] - 3.0 * (R[i, j + 2, c] - R[i, j + 1, c])
                    lo = min(lo, x)
                    hi = max(hi, x)
            f = 1.0
            for i in range(m):
                f *= p - i
            for i in range(k):
                f *= q - i
            D[5 + k, c, 0] = f * lo
            D[5 + k, c, 1] = f * hi
    if not rational:
        return
    w0 = math.inf
    w1 = -math.inf
    for i in range(P):
        for j in range(Q):
            w0 = min(w0, R[i, j, 3])
            w1 = max(w1, R[i, j, 3])
    for c in range(3):
        for k in range(
            4
        ):  # S_fgh = (X_fgh - S_fg w_h - S_fh w_g - S_gh w_f - S_f w_gh - S_g w_fh - S_h w_fg - S w_fgh) / w
            f = 1 if k > 2 else 0
            g = 1 if k > 1 else 0
            h = 1 if k > 0 else 0
            a0, a1 = times(S[c, 0], S[c, 1], D[5 + k, 3, 0], D[5 + k, 3, 1])
            lo = D[5 + k, c, 0] - a1
            hi = D[5 + k, c, 1] - a0
            for i in range(3):
                one = (f, g, h)[i]
                two = 2 + f + g + h - one
                a0, a1 = times(D[two, c, 0], D[two, c, 1], D[one, 3, 0], D[one, 3, 1])
                b0, b1 = times(D[one, c, 0], D[one, c, 1], D[two, 3, 0], D[two, 3, 1])
                lo -= a1 + b1
                hi -= a0 + b0
            D[5 + k, c, 0], D[5 + k, c, 1] = times(lo, hi, 1.0 / w1, 1.0 / w0)


@inner
def third_graph_bounds(
    R: Array, rational: bool, D: Array, S: Array, G: Array, K: Array, E: Array, H: Array, T: Array
) -> None:
    """T[0..3] = intervals of z_xxx, z_xxy, z_xyy, z_yyy; the rest as `graph_bounds` left it.

    Over straightened parameters: z_fgh = Z_ijk x^i_f x^j_g x^k_h + Z_ij (x^i_fg x^j_h + ...) + Z_i x^i_fgh.
    """
    third_derivative_bounds(R, rational, D, S)
    for c in range(3):
        for k in range(4):
            f = 1 if k > 2 else 0
            g = 1 if k > 1 else 0
            h = 1 if k > 0 else 0
            lo = 0.0
            hi = 0.0
            for i in range(8):
                a = i & 1
                b = (i >> 1) & 1
                d = i >> 2
                m = 5 + a + b + d
                x0, x1 = scaled(K[a, f] * K[b, g] * K[d, h], D[m, c])
                lo += x0
                hi += x1
            G[5 + k, c, 0] = lo
            G[5 + k, c, 1] = hi
    for k in range(4):  # W_fgh = Z_ijk x^i_f x^j_g x^k_h, kept in G[5 + k, 2]
        f = 1 if k > 2 else 0
        g = 1 if k > 1 else 0
        h = 1 if k > 0 else 0
        lo = G[5 + k, 2, 0]
        hi = G[5 + k, 2, 1]
        for c in range(2):
            a0, a1 = times(E[c, 0], E[c, 1], G[5 + k, c, 0], G[5 + k, c, 1])
            lo -= a1
            hi -= a0
        for i in range(3):
            one = (f, g, h)[i]
            two = 2 + f + g + h - one
            for c in range(2):
                for d in range(2):
                    a0, a1 = times(G[two, c, 0], G[two, c, 1], G[one, d, 0], G[one, d, 1])
                    a0, a1 = times(a0, a1, H[c + d, 0], H[c + d, 1])
                    lo -= a1
                    hi -= a0
        G[5 + k, 2, 0] = lo
        G[5 + k, 2, 1] = hi
    for k in range(4):
        lo = 0.0
        hi = 0.0
        for i in range(8):
            a = i & 1
            b = (i >> 1) & 1
            d = i >> 2
            m = 5 + a + b + d
            one = 2 + 2 * a + (1 if k > 2 else 0)
            two = 2 + 2 * b + (1 if k > 1 else 0)
            three = 2 + 2 * d + (1 if k > 0 else 0)
            x0, x1 = times(E[one, 0], E[one, 1], E[two, 0], E[two, 1])
            x0, x1 = times(x0, x1, E[three, 0], E[three, 1])
            x0, x1 = times(x0, x1, G[m, 2, 0], G[m, 2, 1])
            lo += x0
            hi += x1
        T[k, 0] = lo
        T[k, 1] = hi


@inner
def foot(
    net: Array, w: Array, at: int, x: float, y: float, F: Array, c: Array, box: Array,
    bu: Array, bv: Array, h: Array, j: Array, g: Array,
) -> bool:  # fmt: skip
    """Newton from w[at:at + 2] to the parameters above (x, y) of the frame F at c; g = z, z_x, z_y, z_xx, z_xy, z_yy.

    False where it leaves the box (4,) by more than the margin or does not settle.
    """
    last = math.inf
    for step in range(12):
        jets(net, w[at], w[at + 1], bu, bv, h, j)
        xu = dot(F[0], j[1])
        xv = dot(F[0], j[2])
        yu = dot(F[1], j[1])
        yv = dot(F[1], j[2])
        det = xu * yv - xv * yu
        if det == 0.0:
            return False
        dx = x
        dy = y
        for k in range(3):
            dx -= F[0, k] * (j[0, k] - c[k])
            dy -= F[1, k] * (j[0, k] - c[k])
        du = (yv * dx - xv * dy) / det
        dv = (xu * dy - yu * dx) / det
        size = dx * dx + dy * dy
        if size <= 1e-33 or (step >= 3 and size >= 0.25 * last):
            if size > 1e-24:
                return False
            break
        last = size
        w[at] += du
        w[at + 1] += dv
        if not (box[0] - 1.0 < w[at] < box[1] + 1.0 and box[2] - 1.0 < w[at + 1] < box[3] + 1.0):
            return False
    # the last correction to first order: z at (x, y) exactly
    zu = dot(F[2], j[1])
    zv = dot(F[2], j[2])
    zx = (zu * yv - zv * yu) / det
    zy = (zv * xu - zu * xv) / det
    z = zx * dx + zy * dy
    for k in range(3):
        z += F[2, k] * (j[0, k] - c[k])
    g[0] = z
    g[1] = zx
    g[2] = zy
    waa = dot(F[2], j[3]) - zx * dot(F[0], j[3]) - zy * dot(F[1], j[3])
    wab = dot(F[2], j[4]) - zx * dot(F[0], j[4]) - zy * dot(F[1], j[4])
    wbb = dot(F[2], j[5]) - zx * dot(F[0], j[5]) - zy * dot(F[1], j[5])
    ux = yv / det
    uy = -xv / det
    vx = -yu / det
    vy = xu / det
    g[3] = ux * ux * waa + 2.0 * ux * vx * wab + vx * vx * wbb
    g[4] = ux * uy * waa + (ux * vy + uy * vx) * wab + vx * vy * wbb
    g[5] = uy * uy * waa + 2.0 * uy * vy * wab + vy * vy * wbb
    mu = MARGIN * (box[1] - box[0])
    mv = MARGIN * (box[3] - box[2])
    return bool(box[0] - mu <= w[at] <= box[1] + mu and box[2] - mv <= w[at + 1] <= box[3] + mv)


@inner
def difference(
    A: Array, B: Array, w: Array, x: float, y: float, F: Array, c: Array, box_a: Array, box_b: Array,
    bu: Array, bv: Array, h: Array, ja: Array, jb: Array, ga: Array, gb: Array, f: Array,
) -> bool:  # fmt: skip
    """f[0..5] = f, f_x, f_y, f_xx, f_xy, f_yy at (x, y), w moved to the two feet; False where one has none."""
    if not foot(A, w, 0, x, y, F, c, box_a, bu, bv, h, ja, ga):
        return False
    if not foot(B, w, 2, x, y, F, c, box_b, bu, bv, h, jb, gb):
        return False
    for k in range(6):
        f[k] = ga[k] - gb[k]
    return True


@kernel
def differences(A: Array, B: Array, w: Array, F: Array, c: Array, xy: Array) -> Array:
    """(k, 10) f, f_x, f_y, f_xx, f_xy, f_yy and the parameters u, v, s, t at places (k, 2) of the frame F at c, found
    from w; NaN where a foot is missing."""
    most = max(max(A.shape[0], A.shape[1]), max(B.shape[0], B.shape[1])) + 1
    bu, bv, h, ja, jb = np.empty((3, most)), np.empty((3, most)), np.empty((6, 4)), np.empty((6, 3)), np.empty((6, 3))
    ga, gb, f, p = np.empty(6), np.empty(6), np.empty(6), np.empty(4)
    everywhere = np.array([-1.0, 2.0, -1.0, 2.0])
    out = np.full((xy.shape[0], 10), math.nan)
    for k in range(xy.shape[0]):
        p[:] = w
        if difference(A, B, p, xy[k, 0], xy[k, 1], F, c, everywhere, everywhere, bu, bv, h, ja, jb, ga, gb, f):
            out[k, :6] = f
            out[k, 6:] = p
    return out


@inner
def functional_range(R: Array, p: float, q: float) -> tuple[float, float]:
    """The interval of p x + q y over the control points of a rotated net."""
    lo = math.inf
    hi = -math.inf
    for i in range(R.shape[0]):
        for j in range(R.shape[1]):
            x = (p * R[i, j, 0] + q * R[i, j, 1]) / R[i, j, 3]
            lo = min(lo, x)
            hi = max(hi, x)
    return lo, hi


@inner
def height_range(R: Array) -> tuple[float, float]:
    """The interval of z over the control points of a rotated net."""
    lo = math.inf
    hi = -math.inf
    for i in range(R.shape[0]):
        for j in range(R.shape[1]):
            x = R[i, j, 2] / R[i, j, 3]
            lo = min(lo, x)
            hi = max(hi, x)
    return lo, hi
