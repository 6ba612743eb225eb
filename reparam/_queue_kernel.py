"""Kernel of the paper's placement: points of a grid moved one at a time, those of the highest penalty first."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import inner, kernel
from patchwright.models._nurbs_kernel import find_span, general_sums, quotient
from patchwright.models.arrays import Array


@inner
def evaluate(
    U: Array, p: int, V: Array, q: int, net: Array, u: float, v: float, order: int, rows_u: Array, rows_v: Array,
    sums: Array, binomial: Array,
) -> None:  # fmt: skip
    """sums[e, f, 0..2] = the derivatives of the surface at (u, v) below `order`."""
    i = find_span(U, p, net.shape[0], u)
    j = find_span(V, q, net.shape[1], v)
    zero = order - order
    general_sums(U, p, i, u, V, q, j, v, net, (zero, order), (zero, order), rows_u, rows_v, sums)
    if net.shape[2] == 4:
        quotient(sums, order, order, binomial)


@inner
def share_off(a: Array, b: Array, c: Array, step: float) -> float:
    """|b - a| / (|b - a| + |c - b|) - step; 0 where all three are one point."""
    before = np.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
    after = np.sqrt((c[0] - b[0]) ** 2 + (c[1] - b[1]) ** 2 + (c[2] - b[2]) ** 2)
    if before + after <= 0.0:
        return 0.0
    return before / (before + after) - step


@inner
def penalty_of(points: Array, i: int, j: int, s: Array, t: Array, parts: int, out: Array) -> float:
    """The residuals of point (i, j): its own two, with `parts` = 6 those of its four inner neighbours along the lines
    through it too. Returns the sum of their squares."""
    m = points.shape[0] - 1
    n = points.shape[1] - 1
    for k in range(6):
        out[k] = 0.0
    out[0] = share_off(points[i - 1, j], points[i, j], points[i + 1, j], s[i - 1])
    out[1] = share_off(points[i, j - 1], points[i, j], points[i, j + 1], t[j - 1])
    if parts == 2:
        return out[0] * out[0] + out[1] * out[1]
    if i > 1:
        out[2] = share_off(points[i - 2, j], points[i - 1, j], points[i, j], s[i - 2])
    if i < m - 1:
        out[3] = share_off(points[i, j], points[i + 1, j], points[i + 2, j], s[i])
    if j > 1:
        out[4] = share_off(points[i, j - 2], points[i, j - 1], points[i, j], t[j - 2])
    if j < n - 1:
        out[5] = share_off(points[i, j], points[i, j + 1], points[i, j + 2], t[j])
    total = 0.0
    for k in range(6):
        total += out[k] * out[k]
    return total


@inner
def upright(uv: Array, i: int, j: int, u: float, v: float) -> bool:
    """Whether the four cells round (i, j) stay convex with the point at (u, v)."""
    for a in range(-1, 2, 2):
        for b in range(-1, 2, 2):
            x1 = uv[i + a, j, 0] - u
            y1 = uv[i + a, j, 1] - v
            x2 = uv[i, j + b, 0] - u
            y2 = uv[i, j + b, 1] - v
            sign = a * b
            # at the point itself, at both neighbours, and at the corner across
            if (x1 * y2 - y1 * x2) * sign <= 0.0:
                return False
            cu = uv[i + a, j + b, 0]
            cv = uv[i + a, j + b, 1]
            d1u = cu - uv[i + a, j, 0]
            d1v = cv - uv[i + a, j, 1]
            d2u = cu - uv[i, j + b, 0]
            d2v = cv - uv[i, j + b, 1]
            if (x1 * d1v - y1 * d1u) * sign <= 0.0:
                return False
            if (d2u * y2 - d2v * x2) * sign <= 0.0:
                return False
            if (d2u * d1v - d2v * d1u) * sign <= 0.0:
                return False
    return True


@kernel
def run_queue(
    U: Array, p: int, V: Array, q: int, net: Array, uv: Array, s: Array, t: Array, box: Array, parts: int,
    still: float, most: int,
) -> tuple[Array, int, bool]:  # fmt: skip
    """Parameters (m + 1, n + 1, 2) after moving inner points until none moves by more than `still` of the domain.

    `s` (m - 1,) and `t` (n - 1,) are the step shares at the inner points. In every iteration the points with a moved
    neighbour are sorted by penalty and moved in that order, by Gauss-Newton, damped until it lowers their penalty: the
    square sum of their own two residuals (`parts` = 2), or of all six they have part in (`parts` = 6). Returns the
    parameters, the number of moves, and whether no point moved in the end.
    """
    m = uv.shape[0] - 1
    n = uv.shape[1] - 1
    at = uv.copy()
    width = box[:, 1] - box[:, 0]
    rows_u = np.empty((2, p + 1))
    rows_v = np.empty((2, q + 1))
    sums = np.empty((2, 2, 4))
    binomial = np.array([[1.0, 0.0], [1.0, 1.0]])
    two = rows_u.shape[0]
    points = np.empty((m + 1, n + 1, 3))
    for i in range(m + 1):
        for j in range(n + 1):
            evaluate(U, p, V, q, net, at[i, j, 0], at[i, j, 1], two, rows_u, rows_v, sums, binomial)
            for c in range(3):
                points[i, j, c] = sums[0, 0, c]
    r = np.empty(6)
    new_r = np.empty(6)
    slopes = np.empty((6, 2))
    old = np.empty(3)
    reach = 1 if parts == 2 else 2
    moved = np.ones((m + 1, n + 1), dtype=np.bool_)
    moves = 0
    while moves < most:
        order = np.empty((m - 1) * (n - 1), dtype=np.int64)
        keys = np.empty((m - 1) * (n - 1))
        count = 0
        for i in range(1, m):
            for j in range(1, n):
                near = False
                for k in range(-reach, reach + 1):
                    x = min(max(i + k, 0), m)
                    y = min(max(j + k, 0), n)
                    near = near or moved[x, j] or moved[i, y]
                if near:
                    order[count] = i * (n + 1) + j
                    keys[count] = -penalty_of(points, i, j, s, t, parts, r)
                    count += 1
        if count == 0:
            return at, moves, True
        sorting = np.argsort(keys[:count])
        moved[:] = False
        for rank in range(count):
            i = order[sorting[rank]] // (n + 1)
            j = order[sorting[rank]] % (n + 1)
            u = at[i, j, 0]
            v = at[i, j, 1]
            energy = penalty_of(points, i, j, s, t, parts, r)
            evaluate(U, p, V, q, net, u, v, two, rows_u, rows_v, sums, binomial)
            for c in range(3):
                old[c] = points[i, j, c]
            for k in range(2):  # derivatives of the residuals by the point, along either tangent
                h = 1e-6 * width[k]
                for side in range(2):
                    for c in range(3):
                        d = sums[1, 0, c] if k == 0 else sums[0, 1, c]
                        points[i, j, c] = old[c] + (h if side == 0 else -h) * d
                    penalty_of(points, i, j, s, t, parts, new_r)
                    for e in range(parts):
                        slopes[e, k] = new_r[e] if side == 0 else (slopes[e, k] - new_r[e]) / (2.0 * h)
            for c in range(3):
                points[i, j, c] = old[c]
            a = 0.0
            b = 0.0
            d_ = 0.0
            g0 = 0.0
            g1 = 0.0
            for e in range(parts):
                a += slopes[e, 0] * slopes[e, 0]
                b += slopes[e, 0] * slopes[e, 1]
                d_ += slopes[e, 1] * slopes[e, 1]
                g0 += slopes[e, 0] * r[e]
                g1 += slopes[e, 1] * r[e]
            damping = 0.0
            for _ in range(12):
                aa = a * (1.0 + damping)
                dd = d_ * (1.0 + damping)
                det = aa * dd - b * b
                du = -(dd * g0 - b * g1) / det if det > 0.0 else 0.0
                dv = -(aa * g1 - b * g0) / det if det > 0.0 else 0.0
                if abs(du) <= still * width[0] and abs(dv) <= still * width[1]:
                    break
                nu = min(max(u + du, box[0, 0]), box[0, 1])
                nv = min(max(v + dv, box[1, 0]), box[1, 1])
                if upright(at, i, j, nu, nv):
                    evaluate(U, p, V, q, net, nu, nv, two, rows_u, rows_v, sums, binomial)
                    for c in range(3):
                        points[i, j, c] = sums[0, 0, c]
                    if penalty_of(points, i, j, s, t, parts, new_r) < energy:
                        moved[i, j] = True
                        moves += 1
                        at[i, j, 0] = nu
                        at[i, j, 1] = nv
                        break
                    for c in range(3):
                        points[i, j, c] = old[c]
                damping = max(4.0 * damping, 0.25)
    return at, moves, False
