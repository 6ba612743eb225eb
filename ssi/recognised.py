"""Closed forms for surfaces that are analytic in substance: NURBS forms of planes, cylinders, cones, spheres and tori.

`closed_form` works on what `recognise` makes of a NURBS surface; its curves then get the NURBS surface's own
parameters, on the same curve parameter. Those are smooth between the breaks of the space curve and the places where it
crosses knot lines of the surface: each such piece is interpolated by a spline of degree 7, its sites halved where the
surface at the fitted parameters is off the curve. Seams and poles lie at breaks of the closed form's curves, so that
parameters jump at knots only.

Limits: a NURBS surface that deviates from its analytic form by more than a hundredth of the tolerance, does not fill
its ranges, or along which a fit stays above 1e-10 of the size is left to subdivision.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from patchwright.models import NurbsCurve, NurbsSurface
from patchwright.models.arrays import Array, BoolArray
from patchwright.models.surface import Surface
from patchwright.ssi.closed_forms.closed_form import KINDS, closed_form
from patchwright.ssi.closed_forms.inversion import Analytic
from patchwright.ssi.intersection import Contact, Intersection, IntersectionCurve
from patchwright.ssi.recognise import Recognised, recognise

DEVIATION = 1e-2  # of the tolerance: what tells touching from crossing by the tolerance must not notice the difference
SAMPLED = 3  # highest degree of a surface whose deviation on samples is trusted, see `_trusted`
DEGREE = 7  # of the parameter curves
FIT = 1e-11  # of the size: what a fit aims at, as the tracer's
PROMISED = 1e-10  # of the size: a larger residual is not returned
COARSE = 33  # samples between two breaks that look for crossed knot lines
MOST = 1000  # sites of one piece: a bound of the work where round-off keeps the accuracy out of reach
DENSER = 10  # samples of the measured residual between two breaks of any of the three curves
DEGENERATE = 1e-5  # of the size: where an iso-curve is shorter than this its parameter has lost its meaning
EPS = float(np.finfo(np.float64).eps)


def by_closed_form(a: Surface, b: Surface, tolerance: float) -> Intersection | None:
    """Everything two surfaces share where both are analytic, or NURBS forms of analytic ones, and a closed form exists.

    Parameters
    ----------
    a, b : unbounded analytic ones are clipped, see `closed_forms.clip`
    tolerance : length; surfaces this near touch

    Returns
    -------
    What `closed_form` returns, with parameters of `a` and `b` themselves. None: another surface, no closed form for
    the pair or position, or parameters that cannot be fitted within 1e-10 of the smaller surface's size.

    Raises
    ------
    ParameterError : a tolerance that is not positive, two unbounded surfaces with an unbounded intersection.
    """
    first = _analytic(a, tolerance)
    second = None if first is None else _analytic(b, tolerance)
    if first is None or second is None:
        return None
    found = closed_form(_form(first), _form(second), tolerance)
    if found is None or not (isinstance(first, Recognised) or isinstance(second, Recognised)):
        return found
    try:
        return _mapped(found, first, second)
    except _NotFitted:
        return None


class _NotFitted(Exception):
    """A parameter curve stays off the surface."""


def _analytic(surface: Surface, tolerance: float) -> Analytic | Recognised | None:
    if isinstance(surface, KINDS):
        return surface
    found = recognise(surface, DEVIATION * tolerance)
    return found if found is not None and found.fills and _trusted(found) else None


def _trusted(found: Recognised) -> bool:
    """Whether the deviation bounds the surface: from control points, or from samples that determine it.

    Along a surface of degree p the equation of a torus has degree 4 p. The check has 28 samples per span; polynomials
    of degree n are bounded by those at N even steps up to a factor exp(O(n^2 / N)) (D. Coppersmith, T. J. Rivlin, The
    growth of polynomials bounded at equally spaced points, SIAM J. Math. Anal. 23, 1992), small for p up to 3, and
    a hundredth of the tolerance leaves room for it.
    """
    return found.proved or max(found.native.degree) <= SAMPLED


def _form(thing: Analytic | Recognised) -> Analytic:
    return thing.surface if isinstance(thing, Recognised) else thing


def _mapped(found: Intersection, a: Analytic | Recognised, b: Analytic | Recognised) -> Intersection:
    """The result with the NURBS surfaces' parameters."""
    size = min(_size(thing) for thing in (a, b))

    def curve(c: IntersectionCurve) -> IntersectionCurve:
        assert c.uv_a is not None
        assert c.uv_b is not None
        uv_a = _parameters(a, c.curve, size) if isinstance(a, Recognised) else c.uv_a
        uv_b = _parameters(b, c.curve, size) if isinstance(b, Recognised) else c.uv_b
        residual = max(c.residual, _residual(c.curve, (uv_a, uv_b), (_own(a), _own(b))))
        if residual > PROMISED * size:
            raise _NotFitted
        return replace(c, uv_a=uv_a, uv_b=uv_b, residual=residual)

    def point(p: Contact) -> Contact:
        return replace(p, uv_a=_at(a, p.point, p.uv_a), uv_b=_at(b, p.point, p.uv_b))

    return Intersection(
        tuple(curve(c) for c in found.curves),
        tuple(point(p) for p in found.points),
        tuple(replace(o, boundary=tuple(curve(c) for c in o.boundary)) for o in found.overlaps),
        found.unresolved,
    )


