"""NURBS curves and surfaces carried on beyond their ends: the end spans' own polynomials, evaluated farther out.

De Casteljau's algorithm with a ratio beyond 1 gives the control points of the longer span (Piegl and Tiller, The NURBS
Book, section 5.3, read backwards). Lines, conics and quadrics are continued exactly; what is a spline approximation of
another shape is continued with an error that grows as the ratio to the power degree + 1.
"""

from __future__ import annotations

import numpy as np

from patchwright.models import knots as knot_tools
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface


def curve_on(curve: NurbsCurve, t0: float, t1: float) -> NurbsCurve:
    """The same curve on [t0, t1], shorter or longer at either end, clamped.

    Raises
    ------
    ParameterError : an empty range, or one that misses the curve's own; weights that vanish farther out.
    """
    knots, net = _on(curve.degree, curve.knots, curve.homogeneous, curve.domain, t0, t1)
    return NurbsCurve.from_homogeneous(curve.degree, knots, net, rational=curve.rational)


def surface_on(surface: NurbsSurface, u: tuple[float, float], v: tuple[float, float]) -> NurbsSurface:
    """The same surface on the ranges u and v, shorter or longer at any side, clamped.

    Raises
    ------
    ParameterError : as for a curve.
    """
    (p, q), (U, V), net = surface.degree, surface.knots, surface.homogeneous
    U, net = _on(p, U, net, surface.domain[0], *u)
    V, net = _on(q, V, net.swapaxes(0, 1), surface.domain[1], *v)
    return NurbsSurface.from_homogeneous((p, q), (U, V), net.swapaxes(0, 1), rational=surface.rational)


def _on(
    degree: int, knots: Array, net: Array, domain: tuple[float, float], t0: float, t1: float
) -> tuple[Array, Array]:
    """Knots and net (n, ...) on [t0, t1]."""
    low, high = domain
    if not (t0 < t1 and t0 < high and low < t1):
        raise ParameterError(f"[{t0:.6g}, {t1:.6g}] is no range that goes on from [{low:.6g}, {high:.6g}]")
    knots, net = knot_tools.restrict(degree, knots, net, max(t0, low), min(t1, high))
    if t1 > high:
        knots, net = _longer(degree, knots, net, t1)
    if t0 < low:
        knots, net = _longer(degree, -knots[::-1], net[::-1], -t0)
        knots, net = -knots[::-1], net[::-1]
    return knots, net


def _longer(p: int, knots: Array, net: Array, end: float) -> tuple[Array, Array]:
    breaks = knot_tools.breaks(p, knots)
    a, b = float(breaks[-2]), float(breaks[-1])
    if len(breaks) > 2:
        knots, net = knot_tools.insert(p, knots, net, knot_tools.missing(p, knots, [a]))
    share, row, out = (end - a) / (b - a), net[-p - 1 :], []
    while len(row):
        out.append(row[0])
        row = (1.0 - share) * row[:-1] + share * row[1:]
    return np.where(knots == b, end, knots), np.concatenate([net[: -p - 1], np.array(out)])
