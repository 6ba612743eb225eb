"""Follow the arcs of two Bezier pieces from seeds to the pieces' borders, to singular points or round.

A node holds x, (u, v), (s, t) and their first two derivatives by arc length; between nodes the curve is the quintic
Hermite piece. The step is as long as the piece's residual at inner points allows.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

import numpy as np

from patchwright.models._compile_kernel import inner, kernel
from patchwright.models.arrays import Array, IntArray
from patchwright.ssi._jet_kernel import FRAME, curve_jet, dot, jets, normals, slice_newton

BORDER, CLOSED, BALL, STUCK, PARTED = range(5)
STEP = 1e-9  # Newton's last step: the next would be its square, below round-off
MOST = 4000  # nodes of an arc on one pair of pieces
NODE = 22  # 3 x 7 jet, then the length of the piece that begins at the node


@inner
def hermite(a: Array, b: Array, L: float, t: float, out: Array) -> None:
    """out[0..6] = the quintic Hermite piece between the jets a and b (21,) of length L at t in [0, 1]."""
    t2 = t * t
    t3 = t2 * t
    h0 = 1.0 + t3 * (-10.0 + t * (15.0 - 6.0 * t))
    h1 = t + t3 * (-6.0 + t * (8.0 - 3.0 * t))
    h2 = 0.5 * t2 + t3 * (-1.5 + t * (1.5 - 0.5 * t))
    g1 = t3 * (-4.0 + t * (7.0 - 3.0 * t))
    g2 = t3 * (0.5 + t * (-1.0 + 0.5 * t))
    for c in range(7):
        out[c] = (
            h0 * a[c]
            + (1.0 - h0) * b[c]
            + L * (h1 * a[7 + c] + g1 * b[7 + c])
            + L * L * (h2 * a[14 + c] + g2 * b[14 + c])
        )


@inner
def speed(a: Array, b: Array, L: float, t: float) -> float:
    """The length of the space part's derivative by t."""
    t2 = t * t
    h0 = t2 * (-30.0 + t * (60.0 - 30.0 * t))
    h1 = 1.0 + t2 * (-18.0 + t * (32.0 - 15.0 * t))
    h2 = t + t2 * (-4.5 + t * (6.0 - 2.5 * t))
    g1 = t2 * (-12.0 + t * (28.0 - 15.0 * t))
    g2 = t2 * (1.5 + t * (-4.0 + 2.5 * t))
    s = 0.0
    for c in range(3):
        d = h0 * (a[c] - b[c]) + L * (h1 * a[7 + c] + g1 * b[7 + c]) + L * L * (h2 * a[14 + c] + g2 * b[14 + c])
        s += d * d
    return math.sqrt(s)


@inner
def piece_length(a: Array, b: Array) -> float:
    """The length L for which the Hermite piece is as long as L: Gauss quadrature, fixed point."""
    chord = 0.0
    for c in range(3):
        chord += (b[c] - a[c]) ** 2
    L = math.sqrt(chord)
    for _ in range(4):
        s = 0.0
        for k in range(5):
            x = (0.04691007703066802, 0.23076534494715845, 0.5, 0.7692346550528415, 0.9530899229693319)[k]
            w = (
                0.11846344252809454,
                0.23931433524968324,
                0.28444444444444444,
                0.23931433524968324,
                0.11846344252809454,
            )[k]
            s += w * speed(a, b, L, x)
        if abs(s - L) <= 1e-15 * L:
            break
        L = s
    return L


@inner
def border_newton(A: Array, B: Array, w: Array, k: int, work: tuple[Array, ...]) -> bool:
    """Solve A = B with parameter k held: three equations in the other three."""
    bu, bv, h, ja, jb = work[:5]
    i0 = 0 if k != 0 else 1
    i1 = 1 if k > 1 else 2
    i2 = 3 if k != 3 else 2
    last = math.inf
    for _ in range(10):
        jets(A, w[0], w[1], bu, bv, h, ja)
        jets(B, w[2], w[3], bu, bv, h, jb)
        p = ja[1 + i0] if i0 < 2 else jb[i0 - 1]
        q = ja[1 + i1] if i1 < 2 else jb[i1 - 1]
        r = ja[1 + i2] if i2 < 2 else jb[i2 - 1]
        d0 = jb[0, 0] - ja[0, 0]
        d1 = jb[0, 1] - ja[0, 1]
        d2 = jb[0, 2] - ja[0, 2]
        c0 = q[1] * r[2] - q[2] * r[1]
        c1 = q[2] * r[0] - q[0] * r[2]
        c2 = q[0] * r[1] - q[1] * r[0]
        det = p[0] * c0 + p[1] * c1 + p[2] * c2
        if abs(det) <= 1e-7 * math.sqrt(dot(p, p) * dot(q, q) * dot(r, r)):
            return False
        x = (d0 * c0 + d1 * c1 + d2 * c2) / det
        y = (p[0] * (d1 * r[2] - d2 * r[1]) + p[1] * (d2 * r[0] - d0 * r[2]) + p[2] * (d0 * r[1] - d1 * r[0])) / det
        z = (p[0] * (q[1] * d2 - q[2] * d1) + p[1] * (q[2] * d0 - q[0] * d2) + p[2] * (q[0] * d1 - q[1] * d0)) / det
        w[i0] += x if i0 < 2 else -x
        w[i1] += y if i1 < 2 else -y
        w[i2] += z if i2 < 2 else -z
        move = abs(x) + abs(y) + abs(z)
        if move > 0.5:
            return False
        if move <= 1e-15 or move >= last:
            return bool(move < 1e-7)
        last = move if move < 1e-6 else math.inf
    return bool(move < 1e-9)


