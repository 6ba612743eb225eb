"""The rungs between sewing and refusal for CAD faces, climbed in order, and the proof that the result holds.

Each rung takes a draft and returns one; nothing is built until all have had their turn. The outcome is then built by
the CAD kernel and counts only if its seams, measured surface to surface, are closed and no face became invalid.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from patchwright.models.assembly import Assembly
from patchwright.models.cad.editing import compacted, welded
from patchwright.models.cad.rebuild import rebuilt
from patchwright.models.cad.seams import measure_seams
from patchwright.models.cad.sewing import sew
from patchwright.models.cad.status import brep_status
from patchwright.models.errors import EngineError
from patchwright.repair.cad_draft import Change, Draft, Limits
from patchwright.repair.loose_seams import opened
from patchwright.repair.realign import realign
from patchwright.repair.retrim import retrim
from patchwright.repair.strip import strip

FOLD = 179.0  # degrees between outward normals: two faces that lie on each other


@dataclass(frozen=True, slots=True, eq=False)
class Healed:
    """The mended assembly, what was done, and how many shared edges were taken apart because surfaces were apart."""

    assembly: Assembly
    changes: tuple[Change, ...]
    opened: int


def heal(model: Assembly, diagonal: float) -> Healed | None:
    """A sewn model with its open and loose seams closed as far as the rungs reach; None where nothing was to be done.

    Where the result of all rungs does not hold, the surfaces' crossings are left out; where that does not hold either,
    None.
    """
    topology = model.topology
    if topology is None:
        return None
    limits = Limits.of(diagonal)
    start = Draft(model, welded(topology, 2.0 * limits.on))
    draft, apart, widest = opened(start, limits)
    if not (draft.topology.use_counts() == 1).any():
        return None
    tried = 0
    for crossing in (True, False):
        mended, changes = _climbed(draft, limits, crossing)
        if len(changes) in (0, tried):
            return None
        tried = len(changes)
        made = _built(model, mended, limits, max(2.0 * limits.on, widest))
        if made is not None:
            return Healed(made, changes, apart)
    return None


def _climbed(draft: Draft, limits: Limits, crossing: bool) -> tuple[Draft, tuple[Change, ...]]:
    """All rungs in order: least change first, and what is certain before what is likely."""
    draft, changes = retrim(draft, limits, crossing=False)
    draft, put_back = realign(draft, limits)
    if put_back:
        draft = replace(draft, topology=welded(draft.topology, 2.0 * limits.on))
        draft, again = retrim(draft, limits, crossing=False)
        joined = {face for change in put_back for face in change.faces}
        changes = (*changes, *put_back, *(c for c in again if not joined & set(c.faces)))
    if crossing:
        draft, crossed = retrim(draft, limits)
        changes = (*changes, *crossed)
    draft, moved = strip(draft, limits)
    changes = (*changes, *moved)
    return draft, changes


def _built(model: Assembly, draft: Draft, limits: Limits, widest: float) -> Assembly | None:
    """The draft as the kernel builds it, sewn where edges coincide but are not shared; None where it does not hold.

    It holds when no seam is wider than `widest`, no face lies on another, and no face has become invalid.
    """
    try:
        made = rebuilt(model, draft.parts, compacted(draft.topology))
        if made.topology is not None and (made.topology.use_counts() == 1).any():
            sewn = sew(made, 2.0 * limits.on)
            if not sewn.dropped and sewn.surface_change.max(initial=0.0) <= 1e-12 * max(limits.diagonal, 1.0):
                made = sewn.assembly
        sound = all(s.gap <= widest and s.angle < FOLD for s in measure_seams(made))
        worse = set(brep_status(made).invalid) - set(brep_status(model).invalid)
    except EngineError:
        return None
    return made if sound and not worse else None
