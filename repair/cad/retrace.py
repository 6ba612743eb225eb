"""Pcurves drawn anew: a face's trims follow its edges again, on the surface it has.

An edge's curve in space may lie on both faces while the curve in a face's parameters strays from it: writers and sewing
leave that behind, and it shows as a seam that gapes although the surfaces meet. Such a pcurve is replaced by the feet
of the edge's curve on the face's own surface, found from the old one by Gauss-Newton steps, so that seams of closed
surfaces and poles keep their side. Surfaces and edges stay; a pcurve stays where no better one exists.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad.connectivity import is_point
from patchwright.models.cad.editing import Loops, with_loops
from patchwright.models.cad.seams import carried_on, edge_deviation, measure_seams
from patchwright.models.knots import divided
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.cad.draft import Attempt, Change, Draft, Limits, apart
from patchwright.repair.cad.loop_shape import polygon, signed_area
from patchwright.repair.cad.pcurves import fitted, joined, parameters, widened
from patchwright.repair.result import Rung

WHAT = "trims drawn anew"
STEPS = 12  # of Gauss and Newton: feet within a hundredth of the curvature radius settle in three
PROBES = 8  # per span of an edge
BETTER = 0.8  # of the old pcurve's distance: a new one that is not nearer than this is not taken
BETWEEN = 2.0  # times the edge's distance from the surface: how far a new pcurve may stray between its points ...
ROUGHLY = 0.1  # ... or this share of the old one's distance
POLE = 1e-4  # of a derivative's largest size along an edge: where it is smaller it vanishes
SAME = 1e-3  # of a surface's ranges: ends of pcurves nearer to each other need no edge between them
BESIDE = 1e-4  # of an edge's range: how far beside a pole its parameters are still good
NEARLY = 0.05  # of the edge's distance from the surface: how well the feet are followed


_UNIT = np.array([0.0, 0.0, 1.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Traced:
    """A new pcurve: the surface wide enough for it, its distance from the edge, and how far the trim moved."""

    pcurve: NurbsCurve
    surface: Surface
    residual: float
    moved: float


def retrace(
    draft: Draft, limits: Limits, faces: Collection[int] = ()
) -> tuple[Draft, tuple[Change, ...], tuple[Attempt, ...]]:
    """The draft with better pcurves where they stray from their edges, what changed, and where they would turn a loop.

    Looked at are the edges whose two surfaces are farther apart than a closed seam, those whose pcurves stray as far
    from them, the free edges, and all edges of `faces`.
    """
    topology = draft.topology
    wide = 2.0 * limits.on
    bare = replace(draft.assembly, topology=topology, native=None)
    asked = {seam.edge for seam in measure_seams(bare) if seam.gap > wide}
    asked |= set(np.flatnonzero((topology.use_counts() == 1) | (edge_deviation(bare) > wide)).tolist())
    loops: dict[int, Loops] = {}
    surfaces: dict[int, Surface] = {}
    changes: list[Change] = []
    failed: list[Attempt] = []
    for face, own in enumerate(draft.topology.loops):
        if limits.expired:
            break
        surface, rows, worst, moved, count = draft.surface(face), [], 0.0, 0.0, 0
        least = limits.on if face in faces else wide
        for loop in own:
            row = []
            for use in loop:
                if (use.edge in asked or face in faces) and not is_point(topology.curves[use.edge]):
                    found = traced(surface, topology.curves[use.edge], use, limits, least)
                    if found is not None:
                        use, surface = replace(use, pcurve=found.pcurve), found.surface
                        worst, moved, count = max(worst, found.residual), max(moved, found.moved), count + 1
                row.append(use)
            rows.append(tuple(row))
        if count and not _same_way(own, rows):
            failed.append(Attempt(WHAT, (face,), "its loop would run the other way round", draft.middle(face)))
        elif count:
            loops[face] = tuple(tuple(replace(use, pcurve=_inside(use.pcurve, surface)) for use in row) for row in rows)
            topology, loops[face] = over_poles(topology, surface, loops[face], limits)
            surfaces[face] = surface
            changes.append(_change(draft, face, count, worst, moved, limits))
    if changes:
        draft = draft.with_surfaces(surfaces, with_loops(topology, loops), same=True)
    return draft, tuple(changes), tuple(failed)


def _same_way(before: Loops, after: Sequence[Sequence[EdgeUse]]) -> bool:
    """Whether every loop still runs the way it did in the parameters."""
    return all(
        signed_area(polygon(old)) * signed_area(polygon(new)) > 0.0 for old, new in zip(before, after, strict=True)
    )


def traced(surface: Surface, curve: NurbsCurve, use: EdgeUse, limits: Limits, least: float) -> Traced | None:
    """A pcurve nearer to the edge than the one it has; None where that one is within `least` or no better is found."""
    t = divided(curve.breaks, PROBES)
    points = curve(t)
    before = _image(surface, use.pcurve, t)
    off = float(np.linalg.norm(before - points, axis=1).max())
    if off <= least:
        return None
    start = use.pcurve

    def place(at: Array) -> Array:
        return _off_poles(surface, curve, start, at)

    at = place(t)
    wide = widened(surface, at)
    away = float(np.linalg.norm(wide(at[:, 0], at[:, 1]) - points, axis=1).max())
    if away > BETTER * off:
        return None
    speed = max(float(np.linalg.norm(wide(at[:, 0], at[:, 1], order), axis=1).max()) for order in ((1, 0), (0, 1)))
    accuracy = max(limits.fit, NEARLY * away) / max(speed, np.finfo(float).tiny)
    best: tuple[float, NurbsCurve, Surface] | None = None
    for draw in (fitted, _span_by_span):
        made = draw(place, curve, accuracy)
        wide = widened(surface, made(t))
        made = _inside(made, wide)  # interpolation swings beyond a border it runs on
        probes = divided(made.breaks, PROBES)
        residual = float(np.linalg.norm(_image(wide, made, probes) - curve(probes), axis=1).max())
        if best is None or residual < best[0]:
            best = residual, made, wide
        if residual <= max(BETWEEN * away, limits.on):
            break
    assert best is not None
    residual, made, wide = best
    if residual > max(BETWEEN * away, ROUGHLY * off, limits.on):
        return None
    return Traced(made, wide, residual, float(apart(before, curve(divided(curve.breaks, 8 * PROBES))).max()))


def _span_by_span(place: Callable[[Array], Array], curve: NurbsCurve, accuracy: float) -> NurbsCurve:
    """`fitted`, with a corner allowed at every knot of the edge, where its derivatives may jump."""
    pieces = [fitted(place, curve.restricted(a, b), accuracy) for a, b in pairwise(curve.breaks.tolist())]
    highest = max(piece.degree for piece in pieces)
    return joined([piece.elevated(highest - piece.degree) if piece.degree < highest else piece for piece in pieces])


def over_poles(topology: Topology, surface: Surface, loops: Loops, limits: Limits) -> tuple[Topology, Loops]:
    """Loops whose pcurves meet at poles too: the pole's own edge leads from one's end to the next one's start.

    Such an edge is stretched where there is one and put in where there is none; one that has no length in the
    parameters either is left out.
    """
    if not isinstance(surface, NurbsSurface):
        return topology, loops
    box = np.array(surface.domain)
    curves, ends, rows = list(topology.curves), topology.ends.tolist(), []
    for loop in loops:
        real = [use for use in loop if not is_point(curves[use.edge])]
        row: list[EdgeUse] = []
        for k, use in enumerate(real):
            row.append(use)
            after = real[(k + 1) % len(real)]
            a, b = _end(use, last=True), _end(after, last=False)
            if np.abs((b - a) / np.ptp(box, axis=1)).max() <= SAME:
                continue
            way = np.clip(a + np.linspace(0.0, 1.0, 9)[:, None] * (b - a), *box.T)
            places = surface(way[:, 0], way[:, 1])
            if np.linalg.norm(places - places[0], axis=1).max() > 2.0 * limits.on:
                continue  # a gap and no pole
            corner = int(topology.ends[use.edge][0 if use.reversed else 1])
            at = topology.vertices[corner]
            row.append(EdgeUse(len(curves), False, NurbsCurve(1, _UNIT, np.stack([a, b]))))
            curves.append(NurbsCurve(1, _UNIT, np.stack([at, at])))
            ends.append([corner, corner])
        rows.append(tuple(row))
    return replace(topology, curves=tuple(curves), ends=np.array(ends)), tuple(rows)


def _end(use: EdgeUse, *, last: bool) -> Array:
    """(2,) where the loop leaves the use (or comes to it)."""
    return np.asarray(use.pcurve.control_points[-1 if last != use.reversed else 0])


def feet(surface: Surface, points: Array, near: Array) -> Array:
    """(k, 2) parameters of the feet of points (k, 3), from parameters nearby (k, 2).

    Surfaces of closed form answer directly, on the turn that `near` is on; on a NURBS steps lead there, and where they
    end farther away than the nearest point of all by more than round-off, that one counts.
    """
    if not isinstance(surface, NurbsSurface):
        return parameters(surface, points, near[0])
    low, high = np.array(surface.domain).T
    uv = np.clip(near, low, high)
    best, least = uv, np.full(len(points), np.inf)
    for _ in range(STEPS):
        jet = surface.jet(uv[:, 0], uv[:, 1], 1)
        left = points - jet[:, 0]
        away = np.linalg.norm(left, axis=1)
        closer = away < least
        best, least = np.where(closer[:, None], uv, best), np.minimum(away, least)
        uv = np.clip(uv + _step(jet[:, 1], jet[:, 2], left), low, high)
    nearest = surface.closest(points)
    lost = least > 1.01 * nearest.distance + 1e-9 * float(np.ptp(points, axis=0).max())
    return np.asarray(np.where(lost[:, None], np.stack([nearest.u, nearest.v], axis=1), best))


def _off_poles(surface: Surface, curve: NurbsCurve, start: NurbsCurve, t: Array) -> Array:
    """Feet at parameters t (k,) of a curve; at its ends where they lie on a pole, the limits they tend to.

    At a pole the parameter that runs round it is anything; what the feet beside it tend to is what continues them.
    """
    uv = feet(surface, curve(t), start(t))
    if not isinstance(surface, NurbsSurface):
        return uv
    t0, t1 = curve.domain
    jet = surface.jet(uv[:, 0], uv[:, 1], 1)
    speed = np.linalg.norm(jet[:, 1:], axis=2)
    for end, inward in ((t0, 1.0), (t1, -1.0)):
        at = np.flatnonzero(t == end)
        for k in (0, 1):
            if len(at) and speed[at[0], k] < POLE * max(speed[:, k].max(), np.finfo(float).tiny):
                beside = end + inward * BESIDE * (t1 - t0) * np.array([1.0, 2.0])
                near = feet(surface, curve(beside), start(beside))
                low, high = surface.domain[k]
                uv[at, k] = np.clip(2.0 * near[0, k] - near[1, k], low, high)
    return uv


def _step(along_u: Array, along_v: Array, left: Array) -> Array:
    """(k, 2) the least-squares step, damped where a derivative vanishes as at a pole."""
    uu, vv = np.einsum("ij,ij->i", along_u, along_u), np.einsum("ij,ij->i", along_v, along_v)
    mixed = np.einsum("ij,ij->i", along_u, along_v)
    damping = 1e-14 * (uu + vv) + np.finfo(float).tiny
    uu, vv = uu + damping, vv + damping
    right_u, right_v = np.einsum("ij,ij->i", along_u, left), np.einsum("ij,ij->i", along_v, left)
    determinant = np.maximum(uu * vv - mixed**2, np.finfo(float).tiny)
    steps = np.stack([vv * right_u - mixed * right_v, uu * right_v - mixed * right_u], axis=1)
    return np.asarray(steps / determinant[:, None])


def _inside(pcurve: NurbsCurve, surface: Surface) -> NurbsCurve:
    """The pcurve held within a NURBS surface's ranges where it leaves them: the kernel would go on beyond them."""
    if not isinstance(surface, NurbsSurface) or pcurve.rational:
        return pcurve
    low, high = np.array(surface.domain).T
    t = divided(pcurve.breaks, PROBES)
    beyond = np.maximum(low - pcurve(t), pcurve(t) - high).max(axis=0)
    if (beyond <= 0.0).all():
        return pcurve
    held = np.where(beyond > 0.0, np.clip(pcurve.control_points, low, high), pcurve.control_points)
    new = NurbsCurve(pcurve.degree, pcurve.knots, held)
    clipped = np.clip(pcurve(t), low, high)
    return new if np.abs(new(t) - clipped).max() <= 2.0 * beyond.max() else pcurve


def _image(surface: Surface, pcurve: NurbsCurve, t: Array) -> Array:
    """(k, 3) the pcurve's points as the kernel takes them, which goes on beyond a surface's borders."""
    uv = pcurve(t)
    wide = carried_on(surface, uv)
    u, v = np.clip(uv, *np.array(wide.domain).T).T
    return wide(u, v)


def _change(draft: Draft, face: int, count: int, worst: float, moved: float, limits: Limits) -> Change:
    return Change(
        WHAT,
        Rung.CUT,
        (face,),
        f"{count} of its pcurves strayed from the edges in space; the new ones follow them to {worst:.2g}",
        limits.on,
        moved,
        draft.middle(face),
    )