@inner
def slack(j: Array, k: int, tol: float) -> float:
    """The parameter difference that moves a point by tol, at most 0.1."""
    return min(tol / max(math.sqrt(dot(j[k], j[k])), 1e-300), 0.1)


@inner
def towards(balls: Array, a: Array, step: float) -> tuple[float, int]:
    """The step shortened so that it ends well inside a ball it would enter or jump over, and the number of that ball,
    -1 for none. `a` begins with x and holds the tangent from 7 on."""
    entering = -1
    for i in range(balls.shape[0]):
        along = 0.0
        far = 0.0
        for c in range(3):
            d = balls[i, c] - a[c]
            along += d * a[7 + c]
            far += d * d
        aside = math.sqrt(max(far - along * along, 0.0))
        r = balls[i, 3]
        if far > r * r and along > 0.0 and aside < 0.8 * r + 0.1 * along and along - 0.5 * r < step:
            step = max(along - 0.5 * r, 0.1 * r)
            entering = i
    return step, entering


@inner
def march(
    A: Array, B: Array, w: Array, T0: Array, balls: Array, home: Array, longest: float, begin: float, fit: float,
    tol: float, nodes: Array, work: tuple[Array, ...],
) -> tuple[int, int, int]:  # fmt: skip
    """Nodes from w along T0, the first step `begin`: their number, how it ended, and in which ball."""
    bu, bv, h, ja, jb, frame, p, new, mid, jet = work
    T = frame[7]
    jets(A, w[0], w[1], bu, bv, h, ja)
    jets(B, w[2], w[3], bu, bv, h, jb)
    if normals(ja, jb, frame) <= 0.0:
        return 0, STUCK, -1
    if not curve_jet(ja, jb, frame, 1.0 if dot(frame[4], T0) > 0.0 else -1.0, w, jet):
        return 0, STUCK, -1
    for k in range(21):
        nodes[0, k] = jet[k // 7, k % 7]
    nodes[0, 21] = 0.0
    n = 1
    # already at a border and leaving it
    for k in range(4):
        j = ja if k < 2 else jb
        d = slack(j, 1 + k % 2, tol)
        x = nodes[0, 3 + k]
        v = nodes[0, 10 + k]
        leaves = (x <= d and v * longest < -2.0 * d) or (x >= 1.0 - d and v * longest > 2.0 * d)
        if leaves and (x + v * 1e-7 < -d or x + v * 1e-7 > 1.0 + d):
            return n, BORDER, -1
    step = begin
    tries = 0
    travelled = 0.0
    while n < nodes.shape[0] - 1:
        a = nodes[n - 1]
        tries += 1
        if tries > 60 or step < 1e-11:
            return n, STUCK, -1
        step = min(step, longest)
        step, entering = towards(balls, a, step)
        for k in range(4):
            p[k] = a[3 + k] + step * (a[10 + k] + 0.5 * step * a[17 + k])
        level = 0.0
        for c in range(3):
            T[c] = a[7 + c]
            level += T[c] * a[c]
        gap = slice_newton(A, B, p, T, level + step, 10, bu, bv, h, ja, jb, frame, STEP)
        if gap < 0.0 or gap > 1e-12:
            step *= 0.5
            continue
        sine = 2.0 * math.sqrt(dot(frame[3], frame[3])) * 0.5
        if not curve_jet(ja, jb, frame, 1.0 if dot(frame[4], T) > 0.0 else -1.0, p, jet):
            step *= 0.5
            continue
        for k in range(21):
            new[k] = jet[k // 7, k % 7]
        if dot(new[7:10], T) < 0.8:
            step *= 0.5
            continue
        L = piece_length(a, new)
        # residual of the piece at inner points; small angles ask for less, so that the place is right too
        limit = max(min(fit, 1e-9 * sine), 6e-15)
        worst = 0.0
        for i in range(2):
            hermite(a, new, L, 0.5 if i == 0 else 0.23, mid)
            jets(A, mid[3], mid[4], bu, bv, h, ja)
            jets(B, mid[5], mid[6], bu, bv, h, jb)
            d0 = 0.0
            d1 = 0.0
            for c in range(3):
                d0 += (ja[0, c] - jb[0, c]) ** 2
                d1 = max(d1, max(abs(ja[0, c] - mid[c]), abs(jb[0, c] - mid[c])))
            worst = max(worst, math.sqrt(d0))
            worst = max(worst, d1 * min(1.0, limit / fit))
        if not worst <= limit and step > 1e-7:
            step *= max(0.3, 0.85 * (limit / worst) ** (1.0 / 6.0))
            continue
        tries = 0
        next_step = step * min(2.0, 0.85 * (limit / max(worst, 1e-30)) ** (1.0 / 6.0))
        # the first border crossed
        first = -1
        when = 2.0
        edge = 0.0
        for k in range(4):
            j = ja if k < 2 else jb
            d = slack(j, 1 + k % 2, tol)
            x = new[3 + k]
            if x < -d or x > 1.0 + d:
                bound = 0.0 if x < 0.0 else 1.0
                lo = 0.0
                hi = 1.0
                for _ in range(50):
                    t = 0.5 * (lo + hi)
                    hermite(a, new, L, t, mid)
                    if (mid[3 + k] - bound) * (x - bound) > 0.0:
                        hi = t
                    else:
                        lo = t
                if hi < when:
                    when = hi
                    first = k
                    edge = bound
        # back home: the start lies on this piece
        if home[0] > 0.0 and travelled + L > 0.0 and n >= 3:
            s = 0.0
            for c in range(3):
                s += (home[1 + c] - a[c]) * a[7 + c]
            if 0.0 < s <= 1.0001 * L + 1e-12 and dot(home[8:11], T) > 0.5:
                t = s / L
                for _ in range(4):
                    hermite(a, new, L, t, mid)
                    d = 0.0
                    for c in range(3):
                        d += (home[1 + c] - mid[c]) * (a[7 + c] * (1.0 - t) + new[7 + c] * t)
                    t += d / L
                hermite(a, new, L, t, mid)
                off = 0.0
                for c in range(7):
                    off = max(off, abs(home[1 + c] - mid[c]) * (1.0 if c < 3 else 1e-3))
                if off < 2e-8 and t <= min(1.0, when) + 1e-9:
                    for k in range(21):
                        nodes[n, k] = home[1 + k]
                    a[21] = piece_length(a, nodes[n])
                    nodes[n, 21] = 0.0
                    return n + 1, CLOSED, -1
        if first >= 0:
            hermite(a, new, L, when, mid)
            for k in range(4):
                p[k] = mid[3 + k]
            p[first] = edge
            if not border_newton(A, B, p, first, work):
                for k in range(4):
                    p[k] = mid[3 + k]
                slice_newton(A, B, p, T, dot(T, mid), 10, bu, bv, h, ja, jb, frame, 1e-13)
            for k in range(4):
                p[k] = min(max(p[k], 0.0), 1.0)
            if when * L < 1e-12 and n > 1:
                return n, BORDER, -1
            jets(A, p[0], p[1], bu, bv, h, ja)
            jets(B, p[2], p[3], bu, bv, h, jb)
            normals(ja, jb, frame)
            if curve_jet(ja, jb, frame, 1.0 if dot(frame[4], T) > 0.0 else -1.0, p, jet):
                for k in range(21):
                    nodes[n, k] = jet[k // 7, k % 7]
                a[21] = piece_length(a, nodes[n])
                nodes[n, 21] = 0.0
                n += 1
            return n, BORDER, -1
        for k in range(21):
            nodes[n, k] = new[k]
        nodes[n, 21] = 0.0
        a[21] = L
        travelled += L
        n += 1
        step = next_step
        if entering >= 0 or balls.shape[0] > 0:
            for i in range(balls.shape[0]):
                far = 0.0
                for c in range(3):
                    far += (balls[i, c] - new[c]) ** 2
                if far < balls[i, 3] ** 2:
                    return n, BALL, i
    return n, STUCK, -1


@kernel
def trace(
    nets_a: Array, nets_b: Array, which: IntArray, firsts: IntArray, seeds: Array, balls: Array, longest: float,
    fit: float, tol: float,
) -> tuple[Array, IntArray]:  # fmt: skip
    """Arcs of pairs of pieces `which` (g, 2) through the seeds (k, 7) u v s t x y z, those of pair i from firsts[i] to
    firsts[i + 1]: nodes (n, NODE) and one row per arc: first node, end, how it ended behind and ahead, the balls, the
    pair's number."""
    most = max(max(nets_a.shape[1], nets_a.shape[2]), max(nets_b.shape[1], nets_b.shape[2])) + 1
    work = (
        np.empty((3, most)), np.empty((3, most)), np.empty((6, 4)), np.empty((6, 3)), np.empty((6, 3)),
        np.empty((FRAME, 4)), np.empty(4), np.empty(NODE), np.empty(7), np.empty((3, 7)),
    )  # fmt: skip
    bu, bv, h, ja, jb, frame, _, _, _, jet = work
    ahead = np.empty((MOST, NODE))
    behind = np.empty((MOST, NODE))
    nodes = np.empty((512, NODE))
    arcs = np.empty((64, 7), np.int64)
    begin = longest
    n = 0
    m = 0
    w = np.empty(4)
    T = np.empty(3)
    mid = np.empty(7)
    home = np.zeros(22)
    done = np.zeros(seeds.shape[0], np.bool_)
    for k in range(seeds.shape[0]):
        for i in range(balls.shape[0]):
            far = 0.0
            for c in range(3):
                far += (balls[i, c] - seeds[k, 4 + c]) ** 2
            if far < 1.02 * balls[i, 3] ** 2:
                done[k] = True
    for g in range(which.shape[0]):
        A = nets_a[which[g, 0]]
        B = nets_b[which[g, 1]]
        count = firsts[g + 1] - firsts[g]
        for turn in range(2 * count):  # points exactly on their pieces first, those within the tolerance after
            k = firsts[g] + turn % count
            exact = turn < count
            if done[k]:
                continue
            for i in range(4):
                w[i] = seeds[k, i]
            jets(A, w[0], w[1], bu, bv, h, ja)
            jets(B, w[2], w[3], bu, bv, h, jb)
            if normals(ja, jb, frame) <= 0.0:
                continue
            T[:] = frame[4, :3]
            gap = slice_newton(A, B, w, T, 0.5 * (dot(T, ja[0]) + dot(T, jb[0])), 10, bu, bv, h, ja, jb, frame, 1e-13)
            if gap < 0.0:
                continue
            out_of = 0.0
            for i in range(4):
                out_of = max(out_of, max(-w[i], w[i] - 1.0))
                w[i] = min(max(w[i], 0.0), 1.0)
            if exact and out_of > 1e-12:
                continue
            done[k] = True
            if out_of > 0.02:
                continue
            jets(A, w[0], w[1], bu, bv, h, ja)
            jets(B, w[2], w[3], bu, bv, h, jb)
            if normals(ja, jb, frame) <= 0.0:
                continue
            if not curve_jet(ja, jb, frame, 1.0 if dot(frame[4], T) > 0.0 else -1.0, w, jet):
                continue
            home[0] = 1.0  # the start is a goal: closed loops
            for i in range(21):
                home[1 + i] = jet[i // 7, i % 7]
            n1, e1, b1 = march(A, B, w, T, balls, home, longest, begin, fit, tol, ahead, work)
            if n1 == 0:
                continue
            if n1 > 3:
                begin = min(longest, max(2.0 * ahead[n1 - 3, 21], 1e-3 * longest))  # the last piece is cut off
            n2 = 1
            e2 = e1
            b2 = -1
            if e1 != CLOSED:
                home[0] = 0.0
                T[:] = -ahead[0, 7:10]
                n2, e2, b2 = march(A, B, w, T, balls, home, longest, begin, fit, tol, behind, work)
            total = n1 + n2 - 1
            while n + total > nodes.shape[0]:
                bigger = np.empty((2 * nodes.shape[0], NODE))
                bigger[:n] = nodes[:n]
                nodes = bigger
            for i in range(n2 - 1):
                row = nodes[n + i]
                back = behind[n2 - 1 - i]
                for q in range(21):
                    row[q] = -back[q] if 7 <= q < 14 else back[q]
                row[21] = behind[n2 - 2 - i, 21]
            for i in range(n1):
                nodes[n + n2 - 1 + i] = ahead[i]
            if m == arcs.shape[0]:
                more = np.empty((2 * m, 7), np.int64)
                more[:m] = arcs
                arcs = more
            arcs[m, 0] = n
            arcs[m, 1] = n + total
            arcs[m, 2] = e2
            arcs[m, 3] = e1
            arcs[m, 4] = b2
            arcs[m, 5] = b1
            arcs[m, 6] = g
            # seeds on this arc need no arc of their own
            for q in range(firsts[g], firsts[g + 1]):
                if done[q]:
                    continue
                for i in range(n, n + total - 1):
                    L = nodes[i, 21]
                    far = 0.0
                    t = 0.0
                    for c in range(3):
                        d = seeds[q, 4 + c] - nodes[i, c]
                        far += d * d
                        t += d * nodes[i, 7 + c]
                    if far > 1.1 * L * L + 1e-15 or L <= 0.0:
                        continue
                    t /= L
                    for _ in range(5):
                        hermite(nodes[i], nodes[i + 1], L, t, mid)
                        d = 0.0
                        for c in range(3):
                            d += (seeds[q, 4 + c] - mid[c]) * (nodes[i, 7 + c] * (1.0 - t) + nodes[i + 1, 7 + c] * t)
                        t += d / L
                        t = min(max(t, -0.1), 1.1)
                    if not (-1e-6 <= t * L <= L + 1e-6):
                        continue
                    off = 0.0
                    for c in range(3):
                        off += (seeds[q, 4 + c] - mid[c]) ** 2
                    aside = 0.0
                    for c in range(4):
                        aside = max(aside, abs(seeds[q, c] - mid[3 + c]))
                    if off < 4e-16 + 16.0 * tol * tol and aside < 0.05:
                        done[q] = True
                        break
            m += 1
            n += total
    return nodes[:n].copy(), arcs[:m].copy()


@kernel
def corrected(A: Array, B: Array, starts: Array, T: Array, level: Array) -> tuple[Array, Array]:
    """Jets (k, 3, 7) where the planes T . x = level meet both pieces near the starts (k, 4), and gaps, -1: failed."""
    most = max(max(A.shape[0], A.shape[1]), max(B.shape[0], B.shape[1])) + 1
    bu, bv, h, ja, jb, frame = (
        np.empty((3, most)), np.empty((3, most)), np.empty((6, 4)), np.empty((6, 3)), np.empty((6, 3)),
        np.empty((FRAME, 4)),
    )  # fmt: skip
    out = np.zeros((starts.shape[0], 3, 7))
    gaps = np.empty(starts.shape[0])
    for k in range(starts.shape[0]):
        w = starts[k].copy()
        gaps[k] = slice_newton(A, B, w, T[k], level[k], 20, bu, bv, h, ja, jb, frame, 1e-13)
        if gaps[k] >= 0.0 and not curve_jet(ja, jb, frame, 1.0 if dot(frame[4], T[k]) > 0.0 else -1.0, w, out[k]):
            gaps[k] = -1.0
    return out, gaps


@kernel
def piece_lengths(jets: Array) -> Array:
    """(n - 1,) the lengths of the Hermite pieces between n jets (n, 21)."""
    out = np.empty(jets.shape[0] - 1)
    for k in range(out.shape[0]):
        out[k] = piece_length(jets[k], jets[k + 1])
    return out


@kernel
def surface_jets(net: Array, uv: Array) -> Array:
    """(k, 6, 3) S, S_u, S_v, S_uu, S_uv, S_vv of one piece at local parameters (k, 2)."""
    most = max(net.shape[0], net.shape[1]) + 1
    bu, bv, h = np.empty((3, most)), np.empty((3, most)), np.empty((6, 4))
    out = np.empty((uv.shape[0], 6, 3))
    for k in range(uv.shape[0]):
        jets(net, uv[k, 0], uv[k, 1], bu, bv, h, out[k])
    return out


@kernel
def speeds(nets: Array, which: IntArray, uv: Array) -> Array:
    """(k, 2) |S_u| and |S_v| of the pieces `which` (k,) of nets (n, p + 1, q + 1, 4) at local parameters (k, 2)."""
    most = max(nets.shape[1], nets.shape[2]) + 1
    bu, bv, h, j = np.empty((3, most)), np.empty((3, most)), np.empty((6, 4)), np.empty((6, 3))
    out = np.empty((uv.shape[0], 2))
    for k in range(uv.shape[0]):
        jets(nets[which[k]], uv[k, 0], uv[k, 1], bu, bv, h, j)
        for axis in range(2):
            out[k, axis] = math.sqrt(dot(j[1 + axis], j[1 + axis]))
    return out
