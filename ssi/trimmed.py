"""Curves of two surfaces cut back to the faces' trims.

A curve ends where its (u, v) image crosses a trim loop: crossings of the polylines seed Newton's method on both curves.
Pieces are kept when their middle lies inside the loops (even-odd rule) or on them. An overlap stays when it lies within
the face, goes when it lies outside, and is cut in a plane (`trimmed_overlaps`). Limits: a curve that runs along a loop
and leaves it smoothly is cut where the polylines cross, not where it leaves; an overlap that a loop would cut on a
curved surface is handed back as unresolved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from patchwright.models.analytic import Plane
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.knots import divided
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.ssi.chained import appended
from patchwright.ssi.intersection import Box, Contact, Intersection, IntersectionCurve, Overlap, Unresolved
from patchwright.ssi.operands import Loops

PER_SPAN = 24  # chords of a polyline in each knot span
NEWTON = 12
ON = 1e-8  # of the loops' extent in space: what is nearer than this to a loop lies on it


def trimmed(found: Intersection, surface: Surface, loops: Loops | None, side: int) -> Intersection:
    """What of an intersection lies on a face, its border included.

    Parameters
    ----------
    surface, loops : the face; None as loops keeps everything
    side : 0 when the face is the first of the two surfaces, 1 when it is the second
    """
    if loops is None or not (found.curves or found.points or found.overlaps):
        return found
    moved = [[[_moved(curve, shift) for curve in loop] for loop in loops] for shift in _shifts(surface)]
    curves = tuple(piece for curve in found.curves for piece in _cut(curve, surface, moved, side))
    points = tuple(p for p in found.points if _keeps(p, surface, moved, side))
    overlaps: list[Overlap] = []
    open_: list[Unresolved] = []
    for overlap in found.overlaps:
        parts = _common(overlap, surface, moved, side)
        overlaps += parts or []
        if parts is None:
            boxes = _range(overlap, 0), _range(overlap, 1)
            open_.append(Unresolved(*boxes, "an overlap is not cut back to the face's trims", overlap.surfaces))
    return replace(
        found, curves=curves, points=points, overlaps=tuple(overlaps), unresolved=found.unresolved + tuple(open_)
    )


Moved = Sequence[Sequence[Sequence[NurbsCurve]]]  # loops of curves, once for every period of the surface


def _keeps(contact: Contact, surface: Surface, moved: Moved, side: int) -> bool:
    uv = contact.uv_a if side == 0 else contact.uv_b
    return uv is None or bool(_inside(np.array([uv]), surface, moved)[0])


def _range(overlap: Overlap, side: int) -> Box:
    """The parameters of an overlap's boundary, zeros on a mesh."""
    images = [c.uv_a if side == 0 else c.uv_b for c in overlap.boundary]
    net = np.concatenate([uv.control_points for uv in images if uv is not None] or [np.zeros((1, 2))])
    (u0, v0), (u1, v1) = net.min(axis=0).tolist(), net.max(axis=0).tolist()
    return (u0, u1), (v0, v1)


def _common(overlap: Overlap, surface: Surface, moved: Moved, side: int) -> list[Overlap] | None:
    """What of an overlap lies on the face; None where that cannot be told."""
    from patchwright.ssi.trimmed_overlaps import Cutting, cut_overlap

    images = [c.uv_a if side == 0 else c.uv_b for c in overlap.boundary]
    border = [uv for uv in images if uv is not None]
    if not border or len(border) < len(images):
        return None
    lines = [uv(divided(uv.breaks, PER_SPAN)) for uv in border]
    tails, heads = np.concatenate([p[:-1] for p in lines]), np.concatenate([p[1:] for p in lines])
    trims = [curve for loops in moved for loop in loops for curve in loop]
    on_face = _inside(np.concatenate(lines), surface, moved)
    rim = np.concatenate([_polyline(curve)[0] for curve in trims])
    within = _rays_cut(rim, tails, heads) % 2 == 1
    if within.any():  # on the overlap's border is not within it
        reach = ON * float(np.ptp(np.concatenate(lines), axis=0).max())
        within[within] = np.min([uv.closest(rim[within]).distance for uv in border], axis=0) > reach
    if not within.any() and (on_face.all() or not on_face.any()):
        return [overlap] if on_face.all() else []
    if not isinstance(surface, Plane):
        return None
    return cut_overlap(
        overlap,
        surface,
        trims,
        side,
        lambda uv: _inside(uv, surface, moved),
        lambda uv: np.asarray(_rays_cut(uv, tails, heads) % 2 == 1),
        Cutting(_crossings, _restricted),
    )


