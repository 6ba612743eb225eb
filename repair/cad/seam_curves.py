"""The curve two faces share along a seam: an edge that lies on both already, or the curve where their surfaces cross.

An edge of one face lies on the other's surface where it is within round-off of it, or where the two surfaces touch or
nearly so and are no farther apart than a closed seam. Where they cross at a clear angle the curve is found by Newton's
method from the longer edge: first points, then a smooth guide through them, then a spline whose every point is in the
guide's normal plane and on both surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.boundary_strip import SIDES, border_below
from patchwright.models.closest_point import closest_on_curve
from patchwright.models.errors import GeometryError
from patchwright.models.extension import curve_on
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse
from patchwright.repair.cad.draft import Draft, Limits
from patchwright.repair.cad.meeting import CROSSING, across, farthest, feet, on_both
from patchwright.repair.cad.pcurves import fitted, knots_met, spline
from patchwright.repair.cad.seam_pieces import Piece, Seam

SAMPLES = 33
EXACT = 0.02  # of the distance at which an edge lies on a surface: nearer than this it lies there to round-off
FINE = 10.0  # of the rungs' finest length: how near a new edge follows its surfaces
PER_SPAN = 3  # points of the first guess per control point of the leading edge
MOST = 400  # points of the first guess
SAME_SIDE = 0.9998  # cosine between the ways into two faces: one lies on the other
FAR = 1e-7  # of a domain: a pcurve this near its border runs along it


class Meeting(Enum):
    """How two faces meet along a seam."""

    LIES = "an edge of one lies on the other"
    CROSS = "the surfaces cross"
    APART = "the surfaces are apart"
    FOLD = "one face lies on the other"


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A seam with how its faces meet, the leading piece's own curve, and how far that is from the other surface."""

    seam: Seam
    meeting: Meeting
    track: NurbsCurve
    apart: float


def uses_of(draft: Draft) -> dict[int, EdgeUse]:
    """The use of every edge that is used once."""
    owner = draft.owners()
    out = {}
    for face in sorted(set(owner.values())):
        for loop in draft.topology.loops[face]:
            out.update({use.edge: use for use in loop if owner.get(use.edge) == face})
    return out


def judged(draft: Draft, seam: Seam, uses: dict[int, EdgeUse], limits: Limits) -> Judged:
    """How the faces of a seam meet, led by the piece that is nearer to the other face's surface."""
    pieces = (seam.lead, *seam.others)
    own = [uses[piece.edge] for piece in pieces]
    curves = [draft.topology.curves[piece.edge] for piece in pieces]
    objects = (*map(draft.surface, seam.faces), *curves, *(use.pcurve for use in own))
    ranges = [number for piece in pieces for number in (piece.t0, piece.t1)]
    numbers = (seam.against, *(use.reversed for use in own), *ranges, limits.on, limits.fit)
    turned, meeting, curve, apart = limits.remembered(
        "judged", objects, numbers, lambda: _judged(draft, seam, uses, limits)
    )
    return Judged(seam.turned() if turned else seam, meeting, curve, apart)


def _judged(
    draft: Draft, seam: Seam, uses: dict[int, EdgeUse], limits: Limits
) -> tuple[bool, Meeting, NurbsCurve, float]:
    """Whether the other piece leads, how they meet, the leading curve, and how far it is from the other surface."""
    candidates = [seam] if len(seam.others) > 1 else [seam, seam.turned()]
    tracks = [track(draft, one.lead, uses, limits) for one in candidates]
    points = [curve(np.linspace(*curve.domain, SAMPLES)) for curve in tracks]
    near = [_below(draft.surface(one.faces[1]), p) for one, p in zip(candidates, points, strict=True)]
    far, rims = [some for some, _ in near], [count for _, count in near]
    # of two equally near ones the one that lies inside the other face rather than along its border
    scale = [round(float(np.log10(max(some, 1e-3 * limits.fit)))) for some in far]
    best = min(range(len(far)), key=lambda k: (scale[k], rims[k], far[k], len(tracks[k].control_points)))
    own, other = (draft.surface(face) for face in candidates[best].faces)
    if _folded(draft, candidates[best], tracks[best], uses):
        meeting = Meeting.FOLD
    elif far[best] <= EXACT * limits.on:
        meeting = Meeting.LIES
    elif across(own, other, points[best]).min() >= CROSSING:
        meeting = Meeting.CROSS
    else:
        meeting = Meeting.LIES if far[best] <= limits.on else Meeting.APART
    return best == 1, meeting, tracks[best], far[best]


