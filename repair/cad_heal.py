"""The rungs between sewing and refusal for CAD faces, climbed in order, and the proof that the result holds.

First each face by itself (`face_steps`), then what brings faces together: borders trimmed again, put back, moved. Each
rung takes a draft and returns one; nothing is built until all have had their turn. The outcome is then built by the CAD
kernel and counts only if its seams, measured surface to surface, are closed and no face became invalid.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import partial

from patchwright.models.assembly import Assembly
from patchwright.models.cad.editing import welded
from patchwright.models.cad.sewing import sew
from patchwright.models.cad.status import brep_status
from patchwright.models.errors import EngineError
from patchwright.repair.cad_draft import Attempt, Change, Draft, Limits
from patchwright.repair.face_steps import built, folds, in_vain, mended_faces, widest
from patchwright.repair.free_edges import on_own_surfaces
from patchwright.repair.loose_seams import opened
from patchwright.repair.realign import realign
from patchwright.repair.retrim import retrim
from patchwright.repair.seam_join import COARSE, join_seams
from patchwright.repair.side_strip import strip_sides
from patchwright.repair.strip import strip


@dataclass(frozen=True, slots=True, eq=False)
class Healed:
    """The mended assembly, what was done, what was tried in vain, and how many shared edges were taken apart because
    surfaces were apart. Parts keep their numbers."""

    assembly: Assembly
    changes: tuple[Change, ...]
    failed: tuple[Attempt, ...]
    opened: int


def heal(model: Assembly, limits: Limits, folded: Collection[int] = ()) -> Healed | None:
    """A sewn model with its bad faces mended and its open and loose seams closed as far as the rungs reach.

    `folded` are faces that pass through themselves.
    None where there was nothing to do; the model as it came, with what was tried, where nothing held.
    """
    if model.topology is None:
        return None
    model, changes, failed = mended_faces(model, limits, folded)
    apart = 0
    if not limits.expired:
        model, done, missed, apart = _brought_together(model, limits)
        changes, failed = (*changes, *done), (*failed, *missed)
    return Healed(model, changes, failed, apart) if changes or failed else None


def _brought_together(model: Assembly, limits: Limits) -> tuple[Assembly, tuple[Change, ...], tuple[Attempt, ...], int]:
    """Open and loose seams closed; where the result of all rungs does not hold, with fewer of them.

    First without the surfaces' crossings, then only the seams that the file's own precision left open.
    """
    assert model.topology is not None
    draft, apart, gap = opened(Draft(model, model.topology), limits)
    if not (draft.topology.use_counts() == 1).any():
        return model, (), (), 0
    draft, joined = join_seams(draft, limits)
    draft = replace(draft, topology=welded(draft.topology, 2.0 * limits.on))
    tried = {0}
    failed: tuple[Attempt, ...] = ()
    for rungs in (_climbed, partial(_climbed, crossing=False), _no_rung):
        mended, more = rungs(draft, limits)
        changes = (*joined, *more)
        if len(changes) in tried:
            continue
        tried.add(len(changes))
        mended, drawn = on_own_surfaces(mended, limits)
        made = _closed(model, mended, limits, max(2.0 * limits.on, gap))
        if made is not None:
            return made, (*changes, *drawn), (), apart
        failed = in_vain("faces brought together", changes, "its seams gape or its faces fold or became invalid")
    return model, (), failed, 0


def _no_rung(draft: Draft, limits: Limits) -> tuple[Draft, tuple[Change, ...]]:
    return draft, ()


def _climbed(draft: Draft, limits: Limits, crossing: bool = True) -> tuple[Draft, tuple[Change, ...]]:
    """All rungs in order: least change first, and what is certain before what is likely."""
    draft, changes = retrim(draft, limits, crossing=False)
    draft, put_back = realign(draft, limits)
    if put_back:
        draft = replace(draft, topology=welded(draft.topology, 2.0 * limits.on))
        draft, again = retrim(draft, limits, crossing=False)
        moved_back = {face for change in put_back for face in change.faces}
        changes = (*changes, *put_back, *(c for c in again if not moved_back & set(c.faces)))
    draft, joined = join_seams(draft, limits, COARSE)
    changes = (*changes, *joined)
    if crossing:
        draft, crossed = retrim(draft, limits)
        changes = (*changes, *crossed)
    draft, moved = strip(draft, limits)
    draft, sides = strip_sides(draft, limits)
    changes = (*changes, *moved, *sides)
    return draft, changes


def _closed(model: Assembly, draft: Draft, limits: Limits, gap: float) -> Assembly | None:
    """The draft as the kernel builds it, sewn where edges coincide but are not shared; None where it does not hold.

    It holds when no seam is wider than `gap`, no face lies on another, and no face has become invalid.
    """
    made = built(model, draft, limits)
    if made is None:
        return None
    try:
        if made.topology is not None and (made.topology.use_counts() == 1).any():
            sewn = sew(made, 2.0 * limits.on)
            if not sewn.dropped and sewn.surface_change.max(initial=0.0) <= 1e-12 * max(limits.diagonal, 1.0):
                made = sewn.assembly
        worse = set(brep_status(made).invalid) - set(brep_status(model).invalid)
    except EngineError:
        return None
    return made if widest(made) <= gap and folds(made) == 0 and not worse else None
