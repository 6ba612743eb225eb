"""Re-trim at the true edge: a face whose border came away from its neighbours' is trimmed by them again.

The border of a hole around or beside a face either lies on the face's surface, then the face takes its edges as they
are; or the neighbours' surfaces cross the face's, then every edge of the hole moves along its neighbour to the curve
where the two really meet, and the edges between neighbours grow or shrink along themselves to its corners. Surfaces
stay as they are. The crossing curve is found point by point with the auxiliary planes of Hamann, Jean and Razdan,
section 4: tangent planes of both surfaces and the plane across the old edge.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad.capping import FreeLoop
from patchwright.models.cad.connectivity import components
from patchwright.models.cad.editing import in_chains, with_loops
from patchwright.models.errors import GeometryError
from patchwright.models.extension import curve_on
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.cad.draft import RIM_SHARE, Change, Draft, Limits, apart
from patchwright.repair.cad.loop_shape import in_step, outer_first, simple
from patchwright.repair.cad.meeting import CROSSING, STEPS, farthest, feet, on_both
from patchwright.repair.cad.pcurves import below, fitted, widened
from patchwright.repair.decisions import TRIMMED
from patchwright.repair.result import Rung

GROWTH = 5.0  # of the gap: how far an edge's corner may run along its neighbours


def retrim(draft: Draft, limits: Limits, *, crossing: bool = True) -> tuple[Draft, tuple[Change, ...]]:
    """Every face that can be trimmed by the holes around it, one after the other until none can.

    `crossing` lets neighbours' edges move to where the surfaces cross; without it only edges that lie on the face's
    surface are taken.
    """
    changes: list[Change] = []
    while not limits.expired:
        step = _next(draft, limits, crossing)
        if step is None:
            break
        draft, change = step
        changes.append(change)
    return draft, tuple(changes)


def _next(draft: Draft, limits: Limits, cross: bool) -> tuple[Draft, Change] | None:
    rims, owner = draft.rims(), draft.owners()
    piece = {face: k for k, group in enumerate(components(draft.topology)) for face in group}
    for crossing in (False, True) if cross else (False,):  # what lies on a surface already comes first
        for rim in rims:
            faces = {owner[edge] for edge, _ in rim.steps}
            if not crossing and not any(_over(rim, other, piece, limits) for other in rims):
                for face in sorted(faces) if len(faces) > 1 else ():
                    step = _beside(draft, rim, face, owner, limits)
                    if step is not None and not draft.vetoed(step[1], limits):
                        return step
        for face in sorted({owner[e] for rim in rims for e, _ in rim.steps}):
            step = _around(draft, rims, face, owner, limits, crossing)
            if step is not None and not draft.vetoed(step[1], limits):
                return step
    return None


def _over(rim: FreeLoop, other: FreeLoop, piece: dict[int, int], limits: Limits) -> bool:
    """Whether another piece's rim lies along a rim all round: what belongs there has only come away."""
    if piece[rim.faces[0]] == piece[other.faces[0]]:
        return False
    near = min(limits.reach, RIM_SHARE * rim.diagonal)
    return max(float(apart(rim.points, other.points).max()), float(apart(other.points, rim.points).max())) <= near


def _beside(
    draft: Draft, rim: FreeLoop, face: int, owner: dict[int, int], limits: Limits
) -> tuple[Draft, Change] | None:
    """The face grown over a gap along which it lies, where the rest of the rim lies on its surface."""
    own = [step for step in rim.steps if owner[step[0]] == face]
    rest = [step for step in rim.steps if owner[step[0]] != face]
    width = _width(draft, rest, own)
    if not rim.closed or width > min(limits.reach, RIM_SHARE * rim.diagonal):
        return None
    return _taken(draft, face, {edge for edge, _ in own}, rest, width, rim.centre, limits)


def _around(
    draft: Draft, rims: tuple[FreeLoop, ...], face: int, owner: dict[int, int], limits: Limits, crossing: bool
) -> tuple[Draft, Change] | None:
    """The face trimmed by the holes that its own free rings lie in."""
    own = [rim for rim in rims if {owner[e] for e, _ in rim.steps} == {face}]
    if not own or any(not rim.closed for rim in own):
        return None
    holes = []
    for rim in own:
        hole = _hole(rims, rim, face, owner, limits)
        if hole is None:
            return None
        holes.append(hole)
    width = max(_width(draft, list(h.steps), list(r.steps)) for h, r in zip(holes, own, strict=True))
    removed = {edge for rim in own for edge, _ in rim.steps}
    steps = [step for hole in holes for step in hole.steps]
    centre = np.mean([rim.centre for rim in own], axis=0)
    if not crossing:
        return _taken(draft, face, removed, steps, width, centre, limits)
    moved = _moved(draft, face, steps, owner, width, limits)
    if moved is None:
        return None
    taken = _taken(moved[0], face, removed, steps, width, centre, limits)
    if taken is None or not all(simple(taken[0].topology.loops[one]) for one in (face, *moved[1])):
        return None
    change = replace(
        taken[1],
        faces=(face, *moved[1]),
        reason="its neighbours' surfaces cross its own: all are trimmed at the curves where they meet",
        largest_move=moved[2],
    )
    return taken[0], change


