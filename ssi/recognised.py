"""Closed forms for surfaces that are analytic in substance: NURBS forms of planes, cylinders, cones, spheres and tori.

`closed_form` works on what `recognise` makes of a NURBS surface; its curves then get the NURBS surface's own
parameters, on the same curve parameter. On one rectangle these are an affine image, and exact. Elsewhere they are
smooth between the breaks of the space curve and the places where it crosses knot lines of the surface: each such piece
is interpolated by a spline of degree 7, its sites halved where the surface at the fitted parameters is off the curve.
Seams and poles lie at breaks of the closed form's curves, so that parameters jump at knots only.

Limits: a polynomial (not rational) NURBS surface other than a plane, one that deviates from its analytic form by more
than a hundredth of the tolerance, does not fill its ranges, or along which a fit stays above 1e-10 of the size is left
to subdivision.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from patchwright.models import NurbsCurve, NurbsSurface
from patchwright.models.arrays import Array, BoolArray
from patchwright.models.knots import between
from patchwright.models.surface import Surface
from patchwright.ssi.closed_forms.closed_form import KINDS, closed_form
from patchwright.ssi.closed_forms.inversion import Analytic
from patchwright.ssi.intersection import Contact, Intersection, IntersectionCurve
from patchwright.ssi.recognise import Recognised, recognise
from patchwright.ssi.self_closed_form import analytic_itself

DEVIATION = 1e-2  # of the tolerance: what tells touching from crossing by the tolerance must not notice the difference
SAMPLED = 3  # highest degree of a surface whose deviation on samples is trusted, see `_trusted`
MANY = 16  # spans of a whole sphere or torus in its usual NURBS form; more are tried on one span first
DEGREE = 7  # of the parameter curves
FIT = 1e-11  # of the size: what a fit aims at, as the tracer's
PROMISED = 1e-10  # of the size: a larger residual is not returned
COARSE = 33  # samples between two breaks that look for crossed knot lines
MOST = 1000  # sites of one piece: a bound of the work where round-off keeps the accuracy out of reach
DENSER = 10  # samples of the measured residual between two breaks of any of the three curves
SWING = 0.1  # of a parameter's range: samples further apart are halved
ROUNDS = 40  # of halving them
DEGENERATE = 1e-12  # of the size: where an iso-curve is shorter than this its parameter has lost its meaning
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


def itself_by_closed_form(surface: Surface, tolerance: float) -> Intersection | None:
    """Everything a NURBS form of an analytic surface shares with itself; None for other surfaces."""
    found = _analytic(surface, tolerance)
    if not isinstance(found, Recognised):
        return None if found is None else analytic_itself(found)
    alone = analytic_itself(found.surface)
    return Intersection(
        points=tuple(_two_places(found.native, p, found.to_native(p.point[None])[0]) for p in alone.points)
    )


def _two_places(native: NurbsSurface, point: Contact, at: Array) -> Contact:
    """The contact with its parameters at two places of the iso-curve that shrinks to it."""
    speeds = [float(np.linalg.norm(native(at[0], at[1], nu))) for nu in ((1, 0), (0, 1))]
    axis = int(speeds[1] < speeds[0])
    low, high = native.domain[axis]
    places = []
    for t in (low, 0.5 * (low + high)):
        uv = at.copy()
        uv[axis] = t
        places.append((float(uv[0]), float(uv[1])))
    gap = float(np.linalg.norm(native(*places[0]) - native(*places[1])))
    return replace(point, uv_a=places[0], uv_b=places[1], gap=gap)


class _NotFitted(Exception):
    """A parameter curve stays off the surface."""


def _analytic(surface: Surface, tolerance: float) -> Analytic | Recognised | None:
    if isinstance(surface, KINDS):
        return surface
    native = surface.to_nurbs()
    if native.weights is None and not _nearly_flat(native):
        return None  # of the analytic surfaces only planes are polynomial
    us, vs = native.breaks
    i, j = (us.size - 1) // 2, (vs.size - 1) // 2
    if (us.size - 1) * (vs.size - 1) > MANY:  # of a large free-form surface one span tells at once
        span = native.restricted((float(us[i]), float(us[i + 1])), (float(vs[j]), float(vs[j + 1])))
        if recognise(span, DEVIATION * tolerance) is None:
            return None
    found = recognise(native, DEVIATION * tolerance)
    return found if found is not None and found.fills and _trusted(found) else None


def _nearly_flat(native: NurbsSurface) -> bool:
    """Whether the control points lie in a plane to a thousandth of their extent."""
    points = native.control_points.reshape(-1, 3)
    local = points - points.mean(axis=0)
    values = np.linalg.eigvalsh(local.T @ local)
    return bool(values[0] <= 1e-6 * values[2])


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
    t = between(breaks, DENSER)
    x = curve(t)
    on = []
    for uv, surface in zip(uvs, surfaces, strict=True):
        low, high = np.array(surface.domain).T
        w = np.clip(uv(t), low, high)
        on.append(surface(w[:, 0], w[:, 1]))
    return float(max(np.linalg.norm(p - q, axis=1).max() for p, q in ((x, on[0]), (x, on[1]), (on[0], on[1]))))


def _parameters(found: Recognised, curve: NurbsCurve, size: float) -> NurbsCurve:
    """The (u, v) curve on the NURBS surface of a curve that lies on it."""
    native = found.native
    flat = _affine(native, curve)
    if flat is not None:
        return _within(native, flat)
    accuracy = max(FIT * size, 64.0 * EPS * float(np.abs(native.control_points).max()))
    cuts = [curve.domain[0]]
    for t0, t1 in itertools.pairwise(curve.breaks.tolist()):
        cuts += [*_crossed(found, curve, t0, t1, size), t1]
    spans = np.ptp(np.array(native.domain), axis=1)
    knots: list[Array] = []
    points: list[Array] = []
    for t0, t1 in itertools.pairwise(cuts):
        U, Q = _piece(found, curve, (t0, t1), accuracy)
        if not points:
            knots.append(U)
        else:
            if (np.abs(points[-1][-1] - Q[0]) <= 1e-9 * spans).all():  # one knot less: continuous
                knots[-1], points[-1] = knots[-1][:-1], points[-1][:-1]
            knots.append(U[DEGREE + 1 :])
        points.append(Q)
    return _within(native, NurbsCurve(DEGREE, np.concatenate(knots), np.concatenate(points)))


def _affine(native: NurbsSurface, curve: NurbsCurve) -> NurbsCurve | None:
    """The exact parameters where the surface is one parallelogram: an affine image of the curve; else None."""
    net, weights = native.control_points, native.weights
    if native.degree != (1, 1) or net.shape[:2] != (2, 2) or (weights is not None and np.ptp(weights) > 0.0):
        return None
    along = np.stack((net[1, 0] - net[0, 0], net[0, 1] - net[0, 0]), axis=1)
    if np.abs(net[0, 0] + along.sum(axis=1) - net[1, 1]).max() > 8.0 * EPS * float(np.abs(net).max()):
        return None
    low, high = np.array(native.domain).T
    shares = np.linalg.lstsq(along, (curve.control_points - net[0, 0]).T, rcond=None)[0].T
    return NurbsCurve(curve.degree, curve.knots, low + shares * (high - low), curve.weights)


def _inverted(found: Recognised, points: Array) -> tuple[Array, BoolArray]:
    """(k, 2) parameters of neighbouring points of the NURBS surface and (k,) where one of them has no meaning.

    On a seam both ends of the range are right: that of the nearest points off the seam is taken.
    """
    native = found.native
    w = found.to_native(points)
    size = float(np.ptp(native.control_points.reshape(-1, 3), axis=0).max())
    lost = np.zeros(w.shape[0], dtype=np.bool_)
    for axis, (low, high) in enumerate(native.domain):
        span = high - low
        along = native(w[:, 0], w[:, 1], (1, 0) if axis == 0 else (0, 1))
        lost |= np.linalg.norm(along, axis=1) * span <= DEGENERATE * size
        net = native.control_points if axis == 0 else native.control_points.swapaxes(0, 1)
        if np.abs(net[0] - net[-1]).max() > 1e-9 * size:
            continue
        seam = (np.minimum(w[:, axis] - low, high - w[:, axis]) <= 1e-7 * span) & ~lost
        free = np.flatnonzero(~seam & ~lost)
        if seam.any():
            at = np.flatnonzero(seam)
            beside = np.full(at.size, low)
            if free.size:
                place = np.clip(np.searchsorted(free, at), 0, free.size - 1)
                before = np.clip(place - 1, 0, free.size - 1)
                nearer = np.where(np.abs(free[place] - at) <= np.abs(free[before] - at), free[place], free[before])
                beside = np.where(w[nearer, axis] < 0.5 * (low + high), low, high)
            w[at, axis] = beside
    return w, lost


def _crossed(found: Recognised, curve: NurbsCurve, t0: float, t1: float, size: float) -> list[float]:
    """Where the curve crosses knot lines of the surface between two of its breaks."""
    native = found.native
    if all(ts.size == 2 for ts in native.breaks):
        return []
    t = t0 + (t1 - t0) * (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, COARSE + 2)[1:-1]))
    spans = np.ptp(np.array(native.domain), axis=1)
    for left in range(ROUNDS, -1, -1):  # beside a pole or an apex a parameter swings round at once
        w, lost = _inverted(found, curve(t))
        t, w = t[~lost], w[~lost]
        wide = (np.abs(np.diff(w, axis=0)) > SWING * spans).any(axis=1)
        if left == 0 or not wide.any():
            break
        t = np.sort(np.concatenate((t, (0.5 * (t[:-1] + t[1:]))[wide])))
    out: list[float] = []
    for axis in (0, 1):
        (low, high), lines = native.domain[axis], native.breaks[axis][1:-1]
        for line in lines.tolist():
            side = w[:, axis] - line
            off = np.flatnonzero(np.abs(side) > 1e-9 * (high - low))
            for i, j in itertools.pairwise(off.tolist()):
                if side[i] * side[j] < 0.0:
                    share = side[i] / (side[i] - side[j])
                    root = _root(native, curve, axis, line, (1.0 - share) * w[i] + share * w[j], (t[i], t[j]), share)
                    if root is not None:
                        out.append(root)
    apart = 1e-9 * (t1 - t0)
    out = sorted(x for x in out if t0 + apart < x < t1 - apart)
    return [x for k, x in enumerate(out) if k == 0 or x - out[k - 1] > apart]


def _root(
    native: NurbsSurface,
    curve: NurbsCurve,
    axis: int,
    line: float,
    w: Array,
    bracket: tuple[float, float],
    share: float,
) -> float | None:
    """The parameter in the bracket at which the curve meets a knot line, by Gauss-Newton steps, None if they fail."""
    t = (1.0 - share) * bracket[0] + share * bracket[1]
    other = float(w[1 - axis])
    low, high = native.domain[1 - axis]
    nu = (0, 1) if axis == 0 else (1, 0)
    step = 1.0
    for _ in range(20):
        at = (line, other) if axis == 0 else (other, line)
        J = np.stack((native(*at, nu), -curve(t, 1)), axis=1)
        move = np.linalg.lstsq(J, curve(t) - native(*at), rcond=None)[0]
        other = float(np.clip(other + move[0], low, high))
        step = float(np.clip(t + move[1], *bracket)) - t
        t += step
        if abs(step) <= 4.0 * EPS * max(abs(bracket[0]), abs(bracket[1])):
            return t
    return t if abs(step) <= 1e-9 * (bracket[1] - bracket[0]) else None


def _piece(found: Recognised, curve: NurbsCurve, ends: tuple[float, float], accuracy: float) -> tuple[Array, Array]:
    """Clamped knots and control points of an interpolant between two cuts, finer where it is off the curve."""
    from scipy.interpolate import make_interp_spline

    native = found.native
    low, high = np.array(native.domain).T
    nodes = np.linspace(*ends, DEGREE + 2)
    half = DEGREE // 2 + 1
    while True:
        sites = nodes.copy()
        w, lost = _inverted(found, curve(sites))
        if lost.any():  # an apex or a pole: sites beside it, on the side of the piece
            gaps = np.diff(nodes)
            shift = np.append(gaps, -gaps[-1]) * 1e-2
            sites[lost] += shift[lost]
            w, lost = _inverted(found, curve(sites))
            if lost.any():
                raise _NotFitted
        knots = np.concatenate(([ends[0]] * (DEGREE + 1), nodes[half:-half], [ends[1]] * (DEGREE + 1)))
        spline = make_interp_spline(sites, w, DEGREE, t=knots)
        fit = NurbsCurve(DEGREE, knots, spline.c)
        gaps = np.diff(nodes)
        probes = nodes[:-1, None] + gaps[:, None] * np.array([0.13, 0.5, 0.87])
        at = np.clip(fit(probes.ravel()), low, high)
        miss = np.linalg.norm(native(at[:, 0], at[:, 1]) - curve(probes.ravel()), axis=1).reshape(probes.shape)
        bad = (miss.max(axis=1) > accuracy) & (gaps > 1e-9 * (ends[1] - ends[0]))
        if not bad.any() or nodes.size > MOST:
            return knots, np.asarray(spline.c)  # the residual is measured by the caller
        while True:  # neighbours differ by a factor of two at most
            longest = np.where(bad, 0.5 * gaps, gaps)
            grown = bad.copy()
            grown[1:] |= longest[1:] > 2.1 * longest[:-1]
            grown[:-1] |= longest[:-1] > 2.1 * longest[1:]
            if (grown == bad).all():
                break
            bad = grown
        nodes = np.sort(np.concatenate((nodes, (nodes[:-1] + 0.5 * gaps)[bad])))


def _within(native: NurbsSurface, uv: NurbsCurve) -> NurbsCurve:
    """The curve brought inside the domain where it strays by round-off; control points move only as far as it does."""
    low, high = np.array(native.domain).T
    points = uv.control_points
    held = np.clip(points, low, high)
    if (held == points).all():
        return uv
    at = uv(np.unique(np.concatenate((np.linspace(*uv.domain, 8 * COARSE), uv.breaks))))
    slack = 4.0 * np.abs(np.clip(at, low, high) - at).max(axis=0) + 64.0 * EPS * np.maximum(np.abs(low), np.abs(high))
    return NurbsCurve(uv.degree, uv.knots, np.where(np.abs(held - points) <= slack, held, points), uv.weights)
