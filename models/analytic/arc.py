"""Circular arcs as exact rational quadratics, their knots at true angles.

Reference: Piegl and Tiller, The NURBS Book, 2nd ed. 1997, section 7.3: an arc below 180 degrees has the weights 1,
cos(half the angle), 1. Between knots the parameter is not the angle, at knots it is.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from patchwright.models.analytic.frame import TURN, Range, across, interval, point, positive, unit
from patchwright.models.arrays import Array
from patchwright.models.knots import ROUND_OFF
from patchwright.models.nurbs_curve import NurbsCurve


def arc_net(angles: Range) -> tuple[Array, Array]:
    """Knots of degree 2 and the homogeneous net (n, 3) of w cos, w sin, w of the unit arc; pieces of at most 90
    degrees.

    Quarter turns come out exactly, so that poles and seams of full turns coincide bit for bit.
    """
    low, high = angles
    pieces = max(1, math.ceil((high - low) / (0.5 * math.pi) * (1.0 - ROUND_OFF)))
    ends = np.linspace(low, high, pieces + 1)
    half = 0.5 * (high - low) / pieces
    net = np.empty((2 * pieces + 1, 3))
    net[0::2] = [(*_cos_sin(t), 1.0) for t in ends]
    net[1::2] = [(*_cos_sin(t), _cos_sin(half)[0]) for t in 0.5 * (ends[:-1] + ends[1:])]
    if abs(high - low - TURN) <= ROUND_OFF * TURN:
        net[-1] = net[0]
    return np.concatenate(([low], np.repeat(ends, 2), [high])), net


def _cos_sin(t: float) -> tuple[float, float]:
    quarters = t / (0.5 * math.pi)
    if abs(quarters - round(quarters)) <= ROUND_OFF * max(1.0, abs(quarters)):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarters) % 4]
    return math.cos(t), math.sin(t)


def circle(
    center: npt.ArrayLike,
    axis: npt.ArrayLike,
    radius: float,
    xdir: npt.ArrayLike | None = None,
    angles: Range | None = None,
) -> NurbsCurve:
    """The circle, or its arc between two angles in radians from xdir, as an exact rational quadratic.

    Raises
    ------
    ParameterError : a radius that is not positive, a zero axis, an empty range or more than one turn.
    """
    c, z, r = point(center, "center"), unit(axis, "axis"), positive(radius, "radius")
    x = across(z, xdir)
    knots, net = arc_net(interval(angles, (0.0, TURN), "the angle", TURN))
    w = net[:, 2:]
    points = w * c + r * (net[:, :1] * x + net[:, 1:2] * np.cross(z, x))
    return NurbsCurve(2, knots, points / w, net[:, 2])
