"""The rational cubic Ball interpolant of Karim, for planar data of increasing x.

On each interval, with t in [0, 1] and h the step,

    S = (alpha f0 (1-t)^2 + (gamma f0 + alpha h d0) t (1-t)^2 + (gamma f1 - beta h d1) t^2 (1-t) + beta f1 t^2) / Q,
    Q = alpha (1-t)^2 + gamma t (1-t) + beta t^2,

the cubic Ball basis over a quadratic denominator with S = f and S' = d at both ends. Sources: the family of Karim, Far
East J. Math. Sci. 82 (2013) 193-207 and 96 (2015) 211-230, whose numerators follow from these end conditions alone;
alpha = beta = 1 is the rational cubic of Delbourgo and Gregory, SIAM J. Sci. Stat. Comput. 6 (1985) 967-976, whose
condition gamma >= (d0 + d1) / slope for monotone data is used here; gamma = 2 is the cubic Hermite interpolant. Slopes
are the arithmetic means of three points, or the geometric means. Not verified against Karim's own text, which gives the
condition of monotonicity in parameters of its own.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.interpolation.claims import Interpolated, scheme
from patchwright.models.interpolation.hermite import cubic_from_bezier


@scheme(
    "rational-ball", exact_degree=1, continuity=1, reach=2, linear=False, monotone=True, dimension=2,
    parameters="abscissa", fixed=True, source="Karim 2013, 2015; Delbourgo, Gregory 1985",
)  # fmt: skip
def rational_ball(
    P: Array, s: Array, *, alpha: float = 1.0, beta: float = 1.0, gamma: float | None = None,
    slopes: Literal["arithmetic", "geometric"] = "arithmetic",
) -> Interpolated:  # fmt: skip
    """The rational cubic Ball curve through planar points.

    Parameters
    ----------
    alpha, beta : positive shape parameters, pulling towards the start and the end of each interval
    gamma : positive; None: what monotone data ask for, 2 or more, with alpha and beta of 1
    slopes : how the derivatives at the points are estimated; geometric means exist for monotone data only, elsewhere
        the slope is 0

    Raises
    ------
    ParameterError : a shape parameter that is not positive, an unknown kind of slopes.
    """
    shape = [alpha, beta] + ([] if gamma is None else [gamma])
    if not all(np.isfinite(v) and v > 0.0 for v in shape):
        raise ParameterError(f"the shape parameters must be positive and finite, got {shape}")
    if gamma is None and (alpha, beta) != (1.0, 1.0):
        raise ParameterError("alpha and beta other than 1 need a gamma: the monotone one is known for 1 only")
    if slopes not in _SLOPES:
        raise ParameterError(f'slopes must be "arithmetic" or "geometric", got {slopes!r}')
    h, f = np.diff(s), P[:, 1]
    chord = np.diff(f) / h
    d = _SLOPES[slopes](h, chord)
    g = np.full(len(h), 2.0 if gamma is None else float(gamma))
    if gamma is None:
        monotone = (d[:-1] * chord >= 0.0) & (d[1:] * chord >= 0.0) & (chord != 0.0)
        asked = np.divide(d[:-1] + d[1:], chord, out=np.zeros_like(chord), where=monotone)
        g = np.maximum(g, asked)
    q = np.stack((np.full_like(g, alpha), (alpha + g) / 3.0, (beta + g) / 3.0, np.full_like(g, beta)), axis=1)

    def inner(v: Array, slope: Array) -> tuple[Array, Array]:
        first = (alpha * v[:-1] + g * v[:-1] + alpha * h * slope[:-1]) / 3.0
        second = (beta * v[1:] + g * v[1:] - beta * h * slope[1:]) / 3.0
        return first / q[:, 1], second / q[:, 2]

    x1, x2 = inner(s, np.ones_like(s))
    y1, y2 = inner(f, d)
    scale = np.concatenate(([1.0], np.cumprod(q[:-1, 3] / q[1:, 0])))  # the last weight of each is the next's first
    first, second = np.stack((x1, y1), axis=1), np.stack((x2, y2), axis=1)
    return Interpolated(cubic_from_bezier(s, P, first, second, weights=q * scale[:, None]), s)


def _arithmetic(h: Array, chord: Array) -> Array:
    """Three-point means; none against the data at the ends, 0 beside flat intervals and at local extrema."""
    if len(h) == 1:
        return np.repeat(chord, 2)
    d = np.empty(len(h) + 1)
    d[1:-1] = (h[1:] * chord[:-1] + h[:-1] * chord[1:]) / (h[1:] + h[:-1])
    d[1:-1][chord[:-1] * chord[1:] <= 0.0] = 0.0
    d[0] = chord[0] + (chord[0] - chord[1]) * h[0] / (h[0] + h[1])
    d[-1] = chord[-1] + (chord[-1] - chord[-2]) * h[-1] / (h[-1] + h[-2])
    for end, slope in ((0, chord[0]), (-1, chord[-1])):
        if d[end] * slope <= 0.0:
            d[end] = 0.0
    return d


def _geometric(h: Array, chord: Array) -> Array:
    """Weighted geometric means of the chords on either side."""
    if len(h) == 1:
        return np.repeat(chord, 2)
    same = chord[:-1] * chord[1:] > 0.0
    size = np.abs(chord)
    share = h[1:] / (h[:-1] + h[1:])
    d = np.zeros(len(h) + 1)
    d[1:-1] = np.where(same, np.sign(chord[1:]) * size[:-1] ** share * size[1:] ** (1.0 - share), 0.0)
    for end, near, far, step, both in (
        (0, chord[0], chord[1], h[0], h[0] + h[1]),
        (-1, chord[-1], chord[-2], h[-1], h[-1] + h[-2]),
    ):
        d[end] = near * (near / far) ** (step / both) if near * far > 0.0 else 0.0
    return d


_SLOPES = {"arithmetic": _arithmetic, "geometric": _geometric}
