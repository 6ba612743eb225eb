"""Curves joined across the seams and poles at which the tracer has to part them.

Two curves become one where exactly their two ends meet, away from branch points, with one tangent. The (u, v) curves
keep the jump of the parameters at a knot of multiplicity degree + 1, as the closed forms do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.ssi.intersection import Intersection, IntersectionCurve

STRAIGHT = 1e-4  # sine of the angle between the tangents of two curves that are one


def chained(found: Intersection, reach: float) -> Intersection:
    """The same intersection with its curves joined.

    Parameters
    ----------
    reach : length; ends nearer than this meet
    """
    curves = list(found.curves)
    stops = np.array([p.point for p in found.points if p.kind == "branch"]).reshape(-1, 3)
    while True:
        pair = _next_pair(curves, stops, reach)
        if pair is None:
            return replace(found, curves=tuple(curves))
        i, j, joint = pair
        if i == j:
            curves[i] = replace(curves[i], closed=True)
        else:
            curves[i] = joint
            del curves[j]


def _next_pair(
    curves: list[IntersectionCurve], stops: Array, reach: float
) -> tuple[int, int, IntersectionCurve] | None:
    """Two curves (or one and itself) whose ends meet, with the curve they make."""
    open_ = [k for k, c in enumerate(curves) if not c.closed]
    ends = np.array([p for k in open_ for p in curves[k].curve(np.array(curves[k].curve.domain))]).reshape(-1, 3)
    for a in range(len(ends)):
        near = np.flatnonzero(np.linalg.norm(ends - ends[a], axis=1) <= reach)
        if len(near) != 2 or (len(stops) and np.linalg.norm(stops - ends[a], axis=1).min() <= reach):
            continue
        b = int(near[near != a][0])
        i, j = open_[a // 2], open_[b // 2]
        one, other = curves[i], curves[j]
        if one.kind != other.kind or one.curve.degree != other.curve.degree:
            continue
        if i == j:
            if _leaves(one, 1) @ _leaves(one, 0) < -1.0 + STRAIGHT**2 / 2.0:
                return i, i, one
            continue
        first = one if a % 2 == 1 else reversed_curve(one)
        second = other if b % 2 == 0 else reversed_curve(other)
        if _leaves(first, 1) @ _leaves(second, 0) < -1.0 + STRAIGHT**2 / 2.0:
            return i, j, appended(first, second)
    return None


def _leaves(curve: IntersectionCurve, end: int) -> Array:
    """(3,) unit tangent at an end, pointing out of the curve."""
    d = curve.curve(curve.curve.domain[end], nu=1) * (1.0 if end else -1.0)
    return np.asarray(d / np.linalg.norm(d))


def reversed_curve(curve: IntersectionCurve) -> IntersectionCurve:
    """The curve run backwards, in space and in both parameter planes."""
    uv_a, uv_b = (None if c is None else c.reversed() for c in (curve.uv_a, curve.uv_b))
    return replace(curve, curve=curve.curve.reversed(), uv_a=uv_a, uv_b=uv_b, points=curve.points[::-1])


def appended(first: IntersectionCurve, second: IntersectionCurve) -> IntersectionCurve:
    """One curve through the first and on through the second."""

    def both(a: NurbsCurve | None, b: NurbsCurve | None) -> NurbsCurve | None:
        return None if a is None or b is None else _one_after_the_other(a, b)

    return replace(
        first,
        curve=_one_after_the_other(first.curve, second.curve, welded=True),
        uv_a=both(first.uv_a, second.uv_a),
        uv_b=both(first.uv_b, second.uv_b),
        points=np.concatenate([first.points, second.points[1:]]),
        residual=max(first.residual, second.residual),
    )


def _one_after_the_other(a: NurbsCurve, b: NurbsCurve, *, welded: bool = False) -> NurbsCurve:
    """One NURBS through a and on through b, both of one degree; where b begins elsewhere it jumps, unless `welded`."""
    a, b = a.clamped(), b.clamped()
    p = a.degree
    shift = a.domain[1] - b.domain[0]
    wa = np.ones(len(a.control_points)) if a.weights is None else a.weights
    wb = np.ones(len(b.control_points)) if b.weights is None else b.weights
    wb = wb * (wa[-1] / wb[0])
    meets = welded or np.allclose(a.control_points[-1], b.control_points[0], rtol=1e-9, atol=1e-12)
    skip = 1 if meets else 0
    knots = np.concatenate([a.knots[: -1 if meets else None], b.knots[p + 1 :] + shift])
    points = np.concatenate([a.control_points, b.control_points[skip:]])
    rational = a.weights is not None or b.weights is not None
    return NurbsCurve(p, knots, points, np.concatenate([wa, wb[skip:]]) if rational else None)
