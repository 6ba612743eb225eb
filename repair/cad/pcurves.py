"""The curve in a surface's parameters below a curve in space, with the space curve's own parameter.

Planes carry it exactly, lines on cylinders and cones too. Elsewhere splines of degree 5 interpolate the parameters of
points of the curve, piece by piece between its corners, and are refined until the surface at the fitted parameters is
within the accuracy of the curve everywhere between the points. Surfaces of closed form are widened to hold the curve:
their ranges are trims, not shape.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import cast

import numpy as np

from patchwright.models import Cone, Cylinder, Plane, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.models.knots import distinct, divided
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface
from patchwright.ssi.closed_forms.inversion import TURN, Analytic, inverted

DEGREE = 5
SHORTEST = 1e-11  # of the parameters: ranges between knots as short as this are round-off
FIRST, MOST = 12, 768  # points per piece at first, and on all pieces when no more are tried
KNOT_PROBES = 8  # per span of a pcurve, where it may cross knot lines or leave its surface
BEYOND = 1e-9  # of a domain: what a pcurve may leave it by
BETWEEN = 4  # probes between two points
POLE = 1e-9  # of the largest speed along a curve: where parameter lines run slower, they have no length


@dataclass(frozen=True, slots=True, eq=False)
class Below:
    """A pcurve, the surface wide enough for it, and how far the two are from the curve at most."""

    pcurve: NurbsCurve
    surface: Surface
    residual: float


def below(surface: Surface, curve: NurbsCurve, accuracy: float, near: Array | None = None) -> Below:
    """The image of a curve on a surface.

    Parameters
    ----------
    accuracy : length; the fit is refined until its residual is below it, or as far as it goes
    near : (2,) parameters the curve's start is to be next to, where the surface is periodic

    The caller judges by `residual`: a curve that is off the surface has its feet's image and its distance.
    """
    if isinstance(surface, Plane):
        flat = (curve.control_points - surface.origin) @ np.stack([surface.xdir, surface.ydir], axis=1)
        found = NurbsCurve(curve.degree, curve.knots, flat, curve.weights)
        return _judged(surface, curve, found, divided(curve.breaks, 8))
    exact = _straight(surface, curve, near, accuracy) or _affine(surface, curve)
    if exact is not None:
        return exact
    smooth, every = _smooth_pieces(curve), _ranges(curve.breaks)
    best = _refined(surface, curve, accuracy, near, smooth)
    if best.residual > accuracy and len(smooth) < len(every) <= MOST // FIRST:  # its knots may stand in the way
        other = _refined(surface, curve, accuracy, near, every)
        best = other if other.residual < best.residual else best
    return best


def _refined(
    surface: Surface, curve: NurbsCurve, accuracy: float, near: Array | None, pieces: list[tuple[float, float]]
) -> Below:
    """The image piece by piece, through more and more points."""
    count, last = FIRST, np.inf
    while True:
        sites = [_sites(a, b, count) for a, b in pieces]
        uv = parameters(surface, curve(np.concatenate(sites)), near)
        splits = np.cumsum([len(s) for s in sites])[:-1]
        made = within(surface, joined([spline(t, some) for t, some in zip(sites, np.split(uv, splits), strict=True)]))
        probes = divided(np.unique(np.concatenate(sites)), BETWEEN)
        result = _judged(surface, curve, made, probes)
        if result.residual <= accuracy or count * len(pieces) >= MOST or result.residual > 0.5 * last:
            return result  # as near as wanted, or more points do not bring it nearer: the curve is off the surface
        last, count = result.residual, 2 * count


def _affine(surface: Surface, curve: NurbsCurve) -> Below | None:
    """The image of a curve of a NURBS that is a parallelogram, which carries it exactly."""
    if not isinstance(surface, NurbsSurface) or surface.degree != (1, 1) or surface.rational:
        return None
    net = surface.control_points
    if net.shape[:2] != (2, 2):
        return None
    along, across = net[1, 0] - net[0, 0], net[0, 1] - net[0, 0]
    size = float(np.abs(net).max())
    if np.abs(net[1, 1] - net[0, 0] - along - across).max() > 1e-15 * size:
        return None
    share = np.linalg.lstsq(np.stack([along, across], axis=1), (curve.control_points - net[0, 0]).T, rcond=None)[0].T
    low, high = np.array(surface.domain).T
    made = NurbsCurve(curve.degree, curve.knots, low + share * (high - low), curve.weights)
    uv = made(divided(curve.breaks, 8))
    if (uv < low).any() or (uv > high).any():
        return None
    return _judged(surface, curve, made, divided(curve.breaks, 8))


def parameters(surface: Surface, points: Array, near: Array | None = None) -> Array:
    """(k, 2) parameters of the points' feet, continuous along the row where the surface is periodic."""
    if isinstance(surface, NurbsSurface):
        feet = surface.closest(points)
        uv = np.stack([feet.u, feet.v], axis=1)
        for k, order in enumerate(((1, 0), (0, 1))):
            _from_beside(uv, k, np.linalg.norm(surface(uv[:, 0], uv[:, 1], order), axis=1))
        return uv
    uv = np.array(inverted(cast(Analytic, surface), points)[0])
    if isinstance(surface, Sphere):
        _from_beside(uv, 0, surface.radius * np.cos(uv[:, 1]))
    elif isinstance(surface, Cone):
        _from_beside(uv, 0, surface.radius(uv[:, 1]))
    for k in (0, 1):
        if _period(surface, k):
            uv[:, k] = np.unwrap(uv[:, k])
            if near is not None:
                uv[:, k] += TURN * np.round((near[k] - uv[0, k]) / TURN)
    return np.asarray(uv)