def _hole(
    rims: tuple[FreeLoop, ...], rim: FreeLoop, face: int, owner: dict[int, int], limits: Limits
) -> FreeLoop | None:
    """The ring of other faces nearest to a face's own ring, if it is near all along both."""
    best, nearest = None, min(limits.reach, RIM_SHARE * rim.diagonal)
    for other in rims:
        if not other.closed or face in {owner[e] for e, _ in other.steps}:
            continue
        far = max(float(apart(other.points, rim.points).max()), float(apart(rim.points, other.points).max()))
        if far <= nearest:
            best, nearest = other, far
    return best


def _width(draft: Draft, some: list[tuple[int, bool]], others: list[tuple[int, bool]]) -> float:
    """The largest distance of the points of some edges from the others."""

    def points(steps: list[tuple[int, bool]]) -> Array:
        curves = [draft.topology.curves[edge] for edge, _ in steps]
        return np.concatenate([curve(np.linspace(*curve.domain, 65)) for curve in curves])

    return float(apart(points(some), points(others)).max())


def _taken(
    draft: Draft,
    face: int,
    removed: set[int],
    steps: list[tuple[int, bool]],
    width: float,
    centre: Array,
    limits: Limits,
) -> tuple[Draft, Change] | None:
    """The face with some of its edges exchanged for edges of its neighbours that lie on its surface."""
    topology, surface = draft.topology, draft.surface(face)
    added, worst = [], 0.0
    for edge, reverse in steps:
        curve = topology.curves[edge]
        if farthest(surface, curve(np.linspace(*curve.domain, 17))) > limits.on:
            return None
        found = below(surface, curve, limits.fit)
        if found.residual > limits.on:
            return None
        surface, worst = found.surface, max(worst, found.residual)
        added.append(EdgeUse(edge, reverse != topology.flipped[face], found.pcurve))
    kept = [use for loop in topology.loops[face] for use in loop if use.edge not in removed]
    chains = in_chains([*kept, *added], topology.ends)
    if chains is None:
        return None
    loops = outer_first([in_step(surface, chain) for chain in chains])
    if loops is None:
        return None
    points = np.concatenate([use.pcurve.control_points for loop in loops for use in loop])
    grown = draft.with_surfaces({face: widened(surface, points)}, with_loops(topology, {face: loops}), same=True)
    if not simple(loops):
        return None
    every = np.concatenate([topology.curves[edge].control_points for edge, _ in steps])
    change = Change(
        TRIMMED,
        Rung.CUT,
        (face,),
        f"their edges lie on its surface to {worst:.2g}; its border had come away by {width:.3g}",
        limits.on,
        width,
        centre,
        float(np.linalg.norm(np.ptp(every, axis=0))),
    )
    return grown, change


def _moved(
    draft: Draft, face: int, steps: list[tuple[int, bool]], owner: dict[int, int], width: float, limits: Limits
) -> tuple[Draft, tuple[int, ...], float] | None:
    """The hole's edges moved along their faces onto the face's surface; the faces touched and the largest move."""
    topology, target = draft.topology, draft.surface(face)
    ring = {edge for edge, _ in steps}
    corners = {int(v) for edge in ring for v in topology.ends[edge]}
    at = np.array(sorted(corners))
    off = {int(v): farthest(target, topology.vertices[v][None]) for v in at}
    curves, vertices = list(topology.curves), topology.vertices.copy()
    touched: set[int] = set()  # edges whose curve is another now
    try:
        for corner in at.tolist():
            if off[corner] <= limits.fit:
                continue
            found = _corner(topology, target, corner, ring, owner, draft, width, limits)
            if found is None:
                return None
            place, radial, curve = found
            vertices[corner] = place
            if radial >= 0:
                curves[radial] = curve
                touched.add(radial)
        for edge in sorted(ring):
            curve = topology.curves[edge]
            stays = all(off[int(v)] <= limits.fit for v in topology.ends[edge])
            if stays and farthest(target, curve(np.linspace(*curve.domain, 17))) <= limits.fit:
                continue
            ends = vertices[topology.ends[edge]] - topology.vertices[topology.ends[edge]]
            new = _crossing(draft.surface(owner[edge]), target, curve, ends, limits)
            if new is None:
                return None
            curves[edge] = new
            touched.add(edge)
    except GeometryError:
        return None
    moved = replace(topology, curves=tuple(curves), vertices=vertices)
    move = float(np.linalg.norm(vertices - topology.vertices, axis=1).max())
    return _below_again(draft, moved, touched, limits, move)


