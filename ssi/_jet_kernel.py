"""Points, derivatives and Newton steps on Bezier pieces, for the kernels of subdivision and tracing."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

from patchwright.models._compile_kernel import inlined, inner
from patchwright.models.arrays import Array

FRAME = 8  # rows of the arrays in which the two normals and what follows from them are kept


@inlined
def add_row(h: Array, b0: float, b1: float, b2: float, c: int, r0: float, r1: float, r2: float) -> None:
    """One row's share of coordinate c of the six derivatives."""
    h[0, c] += b0 * r0
    h[1, c] += b1 * r0
    h[2, c] += b0 * r1
    h[3, c] += b2 * r0
    h[4, c] += b1 * r1
    h[5, c] += b0 * r2


@inner
def bernstein(p: int, t: float, out: Array) -> None:
    """out[k, i] = derivative k (0, 1, 2) of the Bernstein polynomial i of degree p at t."""
    s = 1.0 - t
    if p == 3:  # by far the most common
        out[0, 0] = s * s * s
        out[0, 1] = 3.0 * s * s * t
        out[0, 2] = 3.0 * s * t * t
        out[0, 3] = t * t * t
        out[1, 0] = -3.0 * s * s
        out[1, 1] = 3.0 * s * (s - 2.0 * t)
        out[1, 2] = 3.0 * t * (2.0 * s - t)
        out[1, 3] = 3.0 * t * t
        out[2, 0] = 6.0 * s
        out[2, 1] = 6.0 * (t - 2.0 * s)
        out[2, 2] = 6.0 * (s - 2.0 * t)
        out[2, 3] = 6.0 * t
        return
    # rows of degree p - 2, p - 1 and p are built in turn in out[0]
    for k in range(3):
        for i in range(p + 1):
            out[k, i] = 0.0
    out[0, 0] = 1.0
    for r in range(p + 1):
        if r == p - 2:
            c = float(p * (p - 1))
            for i in range(r, -1, -1):
                b = c * out[0, i]
                out[2, i + 2] += b
                out[2, i + 1] -= 2.0 * b
                out[2, i] += b
        elif r == p - 1:
            for i in range(r, -1, -1):
                b = p * out[0, i]
                out[1, i + 1] += b
                out[1, i] -= b
        if r == p:
            break
        keep = 0.0
        for i in range(r + 1):
            b = out[0, i]
            out[0, i] = keep + s * b
            keep = t * b
        out[0, r + 1] = keep


@inner
def jets(net: Array, u: float, v: float, bu: Array, bv: Array, h: Array, out: Array) -> None:
    """out[0..5] = S, S_u, S_v, S_uu, S_uv, S_vv at (u, v); parameters beyond [0, 1] extrapolate."""
    P = net.shape[0]
    Q = net.shape[1]
    bernstein(P - 1, u, bu)
    bernstein(Q - 1, v, bv)
    for k in range(6):
        for c in range(4):
            h[k, c] = 0.0
    for i in range(P):
        b0 = bu[0, i]
        b1 = bu[1, i]
        b2 = bu[2, i]
        x0 = y0 = z0 = w0 = 0.0  # one row and its derivatives along v, all coordinates at once
        x1 = y1 = z1 = w1 = 0.0
        x2 = y2 = z2 = w2 = 0.0
        for j in range(Q):
            x = net[i, j, 0]
            y = net[i, j, 1]
            z = net[i, j, 2]
            w = net[i, j, 3]
            c0 = bv[0, j]
            c1 = bv[1, j]
            c2 = bv[2, j]
            x0 += c0 * x
            y0 += c0 * y
            z0 += c0 * z
            w0 += c0 * w
            x1 += c1 * x
            y1 += c1 * y
            z1 += c1 * z
            w1 += c1 * w
            x2 += c2 * x
            y2 += c2 * y
            z2 += c2 * z
            w2 += c2 * w
        add_row(h, b0, b1, b2, 0, x0, x1, x2)
        add_row(h, b0, b1, b2, 1, y0, y1, y2)
        add_row(h, b0, b1, b2, 2, z0, z1, z2)
        add_row(h, b0, b1, b2, 3, w0, w1, w2)
    w = 1.0 / h[0, 3]
    wu = h[1, 3]
    wv = h[2, 3]
    for c in range(3):
        s = h[0, c] * w
        su = (h[1, c] - s * wu) * w
        sv = (h[2, c] - s * wv) * w
        out[0, c] = s
        out[1, c] = su
        out[2, c] = sv
        out[3, c] = (h[3, c] - 2.0 * su * wu - s * h[3, 3]) * w
        out[4, c] = (h[4, c] - su * wv - sv * wu - s * h[4, 3]) * w
        out[5, c] = (h[5, c] - 2.0 * sv * wv - s * h[5, 3]) * w