def _from_beside(uv: Array, k: int, size: Array) -> None:
    """Parameter k of rows of uv (k, 2) where its lines have no length, which leaves it open, set to the next row's."""
    clear = np.flatnonzero(np.abs(size) > POLE * np.abs(size).max(initial=0.0))
    if not len(clear) or len(clear) == len(uv):
        return
    place = np.arange(len(uv))
    after = np.minimum(np.searchsorted(clear, place), len(clear) - 1)
    before = np.maximum(after - 1, 0)
    nearer = np.where(np.abs(clear[before] - place) < np.abs(clear[after] - place), before, after)
    uv[:, k] = uv[clear[nearer], k]


def inside(surface: Surface, pcurve: NurbsCurve) -> bool:
    """Whether a pcurve stays in the domain of a NURBS; beyond it kernels carry the surface on, each in its own way."""
    if not isinstance(surface, NurbsSurface):
        return True
    box = np.array(surface.domain)
    uv = pcurve(divided(pcurve.breaks, KNOT_PROBES))
    return bool((np.abs(np.clip(uv, box[:, 0], box[:, 1]) - uv) <= BEYOND * (box[:, 1] - box[:, 0])).all())


def within(surface: Surface, pcurve: NurbsCurve) -> NurbsCurve:
    """A pcurve that leaves the domain of a NURBS with its control points drawn back into it; any other as it is."""
    if not isinstance(surface, NurbsSurface) or pcurve.rational or inside(surface, pcurve):
        return pcurve
    low, high = np.array(surface.domain).T
    return NurbsCurve(pcurve.degree, pcurve.knots, np.clip(pcurve.control_points, low, high))


def widened(surface: Surface, uv: Array) -> Surface:
    """The surface with ranges that hold all of `uv` (k, 2): a NURBS as it is, any other as wide as needed."""
    if isinstance(surface, NurbsSurface):
        return surface
    low, high = np.array(surface.domain).T
    lowest, highest = np.minimum(low, uv.min(axis=0)), np.maximum(high, uv.max(axis=0))
    if (lowest >= low).all() and (highest <= high).all():
        return surface
    for k in (0, 1):
        if _period(surface, k) and highest[k] - lowest[k] > TURN:
            lowest[k], highest[k] = uv[:, k].min(), max(uv[:, k].min() + TURN, uv[:, k].max())
            highest[k] = min(highest[k], lowest[k] + TURN)
    if isinstance(surface, Sphere):
        lowest[1], highest[1] = max(lowest[1], -np.pi / 2), min(highest[1], np.pi / 2)
    return with_ranges(surface, (float(lowest[0]), float(highest[0])), (float(lowest[1]), float(highest[1])))


