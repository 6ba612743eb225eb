"""Free edges that stray from their own face are drawn where its trim is: on the surface, below the pcurve.

A file may hold an edge in space and a trim that differ by more than a closed seam; kernels hide that in the edge's
tolerance. Where no other face has a say the trim on the surface counts, since the surface stays.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad.connectivity import is_point
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.cad.draft import Change, Draft, Limits
from patchwright.repair.cad.pcurves import below, inside
from patchwright.repair.cad.seam_curves import EXACT, reattached, track, uses_of
from patchwright.repair.cad.seam_pieces import Piece
from patchwright.repair.result import Rung

SAMPLES = 65


def on_own_surfaces(draft: Draft, limits: Limits) -> tuple[Draft, tuple[Change, ...]]:
    """The draft with every free edge within `limits.on` of its face's trim, and one change per face."""
    topology, uses, owner = draft.topology, uses_of(draft), draft.owners()
    strayed = {edge: off for edge in uses if (off := _off(draft, edge, uses[edge], owner[edge])) > limits.on}
    if not strayed:
        return draft, ()
    own = _corners(topology, owner)
    tracks = {
        edge: track(draft, Piece(owner[edge], edge, *topology.curves[edge].domain, -1, -1), uses, limits)
        for edge in uses
        if edge in strayed or set(topology.ends[edge].tolist()) & _ends(topology, strayed)
    }
    vertices = topology.vertices.copy()
    tips: dict[int, list[Array]] = {}
    for edge, curve in tracks.items():
        for vertex, tip in zip(topology.ends[edge].tolist(), curve(np.array(curve.domain)), strict=True):
            tips.setdefault(vertex, []).append(tip)
    for vertex, some in tips.items():
        if vertex in own:
            vertices[vertex] = np.mean(some, axis=0)
    tight = replace(limits, on=EXACT * limits.on)
    curves, loops = list(topology.curves), [list(map(list, face)) for face in topology.loops]
    drawn: dict[int, list[float]] = {}
    for edge, curve in tracks.items():
        surface = draft.surface(owner[edge])
        new = reattached(curve, vertices[topology.ends[edge]], (surface,), tight)
        new = curve if new is None else new
        pcurve = uses[edge].pcurve
        if new is not curve:
            found = below(surface, new, tight.on, near=pcurve(np.array([pcurve.domain[0]]))[0])
            if found.residual > limits.on or not inside(surface, found.pcurve):
                continue
            pcurve = found.pcurve
        curves[edge] = new
        for loop in loops[owner[edge]]:
            loop[:] = [replace(use, pcurve=pcurve) if use.edge == edge else use for use in loop]
        if edge in strayed:
            drawn.setdefault(owner[edge], []).append(strayed[edge])
    changes = tuple(
        Change(
            "free edges drawn where the face is trimmed",
            Rung.WELD,
            (face,),
            f"{len(some)} of its free edges strayed from its surface by up to {max(some):.2g}",
            limits.on,
            max(some),
            draft.middle(face),
        )
        for face, some in sorted(drawn.items())
    )
    rows = tuple(tuple(tuple(loop) for loop in face) for face in loops)
    return replace(draft, topology=replace(topology, curves=tuple(curves), vertices=vertices, loops=rows)), changes


def _off(draft: Draft, edge: int, use: EdgeUse, face: int) -> float:
    """The largest distance between an edge and its face's trim."""
    curve, surface = draft.topology.curves[edge], draft.surface(face)
    if is_point(curve):
        return 0.0
    t = np.linspace(*curve.domain, SAMPLES)
    low, high = np.array(surface.domain).T
    u, v = np.clip(use.pcurve(t), low, high).T
    return float(np.linalg.norm(surface(u, v) - curve(t), axis=1).max())


def _ends(topology: Topology, edges: Iterable[int]) -> set[int]:
    return {vertex for edge in edges for vertex in topology.ends[edge].tolist()}


def _corners(topology: Topology, owner: dict[int, int]) -> set[int]:
    """The corners where only free edges of one face end."""
    faces: dict[int, set[int]] = {}
    for edge in np.flatnonzero(topology.use_counts() > 0).tolist():
        for vertex in topology.ends[edge].tolist():
            faces.setdefault(vertex, set()).add(owner.get(edge, -1))
    return {vertex for vertex, some in faces.items() if len(some) == 1 and -1 not in some}
