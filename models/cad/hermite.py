"""Degree-7 splines through values and three derivatives, for curves that are no splines in their own parameter.

An arc whose parameter is the angle is not a NURBS; keeping the CAD kernel's parameter matters more here than keeping
the circle exact, because the pcurves on both sides of an edge run with it. Two-point Hermite interpolation of degree 7
errs by at most |f^(8)| (h / 2)^8 / 8!, which is 2e-13 of the radius for h = pi / 16.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from patchwright.models.arrays import Array

ARC_STEP = np.pi / 16  # see above: 2e-13 of the radius


def hermite_spline(breaks: Array, jets: Array) -> tuple[Array, Array]:
    """Knots (4 s + 12,) and control points (4 s + 4, d) of the C3 spline of degree 7 on s equal spans.

    `breaks` (s + 1,) are equally spaced; `jets` (4, s + 1, d) holds the value and the derivatives 1, 2, 3 there.
    """
    h = (breaks[-1] - breaks[0]) / (len(breaks) - 1)
    left, right = jets[:, :-1], jets[:, 1:]
    b0, b7 = left[0], right[0]
    b1 = b0 + h * left[1] / 7.0
    b2 = 2.0 * b1 - b0 + h**2 * left[2] / 42.0
    b3 = 3.0 * b2 - 3.0 * b1 + b0 + h**3 * left[3] / 210.0
    b6 = b7 - h * right[1] / 7.0
    b5 = 2.0 * b6 - b7 + h**2 * right[2] / 42.0
    b4 = 3.0 * b5 - 3.0 * b6 + b7 - h**3 * right[3] / 210.0
    # blossoms f(a^3 b^4), f(a^2 b^4 c), f(a b^4 c^2), f(b^4 c^3) at each inner break b with neighbours a, c = 2 b - a
    inner = np.stack([b4[:-1], 2.0 * b5[:-1] - b4[:-1], 4.0 * b6[:-1] - 4.0 * b5[:-1] + b4[:-1], b3[1:]], axis=1)
    first = np.stack([b0[0], b1[0], b2[0], b3[0]])
    last = np.stack([b4[-1], b5[-1], b6[-1], b7[-1]])
    points = np.concatenate([first, inner.reshape(-1, jets.shape[2]), last])
    knots = np.concatenate([np.repeat(breaks[:1], 8), np.repeat(breaks[1:-1], 4), np.repeat(breaks[-1:], 8)])
    return knots, points


@lru_cache(maxsize=256)
def circle_spline(t0: float, t1: float) -> tuple[Array, Array]:
    """Knots and control points (n, 2) of (cos t, sin t) on [t0, t1], to 2e-13; not to be changed."""
    spans = max(1, int(np.ceil((t1 - t0) / ARC_STEP - 1e-9)))
    t = np.linspace(t0, t1, spans + 1)
    c, s = np.cos(t), np.sin(t)
    jets = np.stack([np.stack(pair, axis=1) for pair in ((c, s), (-s, c), (-c, -s), (s, -c))])
    return hermite_spline(t, jets)
