"""Free edges of two faces that lie along each other, brought onto the one curve where their surfaces meet.

At each of several reaches, smallest first, the free edges are cut at each other's corners and matched (`seam_pieces`);
every seam gets one curve (`seam_curves`), every node one place on all its surfaces (`seam_nodes`), and the faces one
shared edge. Surfaces stay as they are, only trims move, by less than the reach; what has no such curve is left to the
next rung. A curve counts when it is within half of a closed seam's gap of both surfaces.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad.connectivity import is_point
from patchwright.models.cad.editing import compacted, with_loops
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse
from patchwright.repair.cad.draft import Change, Draft, Limits
from patchwright.repair.cad.face_sides import one_sided
from patchwright.repair.cad.loop_shape import in_step, simple
from patchwright.repair.cad.pcurves import below, inside, widened
from patchwright.repair.cad.seam_curves import EXACT, Judged, Meeting, common, judged, reattached, track, uses_of
from patchwright.repair.cad.seam_nodes import Nodes, placed
from patchwright.repair.cad.seam_pieces import Cut, Piece, cut, seams
from patchwright.repair.decisions import CARRIED_ON, CROSSED
from patchwright.repair.result import Rung

FINE = (1e-6, 1e-5, 1e-4)  # of the diagonal: reaches at which a file's own precision may have left its edges
COARSE = (3e-4, 1e-3, 3e-3, 1e-2, 3e-2)  # of the diagonal: reaches beyond it, tried after faces have been put back
TIGHT = 10.0  # of the rungs' finest length: how near a new pcurve follows its edge
SAMPLES = 9  # of a curve whose extent is taken
ROUNDS = 8  # times a reach is tried again with the seams left out that do not hold


@dataclass(frozen=True, slots=True, eq=False)
class _Edge:
    """A new edge: its curve, its corners in the new topology, and its pcurve on each face."""

    curve: NurbsCurve
    corners: tuple[int, int]
    pcurves: dict[int, NurbsCurve]


@dataclass(frozen=True, slots=True, eq=False)
class _Work:
    """What one attempt builds.

    `stands` holds, per old edge, (parameter, new edge, against) of the new edges that stand for its parts; one that
    several old edges have become stands for a part of each. `surfaces` are those of faces whose ranges grew.
    """

    edges: list[_Edge] = field(default_factory=list)
    stands: dict[int, list[tuple[float, int, bool]]] = field(default_factory=dict)
    surfaces: dict[int, Surface] = field(default_factory=dict)

    def add(self, edge: _Edge, *parts: tuple[int, float, bool]) -> None:
        """A new edge that stands for parts (old edge, parameter, against)."""
        for old, t, against in parts:
            self.stands.setdefault(old, []).append((t, len(self.edges), against))
        self.edges.append(edge)


def join_seams(
    draft: Draft,
    limits: Limits,
    shares: tuple[float, ...] = FINE,
    *,
    crossing: bool = True,
    loose: Collection[int] = (),
) -> tuple[Draft, tuple[Change, ...]]:
    """Every seam whose faces meet in a curve near their edges, at each share of the diagonal in turn.

    Without `crossing` only edges that lie on the other face to round-off count. `loose` are faces that came loose as a
    whole: their seams may be wider for their length.
    """
    changes: list[Change] = []
    for share in shares:
        if limits.expired:
            break
        draft, more = _joined(draft, share * limits.diagonal, limits, crossing, loose)
        changes += more
    if changes:
        draft = replace(draft, topology=one_sided(draft.topology))
    return draft, tuple(changes)


def _joined(
    draft: Draft, reach: float, limits: Limits, crossing: bool, loose: Collection[int]
) -> tuple[Draft, tuple[Change, ...]]:
    whole = cut(draft, reach)
    uses = uses_of(draft)
    found = [judged(draft, seam, uses, limits) for seam in seams(draft, whole, reach, limits, loose)]
    found = [one for one in found if one.meeting in (Meeting.LIES, Meeting.CROSS)]
    found = [one for one in found if not (_moves(one, limits) and draft.vetoed(_entry(one, reach), limits))]
    if not crossing:
        found = [one for one in found if one.apart <= EXACT * limits.on]
    for _ in range(ROUNDS):
        if not found or limits.expired:
            break
        step = _attempt(draft, whole, found, uses, limits)
        if isinstance(step, Draft):
            return step, _changes(found, reach, limits)
        found = [one for one in found if id(one) not in step]
    return draft, ()


def _attempt(
    draft: Draft, whole: Cut, found: list[Judged], uses: dict[int, EdgeUse], limits: Limits
) -> Draft | set[int]:
    """The draft with all these seams joined, or the ids of those that do not hold."""
    nodes, bad = placed(draft, whole, found, limits)
    if bad:
        return bad
    work = _Work()
    bad = {id(one) for one in found if not _join(draft, one, nodes, uses, work, limits)}
    if bad:
        return bad
    for edge in nodes.held:
        if not _hold(draft, edge, nodes, work, limits):
            bad |= _at(found, {nodes.bound[v] for v in draft.topology.ends[edge].tolist() if v in nodes.bound})
    for edge in sorted({e for one in found for e in _edges(one)}):
        if not _rest(draft, edge, whole.pieces[edge], found, nodes, uses, work, limits):
            bad |= {id(one) for one in found if edge in _edges(one)}
    if bad:
        return bad
    joined, touched = _rebuilt(draft, nodes, work)
    wrong = {face for face in touched if not simple(joined.topology.loops[face])}
    return {id(one) for one in found if wrong & set(one.seam.faces)} if wrong else joined


def _edges(one: Judged) -> set[int]:
    return {piece.edge for piece in (one.seam.lead, *one.seam.others)}


def _at(found: list[Judged], nodes: set[int]) -> set[int]:
    return {id(one) for one in found if {one.seam.lead.start, one.seam.lead.end} & nodes}


def _join(draft: Draft, one: Judged, nodes: Nodes, uses: dict[int, EdgeUse], work: _Work, limits: Limits) -> bool:
    """The common edge of one seam added; whether there is one."""
    lead, others, against = one.seam.lead, one.seam.others, one.seam.against
    curve = common(draft, one, np.stack([nodes.place[lead.start], nodes.place[lead.end]]), limits)
    if curve is None:
        return False
    first, own = others[0], uses[lead.edge].pcurve
    near = {first.face: uses[first.edge].pcurve(np.array([first.t1 if against else first.t0]))[0]}
    kept = curve is one.track and inside(draft.surface(lead.face), own)
    if not kept:
        near[lead.face] = own(np.array([lead.t0]))[0]
    pcurves = _below(draft, curve, near, work, limits)
    if pcurves is None:
        return False
    if kept:  # it has the parameter of its old pcurve
        whole = (lead.t0, lead.t1) == own.domain
        pcurves[lead.face] = own if whole else own.restricted(lead.t0, lead.t1)
    edge = _Edge(curve, (nodes.corner[lead.start], nodes.corner[lead.end]), pcurves)
    work.add(edge, (lead.edge, lead.t0, False), *((p.edge, p.t0, against) for p in others))
    return True


def _below(
    draft: Draft, curve: NurbsCurve, near: dict[int, Array], work: _Work, limits: Limits
) -> dict[int, NurbsCurve] | None:
    """The curve's pcurves on some faces; None where one of them is off it."""
    pcurves = {}
    for face, at in near.items():
        found = below(work.surfaces.get(face, draft.surface(face)), curve, TIGHT * limits.fit, near=at)
        if found.residual > limits.on:
            return None
        pcurves[face], work.surfaces[face] = found.pcurve, found.surface
    return pcurves