def _cut(curve: IntersectionCurve, surface: Surface, moved: Moved, side: int) -> list[IntersectionCurve]:
    """The pieces of one curve inside the loops or on them."""
    uv = curve.uv_a if side == 0 else curve.uv_b
    if uv is None:
        return [curve]
    start, end = curve.curve.domain
    least = 1e-9 * (end - start)
    border = [c for loops in moved for loop in loops for c in loop]
    cuts = np.unique(np.concatenate([_crossings(uv, other) for other in border] or [np.zeros(0)]))
    cuts = cuts[(cuts > start + least) & (cuts < end - least)]
    cuts = cuts[np.diff(cuts, prepend=start) > least]
    ends = np.concatenate([[start], cuts, [end]])
    kept = _inside(uv(0.5 * (ends[1:] + ends[:-1])), surface, moved)
    if kept.all():
        return [curve]
    change = np.diff(np.concatenate([[False], kept, [False]]).astype(np.int64))
    runs = [(ends[i], ends[j]) for i, j in zip(np.flatnonzero(change > 0), np.flatnonzero(change < 0), strict=True)]
    pieces = [_restricted(curve, t0, t1) for t0, t1 in runs]
    if curve.closed and len(pieces) > 1 and kept[0] and kept[-1]:
        # parted only where the loop happens to begin
        pieces = [appended(pieces[-1], pieces[0]), *pieces[1:-1]]
    return pieces


def _restricted(curve: IntersectionCurve, t0: float, t1: float) -> IntersectionCurve:
    part = curve.curve.restricted(t0, t1)
    uv_a, uv_b = (None if c is None else c.restricted(t0, t1) for c in (curve.uv_a, curve.uv_b))
    at = curve.curve.closest(curve.points).t if len(curve.points) else np.zeros(0)
    inner = curve.points[(at > t0) & (at < t1)]
    points = np.concatenate([curve.curve(np.array([t0])), inner, curve.curve(np.array([t1]))])
    return replace(curve, curve=part, uv_a=uv_a, uv_b=uv_b, points=points, closed=False)


def _polyline(curve: NurbsCurve) -> tuple[Array, Array]:
    """Points of a curve, knots included, and their parameters."""
    t = divided(curve.breaks, PER_SPAN)
    return curve(t), t


