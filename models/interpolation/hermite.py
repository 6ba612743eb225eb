"""Piecewise cubics from points and tangents, as one B-spline curve: what every local scheme ends in.

Where the tangents on both sides of a point are equal the curve is C1 and the knot is double, so that the B-spline form
itself guarantees it; elsewhere the knot is triple.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve


def cubic_from_tangents(s: Array, P: Array, incoming: Array, outgoing: Array) -> NurbsCurve:
    """The cubic spline through P (n + 1, d) at s (n + 1,) with the one-sided derivatives given, each (n + 1, d).

    incoming[0] and outgoing[n] are not used.
    """
    step = np.diff(s)[:, None]
    first = P[:-1] + step * outgoing[:-1] / 3.0
    second = P[1:] - step * incoming[1:] / 3.0
    return cubic_from_bezier(s, P, first, second, smooth=(incoming[1:-1] == outgoing[1:-1]).all(axis=1))


def cubic_from_bezier(
    s: Array, P: Array, first: Array, second: Array, *, smooth: Array | None = None, weights: Array | None = None
) -> NurbsCurve:
    """The curve of the cubic Bezier pieces P[k], first[k], second[k], P[k + 1] on [s[k], s[k + 1]].

    Parameters
    ----------
    smooth : (n - 1,) where the pieces join C1 at inner points (None: nowhere), whose control points are then left out
    weights : (n, 4) of the pieces, the last of each equal to the first of the next, or None; not with `smooth`
    """
    n = len(s) - 1
    keep = np.ones((n, 3), dtype=bool)  # first, second, end of each piece
    if smooth is not None:
        keep[:-1, 2] = ~np.asarray(smooth, dtype=bool)
    pieces = np.stack((first, second, P[1:]), axis=1)
    net = np.concatenate((P[:1], pieces[keep]))
    inner = np.repeat(s[1:-1], 2 + keep[:-1, 2])
    knots = np.concatenate((np.repeat(s[0], 4), inner, np.repeat(s[-1], 4)))
    w = None if weights is None else np.concatenate((weights[:1, 0], weights[:, 1:].ravel()))
    return NurbsCurve(3, knots, net, w)
