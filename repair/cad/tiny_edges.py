"""Edges shorter than a closed seam is wide, taken out of the loops of faces that are invalid because of them.

The kernel calls a wire that turns round within its own tolerance self-intersecting. Such an edge is no border of
anything: its corners become one, and the loops on both its sides go on without it. Surfaces and other edges stay.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from patchwright.models.cad.connectivity import is_point
from patchwright.models.cad.editing import welded, with_loops
from patchwright.repair.cad.draft import Change, Draft, Limits
from patchwright.repair.result import Rung

LEAST = 2  # edges a loop must keep


def without_tiny_edges(draft: Draft, limits: Limits, faces: Collection[int]) -> tuple[Draft, tuple[Change, ...]]:
    """The draft without the tiny edges of `faces`, one change per edge."""
    topology, longest = draft.topology, 2.0 * limits.on
    asked = {use.edge for face in faces for loop in topology.loops[face] for use in loop}
    tiny: dict[int, float] = {}
    for edge in sorted(asked):
        curve = topology.curves[edge]
        if not is_point(curve):
            points = curve(np.linspace(*curve.domain, 17))
            length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
            if length <= longest:
                tiny[edge] = length
    loops, owners = {}, {edge: set[int]() for edge in tiny}
    for face, own in enumerate(topology.loops):
        kept = tuple(tuple(use for use in loop if use.edge not in tiny) for loop in own)
        if sum(map(len, kept)) < sum(map(len, own)):
            if min(map(len, kept)) < LEAST:
                return draft, ()
            loops[face] = kept
            for loop in own:
                for use in loop:
                    owners.get(use.edge, set()).add(face)
    if not loops:
        return draft, ()
    changes = tuple(
        Change(
            "tiny edge taken out",
            Rung.WELD,
            tuple(sorted(owners[edge])),
            f"it is {length:.2g} long, less than a closed seam is wide, and a face beside it is invalid",
            longest,
            length,
            topology.curves[edge].control_points[0],
        )
        for edge, length in tiny.items()
    )
    joined = with_loops(welded(topology, longest), loops)
    same = {face: draft.surface(face) for face in loops}
    return draft.with_surfaces(same, joined, same=True), changes