def _hold(draft: Draft, edge: int, nodes: Nodes, work: _Work, limits: Limits) -> bool:
    """An edge that no seam touches taken along by its corners; whether it can be."""
    topology = draft.topology
    curve, old = topology.curves[edge], topology.ends[edge].tolist()
    ends = np.stack([nodes.place[nodes.bound[v]] if v in nodes.bound else topology.vertices[v] for v in old])
    if is_point(curve):
        return bool(np.linalg.norm(ends - topology.vertices[old], axis=1).max() <= limits.on)
    users = [(face, use) for face, loops in enumerate(topology.loops) for lp in loops for use in lp if use.edge == edge]
    faces = sorted({face for face, _ in users})
    new = reattached(curve, ends, tuple(draft.surface(face) for face in faces), limits)
    if new is None:
        return False
    if new is curve:
        return True
    if len(users) != len(faces):  # a seam of one face with itself
        return False
    near = {face: use.pcurve(np.array([use.pcurve.domain[0]]))[0] for face, use in users}
    pcurves = _below(draft, new, near, work, limits)
    if pcurves is None:
        return False
    a, b = (nodes.corner[nodes.bound[v]] if v in nodes.bound else v for v in old)
    work.add(_Edge(new, (a, b), pcurves), (edge, curve.domain[0], False))
    return True