@inner
def dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def cross(a: Array, b: Array, out: Array) -> None:
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    out[0] = x
    out[1] = y
    out[2] = z


@inner
def unit(a: Array) -> float:
    """Make a unit in place; its length."""
    length = math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    if length > 0.0:
        for c in range(3):
            a[c] /= length
    return length


@inner
def tangent_coordinates(j: Array, x: Array, out: Array, at: int) -> bool:
    """out[at], out[at + 1] = (a, b) with x = a S_u + b S_v in the least-squares sense; False where singular."""
    e = dot(j[1], j[1])
    f = dot(j[1], j[2])
    g = dot(j[2], j[2])
    det = e * g - f * f
    if det <= 1e-24 * e * g or det <= 0.0:
        return False
    p = dot(j[1], x)
    q = dot(j[2], x)
    out[at] = (g * p - f * q) / det
    out[at + 1] = (e * q - f * p) / det
    return True


@inner
def normals(ja: Array, jb: Array, frame: Array) -> float:
    """frame[0..4] = n_a, n_b (turned to the side of n_a), the mean n, the difference m and the tangent T; the sine of
    their angle, or -1 where a normal vanishes. `frame` is (FRAME, 4); rows from 5 on are scratch."""
    cross(ja[1], ja[2], frame[0])
    cross(jb[1], jb[2], frame[1])
    if unit(frame[0]) == 0.0 or unit(frame[1]) == 0.0:
        return -1.0
    if dot(frame[0], frame[1]) < 0.0:
        for c in range(3):
            frame[1, c] = -frame[1, c]
    for c in range(3):
        frame[2, c] = 0.5 * (frame[0, c] + frame[1, c])
        frame[3, c] = frame[0, c] - frame[1, c]
    cross(frame[0], frame[1], frame[4])
    return unit(frame[4])