def _crossings(one: NurbsCurve, other: NurbsCurve) -> Array:
    """Parameters of the plane curve `one` at which it crosses `other`."""
    (p, t), (q, s) = _polyline(one), _polyline(other)
    d, e = np.diff(p, axis=0), np.diff(q, axis=0)
    gap = q[None, :-1] - p[:-1, None]
    cross = d[:, None, 0] * e[None, :, 1] - d[:, None, 1] * e[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        x = (gap[..., 0] * e[None, :, 1] - gap[..., 1] * e[None, :, 0]) / cross
        y = (gap[..., 0] * d[:, None, 1] - gap[..., 1] * d[:, None, 0]) / cross
    slack = 0.05  # a chord's crossing may lie a little beyond the curve's own stretch
    i, j = np.nonzero((x > -slack) & (x < 1 + slack) & (y > -slack) & (y < 1 + slack))
    if not len(i):
        return np.zeros(0)
    at, on = t[i] + x[i, j] * np.diff(t)[i], s[j] + y[i, j] * np.diff(s)[j]
    at, on = np.clip(at, *one.domain), np.clip(on, *other.domain)
    for _ in range(NEWTON):
        away = one(at) - other(on)
        a, b = one(at, nu=1), other(on, nu=1)
        area = a[:, 1] * b[:, 0] - a[:, 0] * b[:, 1]
        area = np.where(area == 0.0, np.inf, area)
        at = np.clip(at + (away[:, 0] * b[:, 1] - away[:, 1] * b[:, 0]) / area, *one.domain)
        on = np.clip(on + (away[:, 0] * a[:, 1] - away[:, 1] * a[:, 0]) / area, *other.domain)
    miss = np.linalg.norm(one(at) - other(on), axis=1)
    size = float(np.ptp(q, axis=0).max() + np.ptp(p, axis=0).max())
    good = np.sort(at[miss < 1e-10 * size])
    apart = np.diff(good, prepend=-np.inf) > 1e-9 * (one.domain[1] - one.domain[0])
    return np.asarray(good[apart])


def _inside(uv: Array, surface: Surface, moved: Moved) -> BoolArray:
    """(n,) whether points lie inside the loops or on them, in any of their periods."""
    out = np.zeros(len(uv), dtype=bool)
    low, high = np.array(surface.domain).T
    for loops in moved:
        crossings = np.zeros(len(uv), dtype=np.int64)
        for loop in loops:
            polygon = []
            for curve in loop:
                foot = curve.closest(uv).t
                out |= _together(uv, curve(foot), surface, low, high)
                # with the points' feet for vertices the polygon has them on the same side as the curve
                t = np.unique(np.concatenate([divided(curve.breaks, PER_SPAN), foot]))
                polygon.append(curve(t)[:-1])
            corners = np.concatenate(polygon)
            crossings += _rays_cut(uv, corners, np.roll(corners, -1, axis=0))
        out |= crossings % 2 == 1
    return out


def _together(uv: Array, other: Array, surface: Surface, low: Array, high: Array) -> BoolArray:
    """(n,) whether two points of the parameter plane are one point of the surface, within `ON` of its size."""
    p, q = np.clip(uv, low, high), np.clip(other, low, high)
    size = float(np.ptp(surface.to_nurbs().control_points.reshape(-1, 3), axis=0).max()) if _finite(surface) else 1.0
    apart = np.linalg.norm(surface(p[:, 0], p[:, 1]) - surface(q[:, 0], q[:, 1]), axis=1)
    return np.asarray(apart <= ON * size)


def _rays_cut(uv: Array, tails: Array, heads: Array) -> IntArray:
    """(n,) how many of the edges from `tails` to `heads` the ray along u from each point cuts."""
    spans = (tails[None, :, 1] > uv[:, 1:]) != (heads[None, :, 1] > uv[:, 1:])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (uv[:, 1:] - tails[:, 1]) / (heads[:, 1] - tails[:, 1])
        x = tails[:, 0] + share * (heads[:, 0] - tails[:, 0])
    return np.asarray((spans & (x > uv[:, :1])).sum(axis=1), dtype=np.int64)


def _finite(surface: Surface) -> bool:
    return bool(np.isfinite(surface.domain).all())


def _shifts(surface: Surface) -> list[Array]:
    """Whole periods by which (u, v) may run beyond the domain, none first."""
    (u0, u1), (v0, v1) = surface.domain
    out = [np.zeros(2)]
    if not np.isfinite([u0, u1, v0, v1]).all():
        return out
    t = np.linspace(0.0, 1.0, 7)[1:-1]
    u, v = u0 + t * (u1 - u0), v0 + t * (v1 - v0)
    size = float(np.ptp(surface(u, v), axis=0).max())
    if np.abs(surface(np.full(5, u0), v) - surface(np.full(5, u1), v)).max() < 1e-9 * size:
        out += [np.array([k * (u1 - u0), 0.0]) for k in (-1.0, 1.0)]
    if np.abs(surface(u, np.full(5, v0)) - surface(u, np.full(5, v1))).max() < 1e-9 * size:
        out += [shift + np.array([0.0, k * (v1 - v0)]) for shift in list(out) for k in (-1.0, 1.0)]
    return out


def _moved(curve: NurbsCurve, shift: Array) -> NurbsCurve:
    return NurbsCurve(curve.degree, curve.knots, curve.control_points + shift, curve.weights)
