"""Kernel of the closest point on a NURBS surface: damped Newton steps inside the domain's box, one point after
another."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import kernel
from patchwright.models._nurbs_kernel import find_span, general_sums, quotient
from patchwright.models.arrays import Array, IntArray


@kernel
def polish(
    U: Array,
    p: int,
    V: Array,
    q: int,
    net: Array,
    points: Array,
    uv: Array,
    box: Array,
    closed: IntArray,
    size: float,
    steps: int,
) -> tuple[Array, IntArray]:
    """Foot points (k, 2) from the starts uv (k, 2), and a status each: 0 square, 1 stopped on the boundary, 2 not
    settled.

    Minimises f = |S(u, v) - P|^2 / 2. `box` is [[u0, u1], [v0, v1]], `closed` marks directions that wrap round,
    `size` is a length of the surface; a Newton step below 1e-14 of it ends the search. Where the Hessian is not
    positive on the free directions, or a step would go uphill, Gauss-Newton with Levenberg's damping takes over.
    """
    n = net.shape[0]
    m = net.shape[1]
    rational = net.shape[2] == 4
    feet = uv.copy()
    status = np.full(points.shape[0], 2)
    rows_u = np.empty((3, p + 1))
    rows_v = np.empty((3, q + 1))
    sums = np.empty((3, 3, 4))
    top = rows_u.shape[0]  # 3, but no literal: the same compiled general_sums serves
    low = top - 3
    binomial = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 1.0]])
    width = box[:, 1] - box[:, 0]
    x = np.empty(2)
    new = np.empty(2)
    g = np.empty(2)
    free = np.empty(2, dtype=np.bool_)
    step = np.empty(2)
    for k in range(points.shape[0]):
        x[0] = feet[k, 0]
        x[1] = feet[k, 1]
        new[0] = x[0]
        new[1] = x[1]
        best = np.inf
        damping = 0.0
        idle = 0
        trusted = False  # the last step was a full Newton step so short that f no longer tells up from down
        for _ in range(steps):
            i = find_span(U, p, n, new[0])
            j = find_span(V, q, m, new[1])
            general_sums(U, p, i, new[0], V, q, j, new[1], net, (low, top), (low, top), rows_u, rows_v, sums)
            if rational:
                quotient(sums, top, top, binomial)
            f = 0.0
            for c in range(3):
                f += (sums[0, 0, c] - points[k, c]) ** 2
            f *= 0.5
            lower = f < best
            if f <= best or trusted:
                best = f
                x[0] = new[0]
                x[1] = new[1]
                damping = 0.1 * damping if damping > 1.0 else 0.0
                g[:] = 0.0
                suu = 0.0
                suv = 0.0
                svv = 0.0
                huu = 0.0
                huv = 0.0
                hvv = 0.0
                for c in range(3):
                    r = sums[0, 0, c] - points[k, c]
                    g[0] += r * sums[1, 0, c]
                    g[1] += r * sums[0, 1, c]
                    suu += sums[1, 0, c] ** 2
                    suv += sums[1, 0, c] * sums[0, 1, c]
                    svv += sums[0, 1, c] ** 2
                    huu += r * sums[2, 0, c]
                    huv += r * sums[1, 1, c]
                    hvv += r * sums[0, 2, c]
            else:
                damping = max(8.0 * damping, 0.1)
            trusted = False
            for c in range(2):
                free[c] = closed[c] == 1 or not (
                    (x[c] <= box[c, 0] and g[c] >= 0.0) or (x[c] >= box[c, 1] and g[c] <= 0.0)
                )
            # the damping is measured in lengths, so that a pole, where S_u vanishes, stays solvable
            floor_u = max(suu, 1e-12 * (size / width[0]) ** 2)
            floor_v = max(svv, 1e-12 * (size / width[1]) ** 2)
            a = suu + huu
            b = suv + huv
            c_ = svv + hvv
            if free[0] and free[1]:
                bowl = a > 0.0 and a * c_ - b * b > 1e-12 * abs(a * c_)
            elif free[0]:
                bowl = a > 0.0
            else:
                bowl = c_ > 0.0
            newton = bowl and damping == 0.0
            if bowl:
                a += damping * floor_u
                c_ += damping * floor_v
            else:
                lift = max(damping, 1e-10)
                a = suu + lift * floor_u
                b = suv
                c_ = svv + lift * floor_v
            step[0] = 0.0
            step[1] = 0.0
            if free[0] and free[1]:
                det = a * c_ - b * b
                step[0] = -(c_ * g[0] - b * g[1]) / det
                step[1] = -(a * g[1] - b * g[0]) / det
                # a step through one wall: slide along it
                for c in range(2):
                    if closed[c] == 0:
                        wall = box[c, 0] if x[c] + step[c] < box[c, 0] else box[c, 1]
                        if x[c] + step[c] < box[c, 0] or x[c] + step[c] > box[c, 1]:
                            step[c] = wall - x[c]
                            o = 1 - c
                            step[o] = -(g[o] + b * step[c]) / (c_ if o == 1 else a)
                            break
            elif free[0]:
                step[0] = -g[0] / a
            elif free[1]:
                step[1] = -g[1] / c_
            for c in range(2):
                t = x[c] + min(max(step[c], -0.5 * width[c]), 0.5 * width[c])
                if closed[c] == 1:
                    if t < box[c, 0]:
                        t += width[c]
                    elif t > box[c, 1]:
                        t -= width[c]
                t = min(max(t, box[c, 0]), box[c, 1])
                new[c] = t
                if abs(step[c]) > abs(t - x[c]) and closed[c] == 0:
                    step[c] = t - x[c]
            move = np.sqrt(suu) * abs(step[0]) + np.sqrt(svv) * abs(step[1])
            still = (abs(step[0]) <= 1e-15 * width[0]) and (abs(step[1]) <= 1e-15 * width[1])
            # g carries round-off of this size: where S_u and S_v are square to P - S within it, nothing is left to gain
            reach = np.sqrt(2.0 * best)
            square = True
            for c in range(2):
                length = np.sqrt(suu if c == 0 else svv)
                if free[c] and abs(g[c]) > 4e-15 * (length * (size + reach) + reach * size / width[c]):
                    square = False
            idle = idle + 1 if newton and move <= 1e-8 * size and not lower else 0
            square = square or idle >= 3
            if (newton and move <= 1e-14 * size) or still or square:
                if newton and not square:
                    x[0] = new[0]
                    x[1] = new[1]
                status[k] = 0
                for c in range(2):
                    length = np.sqrt(suu if c == 0 else svv)
                    if not free[c] and abs(g[c]) > 1e-9 * length * (np.sqrt(2.0 * best) + 1e-9 * size):
                        status[k] = 1
                break
            trusted = newton and move <= 1e-6 * size
        feet[k, 0] = x[0]
        feet[k, 1] = x[1]
    return feet, status
