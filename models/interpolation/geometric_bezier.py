"""C2GBP: the geometric piecewise cubic Bezier construction of Fadhel and Omar, as printed.

Source: Fadhel and Omar, Geometric piecewise cubic Bezier interpolating polynomial with C^2 continuity. Step numbers are
theirs. Planar points of increasing x, one cubic for each interval, all of equal parameter step.

Misprints set right: step 2's intercept is b_j = y_(j-1) - a_j x_(j-1); step 6's line is y = omega_0 x + h_0. Where
the text leaves a choice, this is the reading whose errors come closest to the printed ones on all three test
problems: step 5 uses the distance it names in words (W_1 to its foot on W_0 W_2) and not the one in its formula; step
11 takes the root in which p_2^1 lies after p_1^0, step 15 the root of larger x; step 14's replacement of W_(s+1) by a
foot chi at inflections, which would put p_2^s on a perpendicular of the chord, is not done; the last interval has no
inflection; and where (8) has no real root, its real part is taken, which is the nearest point of the line. In spite
of the name the curve is C1: only lengths, not vectors, are matched in steps 12 to 15.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.interpolation.claims import Interpolated, scheme
from patchwright.models.interpolation.hermite import cubic_from_bezier


@scheme(
    "c2gbp", exact_degree=None, continuity=1, reach=None, linear=False, dimension=2, least=3,
    parameters="uniform", fixed=True, source="Fadhel, Omar",
)  # fmt: skip
def c2gbp(P: Array, s: Array) -> Interpolated:
    """The construction as printed.

    Raises
    ------
    ParameterError : x does not increase, the first three points lie on a line, or two lines of a step are parallel.
    """
    x = P[:, 0]
    if not (x[1:] > x[:-1]).all():
        at = int(np.argmin(x[1:] > x[:-1]))
        raise ParameterError(f"x must increase, but {x[at]:.17g} is followed by {x[at + 1]:.17g} at {at + 1}")
    first, second, unreal = inner_points(P)
    notes = tuple(f"step 15 has no real root in interval {k}; the nearest point of its line was taken" for k in unreal)
    smooth = np.ones(len(P) - 2, dtype=bool)
    return Interpolated(cubic_from_bezier(s, P, first, second, smooth=smooth), s, notes)


def inner_points(W: Array) -> tuple[Array, Array, list[int]]:
    """p_1^k and p_2^k, each (n, 2), for points W (n + 1, 2), and the intervals in which step 15 has no real root."""
    x, y = W.T
    n = len(W) - 1
    omega = np.diff(y) / np.diff(x)
    delta = y[:-1] - omega * x[:-1]  # step 1
    a = (y[2:] - y[:-2]) / (x[2:] - x[:-2])
    above = y[1:-1] - (y[:-2] + a * (x[1:-1] - x[:-2]))  # sigma_j - b_j of steps 2 and 3
    a, above = np.concatenate(([0.0], a)), np.concatenate(([0.0], above))  # from j = 1
    if above[1] == 0.0 or a[1] == omega[0] or a[1] == omega[1]:
        raise ParameterError("points 0, 1 and 2 lie on a line, on which the construction is not defined")
    p1, p2 = np.empty((n, 2)), np.empty((n, 2))
    gamma = 2.0 / 3.0 * abs(above[1]) / np.hypot(1.0, a[1])  # steps 4 and 5: m = 2, q = 3
    h, unreal = np.empty(n), []
    h[0] = delta[0] + (gamma if above[1] >= 0.0 else -gamma)
    at = (h[0] - (y[1] - a[1] * x[1])) / (a[1] - omega[0])
    p2[0] = at, omega[0] * at + h[0]  # step 6
    for k in range(1, n):
        reach = float(np.linalg.norm(W[k] - p2[k - 1]))
        p1[k] = 2.0 * W[k] - p2[k - 1]  # steps 8 and 12, the root that is not p_2 itself
        level = p1[k, 1] - omega[k] * p1[k, 0]
        turns = k < n - 1 and above[k] * above[k + 1] <= 0.0
        offset = abs(level - delta[k])
        h[k] = level if not turns else delta[k] + (offset if above[k] <= 0.0 else -offset)  # steps 9 and 13
        if k == 1:
            p1[0], p2[1] = _eleventh(a[1], omega[:2], h[:2], reach)
        else:
            p2[k], real = _fifteenth(W[k + 1], p1[k], p1[k - 1], 4.0 * reach, k)
            if not real:
                unreal.append(k)
    return p1, p2, unreal


def _eleventh(a: float, omega: Array, h: Array, reach: float) -> tuple[Array, Array]:
    """p_1^0 and p_2^1: where a line of slope a meets the two lines of slopes omega, four times `reach` apart."""
    c0, c1 = 1.0 / (a - omega[0]), 1.0 / (a - omega[1])
    apart = 4.0 * reach / np.hypot(1.0, a)
    epsilon = (h[1] * c1 - h[0] * c0 - apart) / (c1 - c0)  # the quadratic (7), whose roots differ in the sign of apart
    x0, x1 = (h[0] - epsilon) * c0, (h[1] - epsilon) * c1  # 4, 5
    return np.array([x0, omega[0] * x0 + h[0]]), np.array([x1, omega[1] * x1 + h[1]])


def _fifteenth(end: Array, start: Array, centre: Array, radius: float, k: int) -> tuple[Array, bool]:
    """p_2^k, on the line from p_1^k to W_(k+1) at the radius from p_1^(k-1), and whether there is such a point."""
    along = (end - start) / np.linalg.norm(end - start)
    middle = float(along @ (centre - start))
    square = radius**2 - float(((start + middle * along - centre) ** 2).sum())  # (8) along the line
    if not np.isfinite(square):
        raise ParameterError(f"the construction breaks down in interval {k}: its lines are parallel")
    root = float(np.sqrt(max(square, 0.0)))
    return np.asarray(start + (middle + (root if along[0] > 0.0 else -root)) * along), square >= 0.0
