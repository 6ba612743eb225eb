"""Loops and faces that run the wrong way, turned round.

In the parameters of its surface a face's outer loop runs counter-clockwise and its holes run clockwise; in space, two
faces run along a shared edge in opposite ways. A loop that breaks the first rule is run backwards; a face that breaks
the second along all its edges, while its neighbours keep it among themselves, turns its outward side. Neither moves
anything.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from patchwright.models.cad.connectivity import is_point
from patchwright.models.cad.editing import Loops, with_loops
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.cad.draft import Change, Draft, Limits
from patchwright.repair.cad.loop_shape import polygon, signed_area
from patchwright.repair.result import Rung

CLEAR = 1e-6  # of the box of its loops in the parameters: a loop that encloses less has no direction


def turned_loops(draft: Draft, limits: Limits, faces: Collection[int]) -> tuple[Draft, tuple[Change, ...]]:
    """The draft with its loops and faces the right way round; all faces are looked at, not only `faces`."""
    topology = draft.topology
    changes, loops = [], {}
    for face, own in enumerate(topology.loops):
        right = _right_way(own)
        if right is not None:
            loops[face] = right
            why = "a loop ran the wrong way round in its surface's parameters"
            changes.append(Change("loops turned round", Rung.CUT, (face,), why, 0.0, 0.0, draft.middle(face)))
    topology = with_loops(topology, loops)
    against = _against(topology)
    if against:
        flipped = tuple(flip != (face in against) for face, flip in enumerate(topology.flipped))
        topology = replace(topology, flipped=flipped)
        why = "it ran along all its edges the way its neighbours do, and they agree with the others"
        changes += [
            Change("face turned round", Rung.CUT, (face,), why, 0.0, 0.0, draft.middle(face))
            for face in sorted(against)
        ]
    if not changes:
        return draft, ()
    same = {face: draft.surface(face) for change in changes for face in change.faces}
    return draft.with_surfaces(same, topology, same=True), tuple(changes)


def _right_way(loops: Loops) -> Loops | None:
    """The loops with those turned that run the wrong way; None where none does."""
    if not loops:
        return None
    rings = [polygon(loop) for loop in loops]
    box = np.ptp(np.concatenate(rings), axis=0)
    least = CLEAR * float(box[0] * box[1])
    areas = [signed_area(ring) for ring in rings]
    outer = int(np.argmax(np.abs(areas)))
    wrong = [i for i, area in enumerate(areas) if abs(area) > least and (area > 0.0) != (i == outer)]
    if not wrong:
        return None
    turned = [_backwards(loop) if i in wrong else loop for i, loop in enumerate(loops)]
    return (turned[outer], *(loop for i, loop in enumerate(turned) if i != outer))


def _backwards(loop: tuple[EdgeUse, ...]) -> tuple[EdgeUse, ...]:
    return tuple(replace(use, reversed=not use.reversed) for use in reversed(loop))


def _against(topology: Topology) -> set[int]:
    """Faces that disagree with their neighbours along every shared edge; the neighbours must agree with others."""
    runs: dict[int, list[tuple[int, bool]]] = {}
    for face, loops in enumerate(topology.loops):
        for loop in loops:
            for use in loop:
                if not is_point(topology.curves[use.edge]):
                    runs.setdefault(use.edge, []).append((face, use.reversed != topology.flipped[face]))
    agree: dict[int, list[tuple[int, bool]]] = {}
    for run in runs.values():
        if len(run) == 2 and run[0][0] != run[1][0]:
            (a, one), (b, two) = run
            agree.setdefault(a, []).append((b, one != two))
            agree.setdefault(b, []).append((a, one != two))
    return {
        face
        for face, beside in agree.items()
        if not any(good for _, good in beside) and all(any(ok for _, ok in agree[other]) for other, _ in beside)
    }
