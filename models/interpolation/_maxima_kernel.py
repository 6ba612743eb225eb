"""The bounded least-squares problem of the maxima condition: Levenberg-Marquardt with an active set.

Every f_i holds four neighbouring knots, so the normal equations have seven diagonals and a step costs O(n). Letters and
equation numbers as in `maxima_knots`. Knots are held with their neighbours outside, e[0..n+3] = t_-1..t_{n+2}.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import inner, kernel
from patchwright.models.arrays import Array

MOST_STEPS = 500
FIRST_DAMPING = 2.0**-10  # of the diagonal; adapted from there
EPS = 2.0**-52
SETTLED = 2.0**-42  # of F: a step that gains less is the last


@inner
def misses(s: Array, e: Array, f: Array) -> float:
    """Put the f_i of sites s (n + 1,) into f, and return F, the sum of their squares."""
    total = 0.0
    for i in range(s.shape[0]):
        # 3.7 and 3.8, in differences from s_i, which lose nothing where steps are small
        f[i] = (e[i + 3] - s[i]) * (e[i + 2] - s[i]) - (s[i] - e[i + 1]) * (s[i] - e[i])
        total += f[i] * f[i]  # 3.9
    return total


@inner
def normal_equations(s: Array, e: Array, f: Array, slope: Array, normal: Array) -> None:
    """slope = J'f and normal[:, lag] = the diagonals of J'J, over e; rows of the two outermost stay unused."""
    slope[:] = 0.0
    normal[:] = 0.0
    n = s.shape[0] - 1
    for i in range(n + 1):
        r0 = s[i] - e[i + 1]
        r1 = s[i] - e[i]
        r2 = e[i + 3] - s[i]
        r3 = e[i + 2] - s[i]
        if i == 0:
            r1 += r0  # t_-1 moves with t_0
            r0 = 0.0
        if i == n:
            r2 += r3  # t_{n+2} with t_{n+1}
            r3 = 0.0
        slope[i] += r0 * f[i]
        slope[i + 1] += r1 * f[i]
        slope[i + 2] += r2 * f[i]
        slope[i + 3] += r3 * f[i]
        normal[i, 0] += r0 * r0
        normal[i, 1] += r0 * r1
        normal[i, 2] += r0 * r2
        normal[i, 3] += r0 * r3
        normal[i + 1, 0] += r1 * r1
        normal[i + 1, 1] += r1 * r2
        normal[i + 1, 2] += r1 * r3
        normal[i + 2, 0] += r2 * r2
        normal[i + 2, 1] += r2 * r3
        normal[i + 3, 0] += r3 * r3


@inner
def damped_step(slope: Array, normal: Array, held: Array, factor: float, floor: float, low: Array, step: Array) -> None:
    """step = -(J'J + damping)^-1 J'f over the knots that are not held, by a banded L D L'; low is room for L and D."""
    m = slope.shape[0] - 2  # knots t_0..t_{n+1} are rows 1..m
    for j in range(1, m + 1):
        free = not held[j]
        for lag in range(min(3, j - 1), 0, -1):  # row j of L, the farthest column first
            k = j - lag
            value = normal[k, lag] if free and not held[k] else 0.0
            for other in range(lag + 1, min(3, j - 1) + 1):
                c = j - other
                if k - c <= 3:
                    value -= low[j, other] * low[k, k - c] * low[c, 0]
            low[j, lag] = value / low[k, 0]
        pivot = normal[j, 0] * factor + floor if free else 1.0
        for lag in range(1, min(3, j - 1) + 1):
            pivot -= low[j, lag] * low[j, lag] * low[j - lag, 0]
        low[j, 0] = pivot
        value = -slope[j] if free else 0.0
        for lag in range(1, min(3, j - 1) + 1):
            value -= low[j, lag] * step[j - lag]
        step[j] = value
    for j in range(1, m + 1):
        step[j] /= low[j, 0]
    for j in range(m, 0, -1):
        for lag in range(1, min(3, m - j) + 1):
            step[j] -= low[j + lag, lag] * step[j + lag]


@inner
def place(t: Array, at_start: float, at_end: float, e: Array) -> None:
    """e = t with its neighbours outside."""
    m = t.shape[0]
    e[0] = t[0] - at_start
    for j in range(m):
        e[j + 1] = t[j]
    e[m + 1] = t[m - 1] + at_end


@kernel
def descend(
    s: Array, at_start: float, at_end: float, start: Array, below: Array, above: Array
) -> tuple[Array, float, int, bool]:
    """From start (n + 2,) down to a local minimum of F with below <= t <= above: knots, F, steps, whether settled.

    at_start is t_0 - t_-1, at_end is t_{n+2} - t_{n+1}.
    """
    m = start.shape[0]
    t = np.minimum(np.maximum(start, below), above)
    new = np.empty(m)
    e = np.empty(m + 2)
    e_new = np.empty(m + 2)
    f = np.empty(m - 1)
    f_new = np.empty(m - 1)
    slope = np.empty(m + 2)
    step = np.empty(m + 2)
    normal = np.empty((m + 2, 4))
    low = np.empty((m + 2, 4))
    held = np.zeros(m + 2, dtype=np.bool_)
    place(t, at_start, at_end, e)
    F = misses(s, e, f)
    damping = FIRST_DAMPING
    for steps in range(MOST_STEPS):
        normal_equations(s, e, f, slope, normal)
        largest = 0.0
        level = True
        for j in range(m):
            g = slope[j + 1]
            held[j + 1] = (t[j] <= below[j] and g > 0.0) or (t[j] >= above[j] and g < 0.0)
            if not held[j + 1]:
                largest = max(largest, normal[j + 1, 0])
                level = level and g == 0.0
        if F == 0.0 or level:
            return t, F, steps, True
        while True:
            damped_step(slope, normal, held, 1.0 + damping, EPS * largest, low, step)
            moved = 0.0
            for j in range(m):
                new[j] = min(max(t[j] + step[j + 1], below[j]), above[j])
                moved = max(moved, abs(new[j] - t[j]))
            place(new, at_start, at_end, e_new)
            F_new = misses(s, e_new, f_new)
            if F_new < F or moved <= 4.0 * EPS:
                break
            damping *= 4.0
            if damping > 1.0 / EPS:  # no step down the slope lowers F in double precision
                return t, F, steps, True
        gained = F - F_new
        if gained <= 0.0:
            return t, F, steps, True
        t, new = new, t
        e, e_new = e_new, e
        f, f_new = f_new, f
        F = F_new
        damping /= 8.0
        if gained <= SETTLED * F:
            return t, F, steps + 1, True
    return t, F, MOST_STEPS, False
