"""What mends a CAD face where it is, step by step, and the proof that each step's result holds.

Loops turned round; trims drawn anew on the face's own surface; tiny edges taken out; a new surface through its edges.
Each step is built by the CAD kernel before the next. Faces it made invalid get back what they had, and that is told.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np

from patchwright.models.assembly import Assembly
from patchwright.models.cad.editing import compacted, with_loops
from patchwright.models.cad.rebuild import rebuilt
from patchwright.models.cad.seams import measure_seams
from patchwright.models.cad.status import brep_status
from patchwright.models.errors import EngineError
from patchwright.repair.cad.draft import Attempt, Change, Draft, Limits
from patchwright.repair.cad.new_face import new_faces
from patchwright.repair.cad.retrace import retrace
from patchwright.repair.cad.tiny_edges import without_tiny_edges
from patchwright.repair.cad.turned_loops import turned_loops

CHECK, BUILD = 60.0, 120.0  # seconds for the kernel's check of all faces and for building them, where the time is left
AGAIN = 3  # rounds in which faces that became invalid get back what they had
POINT = 1e-9  # of the diagonal: an edge this short is a pole
FOLD = 179.0  # degrees between outward normals: two faces that lie on each other

Changes = tuple[Change, ...]
Attempts = tuple[Attempt, ...]
Step = Callable[[Draft, Limits, Collection[int]], tuple[Draft, Changes, Attempts]]


def _simply(step: Callable[[Draft, Limits, Collection[int]], tuple[Draft, Changes]]) -> Step:
    def made(draft: Draft, limits: Limits, bad: Collection[int]) -> tuple[Draft, Changes, Attempts]:
        return (*step(draft, limits, bad), ())

    return made


STEPS: tuple[tuple[str, Step], ...] = (
    ("loops turned round", _simply(turned_loops)),
    ("trims drawn anew", retrace),
    ("tiny edges taken out", _simply(without_tiny_edges)),
    ("face replaced", new_faces),
)


def mended_faces(model: Assembly, limits: Limits, folded: Collection[int] = ()) -> tuple[Assembly, Changes, Attempts]:
    """The model with its bad faces mended as far as the steps reach, what was done, and what was tried in vain.

    Bad is what the kernel calls so, and `folded`, faces that pass through themselves.
    """
    changes: Changes = ()
    failed: Attempts = ()
    bad = bad_faces(model, limits) | set(folded)
    for what, step in STEPS:
        if limits.expired:
            start = Draft(model, model.topology) if model.topology is not None else None
            failed += tuple(Attempt(what, (f,), "the time was up", start.middle(f)) for f in sorted(bad) if start)
            break
        model, bad, done, missed = _stepped(model, bad, limits, what, step)
        bad |= set(folded)
        changes, failed = (*changes, *done), (*failed, *missed)
    return model, changes, failed


def bad_faces(model: Assembly, limits: Limits) -> set[int]:
    """Faces the kernel calls invalid or cannot tessellate."""
    bare = {i for i, part in enumerate(model.parts) if not len(part.triangulation)}
    return bare | set(brep_status(model, time_limit=limits.left(CHECK)).invalid)


def widest(model: Assembly) -> float:
    """The largest gap of any seam."""
    return max((seam.gap for seam in measure_seams(model)), default=0.0)


def free_edges(assembly: Assembly) -> int:
    """Edges one face uses once, poles left out; the number of parts where no topology is known."""
    topology = assembly.topology
    if topology is None:
        return len(assembly.parts)
    lengths = np.array([np.ptp(c(np.linspace(*c.domain, 5)), axis=0).max() for c in topology.curves])
    return int(((topology.use_counts() == 1) & (lengths > POINT * assembly.diagonal)).sum())


def folds(model: Assembly) -> int:
    """How many pairs of faces lie on each other beside a seam."""
    return sum(seam.typical >= FOLD for seam in measure_seams(model))


def built(model: Assembly, draft: Draft, limits: Limits) -> Assembly | None:
    """The draft as the kernel builds it; None where it cannot."""
    try:
        return rebuilt(model, draft.parts, compacted(draft.topology), time_limit=limits.left(BUILD + len(draft.parts)))
    except EngineError:
        return None


def in_vain(what: str, changes: Changes, why: str) -> Attempts:
    """One attempt for changes that do not count."""
    faces = tuple(dict.fromkeys(face for change in changes for face in change.faces))
    return (Attempt(what, faces, why, changes[0].where),)


def _stepped(
    model: Assembly, bad: set[int], limits: Limits, what: str, step: Step
) -> tuple[Assembly, set[int], Changes, Attempts]:
    assert model.topology is not None
    start = Draft(model, model.topology)
    draft, changes, failed = step(start, limits, bad)
    wrong: set[int] = set()
    plain = False
    for _ in range(AGAIN):
        if not changes:
            break
        made = built(model, draft, limits)
        if made is None:
            return model, bad, (), (*failed, *in_vain(what, changes, "the CAD kernel cannot build it"))
        now = bad_faces(made, limits)
        worse = now - bad
        if worse and not plain:  # what the kernel makes of the model as it was: its triangles may be from elsewhere
            plain = True
            as_it_was = built(model, start, limits)
            bad = bad | (bad_faces(as_it_was, limits) if as_it_was is not None else set())
            worse = now - bad
        if not worse:
            if widest(made) > max(widest(model), 2.0 * limits.on) or folds(made) > folds(model):
                return model, bad, (), (*failed, *in_vain(what, changes, "its seams are worse than before"))
            return made, now, changes, (*failed, *_given_back(what, wrong, start))
        touched = {face for change in changes for face in change.faces}
        blamed = worse & touched | _beside(start, worse - touched) & touched
        if not blamed:
            return model, bad, (), (*failed, *in_vain(what, changes, "faces beside became invalid"))
        wrong |= blamed
        draft = _with_old(draft, start, wrong)
        changes = tuple(change for change in changes if not wrong & set(change.faces))
    return model, bad, (), (*failed, *_given_back(what, wrong, start))


def _with_old(draft: Draft, start: Draft, faces: set[int]) -> Draft:
    """The draft with what some faces had at the start; edges keep their numbers through a step."""
    loops = with_loops(draft.topology, {face: start.topology.loops[face] for face in faces})
    old = start.topology.flipped
    flipped = tuple(old[i] if i in faces else flip for i, flip in enumerate(draft.topology.flipped))
    parts = tuple(start.parts[i] if i in faces else part for i, part in enumerate(draft.parts))
    return Draft(replace(draft.assembly, parts=parts), replace(loops, flipped=flipped))


def _beside(draft: Draft, faces: set[int]) -> set[int]:
    """Faces that share an edge with some."""
    edges = {use.edge for face in faces for loop in draft.topology.loops[face] for use in loop}
    return {
        face
        for face, loops in enumerate(draft.topology.loops)
        if face not in faces and any(use.edge in edges for loop in loops for use in loop)
    }


def _given_back(what: str, faces: set[int], start: Draft) -> Attempts:
    why = "the CAD kernel calls the result invalid, so the face has what it had"
    return tuple(Attempt(what, (face,), why, start.middle(face)) for face in sorted(faces))
