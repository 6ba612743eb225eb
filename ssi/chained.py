"""Curves joined across the seams and poles at which the tracer has to part them.

Two curves become one where exactly their two ends meet, away from branch points, with one tangent. The (u, v) curves
keep the jump of the parameters at a knot of multiplicity degree + 1, as the closed forms do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.ssi.intersection import Intersection, IntersectionCurve

STRAIGHT = 1e-4  # sine of the angle between the tangents of two curves that are one


def chained(found: Intersection, reach: float) -> Intersection:
    """The same intersection with its curves joined. Cost: n log n in the curves.

    Parameters
    ----------
    reach : length; ends nearer than this meet
    """
    curves = found.curves
    open_ = np.flatnonzero([not c.closed for c in curves])
    stops = np.array([p.point for p in found.points if p.kind == "branch"]).reshape(-1, 3)
    partner = _partners([curves[k] for k in open_.tolist()], stops, reach)
    joints: dict[int, IntersectionCurve | None] = dict.fromkeys(open_.tolist())
    done = np.zeros(len(open_), dtype=np.bool_)
    for k in range(len(open_)):
        if done[k]:
            continue
        line, closed = _line(k, partner)
        done[[end // 2 for end in line]] = True
        parts = [curves[open_[end // 2]] for end in line]
        joint = _all([reversed_curve(c) if end % 2 else c for c, end in zip(parts, line, strict=True)])
        joints[int(open_[k])] = replace(joint, closed=True) if closed else joint
    kept = [joints.get(k, curve) for k, curve in enumerate(curves)]
    return replace(found, curves=tuple(c for c in kept if c is not None))


def _partners(curves: Sequence[IntersectionCurve], stops: Array, reach: float) -> IntArray:
    """(2 n,) for the start (even) and the end (odd) of each curve the one end it meets smoothly, -1 for none."""
    from scipy.spatial import cKDTree

    partner = np.full(2 * len(curves), -1)
    if not len(curves):
        return partner
    ends = np.array([p for c in curves for p in c.curve(np.array(c.curve.domain))])
    away = np.array([_leaves(c, end) for c in curves for end in (0, 1)])
    pairs = cKDTree(ends).query_pairs(reach, output_type="ndarray")
    alone = np.bincount(pairs.reshape(-1), minlength=len(ends)) == 1
    if len(stops):
        alone &= cKDTree(stops).query(ends)[0] > reach
    kinds = np.array([[f"{c.kind} {c.curve.degree}"] * 2 for c in curves]).reshape(-1)
    i, j = pairs.T
    good = alone[i] & alone[j] & (kinds[i] == kinds[j])
    good &= np.einsum("ij,ij->i", away[i], away[j]) < -1.0 + STRAIGHT**2 / 2.0
    partner[i[good]], partner[j[good]] = j[good], i[good]
    return partner


def _line(curve: int, partner: IntArray) -> tuple[list[int], bool]:
    """The ends at which the curves of a chain are entered, in order, and whether it comes round to its beginning."""
    first = 2 * curve
    start = first
    while partner[start] >= 0:  # back to where it begins
        start = int(partner[start]) ^ 1
        if start == first:
            break
    line = [start]
    while (after := int(partner[line[-1] ^ 1])) not in (-1, start):
        line.append(after)
    return line, after == start


def _all(curves: Sequence[IntersectionCurve]) -> IntersectionCurve:
    """One curve through all, joined in halves."""
    if len(curves) == 1:
        return curves[0]
    middle = len(curves) // 2
    return appended(_all(curves[:middle]), _all(curves[middle:]))


def _leaves(curve: IntersectionCurve, end: int) -> Array:
    """(3,) unit tangent at an end, pointing out of the curve."""
    d = curve.curve(curve.curve.domain[end], nu=1) * (1.0 if end else -1.0)
    return np.asarray(d / max(float(np.linalg.norm(d)), np.finfo(np.float64).tiny))  # at a pinch point it is zero


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
