"""Overlaps cut back to the trims of a plane face.

The boundary of what is left is made of pieces of the overlap's boundary and pieces of the trims, cut where they cross:
those that have the common region on exactly one side. Oriented with it on the left they give its area by Green's
theorem and close to loops: one region for each loop run counter-clockwise, less the clockwise ones within it.

Limits: planes only, since trims become curves in space, and areas, by an affine map. The image of a trim on the other
surface is that of the overlap's boundary if this is affine too; else the overlap cannot be cut.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from patchwright.models.analytic import Plane
from patchwright.models.arrays import Array, BoolArray
from patchwright.models.knots import divided
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.ssi.chained import reversed_curve
from patchwright.ssi.intersection import IntersectionCurve, Overlap

NUDGE = 1e-6  # of the extent: how far beside a piece it is asked what lies there
NEAR = 1e-9  # of the extent: nearer places are one
GAUSS = 16  # points in each span

Inside = Callable[[Array], BoolArray]  # of (n, 2) parameters
Crossings = Callable[[NurbsCurve, NurbsCurve], Array]
Restricted = Callable[[IntersectionCurve, float, float], IntersectionCurve]


@dataclass(frozen=True, slots=True, eq=False)
class Cutting:
    """What cutting curves at each other takes: parameters of crossings, and the part of a curve between two."""

    crossings: Crossings
    restricted: Restricted


def cut_overlap(
    overlap: Overlap,
    plane: Plane,
    trims: Sequence[NurbsCurve],
    side: int,
    in_face: Inside,
    in_overlap: Inside,
    how: Cutting,
) -> list[Overlap] | None:
    """The connected regions an overlap has in common with a face; None where the other surface's map is not known.

    Parameters
    ----------
    trims : (u, v) curves of all loops of the face
    side : 0 when the plane is the first of the two surfaces, 1 when it is the second
    """
    own = [_image(c, side) for c in overlap.boundary]
    net = np.concatenate([uv.control_points for uv in own])
    size = float(np.ptp(net, axis=0).max())
    as_curves = _lifted(overlap, plane, trims, side)
    if as_curves is None:
        return None
    rim = [p for c in overlap.boundary for p in _parted(c, side, trims, how)]
    for curve in as_curves:
        for piece in _parted(curve, side, own, how):
            image = _image(piece, side)
            middle = image(_inner(image))
            if min(float(uv.closest(middle).distance[0]) for uv in own) > NEAR * size:
                rim.append(piece)
    pieces = [p for p in (_oriented(piece, side, NUDGE * size, in_face, in_overlap) for piece in rim) if p is not None]
    return _regions(pieces, side, NEAR * size * 100.0, overlap.surfaces)


def _image(curve: IntersectionCurve, side: int) -> NurbsCurve:
    uv = curve.uv_a if side == 0 else curve.uv_b
    assert uv is not None
    return uv


def _inner(uv: NurbsCurve) -> Array:
    """(1,) the middle of the longest span: away from corners."""
    k = int(np.argmax(np.diff(uv.breaks)))
    return np.array([0.5 * (uv.breaks[k] + uv.breaks[k + 1])])


def _lifted(overlap: Overlap, plane: Plane, trims: Sequence[NurbsCurve], side: int) -> list[IntersectionCurve] | None:
    """The trims as curves in space and on both surfaces."""
    across = np.stack([plane.xdir, plane.ydir])
    others = [c.uv_b if side == 0 else c.uv_a for c in overlap.boundary]
    affine = None
    if all(uv is not None for uv in others):
        t = [divided(c.curve.breaks, 8) for c in overlap.boundary]
        here = np.concatenate([_image(c, side)(s) for c, s in zip(overlap.boundary, t, strict=True)])
        there = np.concatenate([uv(s) for uv, s in zip(others, t, strict=True) if uv is not None])
        rows = np.concatenate([here, np.ones((len(here), 1))], axis=1)
        affine = np.linalg.lstsq(rows, there, rcond=None)[0]
        if np.abs(rows @ affine - there).max() > NEAR * np.ptp(there, axis=0).max():
            return None
    elif any(uv is not None for uv in others):
        return None
    out = []
    for uv in trims:
        net = uv.control_points
        space = NurbsCurve(uv.degree, uv.knots, plane.origin + net @ across, uv.weights)
        other = None
        if affine is not None:
            other = NurbsCurve(uv.degree, uv.knots, net @ affine[:2] + affine[2], uv.weights)
        points = space(divided(space.breaks, 2))
        on_a, on_b = (uv, other) if side == 0 else (other, uv)
        out.append(IntersectionCurve(space, on_a, on_b, points, "overlap-boundary", False, 0.0, overlap.surfaces))
    return out


def _parted(curve: IntersectionCurve, side: int, others: Sequence[NurbsCurve], how: Cutting) -> list[IntersectionCurve]:
    """The curve cut where it crosses others in the parameters of the plane."""
    uv = _image(curve, side)
    start, end = uv.domain
    least = 1e-9 * (end - start)
    cuts = np.unique(np.concatenate([how.crossings(uv, other) for other in others] or [np.zeros(0)]))
    cuts = cuts[(cuts > start + least) & (cuts < end - least)]
    ends = np.concatenate([[start], cuts[np.diff(cuts, prepend=start) > least], [end]])
    if len(ends) == 2:
        return [curve]
    return [how.restricted(curve, a, b) for a, b in pairwise(ends.tolist())]


def _oriented(
    piece: IntersectionCurve, side: int, step: float, in_face: Inside, in_overlap: Inside
) -> IntersectionCurve | None:
    """The piece run with the common region on its left; None where that is on both sides or on neither."""
    uv = _image(piece, side)
    t = _inner(uv)
    ahead = uv(t, nu=1)[0]
    left = step * np.array([-ahead[1], ahead[0]]) / np.linalg.norm(ahead)
    beside = np.stack([uv(t)[0] + left, uv(t)[0] - left])
    common = in_face(beside) & in_overlap(beside)
    if common[0] == common[1]:
        return None
    return piece if common[0] else reversed_curve(piece)


def _regions(
    pieces: Sequence[IntersectionCurve], side: int, reach: float, surfaces: tuple[int, int]
) -> list[Overlap] | None:
    """Loops of the pieces, each counter-clockwise one with the clockwise ones inside it; None where one is open."""
    left = list(pieces)
    loops: list[list[IntersectionCurve]] = []
    while left:
        loop = [left.pop(0)]
        first = _end(loop[0], side, 0)
        while float(np.linalg.norm(_end(loop[-1], side, 1) - first)) > reach:
            gaps = [float(np.linalg.norm(_end(p, side, 0) - _end(loop[-1], side, 1))) for p in left]
            if not gaps or min(gaps) > reach:
                return None
            loop.append(left.pop(int(np.argmin(gaps))))
        loops.append(loop)
    areas = [sum(_swept(_image(p, side)) for p in loop) for loop in loops]
    outer = [k for k, area in enumerate(areas) if area > 0.0]
    held = {k: list(loops[k]) for k in outer}
    total = {k: areas[k] for k in outer}
    for k in sorted(set(range(len(loops))) - set(outer)):
        around = [o for o in outer if _winds(loops[o], side, _end(loops[k][0], side, 0))]
        if not around:
            return None
        home = min(around, key=lambda o: areas[o])
        held[home] += loops[k]
        total[home] += areas[k]
    return [
        Overlap(tuple(replace(p, closed=len(held[k]) == 1) for p in held[k]), float(total[k]), surfaces) for k in outer
    ]


def _end(piece: IntersectionCurve, side: int, which: int) -> Array:
    uv = _image(piece, side)
    return np.asarray(uv(np.array([uv.domain[which]]))[0])


def _swept(uv: NurbsCurve) -> float:
    """Half the integral of u dv - v du."""
    x, w = np.polynomial.legendre.leggauss(GAUSS)
    breaks = uv.breaks
    half = 0.5 * np.diff(breaks)[:, None]
    t = (0.5 * (breaks[1:] + breaks[:-1])[:, None] + half * x).reshape(-1)
    p, d = uv(t), uv(t, nu=1)
    return float(0.5 * ((p[:, 0] * d[:, 1] - p[:, 1] * d[:, 0]) * (half * w).reshape(-1)).sum())


def _winds(loop: Sequence[IntersectionCurve], side: int, point: Array) -> bool:
    """Whether a loop runs round a point."""
    images = [_image(p, side) for p in loop]
    corners = np.concatenate([uv(divided(uv.breaks, 24)) for uv in images]) - point
    angle = np.unwrap(np.arctan2(corners[:, 1], corners[:, 0]))
    return bool(abs(angle[-1] - angle[0]) > np.pi)