def _folded(draft: Draft, seam: Seam, own: NurbsCurve, uses: dict[int, EdgeUse]) -> bool:
    """Whether both faces lie on the same side of a seam: then they overlap there and do not meet."""
    t0, t1 = own.domain
    t = t0 + (t1 - t0) * np.array([0.2, 0.5, 0.8])
    points, along = own(t), own(t, 1)
    sign = [-1.0 if uses[seam.lead.edge].reversed else 1.0]
    sign.append(-1.0 if uses[seam.others[0].edge].reversed != seam.against else 1.0)
    # a loop has its face on its left, seen against the surface's own normal
    inward = [
        direction * np.cross(feet(draft.surface(face), points)[1], along)
        for face, direction in zip(seam.faces, sign, strict=True)
    ]
    size = np.prod([np.linalg.norm(some, axis=1) for some in inward], axis=0)
    together = np.einsum("ij,ij->i", *inward) > SAME_SIDE * size
    return bool(np.count_nonzero(together & (size > 0.0)) > 1)


def _below(surface: Surface, points: Array) -> tuple[float, int]:
    """The largest distance of points (k, 3) from a surface, and how many of their feet are on its border."""
    places, _, uv = feet(surface, points)
    box = np.array(surface.domain)
    inside = (uv > box[:, 0]) & (uv < box[:, 1]) if isinstance(surface, NurbsSurface) else np.ones_like(uv, dtype=bool)
    return float(np.linalg.norm(places - points, axis=1).max()), int(np.count_nonzero(~inside.all(axis=1)))


def track(draft: Draft, piece: Piece, uses: dict[int, EdgeUse], limits: Limits) -> NurbsCurve:
    """A piece's curve on its face's surface, over [t0, t1]: its own, or its pcurve's image where that is elsewhere."""
    curve, use, surface = draft.topology.curves[piece.edge], uses[piece.edge], draft.surface(piece.face)
    t = np.linspace(piece.t0, piece.t1, SAMPLES)
    low, high = np.array(surface.domain).T

    def image(t: Array) -> Array:
        u, v = np.clip(use.pcurve(t), low, high).T
        return np.asarray(surface(u, v))

    if np.linalg.norm(image(t) - curve(t), axis=1).max() > limits.fit:
        border = _border(surface, use.pcurve)
        if border is not None:
            return border.restricted(piece.t0, piece.t1)
        below = use.pcurve.restricted(piece.t0, piece.t1)
        return fitted(image, below, FINE * limits.fit, knots_met(surface, below))
    whole = (piece.t0, piece.t1) == curve.domain
    return curve if whole else curve.restricted(piece.t0, piece.t1)


def _border(surface: Surface, pcurve: NurbsCurve) -> NurbsCurve | None:
    """The surface's border below a straight pcurve along it, in the pcurve's own parameter."""
    if not isinstance(surface, NurbsSurface) or pcurve.degree != 1 or len(pcurve.control_points) != 2:
        return None
    box, (first, last) = np.array(surface.domain), pcurve.control_points
    size = box[:, 1] - box[:, 0]
    for side in SIDES:
        k, end = (0 if side[0] == "u" else 1), int(side[1])
        if max(abs(first[k] - box[k, end]), abs(last[k] - box[k, end])) <= FAR * size[k]:
            return border_below(surface, side, pcurve)
    return None


def common(draft: Draft, one: Judged, ends: Array, limits: Limits) -> NurbsCurve | None:
    """The curve both faces share, from `ends[0]` to `ends[1]` (2, 3) near enough for a seam; None without one."""
    own, other = (draft.surface(face) for face in one.seam.faces)
    if one.meeting is Meeting.CROSS:
        found = crossing_curve(own, other, one.track, ends, limits)
        if found is not None or one.apart > limits.on:
            return found
    moved = reattached(one.track, ends, (own,), limits)
    if moved is None:
        return None
    points = moved(np.linspace(*moved.domain, SAMPLES))
    return moved if farthest(other, points) <= limits.on else None