@inner
def slice_newton(
    A: Array, B: Array, w: Array, T: Array, level: float, steps: int, bu: Array, bv: Array, h: Array,
    ja: Array, jb: Array, frame: Array, tiny: float,
) -> float:  # fmt: skip
    """Move w = (u, v, s, t) onto both surfaces and the plane T . x = level; the remaining gap, or -1 on failure.

    The paper's auxiliary plane method (HJR section 4): the common point of the two tangent planes and the plane, pulled
    back to both parameter planes. The two tangent planes enter by the mean and the difference of their normals, which
    keeps the point's error at round-off over the crossing angle. The jets and normals at w are left in ja, jb, frame.
    """
    x = frame[5]
    d = frame[6]
    last = math.inf
    for step in range(steps + 1):
        jets(A, w[0], w[1], bu, bv, h, ja)
        jets(B, w[2], w[3], bu, bv, h, jb)
        sine = normals(ja, jb, frame)
        if sine < 0.0:
            return -1.0
        gap2 = 0.0
        for c in range(3):
            gap2 += (ja[0, c] - jb[0, c]) ** 2
        if step == steps:
            return math.sqrt(gap2)
        n = frame[2]
        m = frame[3]
        mm = dot(m, m)
        if mm < 1e-26:
            return -1.0
        nn = dot(n, n)
        nd = 0.0
        md = 0.0
        tq = 0.0
        tm = 0.0
        for c in range(3):
            gap = jb[0, c] - ja[0, c]
            nd += n[c] * gap
            md -= 0.25 * m[c] * gap
            tq += T[c] * 0.5 * (ja[0, c] + jb[0, c])
        # x = q + n a + m b + T' c with T' the common tangent
        a = md / nn
        b = -nd / mm
        tt = dot(T, frame[4])
        if abs(tt) < 1e-3:
            return -1.0
        tm = (level - tq - a * dot(T, n) - b * dot(T, m)) / tt
        for c in range(3):
            x[c] = 0.5 * (ja[0, c] + jb[0, c]) + a * n[c] + b * m[c] + tm * frame[4, c]
        move = 0.0
        for c in range(3):
            x[c] -= ja[0, c]
            move += x[c] * x[c]
        if not tangent_coordinates(ja, x, d, 0):
            return -1.0
        for c in range(3):
            x[c] += ja[0, c] - jb[0, c]
        if not tangent_coordinates(jb, x, d, 2):
            return -1.0
        for k in range(4):
            if abs(d[k]) > 2.0:
                return -1.0
        for k in range(4):
            w[k] += d[k]
            if not (-1.0 < w[k] < 2.0):
                return -1.0
        if (move <= tiny * tiny or move >= last) and step >= 1:
            jets(A, w[0], w[1], bu, bv, h, ja)
            jets(B, w[2], w[3], bu, bv, h, jb)
            normals(ja, jb, frame)
            gap2 = 0.0
            for c in range(3):
                gap2 += (ja[0, c] - jb[0, c]) ** 2
            if move > 1e-6:
                return -1.0
            return math.sqrt(gap2)
        last = move if step >= 2 else math.inf
    return -1.0


@inner
def curve_jet(ja: Array, jb: Array, frame: Array, sign: float, w: Array, out: Array) -> bool:
    """out (3, 7): x, w = (u, v, s, t) and their first two derivatives by arc length along sign * T."""
    T = frame[5]
    n = frame[2]
    m = frame[3]
    r = frame[6]
    for k in range(4):
        out[0, 3 + k] = w[k]
    for c in range(3):
        T[c] = sign * frame[4, c]
        out[0, c] = 0.5 * (ja[0, c] + jb[0, c])
        out[1, c] = T[c]
    if not (tangent_coordinates(ja, T, out[1], 3) and tangent_coordinates(jb, T, out[1], 5)):
        return False
    ka = 0.0
    kb = 0.0
    u = out[1, 3]
    v = out[1, 4]
    s = out[1, 5]
    t = out[1, 6]
    for c in range(3):
        ka += frame[0, c] * (ja[3, c] * u * u + 2.0 * ja[4, c] * u * v + ja[5, c] * v * v)
        kb += frame[1, c] * (jb[3, c] * s * s + 2.0 * jb[4, c] * s * t + jb[5, c] * t * t)
    nn = dot(n, n)
    mm = dot(m, m)
    if mm == 0.0:
        return False
    a = 0.5 * (ka + kb) / nn
    b = (ka - kb) / mm
    for c in range(3):
        out[2, c] = a * n[c] + b * m[c]
    for c in range(3):
        r[c] = out[2, c] - (ja[3, c] * u * u + 2.0 * ja[4, c] * u * v + ja[5, c] * v * v)
    tangent_coordinates(ja, r, out[2], 3)
    for c in range(3):
        r[c] = out[2, c] - (jb[3, c] * s * s + 2.0 * jb[4, c] * s * t + jb[5, c] * t * t)
    tangent_coordinates(jb, r, out[2], 5)
    return True
