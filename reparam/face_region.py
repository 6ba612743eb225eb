"""Trimmed CAD faces with four sides, as regions to reparametrize."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Part
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.reparam.parameter_curves import Backwards, Carried, Chain, ParameterCurve, carrying
from patchwright.reparam.region import Region

SHARP = 30.0  # degrees: edges that turn less are one side where there are more than four
LEAST_CORNER = 5.0  # degrees: a side that goes on straighter than this has no corner


def face_region(part: Part) -> Region:
    """The region of a face between its four sides.

    A face without trims is its whole surface. More than four edges count as four sides where all other joints between
    them turn by less than 30 degrees. An edge that is a point (the pole of a sphere) is a side.

    Raises
    ------
    ParameterError : no surface, holes, not four sides, or a corner that is none.
    """
    name = part.name or "the face"
    if part.surface is None:
        raise ParameterError(f"{name}: has triangles but no surface; fit surfaces first (patchwright repair)")
    if not np.isfinite(np.array(part.surface.domain)).all():
        raise ParameterError(f"{name}: its surface is unbounded and has no trims")
    form = part.surface.to_nurbs()
    if part.trims is None:
        return Region.of_surface(form, name=name)
    if len(part.trims) != 1:
        raise ParameterError(
            f"{name}: has {len(part.trims) - 1} holes; only faces with four sides and no hole are taken"
        )
    curves: list[ParameterCurve] = list(part.trims[0])
    if not isinstance(part.surface, NurbsSurface):
        maps = carrying(part.surface, form)
        curves = [Carried(c, maps) for c in curves]
    south, east, north, west = _sides(form, curves, name)
    return Region.of_sides(form, (south, Backwards(north), Backwards(west), east), name)


def _sides(surface: NurbsSurface, curves: list[ParameterCurve], name: str) -> list[ParameterCurve]:
    """Four chains head to tail, counter-clockwise, the first from the corner nearest to (u0, v0)."""
    outline = np.concatenate([c(np.linspace(*c.domain, 33))[:-1] for c in curves])
    following = np.roll(outline, -1, axis=0)
    if float((outline[:, 0] * following[:, 1] - outline[:, 1] * following[:, 0]).sum()) < 0.0:
        curves = [Backwards(c) for c in curves[::-1]]
    turn = np.array([_turn(surface, curves[k - 1], curves[k]) for k in range(len(curves))])  # at the start of curve k
    if len(curves) < 4:
        raise ParameterError(f"{name}: has {len(curves)} sides, not four")
    order = np.argsort(-turn, kind="stable")
    if len(curves) > 4 and turn[order[4]] >= SHARP:
        sharp = int((turn >= SHARP).sum())
        raise ParameterError(f"{name}: has {sharp} corners of {SHARP:g} degrees and more, not four")
    if turn[order[3]] < LEAST_CORNER:
        raise ParameterError(f"{name}: its sides join smoothly, so that it has fewer than four corners")
    corners = np.sort(order[:4])
    box = outline.min(axis=0), np.maximum(np.ptp(outline, axis=0), 1e-300)
    starts = np.array([curves[k](curves[k].domain[0]) for k in corners])
    first = int(np.argmin(((starts - box[0]) / box[1]).sum(axis=1)))
    corners = np.roll(corners, -first)
    sides = []
    for a, b in zip(corners.tolist(), np.roll(corners, -1).tolist(), strict=True):
        links = [curves[k % len(curves)] for k in range(a, b if b > a else b + len(curves))]
        sides.append(links[0] if len(links) == 1 else Chain(tuple(links)))
    return sides


def _turn(surface: NurbsSurface, before: ParameterCurve, after: ParameterCurve) -> float:
    """Degrees between both curves where they meet; 180 where one of them is a point."""
    low, high = np.array(surface.domain).T
    directions: list[Array] = []
    for curve, ends in ((before, (0.999, 1.0)), (after, (0.0, 0.001))):
        t0, t1 = curve.domain
        uv = np.clip(curve(t0 + (t1 - t0) * np.array([*ends, 0.5])), low, high)
        a, b, middle = surface(uv[:, 0], uv[:, 1])
        if np.linalg.norm(b - a) <= 1e-9 * max(float(np.linalg.norm(middle - a)), float(np.abs(a).max())):
            return 180.0
        directions.append((b - a) / np.linalg.norm(b - a))
    return float(np.degrees(np.arccos(np.clip(directions[0] @ directions[1], -1.0, 1.0))))
