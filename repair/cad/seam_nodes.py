"""The places of the nodes where seams end: on every surface there, and on the edges that lead seams through them.

Where an edge that leads ends on all of them already, that end is the place: what is sound stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.models.topology import Topology
from patchwright.repair.cad.draft import Draft, Limits
from patchwright.repair.cad.meeting import farthest, on_all
from patchwright.repair.cad.seam_curves import EXACT, Judged, Meeting
from patchwright.repair.cad.seam_pieces import Cut


@dataclass(frozen=True, slots=True, eq=False)
class Nodes:
    """Where seams end.

    Parameters
    ----------
    place : per node, its point (3,)
    corner : per node, its corner in `vertices`
    bound : the node of each old corner that becomes one
    vertices : (n, 3) the old corners at their new places, and new ones after them
    held : edges that no seam touches but that end at bound corners
    """

    place: dict[int, Array]
    corner: dict[int, int]
    bound: dict[int, int]
    vertices: Array
    held: tuple[int, ...]


def placed(draft: Draft, whole: Cut, found: list[Judged], limits: Limits) -> tuple[Nodes, set[int]]:
    """One place per node, or the ids of the seams at nodes that no place is near enough to all their surfaces."""
    topology = draft.topology
    at = _edges_at(topology)
    faces_of = _faces_of(topology)
    bound, held, ends = _bound(whole, found, at)
    place: dict[int, Array] = {}
    corner: dict[int, int] = {}
    bad: set[int] = set()
    fresh: list[Array] = []
    for number, some in ends.items():
        mine = sorted(v for v, n in bound.items() if n == number)
        faces = {face for one in some for face in one.seam.faces}
        faces |= {face for v in mine for edge in at.get(v, ()) for face in faces_of.get(edge, ())}
        leading = [one for one in some if one.meeting is Meeting.LIES]
        tips = _tips(some, number)
        start = topology.vertices[mine].mean(axis=0) if mine else tips.mean(axis=0)
        surfaces = [draft.surface(face) for face in sorted(faces)]
        spot = _sound(surfaces, _tips(leading, number), limits)
        if spot is None:
            spot = _spot(surfaces, [one.track for one in leading], start, limits)
        if spot is None:
            bad |= {id(one) for one in some}
            continue
        place[number] = spot
        if mine:
            corner[number] = mine[0]
        else:
            corner[number] = len(topology.vertices) + len(fresh)
            fresh.append(spot)
    vertices = np.concatenate([topology.vertices, np.array(fresh).reshape(-1, 3)])
    for number, spot in place.items():
        vertices[corner[number]] = spot
    return Nodes(place, corner, bound, vertices, held), bad


def _tips(some: list[Judged], number: int) -> Array:
    """(k, 3) where the curves that lead seams end at a node."""
    return np.array([one.track(np.array([one.track.domain[k]]))[0] for one in some for k in _at(one, number)]).reshape(
        -1, 3
    )


def _sound(surfaces: list[Surface], tips: Array, limits: Limits) -> Array | None:
    """The mean of tips that coincide on all surfaces to round-off."""
    exact = EXACT * limits.on
    if not len(tips) or float(np.ptp(tips, axis=0).max()) > exact:
        return None
    spot = np.asarray(tips.mean(axis=0))
    return spot if all(farthest(surface, spot[None]) <= exact for surface in surfaces) else None


def _spot(surfaces: list[Surface], leads: list[NurbsCurve], start: Array, limits: Limits) -> Array | None:
    """The point on all surfaces, and on the leading edges where they allow it."""
    for curves in (leads, []) if leads else ([],):
        spot = on_all(surfaces, curves, start, limits)
        if all(farthest(surface, spot[None]) <= limits.on for surface in surfaces):
            return spot
    return None


def _at(one: Judged, number: int) -> list[int]:
    """Which ends of the leading piece are at a node."""
    return [k for k, node in enumerate((one.seam.lead.start, one.seam.lead.end)) if node == number]


def _bound(
    whole: Cut, found: list[Judged], at: dict[int, list[int]]
) -> tuple[dict[int, int], tuple[int, ...], dict[int, list[Judged]]]:
    """Old corners and their nodes, edges that only end there, and the seams that end at each node."""
    ends: dict[int, list[Judged]] = {}
    taken: set[int] = set()
    for one in found:
        taken |= {piece.edge for piece in (one.seam.lead, *one.seam.others)}
        for number in {one.seam.lead.start, one.seam.lead.end}:
            ends.setdefault(number, []).append(one)
    reached = {
        (piece.edge, node)
        for one in found
        for piece in (one.seam.lead, *one.seam.others)
        for node in (piece.start, piece.end)
    }
    bound = {
        vertex: number
        for number in ends
        for vertex in whole.members[number]
        if any((edge, number) in reached for edge in at.get(vertex, ()))
    }
    held = sorted({edge for vertex in bound for edge in at.get(vertex, ())} - taken)
    return bound, tuple(held), ends


def _edges_at(topology: Topology) -> dict[int, list[int]]:
    """The edges in use that end at each corner."""
    used = topology.use_counts() > 0
    out: dict[int, list[int]] = {}
    for edge in np.flatnonzero(used).tolist():
        for vertex in set(topology.ends[edge].tolist()):
            out.setdefault(vertex, []).append(edge)
    return out


def _faces_of(topology: Topology) -> dict[int, set[int]]:
    out: dict[int, set[int]] = {}
    for face, loops in enumerate(topology.loops):
        for loop in loops:
            for use in loop:
                out.setdefault(use.edge, set()).add(face)
    return out
