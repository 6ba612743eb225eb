"""What is invented in a CAD model: gaps bridged and openings filled by new faces on exactly the free edges round them.

A planar opening gets the plane trimmed by its edges, loops inside each other one plane with holes; any other ring the
best surface through it (`ring_patch`), or where one surface cannot, several about a centre (`split_ring`). Faces around
stay as they are; the whole is built and judged before it counts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.analytic import Plane
from patchwright.models.assembly import Assembly, Part
from patchwright.models.cad.capping import FreeLoop, cap, free_loops, reason_against
from patchwright.models.cad.connectivity import components
from patchwright.models.cad.rebuild import NOTHING
from patchwright.models.cad.sewing import surface_difference
from patchwright.models.errors import EngineError
from patchwright.models.topology import Topology
from patchwright.repair.cad.creased_ring import creased_ring
from patchwright.repair.cad.deadline import Deadline
from patchwright.repair.cad.draft import RIM_SHARE, Attempt, Draft, Limits, apart
from patchwright.repair.cad.face_steps import bad_faces, built, widest
from patchwright.repair.cad.four_sides import four_sided
from patchwright.repair.cad.new_face import rim_normals, with_patch
from patchwright.repair.cad.outcome import Filled, Outcome, point
from patchwright.repair.cad.ring_judged import RingPatch
from patchwright.repair.cad.ring_patch import ring_patch
from patchwright.repair.cad.ring_sides import Normals
from patchwright.repair.cad.sew import SEAM_SHARE, UNCHANGED
from patchwright.repair.cad.split_ring import SplitRing, split_ring
from patchwright.repair.decisions import CAPPED, FILLED, Candidate, Decisions
from patchwright.repair.diagnosis import Defect, Diagnosis
from patchwright.repair.result import Problem

BRIDGED = "bridge"  # as the plan and the decisions call it
SAME = 0.05  # of a ring's diagonal: how far its box may differ from that of the gap it is


def bridged(outcome: Outcome, after: Diagnosis, decisions: Decisions | None, deadline: Deadline) -> Outcome:
    """Every ring of free edges that diagnosis calls a gap and nobody decided to keep, bridged as far as it goes."""
    model = outcome.assembly
    gaps = [d for d in after.defects if d.kind == "gap" and d.severity == "error" and not outcome.decided(d)]
    if model.topology is None or not gaps:
        return outcome
    if deadline.passed:
        return replace(outcome, undone=(*outcome.undone, "bridging gaps"))
    rings = tuple(loop for loop in free_loops(model) if any(_is(loop, gap, model) for gap in gaps))
    missed = [gap for gap in gaps if not any(_is(ring, gap, model) for ring in rings)]
    why = "no closed ring of shared corners lies round it: it is between several rims, or its corners are apart"
    failed = tuple(Attempt("gap bridged", (), why, np.asarray(gap.where)) for gap in missed)
    outcome = replace(outcome, failed=(*outcome.failed, *failed))
    rings, covered = _uncovered(rings, free_loops(model), model)
    outcome = replace(outcome, failed=(*outcome.failed, *covered))
    outcome, rings = _free(outcome, rings, [BRIDGED] * len(rings), decisions)
    return _patched(outcome, rings, BRIDGED, "bridge", deadline)


def closed(outcome: Outcome, decisions: Decisions | None, deadline: Deadline) -> tuple[Outcome, tuple[Problem, ...]]:
    """Every opening filled but those decided upon; why some could not be."""
    model = outcome.assembly
    if model.topology is None:
        return outcome, ()
    flat = SEAM_SHARE * model.diagonal
    every = free_loops(model)
    kinds = [CAPPED if not reason_against(loop, flat) else FILLED for loop in every]
    outcome, loops = _free(outcome, every, kinds, decisions)
    planar = tuple(loop for loop in loops if not reason_against(loop, flat))
    bent = tuple(loop for loop in loops if loop.closed and reason_against(loop, flat))
    if planar:
        try:
            made = cap(model, planar, flat, time_limit=deadline.left(600.0))
        except EngineError as error:
            return outcome, (_problem(outcome, planar[0], str(error)),)
        change = float(made.surface_change.max(initial=0.0))
        if change > UNCHANGED * max(model.diagonal, 1.0):
            return outcome, (_problem(outcome, planar[0], f"the caps would change a kept face by {change:.3g}"),)
        how = "trimmed by the opening's own edges"
        new = tuple(Filled(p, around, CAPPED, how) for p, around in zip(made.caps, made.around, strict=True))
        outcome = replace(outcome, assembly=made.assembly, filled=(*outcome.filled, *new))
    # planar caps are built first, so the other rings are found again by their places
    places = [loop.centre for loop in bent]
    again = tuple(
        loop
        for loop in free_loops(outcome.assembly)
        if any(np.linalg.norm(loop.centre - place) <= flat for place in places)
    )
    outcome = _patched(outcome, again, FILLED, "fill", deadline)
    problems = [_problem(outcome, loop, reason_against(loop, flat)) for loop in loops if not loop.closed]
    open_still = free_loops(outcome.assembly) if again else ()
    for loop in again:
        if any(np.linalg.norm(loop.centre - other.centre) <= flat for other in open_still):
            last = outcome.failed[-1].reason if outcome.failed else "the result does not hold"
            problems.append(_problem(outcome, loop, last))
    return outcome, tuple(problems)


def _free(
    outcome: Outcome, rings: tuple[FreeLoop, ...], kinds: list[str], decisions: Decisions | None
) -> tuple[Outcome, tuple[FreeLoop, ...]]:
    """The rings nobody decided to keep; the others are noted with the reason."""
    if decisions is None or not rings:
        return outcome, rings
    names = outcome.assembly.names
    asked = [
        Candidate(kind, ring.points, tuple(names[face] for face in ring.faces))
        for kind, ring in zip(kinds, rings, strict=True)
    ]
    against = decisions.against(asked)
    left = tuple((c, why) for c, why in zip(asked, against, strict=True) if why)
    free = tuple(ring for ring, why in zip(rings, against, strict=True) if not why)
    return replace(outcome, left=(*outcome.left, *left)), free


def _is(ring: FreeLoop, gap: Defect, model: Assembly) -> bool:
    """Whether a ring is the whole of a gap: both have one box, and no face is along the gap that is not along it.

    A lid that came off its walls lies along the gap but not along the walls' ring: bridging that would leave it over.
    """
    if not ring.closed or gap.box is None or not set(gap.parts) <= {model.parts[face].name for face in ring.faces}:
        return False
    box = np.stack([ring.points.min(axis=0), ring.points.max(axis=0)])
    return bool(np.abs(box - gap.box).max() <= SAME * ring.diagonal)


def _uncovered(
    rings: tuple[FreeLoop, ...], every: tuple[FreeLoop, ...], model: Assembly
) -> tuple[tuple[FreeLoop, ...], tuple[Attempt, ...]]:
    """The rings that no loose piece lies over; such a piece may be what is missing there, only too far away."""
    assert model.topology is not None
    piece = {face: k for k, group in enumerate(components(model.topology)) for face in group}
    free, covered = [], []
    for ring in rings:
        over = [
            other
            for other in every
            if piece[other.faces[0]] != piece[ring.faces[0]]
            and apart(ring.points, other.points).max() <= RIM_SHARE * ring.diagonal
            and apart(other.points, ring.points).max() <= RIM_SHARE * ring.diagonal
        ]
        if over:
            name = model.parts[over[0].faces[0]].name
            why = f"{name} lies loose over it, farther away than a seam that came open, and may be what belongs there"
            covered.append(Attempt(BRIDGED, ring.faces, why, ring.centre))
        else:
            free.append(ring)
    return tuple(free), tuple(covered)


def _patched(outcome: Outcome, rings: tuple[FreeLoop, ...], what: str, word: str, deadline: Deadline) -> Outcome:
    """The outcome with new parts through each ring that can have them: one surface, or where that fails several."""
    model = outcome.assembly
    if model.topology is None or not rings:
        return outcome
    limits = Limits.of(model.diagonal, deadline.left(600.0))
    for split in (False, True):
        draft, new, failed = _filled(Draft(model, model.topology), rings, what, word, limits, split)
        if not new:
            break
        made = built(model, draft, limits)
        reason = _wrong(model, made, limits)
        if made is not None and not reason:
            return replace(outcome, assembly=made, filled=(*outcome.filled, *new), failed=(*outcome.failed, *failed))
        around = tuple(dict.fromkeys(face for one in new for face in one.around))
        outcome = replace(outcome, failed=(*outcome.failed, Attempt(what, around, reason, rings[0].centre)))
    return replace(outcome, failed=(*outcome.failed, *failed))


def _filled(
    draft: Draft, rings: tuple[FreeLoop, ...], what: str, word: str, limits: Limits, split: bool
) -> tuple[Draft, list[Filled], list[Attempt]]:
    """The draft with new parts, which they are, and why some rings have none; `split` asks for several per ring."""
    new: list[Filled] = []
    failed: list[Attempt] = []
    for ring in rings:
        if limits.expired:
            failed.append(Attempt(what, ring.faces, "the time was up", ring.centre))
            continue
        several: SplitRing | str = _split(draft, ring, limits) if split else ""
        one = ring_patch(draft.topology, (ring.steps,), rim_normals(draft, set()), limits)
        if not split and (isinstance(one, str) or not isinstance(one.surface, Plane)):
            several = creased_ring(draft.topology, ring.steps, rim_normals(draft, set()), limits)
        if isinstance(one, str) and not split and isinstance(several, str):
            several = _split(draft, ring, limits)
        if not isinstance(several, str):
            draft, patches = replace(draft, topology=several.topology), several.patches
        elif not isinstance(one, str):
            patches = (one,)
        else:
            failed.append(Attempt(what, ring.faces, f"{one}; {several}", ring.centre))
            continue
        for patch in patches:
            draft, number = _with_part(draft, patch, ring, word, limits)
            new.append(Filled(number, ring.faces, what, _how(patch)))
    return draft, new, failed


def _wrong(model: Assembly, made: Assembly | None, limits: Limits) -> str:
    """Why a model with further parts does not hold; "" where it does."""
    if made is None:
        return "the CAD kernel cannot build it"
    if max(map(_change, model.parts, made.parts)) > UNCHANGED * max(model.diagonal, 1.0):
        return "building it would change a kept face"
    if bad_faces(made, limits) - bad_faces(model, limits):
        return "the CAD kernel calls the result invalid"
    return "its seams gape" if widest(made) > max(widest(model), SEAM_SHARE * model.diagonal) else ""


def _split(draft: Draft, ring: FreeLoop, limits: Limits) -> SplitRing | str:
    def normals(topology: Topology) -> Normals:
        return rim_normals(replace(draft, topology=topology), set())

    several = split_ring(draft.topology, ring.steps, normals, limits)
    if not isinstance(several, str):
        return several
    one = four_sided(draft.topology, ring.steps, normals, limits)
    return one if not isinstance(one, str) else f"{several}; {one}"


def _with_part(draft: Draft, patch: RingPatch, ring: FreeLoop, word: str, limits: Limits) -> tuple[Draft, int]:
    """The draft with one more part, named, in the body of the first face along its ring."""
    number = len(draft.parts)
    names, count = set(draft.assembly.names), 1
    while f"{word}-{count}" in names:
        count += 1
    part = Part(f"{word}-{count}", NOTHING, patch.surface, body=draft.parts[ring.faces[0]].body)
    topology = replace(draft.topology, loops=(*draft.topology.loops, ()), flipped=(*draft.topology.flipped, False))
    wider = Draft(replace(draft.assembly, parts=(*draft.parts, part), topology=topology), topology)
    return with_patch(wider, number, patch, limits), number


def _how(patch: RingPatch) -> str:
    angle = f", at {patch.angle:.3g} degrees to the faces around in the mean" if np.isfinite(patch.angle) else ""
    return f"{patch.how}{angle}"


def _change(old: Part, new: Part) -> float:
    return surface_difference(old.surface, new.surface)


def _problem(outcome: Outcome, loop: FreeLoop, why: str) -> Problem:
    along = ", ".join(outcome.assembly.parts[face].name for face in loop.faces)
    words = f"the opening along {along} cannot be filled: {why}; --scope all closes it on the tessellation"
    return Problem("opening", point(loop.centre), loop.diagonal, words)