def _rest(
    draft: Draft,
    edge: int,
    pieces: tuple[Piece, ...],
    found: list[Judged],
    nodes: Nodes,
    uses: dict[int, EdgeUse],
    work: _Work,
    limits: Limits,
) -> bool:
    """The parts of an edge that no seam takes, as edges of their own; whether they can be."""
    taken = [p for one in found for p in (one.seam.lead, *one.seam.others) if p.edge == edge]
    face = pieces[0].face
    runs: list[Piece] = []
    for piece in pieces:
        if any(p.t0 <= piece.t0 < p.t1 for p in taken):
            continue
        if runs and runs[-1].t1 == piece.t0 and piece.start not in nodes.place:
            runs[-1] = replace(runs[-1], t1=piece.t1, end=piece.end)
        else:
            runs.append(piece)
    topology = draft.topology
    for run in runs:
        own = track(draft, run, uses, limits)
        old = topology.ends[edge].tolist()
        tips = own(np.array(own.domain))
        ends = np.stack([nodes.place.get(n, tip) for n, tip in zip((run.start, run.end), tips, strict=True)])
        curve = reattached(own, ends, (draft.surface(face),), limits)
        if curve is None:
            return False
        pcurves = _below(draft, curve, {face: uses[edge].pcurve(np.array([run.t0]))[0]}, work, limits)
        if pcurves is None:
            return False
        a, b = (nodes.corner.get(n, v) for n, v in zip((run.start, run.end), old, strict=True))
        work.add(_Edge(curve, (a, b), pcurves), (edge, run.t0, False))
    return True


def _rebuilt(draft: Draft, nodes: Nodes, work: _Work) -> tuple[Draft, set[int]]:
    """The draft with the new edges in its loops, and the faces that have other loops."""
    topology, first = draft.topology, len(draft.topology.curves)
    to = np.arange(len(nodes.vertices))
    for vertex, number in nodes.bound.items():
        to[vertex] = nodes.corner[number]
    fresh = np.array([edge.corners for edge in work.edges], dtype=np.int64).reshape(-1, 2)
    ends = np.concatenate([to[topology.ends], fresh])
    curves = (*topology.curves, *(edge.curve for edge in work.edges))
    changed = {}
    surfaces = dict(work.surfaces)
    for face, loops in enumerate(topology.loops):
        if not any(use.edge in work.stands for loop in loops for use in loop):
            continue
        rows = []
        for loop in loops:
            row: list[EdgeUse] = []
            for use in loop:
                if use.edge not in work.stands:
                    row.append(use)
                    continue
                for _, number, against in sorted(work.stands[use.edge], reverse=use.reversed):
                    if not row or row[-1].edge != first + number:
                        pcurve = work.edges[number].pcurves[face]
                        row.append(EdgeUse(first + number, use.reversed != against, pcurve))
            if len(row) > 1 and row[0].edge == row[-1].edge >= first:
                row.pop()
            rows.append(tuple(in_step(work.surfaces.get(face, draft.surface(face)), row)))
        changed[face] = tuple(rows)
        points = np.concatenate([use.pcurve.control_points for row in rows for use in row])
        surfaces[face] = widened(surfaces.get(face, draft.surface(face)), points)  # a turn on may be out of its range
    new = replace(topology, vertices=nodes.vertices, curves=curves, ends=ends)
    surfaces = {face: surface for face, surface in surfaces.items() if surface is not draft.surface(face)}
    return draft.with_surfaces(surfaces, compacted(with_loops(new, changed)), same=True), set(changed)


def _changes(found: list[Judged], reach: float, limits: Limits) -> tuple[Change, ...]:
    """One entry for the seams that only became one edge, and one for each whose trims moved."""
    moved = tuple(_entry(one, reach) for one in found if _moves(one, limits))
    shared = [one for one in found if not _moves(one, limits)]
    if not shared:
        return moved
    widest = max(shared, key=lambda one: one.seam.gap)
    faces = tuple(sorted({face for one in shared for face in one.seam.faces}))
    reason = (
        f"{len(shared)} seams between edges up to {widest.seam.gap:.3g} apart; each lies on the other face's surface; "
        f"looked for within {reach:.3g}"
    )
    what = "edges that lie on both faces shared"
    return (Change(what, Rung.WELD, faces, reason, reach, widest.seam.gap, _middle(widest)), *moved)


def _moves(one: Judged, limits: Limits) -> bool:
    """Whether joining a seam moves trims by more than files leave their edges apart."""
    return one.meeting is Meeting.CROSS or one.seam.gap > FINE[-1] * limits.diagonal


def _entry(one: Judged, reach: float) -> Change:
    """The entry of a seam whose trims move."""
    gap, cross = one.seam.gap, one.meeting is Meeting.CROSS
    why = "their surfaces cross beside them" if cross else "one lies on the other face's surface"
    reason = f"edges {gap:.3g} apart; {why}; looked for within {reach:.3g}"
    size = float(np.linalg.norm(np.ptp(one.track(np.linspace(*one.track.domain, SAMPLES)), axis=0)))
    what = CROSSED if cross else CARRIED_ON
    return Change(what, Rung.CUT, one.seam.faces, reason, reach, gap, _middle(one), size)


def _middle(one: Judged) -> Array:
    return np.asarray(one.track(np.array([np.mean(one.track.domain)]))[0])