def reattached(curve: NurbsCurve, ends: Array, surfaces: tuple[Surface, ...], limits: Limits) -> NurbsCurve | None:
    """A curve on one or two surfaces that goes to new ends (2, 3): along itself, or bent on the surfaces.

    A curve whose ends are within `limits.on` of the new ones is returned as it is.
    """
    tips = curve(np.array(curve.domain))
    away = np.linalg.norm(ends - tips, axis=1)
    if away.max() <= limits.on:
        return curve
    along = _along(curve, ends, away, limits)
    if along is not None:
        return along
    t0, t1 = curve.domain

    def guide(t: Array) -> Array:
        share = ((t - t0) / (t1 - t0))[:, None]
        return np.asarray(curve(t) + (1.0 - share) * (ends[0] - tips[0]) + share * (ends[1] - tips[1]))

    def place(t: Array) -> Array:
        if len(surfaces) == 2 and crossing:
            slope = curve(t, 1) + ((ends[1] - tips[1]) - (ends[0] - tips[0])) / (t1 - t0)
            found = on_both(*surfaces, guide(t), slope, limits)
            if found is None:
                raise GeometryError("two surfaces do not cross all along an edge")
            return found
        return feet(surfaces[0], guide(t))[0]

    probes = np.linspace(t0, t1, SAMPLES)
    crossing = len(surfaces) == 2 and bool(across(*surfaces, curve(probes)).min() >= CROSSING)
    try:
        made = fitted(place, curve, FINE * limits.fit)
    except GeometryError:
        return None
    points = made(probes)
    sound = all(farthest(s, points) <= limits.on for s in surfaces)
    sound &= float(np.linalg.norm(made(np.array([t0, t1])) - ends, axis=1).max()) <= limits.on
    return made if sound else None


def _along(curve: NurbsCurve, ends: Array, away: Array, limits: Limits) -> NurbsCurve | None:
    """The curve made shorter or longer to reach its new ends; None where they are beside it."""
    t0, t1 = curve.domain
    speeds = np.linalg.norm(curve(np.array([t0, t1]), 1), axis=1)
    if (speeds == 0.0).any():
        return None
    room = np.minimum(2.0 * away / speeds, 0.25 * (t1 - t0))
    try:
        longer = curve_on(curve, t0 - room[0], t1 + room[1])
    except GeometryError:
        return None
    found = closest_on_curve(longer, ends)
    if found.distance.max() > limits.on:
        return None
    moved = [t if far > limits.on else own for t, far, own in zip(found.t, away, (t0, t1), strict=True)]
    if abs(moved[0] - t0) > room[0] + 1e-12 or abs(moved[1] - t1) > room[1] + 1e-12 or moved[0] >= moved[1]:
        return None
    return curve_on(curve, float(moved[0]), float(moved[1]))


def crossing_curve(own: Surface, other: Surface, curve: NurbsCurve, ends: Array, limits: Limits) -> NurbsCurve | None:
    """The curve where two surfaces cross beside a leading one, from `ends[0]` to `ends[1]` (2, 3)."""
    t0, t1 = curve.domain
    tips = curve(np.array([t0, t1]))
    count = int(np.clip(PER_SPAN * len(curve.control_points), SAMPLES, MOST))
    t = np.linspace(t0, t1, count)
    share = ((t - t0) / (t1 - t0))[:, None]
    points = curve(t) + (1.0 - share) * (ends[0] - tips[0]) + share * (ends[1] - tips[1])
    slope = curve(t, 1) + ((ends[1] - tips[1]) - (ends[0] - tips[0])) / (t1 - t0)
    places = on_both(own, other, points, slope, limits)
    if places is None:
        return None
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    if (steps == 0.0).any():
        return None
    along = np.concatenate([[0.0], np.cumsum(steps)])
    guide = spline(along, places)

    def place(t: Array) -> Array:
        found = on_both(own, other, guide(t), guide(t, 1), limits)
        if found is None:
            raise GeometryError("two surfaces do not cross all along an edge")
        return found

    try:
        smooth = NurbsCurve(1, np.array([0.0, 0.0, along[-1], along[-1]]), np.stack([places[0], places[-1]]))
        made = fitted(place, smooth, FINE * limits.fit, _less_smooth((own, other), along, places))
    except GeometryError:
        return None
    at = made(np.array(made.domain))
    points = made(np.linspace(*made.domain, 4 * SAMPLES + 1))
    sound = max(farthest(own, points), farthest(other, points)) <= limits.on
    return made if sound and np.linalg.norm(at - ends, axis=1).max() <= limits.on else None


def _less_smooth(surfaces: tuple[Surface, ...], along: Array, places: Array) -> Array:
    """The parameters at which a curve through `places` (k, 3) at `along` (k,) crosses knot lines of its surfaces."""
    out = [np.zeros(0)]
    for surface in surfaces:
        if isinstance(surface, NurbsSurface):
            out.append(knots_met(surface, spline(along, feet(surface, places)[2])))
    return np.unique(np.concatenate(out))
