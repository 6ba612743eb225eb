"""Kernel curves (3-D, or 2-D in a surface's parameters) to and from `NurbsCurve`, keeping the parameter.

Lines, Bezier and B-spline curves are exact; arcs and every other kind become degree-7 splines in their own parameter
(see `hermite`).
"""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad import kernel
from patchwright.models.cad.hermite import ARC_STEP, circle_spline, hermite_spline
from patchwright.models.cad.kernel_arrays import (
    curve_weights,
    items,
    kernel_knots,
    kernel_points,
    kernel_reals,
    points_2d,
    points_3d,
    reals,
)
from patchwright.models.nurbs_curve import NurbsCurve

_LINES = (kernel.Geom_Line, kernel.Geom2d_Line)
_TRIMMED = (kernel.Geom_TrimmedCurve, kernel.Geom2d_TrimmedCurve)
_SPLINES = (kernel.Geom_BSplineCurve, kernel.Geom2d_BSplineCurve)
_BEZIERS = (kernel.Geom_BezierCurve, kernel.Geom2d_BezierCurve)
_CONICS = (kernel.Geom_Circle, kernel.Geom_Ellipse, kernel.Geom2d_Circle, kernel.Geom2d_Ellipse)
_FIELDS = {"degree", "knots", "control_points", "weights", "homogeneous"}
_MOST_SPANS = 256


def curve_from_kernel(curve: Any, t0: float, t1: float) -> NurbsCurve:
    """The piece of a kernel curve on [t0, t1] as a clamped NURBS with the same parameter."""
    while isinstance(curve, _TRIMMED):
        curve = curve.BasisCurve()
    if isinstance(curve, _LINES):
        ends = _points([curve.Value(t0), curve.Value(t1)])
        return plain_curve(1, np.array([t0, t0, t1, t1]), ends)
    if isinstance(curve, _BEZIERS):
        curve = _spline_of_bezier(curve)
    if isinstance(curve, _SPLINES):
        return _spline_from_kernel(curve, t0, t1)
    if isinstance(curve, _CONICS):
        knots, circle = circle_spline(t0, t1)
        east, north, west = _points([curve.Value(t) for t in (0.0, pi / 2, pi)])
        middle = (east + west) / 2.0
        return plain_curve(7, knots, middle + circle @ np.stack([east - middle, north - middle]))
    return sampled_curve(curve, t0, t1)


def curve_to_kernel(curve: NurbsCurve) -> Any:
    """The kernel's B-spline curve (3-D or 2-D) of a clamped NURBS."""
    knots, multiplicities = kernel_knots(curve.knots)
    make = kernel.Geom_BSplineCurve if curve.dimension == 3 else kernel.Geom2d_BSplineCurve
    poles = kernel_points(curve.control_points)
    if curve.weights is None:
        return make(poles, knots, multiplicities, curve.degree)
    return make(poles, kernel_reals(curve.weights), knots, multiplicities, curve.degree)


def plain_curve(degree: int, knots: Array, points: Array) -> NurbsCurve:
    """A curve without weights from fresh arrays that the kernel vouches for: checking them would dominate reading."""
    if set(NurbsCurve.__slots__) != _FIELDS:
        return NurbsCurve(degree, knots, points)
    knots.flags.writeable = points.flags.writeable = False
    curve, put = object.__new__(NurbsCurve), object.__setattr__
    put(curve, "degree", degree)
    put(curve, "knots", knots)
    put(curve, "control_points", points)
    put(curve, "weights", None)
    put(curve, "homogeneous", points)
    return curve


def point_curve(point: Array, t0: float, t1: float) -> NurbsCurve:
    """A curve that stays at one point (a pole) over [t0, t1]."""
    return plain_curve(1, np.array([t0, t0, t1, t1]), np.stack([point, point]))


def _points(values: Any) -> Array:
    return points_3d(values) if hasattr(values[0], "Z") else points_2d(values)


def _spline_of_bezier(curve: Any) -> Any:
    poles = _points(items(curve.Poles()))
    knots = np.repeat([0.0, 1.0], len(poles))
    return curve_to_kernel(NurbsCurve(len(poles) - 1, knots, poles, curve_weights(curve)))


def _spline_from_kernel(curve: Any, t0: float, t1: float) -> NurbsCurve:
    first, last = curve.FirstParameter(), curve.LastParameter()
    slack = 1e-9 * (last - first)
    whole = abs(t0 - first) <= slack and abs(t1 - last) <= slack
    if curve.IsPeriodic() or not whole:
        inside = curve.IsPeriodic() or (t0 >= first - slack and t1 <= last + slack)
        if not inside or t1 - t0 < 1e-6 * (last - first):  # beyond the ends, or too short for the kernel to cut
            return sampled_curve(curve, t0, t1)
        curve = curve.Copy()
        low, high = (t0, t1) if curve.IsPeriodic() else (max(t0, first), min(t1, last))
        try:
            curve.Segment(low, high)
        except kernel.Standard_Failure:
            return sampled_curve(curve, t0, t1)
    if curve.Degree() == 1 and curve.NbPoles() == 2 and not curve.IsRational():  # most pcurves
        return plain_curve(1, np.array([t0, t0, t1, t1]), _points([curve.Pole(1), curve.Pole(2)]))
    knots, weights = reals(curve.KnotSequence()), curve_weights(curve)
    degree = curve.Degree()
    low, high = knots[degree], knots[-degree - 1]
    if (low, high) != (t0, t1):  # round-off of the ends only
        scaled = np.clip(t0 + (knots - low) * ((t1 - t0) / (high - low)), t0, t1)
        knots = np.where(knots <= low, t0, np.where(knots >= high, t1, scaled))
    points = _points(items(curve.Poles()))
    return plain_curve(degree, knots, points) if weights is None else NurbsCurve(degree, knots, points, weights)


def sampled_curve(curve: Any, t0: float, t1: float) -> NurbsCurve:
    """The spline of degree 7 through the curve's jets; spans are doubled until it agrees half-way to round-off."""
    spans = max(1, int(np.ceil((t1 - t0) / ARC_STEP - 1e-9))) if curve.IsPeriodic() else 8
    while True:
        breaks = np.linspace(t0, t1, spans + 1)
        jets = np.stack(
            [_points([curve.Value(t) for t in breaks]), *(_points([curve.DN(t, k) for t in breaks]) for k in (1, 2, 3))]
        )
        knots, points = hermite_spline(breaks, jets)
        h = (t1 - t0) / spans
        # the spline's value half-way, from the jets at both ends
        a, b = jets[:, :-1], jets[:, 1:]
        half = (a[0] + b[0]) / 2 + 11 * h * (a[1] - b[1]) / 64 + 3 * h**2 * (a[2] + b[2]) / 128
        half += h**3 * (a[3] - b[3]) / 768
        middle = _points([curve.Value(t) for t in (breaks[:-1] + breaks[1:]) / 2])
        size = float(np.ptp(points, axis=0).max()) + 1e-300
        if spans >= _MOST_SPANS or float(np.abs(middle - half).max()) <= 1e-11 * size:
            return NurbsCurve(7, knots, points)
        spans *= 2
