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
from patchwright.models.cad.connectivity import components
from patchwright.models.cad.editing import welded
from patchwright.models.cad.sewing import sew
from patchwright.models.cad.status import brep_status
from patchwright.models.errors import EngineError
from patchwright.repair.cad.carried_on import join_carried_on
from patchwright.repair.cad.draft import Attempt, Change, Draft, Limits
from patchwright.repair.cad.face_steps import built, folds, free_edges, in_vain, mended_faces, widest
from patchwright.repair.cad.free_edges import on_own_surfaces
from patchwright.repair.cad.loose_seams import opened
from patchwright.repair.cad.realign import realign
from patchwright.repair.cad.retrim import retrim
from patchwright.repair.cad.seam_join import COARSE, FINE, join_seams
from patchwright.repair.cad.side_strip import strip_sides
from patchwright.repair.cad.strip import strip


@dataclass(frozen=True, slots=True, eq=False)
class Healed:
    """The mended assembly, what was done, what was tried in vain, and how many shared edges were taken apart because
    surfaces were apart. Parts keep their numbers."""

    assembly: Assembly
    changes: tuple[Change, ...]
    failed: tuple[Attempt, ...]
    opened: int


@dataclass(frozen=True, slots=True, eq=False)
class _Together:
    """`Healed` by bringing faces together; `early` is the largest reach of seams joined before faces are put back."""

    assembly: Assembly
    changes: tuple[Change, ...] = ()
    failed: tuple[Attempt, ...] = ()
    opened: int = 0
    early: float = 0.0


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
        together = _brought_together(model, limits)
        model, apart = together.assembly, together.opened
        changes, failed = (*changes, *together.changes), (*failed, *together.failed)
    return Healed(model, changes, failed, apart) if changes or failed else None


def _brought_together(model: Assembly, limits: Limits) -> _Together:
    """Open and loose seams closed, in the order that leaves the fewest free edges, then the narrowest seams.

    A face displaced by little is in reach of its neighbours: joining may trim it where it is before it is put back. A
    crude trim is no counterpart for a displaced face until it is joined. So where one order leaves free edges after
    seams that the other would join later, both are tried.
    """
    assert model.topology is not None
    draft, apart, gap = opened(Draft(model, model.topology), limits)
    if not (draft.topology.use_counts() == 1).any():
        return _Together(model)
    widest_kept = max(2.0 * limits.on, gap)
    best = _in_order(model, draft, limits, widest_kept, FINE, COARSE)
    if free_edges(best.assembly) and best.early > FINE[0] * limits.diagonal and not limits.expired:
        other = _in_order(model, draft, limits, widest_kept, FINE[:1], (*FINE[1:], *COARSE))
        best = min(best, other, key=lambda one: (free_edges(one.assembly), max(widest(one.assembly), limits.fit)))
    return replace(best, opened=apart if best.changes else 0)


def _in_order(
    model: Assembly,
    draft: Draft,
    limits: Limits,
    gap: float,
    before: tuple[float, ...],
    after: tuple[float, ...],
) -> _Together:
    """Seams joined at some reaches before displaced faces are put back, at others after it, no seam wider than `gap`.

    Where the result of all rungs does not hold, with fewer of them: first without the surfaces' crossings, then only
    the seams joined before.
    """
    draft, joined = join_seams(draft, limits, before)
    early = max((change.tolerance for change in joined), default=0.0)
    draft = replace(draft, topology=welded(draft.topology, 2.0 * limits.on))
    tried = {0}
    failed: tuple[Attempt, ...] = ()
    for rungs in (partial(_climbed, after=after), partial(_climbed, after=after, crossing=False), _no_rung):
        mended, more = rungs(draft, limits)
        changes = (*joined, *more)
        if len(changes) in tried:
            continue
        tried.add(len(changes))
        mended, drawn = on_own_surfaces(mended, limits)
        made = _closed(model, mended, limits, gap)
        if made is not None:
            return _Together(made, (*changes, *drawn), early=early)
        failed = in_vain("faces brought together", changes, "its seams gape or its faces fold or became invalid")
    return _Together(model, failed=failed, early=early)


def _no_rung(draft: Draft, limits: Limits) -> tuple[Draft, tuple[Change, ...]]:
    return draft, ()


def _climbed(
    draft: Draft, limits: Limits, after: tuple[float, ...], crossing: bool = True
) -> tuple[Draft, tuple[Change, ...]]:
    """All rungs in order: least change first, and what is certain before what is likely."""
    draft, changes = retrim(draft, limits, crossing=False)
    draft, put_back = realign(draft, limits)
    if put_back:
        draft = replace(draft, topology=welded(draft.topology, 2.0 * limits.on))
        draft, again = retrim(draft, limits, crossing=False)
        moved_back = {face for change in put_back for face in change.faces}
        changes = (*changes, *put_back, *(c for c in again if not moved_back & set(c.faces)))
    loose = _loose(draft)
    draft, joined = join_seams(draft, limits, after, crossing=False, loose=loose)
    draft, sized = realign(draft, limits, sized=True)
    draft, more = join_seams(draft, limits, after, loose=loose)
    draft, carried = join_carried_on(draft, limits, loose=loose)
    changes = (*changes, *joined, *sized, *more, *carried)
    if crossing:
        draft, crossed = retrim(draft, limits)
        changes = (*changes, *crossed)
    draft, moved = strip(draft, limits)
    draft, sides = strip_sides(draft, limits)
    changes = (*changes, *moved, *sides)
    return draft, changes


def _loose(draft: Draft) -> frozenset[int]:
    """The faces that are joined with no other."""
    pieces = components(draft.topology)
    return frozenset(piece[0] for piece in pieces if len(piece) == 1) if len(pieces) > 1 else frozenset()


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