def _own(thing: Analytic | Recognised) -> Surface:
    return thing.native if isinstance(thing, Recognised) else thing


def _size(thing: Analytic | Recognised) -> float:
    surface = _own(thing)
    if not np.isfinite(surface.domain).all():
        return float("inf")
    return float(np.linalg.norm(np.ptp(surface.to_nurbs().control_points.reshape(-1, 3), axis=0)))


def _at(thing: Analytic | Recognised, point: Array, known: tuple[float, float] | None) -> tuple[float, float] | None:
    if not isinstance(thing, Recognised):
        return known
    u, v = thing.to_native(point[None])[0].tolist()
    return u, v


def _residual(curve: NurbsCurve, uvs: tuple[NurbsCurve, NurbsCurve], surfaces: tuple[Surface, Surface]) -> float:
    """The largest distance between the curve and both surfaces at their parameters, on samples inside all pieces."""
    breaks = np.unique(np.concatenate([c.breaks for c in (curve, *uvs)]))
    steps = (np.arange(DENSER) + 0.5) / DENSER
    t = (breaks[:-1, None] + np.diff(breaks)[:, None] * steps).ravel()
    x = curve(t)
    on = []
    for uv, surface in zip(uvs, surfaces, strict=True):
        low, high = np.array(surface.domain).T
        w = np.clip(uv(t), low, high)
        on.append(surface(w[:, 0], w[:, 1]))
    return float(max(np.linalg.norm(p - q, axis=1).max() for p, q in ((x, on[0]), (x, on[1]), (on[0], on[1]))))


@dataclass(frozen=True, slots=True, eq=False)
class _Samples:
    """Parameters w (k, 2) of the points at t (k,) of a curve; `lost[:, i]` where parameter i has no meaning there."""

    t: Array
    w: Array
    lost: BoolArray


def _parameters(found: Recognised, curve: NurbsCurve, size: float) -> NurbsCurve:
    """The (u, v) curve on the NURBS surface of a curve that lies on it."""
    native = found.native
    reach = float(np.abs(native.control_points).max())
    accuracy = max(FIT * size, 64.0 * EPS * reach)
    cuts = [curve.domain[0]]
    for t0, t1 in itertools.pairwise(curve.breaks.tolist()):
        cuts += [*_crossed(native, curve, t0, t1, size), t1]
    knots, points = [np.full(1, cuts[0])], []
    for t0, t1 in itertools.pairwise(cuts):
        U, Q = _piece(native, curve, t0, t1, accuracy)
        spans = np.ptp(np.array(native.domain), axis=1)
        joins = bool(points) and bool((np.abs(points[-1][-1] - Q[0]) <= 1e-9 * spans).all())
        if joins:  # one knot less: continuous
            knots[-1] = knots[-1][:-1]
            Q = Q[1:]
        knots.append(U[1 : -1] if not points else U[1:-1])
        points.append(Q)
    return _within(native, NurbsCurve(DEGREE, np.concatenate([*knots, [cuts[-1]]]), np.concatenate(points)))