def with_ranges(surface: Surface, u: tuple[float, float], v: tuple[float, float]) -> Surface:
    """A surface of closed form on other ranges."""
    if isinstance(surface, Plane):
        return Plane(surface.origin, surface.normal, surface.xdir, u, v)
    if isinstance(surface, Cylinder):
        return Cylinder(surface.origin, surface.axis, surface.radius, surface.xdir, u, v)
    if isinstance(surface, Cone):
        return Cone(surface.origin, surface.axis, surface.half_angle, surface.ref_radius, surface.xdir, u, v)
    if isinstance(surface, Sphere):
        return Sphere(surface.center, surface.radius, axis=surface.axis, xdir=surface.xdir, u=u, v=v)
    torus = cast(Torus, surface)
    return Torus(torus.center, torus.axis, torus.major_radius, torus.minor_radius, xdir=torus.xdir, u=u, v=v)


def _period(surface: Surface, k: int) -> bool:
    return isinstance(surface, Torus) or (k == 0 and isinstance(surface, Cylinder | Cone | Sphere))


def _straight(surface: Surface, curve: NurbsCurve, near: Array | None, accuracy: float) -> Below | None:
    """The image where it is a straight line run at even speed: rulings, circles round the axis by their angle."""
    t0, t1 = curve.domain
    if isinstance(surface, NurbsSurface):
        return None
    t = np.linspace(t0, t1, 33)
    uv = parameters(surface, curve(t), near)
    line = uv[0] + ((t - t0) / (t1 - t0))[:, None] * (uv[-1] - uv[0])
    if np.abs(uv - line).max() > 1e-9 * max(1.0, float(np.abs(uv).max())):
        return None
    made = NurbsCurve(1, np.array([t0, t0, t1, t1]), np.stack([uv[0], uv[-1]]))
    found = _judged(surface, curve, made, divided(curve.breaks, 8))
    return found if found.residual <= accuracy else None


def _judged(surface: Surface, curve: NurbsCurve, pcurve: NurbsCurve, t: Array) -> Below:
    uv = pcurve(t)
    wide = widened(surface, np.concatenate([uv, pcurve.control_points]) if not pcurve.rational else uv)
    low, high = np.array(wide.domain).T
    inside = np.clip(uv, low, high)
    off = np.linalg.norm(wide(inside[:, 0], inside[:, 1]) - curve(t), axis=1)
    return Below(pcurve, wide, float(off.max()))


def _smooth_pieces(curve: NurbsCurve) -> list[tuple[float, float]]:
    """The ranges between the corners a knot of full multiplicity allows."""
    values, counts = distinct(curve.knots)
    t0, t1 = curve.domain
    return _ranges(np.array([t0, *values[(counts >= curve.degree) & (values > t0) & (values < t1)], t1]))


def _ranges(stops: Array) -> list[tuple[float, float]]:
    """The ranges between increasing stops, without those too short for distinct sites; first and last stay."""
    least = SHORTEST * max(float(np.ptp(stops)), float(np.abs(stops).max()))
    kept = [float(stops[0])]
    for stop in stops[1:-1].tolist():
        if stop - kept[-1] > least and stops[-1] - stop > least:
            kept.append(stop)
    return list(pairwise([*kept, float(stops[-1])]))


def _sites(a: float, b: float, count: int) -> Array:
    """Sites from a to b, closer together at the ends, where interpolation of high degree needs them."""
    even = np.linspace(-1.0, 1.0, count)
    bent = 0.8 * even + 0.2 * np.sin(0.5 * np.pi * even)
    out = a + (b - a) * 0.5 * (1.0 + bent)
    out[0], out[-1] = a, b
    return np.asarray(out)