def _below_again(
    draft: Draft, topology: Topology, touched: set[int], limits: Limits, move: float
) -> tuple[Draft, tuple[int, ...], float] | None:
    """New pcurves for the edges whose curves changed, on every face that uses them."""
    changed: dict[int, tuple[tuple[EdgeUse, ...], ...]] = {}
    surfaces: dict[int, Surface] = {}
    for face, loops in enumerate(topology.loops):
        if not any(use.edge in touched for loop in loops for use in loop):
            continue
        surface = draft.surface(face)
        rows = []
        for loop in loops:
            row = []
            for use in loop:
                if use.edge in touched:
                    found = below(surface, topology.curves[use.edge], limits.fit, near=use.pcurve.control_points[0])
                    if found.residual > limits.on:
                        return None
                    surface, use = found.surface, replace(use, pcurve=found.pcurve)
                row.append(use)
            rows.append(tuple(row))
        changed[face], surfaces[face] = tuple(rows), surface
    return draft.with_surfaces(surfaces, with_loops(topology, changed), same=True), tuple(changed), move


def _corner(
    topology: Topology,
    target: Surface,
    corner: int,
    ring: set[int],
    owner: dict[int, int],
    draft: Draft,
    width: float,
    limits: Limits,
) -> tuple[Array, int, NurbsCurve] | None:
    """Where a corner of the hole goes, the edge that leads there (-1: none) and that edge's new curve."""
    used = topology.use_counts() > 0
    here = [int(e) for e in np.flatnonzero((topology.ends == corner).any(axis=1) & used)]
    radial = [e for e in here if e not in ring]
    beside = [e for e in here if e in ring]
    if len(radial) > 1 or (not radial and len({owner[e] for e in beside}) > 1):
        return None
    if not radial:  # a point where a smooth edge is only divided
        curve = topology.curves[beside[0]]
        end = 0 if topology.ends[beside[0], 0] == corner else 1
        t = np.array([curve.domain[end]])
        place = on_both(draft.surface(owner[beside[0]]), target, curve(t), curve(t, 1), limits)
        return None if place is None else (place[0], -1, curve)
    curve = topology.curves[radial[0]]
    end = 0 if topology.ends[radial[0], 0] == corner else 1
    met = _met(curve, end, target, GROWTH * max(width, limits.on), limits)
    if met is None:
        return None
    low, high = curve.domain
    made = curve_on(curve, met, high) if end == 0 else curve_on(curve, low, met)
    return made.control_points[-end], radial[0], made


def _met(curve: NurbsCurve, end: int, target: Surface, most: float, limits: Limits) -> float | None:
    """The parameter near an end of a curve, carried on if need be, where it meets a surface."""
    low, high = curve.domain
    at = (low, high)[end]
    speed = float(np.linalg.norm(curve(np.array([at]), 1)[0]))
    if speed == 0.0:
        return None
    room = most / speed
    longer = curve_on(curve, low - room * (end == 0), high + room * (end == 1))
    t = at
    for _ in range(STEPS):
        point, slope = longer(np.array([t])), longer(np.array([t]), 1)[0]
        foot, normal, _ = feet(target, point)
        rise = float(slope @ normal[0])
        if abs(rise) < CROSSING * float(np.linalg.norm(slope)):
            return None
        step = float((foot[0] - point[0]) @ normal[0]) / rise
        t += step
        if abs(t - at) > room or not longer.domain[0] <= t <= longer.domain[1]:
            return None
        if abs(step) * speed <= 1e-3 * limits.fit:
            break
    closer = float(np.linalg.norm(feet(target, longer(np.array([t])))[0] - longer(np.array([t]))))
    shortest = 1e-6 * (high - low)
    sound = (t < high - shortest) if end == 0 else (t > low + shortest)
    return t if closer <= limits.fit and sound else None


def _crossing(own: Surface, target: Surface, curve: NurbsCurve, ends: Array, limits: Limits) -> NurbsCurve | None:
    """The curve where two surfaces cross beside a curve on the first, with its range; `ends` (2, 3) move its ends."""
    t0, t1 = curve.domain
    slope = (ends[1] - ends[0]) / (t1 - t0)

    def guide(t: Array) -> tuple[Array, Array]:
        share = ((t - t0) / (t1 - t0))[:, None]
        return curve(t) + (1.0 - share) * ends[0] + share * ends[1], curve(t, 1) + slope

    places = on_both(own, target, *guide(np.linspace(t0, t1, 17)), limits)
    if places is None:
        return None

    def place(t: Array) -> Array:
        found = on_both(own, target, *guide(t), limits)
        if found is None:
            raise GeometryError("two surfaces do not cross all along an edge")
        return found

    return fitted(place, curve, limits.fit)
