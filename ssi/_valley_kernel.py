"""Follow a curve along which two Bezier pieces are tangent.

There the surfaces' distance has a valley whose bottom is zero: the curve is the bottom, found as the place where f's
derivative across the valley vanishes (f = z_a - z_b over the common tangent plane). That is a minimum and not a root of
f, so the steps stay quadratic where those for crossing surfaces break down.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

import numpy as np

from patchwright.models._compile_kernel import inner, kernel
from patchwright.models.arrays import Array, IntArray
from patchwright.ssi._graph_kernel import difference
from patchwright.ssi._jet_kernel import cross, dot, jets, tangent_coordinates, unit
from patchwright.ssi._tracing_kernel import BALL, BORDER, CLOSED, PARTED, STUCK, slack, towards


@inner
def bottom(
    A: Array, B: Array, w: Array, T: Array, level: float, everywhere: Array, work: tuple[Array, ...], row: Array
) -> bool:
    """Move w to the valley's bottom in the plane T . x = level; row = x, w, then their first derivatives, f
    counted towards the open side."""
    F, c, f, ga, gb, bu, bv, h, ja, jb = work
    jets(A, w[0], w[1], bu, bv, h, ja)
    jets(B, w[2], w[3], bu, bv, h, jb)
    cross(ja[1], ja[2], F[2])
    if unit(F[2]) == 0.0:
        return False
    lean = dot(T, F[2])
    for k in range(3):
        F[0, k] = T[k] - lean * F[2, k]
        c[k] = ja[0, k]
    if unit(F[0]) == 0.0:
        return False
    cross(F[2], F[0], F[1])
    x = level - dot(T, c)
    y = 0.0
    ok = False
    for _ in range(15):
        if not difference(A, B, w, x, y, F, c, everywhere, everywhere, bu, bv, h, ja, jb, ga, gb, f):
            return False
        if f[5] == 0.0:
            return False
        d = -f[2] / f[5]
        if abs(d) > 0.2:
            return False
        y += d
        if abs(d) < 1e-13:
            ok = True
            break
    if not ok and abs(d) > 1e-9:
        return False
    if abs(f[5]) < 3.0 * abs(f[3]):
        return False
    # the bottom's direction: f_y stays zero
    t = -f[4] / f[5]
    for k in range(3):
        row[k] = 0.5 * (ja[0, k] + jb[0, k])
        row[7 + k] = F[0, k] + t * F[1, k] + (ga[1] + t * ga[2]) * F[2, k]
    unit(row[7:10])
    for k in range(4):
        row[3 + k] = w[k]
    row[14] = f[0] if f[5] > 0.0 else -f[0]
    return tangent_coordinates(ja, row[7:10], row, 10) and tangent_coordinates(jb, row[7:10], row, 12)


@kernel
def trace_valleys(
    A: Array, B: Array, seeds: Array, balls: Array, longest: float, turn: float, tol: float
) -> tuple[Array, IntArray]:  # fmt: skip
    """Arcs of tangency through the seeds (k, 7): rows of x, w, their first derivatives and f, and per arc first
    row, end, and how it ended behind and ahead, the balls."""
    most = max(max(A.shape[0], A.shape[1]), max(B.shape[0], B.shape[1])) + 1
    work = (
        np.empty((3, 3)), np.empty(3), np.empty(6), np.empty(6), np.empty(6), np.empty((3, most)),
        np.empty((3, most)), np.empty((6, 4)), np.empty((6, 3)), np.empty((6, 3)),
    )  # fmt: skip
    ja = work[8]
    jb = work[9]
    everywhere = np.array([-1.0, 2.0, -1.0, 2.0])
    out = np.empty((20000, 15))
    arcs = np.empty((seeds.shape[0] + 1, 6), np.int64)
    done = np.zeros(seeds.shape[0], np.bool_)
    parts = np.empty((2, 4000, 15))
    w = np.empty(4)
    T = np.empty(3)
    row = np.empty(15)
    n = 0
    m = 0
    for k in range(seeds.shape[0]):
        for i in range(balls.shape[0]):
            far = 0.0
            for c in range(3):
                far += (balls[i, c] - seeds[k, 4 + c]) ** 2
            done[k] |= far < balls[i, 3] ** 2
    for k in range(seeds.shape[0]):
        if done[k]:
            continue
        done[k] = True
        for i in range(4):
            w[i] = seeds[k, i]
        # any direction, then the valley's own
        jets(A, w[0], w[1], work[5], work[6], work[7], ja)
        settled = False
        for axis in range(2):
            T[:] = ja[1 + axis]
            unit(T)
            for i in range(4):
                w[i] = seeds[k, i]
            if bottom(A, B, w, T, dot(T, seeds[k, 4:7]), everywhere, work, row):
                settled = True
            else:
                F = work[0]
                f = work[2]
                # the frame of the failed try still tells the direction of least curvature
                e = 0.5 * math.atan2(2.0 * f[4], f[3] - f[5])
                a = math.cos(e)
                b = math.sin(e)
                if abs(f[3] * a * a + 2.0 * f[4] * a * b + f[5] * b * b) > abs(
                    f[3] * b * b - 2.0 * f[4] * a * b + f[5] * a * a
                ):
                    a, b = -b, a
                for c in range(3):
                    T[c] = a * F[0, c] + b * F[1, c]
                unit(T)
                for i in range(4):
                    w[i] = seeds[k, i]
                settled = bottom(A, B, w, T, dot(T, seeds[k, 4:7]), everywhere, work, row)
            if settled:
                break
        if not settled:
            continue
        T[:] = row[7:10]
        for i in range(4):
            w[i] = row[3 + i]
        if not bottom(A, B, w, T, dot(T, row), everywhere, work, row) or abs(row[14]) > tol:
            continue
        start = row.copy()
        counts = [0, 0]
        codes = [STUCK, STUCK]
        hit = [-1, -1]
        for side in range(2):
            buf = parts[side]
            buf[0] = start
            if side == 1:
                for c in range(7, 14):
                    buf[0, c] = -start[c]
            count = 1
            step = 0.25 * longest
            code = STUCK
            for _ in range(60000):
                if count >= buf.shape[0] - 1 or step < 1e-9:
                    break
                a_row = buf[count - 1]
                T[:] = a_row[7:10]
                step, _ = towards(balls, a_row, step)
                for i in range(4):
                    w[i] = a_row[3 + i] + step * a_row[10 + i]
                if not bottom(A, B, w, T, dot(T, a_row) + step, everywhere, work, row):
                    step *= 0.5
                    continue
                if dot(row[7:10], T) < 0.0:
                    for c in range(7, 14):
                        row[c] = -row[c]
                cosine = dot(row[7:10], T)
                if cosine < math.cos(turn):
                    step *= 0.6
                    continue
                if abs(row[14]) > tol:
                    if step > 1e-5 * longest:
                        step *= 0.5
                        continue
                    code = PARTED if row[14] > 0.0 else STUCK
                    break
                # borders
                first = -1
                when = 1.0
                for i in range(4):
                    x = row[3 + i]
                    d = slack(ja if i < 2 else jb, 1 + i % 2, tol)
                    if x < -d or x > 1.0 + d:
                        edge = 0.0 if x < 0.0 else 1.0
                        p = (edge - a_row[3 + i]) / (x - a_row[3 + i])
                        if p <= when:
                            when = p
                            first = i
                if first >= 0:
                    edge = 0.0 if row[3 + first] < 0.0 else 1.0
                    lo = 0.0
                    hi = step
                    s = when * step
                    good = True
                    for _ in range(12):
                        for i in range(4):
                            w[i] = a_row[3 + i] + s * a_row[10 + i]
                        if not bottom(A, B, w, T, dot(T, a_row) + s, everywhere, work, row):
                            good = False
                            break
                        if dot(row[7:10], T) < 0.0:
                            for c in range(7, 14):
                                row[c] = -row[c]
                        rate = row[10 + first] / max(dot(row[7:10], T), 0.1)
                        if rate == 0.0:
                            break
                        d = (edge - row[3 + first]) / rate
                        s = min(max(s + d, lo), hi)
                        if abs(d) < 1e-15:
                            break
                    if good and s > 1e-9:
                        row[3 + first] = edge
                        for i in range(4):
                            row[3 + i] = min(max(row[3 + i], 0.0), 1.0)
                        buf[count] = row
                        count += 1
                    code = BORDER
                    break
                # home
                if count >= 3:
                    s = 0.0
                    off = 0.0
                    turned = -1.0 if side == 1 else 1.0
                    for c in range(3):
                        s += (start[c] - a_row[c]) * T[c]
                        off += (start[c] - a_row[c]) ** 2
                    if (
                        0.0 < s <= step * (1.0 + 1e-9)
                        and off < 2.0 * step * step
                        and dot(start[7:10], T) * turned > 0.5
                    ):
                        buf[count] = start
                        count += 1
                        code = CLOSED
                        break
                for i in range(balls.shape[0]):
                    far = 0.0
                    for c in range(3):
                        far += (balls[i, c] - row[c]) ** 2
                    if far < balls[i, 3] ** 2:
                        code = BALL
                        hit[side] = i
                buf[count] = row
                count += 1
                if code == BALL:
                    break
                step = min(longest, step * min(1.5, 0.8 * turn / max(math.acos(min(cosine, 1.0)), 1e-9)))
            counts[side] = count
            codes[side] = code
            if code == CLOSED:
                counts[1] = 1
                codes[1] = CLOSED
                break
        total = counts[0] + counts[1] - 1
        if n + total > out.shape[0]:
            bigger = np.empty((2 * (n + total), 15))
            bigger[:n] = out[:n]
            out = bigger
        for i in range(counts[1] - 1):
            out[n + i] = parts[1, counts[1] - 1 - i]
            for c in range(7, 14):
                out[n + i, c] = -out[n + i, c]
        for i in range(counts[0]):
            out[n + counts[1] - 1 + i] = parts[0, i]
        arcs[m, 0] = n
        arcs[m, 1] = n + total
        arcs[m, 2] = codes[1]
        arcs[m, 3] = codes[0]
        arcs[m, 4] = hit[1]
        arcs[m, 5] = hit[0]
        for q in range(k + 1, seeds.shape[0]):
            if done[q]:
                continue
            for i in range(n, n + total - 1):
                L = 0.0
                along = 0.0
                far = 0.0
                for c in range(3):
                    L += (out[i + 1, c] - out[i, c]) ** 2
                    d = seeds[q, 4 + c] - out[i, c]
                    far += d * d
                    along += d * out[i, 7 + c]
                if far <= 1.1 * L + 1e-12 and along >= -1e-6:
                    aside = far - along * along
                    if aside <= 4.0 * turn * turn * L + 1e-12:
                        done[q] = True
                        break
                if far <= 1e-10:
                    done[q] = True
                    break
        m += 1
        n += total
    return out[:n].copy(), arcs[:m].copy()