def spline(t: Array, values: Array) -> NurbsCurve:
    """The spline of degree 5 through values (k, d), k > 5, at sites (k,)."""
    from scipy.interpolate import make_interp_spline

    made = make_interp_spline(t, values, k=DEGREE)
    points = np.array(made.c)
    points[0], points[-1] = values[0], values[-1]
    return NurbsCurve(DEGREE, made.t, points)


def joined(pieces: list[NurbsCurve]) -> NurbsCurve:
    """Clamped curves of one degree, each starting where the last ends, as one."""
    p = pieces[0].degree
    knots, points = pieces[0].knots, pieces[0].control_points
    for piece in pieces[1:]:
        knots = np.concatenate([knots[:-1], piece.knots[p + 1 :]])
        points = np.concatenate([points, piece.control_points[1:]])
    return NurbsCurve(p, knots, points)


def fitted(
    place: Callable[[Array], Array], like: NurbsCurve, accuracy: float, corners: Array | None = None
) -> NurbsCurve:
    """The spline through `place(t)`, (k, d) at parameters (k,), with the range and the corners of the curve `like`.

    Where that is not near enough, pieces between all its knots and the parameters `corners` are tried.
    """
    smooth = _smooth_pieces(like)
    every = _ranges(np.union1d(like.breaks, [] if corners is None else corners))
    made, off = _through(place, smooth, accuracy)
    if off > accuracy and len(smooth) < len(every) <= MOST // FIRST:
        other, closer = _through(place, every, accuracy)
        made = other if closer < off else made
    return made


def _through(
    place: Callable[[Array], Array], pieces: list[tuple[float, float]], accuracy: float
) -> tuple[NurbsCurve, float]:
    """The spline through more and more places piece by piece, and its largest distance from those between."""
    count, last = FIRST, np.inf
    while True:
        sites = [_sites(a, b, count) for a, b in pieces]
        splits = np.cumsum([len(s) for s in sites])[:-1]
        values = np.split(place(np.concatenate(sites)), splits)
        line = _line(np.concatenate(sites), np.concatenate(values))
        if line is not None:
            return line, 0.0
        made = joined([spline(t, some) for t, some in zip(sites, values, strict=True)])
        probes = divided(np.unique(np.concatenate(sites)), BETWEEN)
        off = float(np.linalg.norm(made(probes) - place(probes), axis=1).max())
        if off <= accuracy or count * len(pieces) >= MOST or off > 0.5 * last:
            return made, off
        last, count = off, 2 * count


def knots_met(surface: Surface, pcurve: NurbsCurve) -> Array:
    """The parameters where a pcurve crosses knot lines of a NURBS surface, where its image is less smooth."""
    if not isinstance(surface, NurbsSurface):
        return np.zeros(0)
    t = divided(pcurve.breaks, KNOT_PROBES)
    uv, out = pcurve(t), []
    for k, breaks in enumerate(surface.breaks):
        value = uv[:, k]
        for knot in breaks[1:-1].tolist():
            where = np.flatnonzero((value[:-1] - knot) * (value[1:] - knot) < 0.0)
            low, high = t[where], t[where + 1]
            sign = np.sign(value[where] - knot)
            for _ in range(50):
                middle = 0.5 * (low + high)
                before = (pcurve(middle)[:, k] - knot) * sign > 0.0
                low, high = np.where(before, middle, low), np.where(before, high, middle)
            out.append(0.5 * (low + high))
    found = np.unique(np.concatenate(out)) if out else np.zeros(0)
    clear = 1e-6 * (t[-1] - t[0])
    return np.asarray(found[np.abs(found[:, None] - pcurve.breaks[None]).min(axis=1, initial=np.inf) > clear])


def _line(t: Array, values: Array) -> NurbsCurve | None:
    """The straight curve through the values where they lie on one, run at even speed, to round-off."""
    share = ((t - t[0]) / (t[-1] - t[0]))[:, None]
    off = np.abs(values - (1.0 - share) * values[0] - share * values[-1]).max()
    if off > 64.0 * np.finfo(np.float64).eps * np.abs(values).max():
        return None
    return NurbsCurve(1, np.array([t[0], t[0], t[-1], t[-1]]), values[[0, -1]])
