"""The ladder for CAD faces: keep, drop copies, sew round-off, heal faces and seams, bridge gaps, fill openings, refuse.

A kept face has the surface it came with, checked to 1e-12; a seam counts as closed only by the distance measured
between its two surfaces. Sewing is in `cad.sew`, healing in `cad.heal`, what is invented in `cad.fill`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.models.assembly import Assembly
from patchwright.models.cad.seams import measure_seams
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation
from patchwright.repair.cad.copies import without_copies
from patchwright.repair.cad.deadline import Deadline
from patchwright.repair.cad.draft import Change
from patchwright.repair.cad.face_steps import free_edges
from patchwright.repair.cad.fill import bridged, closed
from patchwright.repair.cad.grid import cad_grid
from patchwright.repair.cad.ledger import LEFT, ledger_of
from patchwright.repair.cad.outcome import Outcome, point
from patchwright.repair.cad.sew import healed, sewn
from patchwright.repair.cad.union import Union, united
from patchwright.repair.cad.vetoes import Vetoes
from patchwright.repair.decisions import Decisions
from patchwright.repair.deviation import two_sided
from patchwright.repair.diagnosing import diagnose
from patchwright.repair.diagnosis import Defect, Diagnosis
from patchwright.repair.mender.weld import weld
from patchwright.repair.result import Face, LedgerEntry, Problem, Progress, Repaired, Rung, Seam, Verdict

SECONDS = 600.0  # default time limit


def repair_cad(
    model: Assembly,
    tolerance: Tolerance,
    *,
    openings: str,
    diagnosis: Diagnosis,
    decisions: Decisions | None = None,
    time_limit: float = SECONDS,
    progress: Progress,
) -> Repaired:
    """Keep the faces of a CAD model, sew them where only round-off separates them, mend faces and seams, bridge gaps.

    What no rung mends is refused with its place; `scope="all"` resurfaces the whole tessellation on the true surfaces
    instead, and the message says so. `openings="close"` fills openings by new faces on their own edges, but for those
    `decisions` keep open. After `time_limit` seconds nothing new is begun; what was not done is in the ledger with its
    place, and refused where it leaves the model broken.
    """
    deadline = Deadline.after(time_limit)
    progress("sewing", 0.2)
    once, copies = without_copies(model)
    union = united(once, diagnosis, deadline)
    once, first = union.model, (*copies, *union.entries)
    outcome = sewn(once, deadline)
    progress("healing faces and seams", 0.3)
    vetoes = Vetoes.of(decisions)
    outcome = healed(once, outcome, deadline, _folded(once, diagnosis), vetoes)
    outcome = replace(outcome, rejected=vetoes.left)
    domain = decisions.surroundings.domain if decisions is not None else None
    after = diagnosis
    if outcome.sewn is not None or outcome.changes or copies or union.made:
        progress("checking the mended shell", 0.6)
        after = diagnose(outcome.assembly, tolerance=tolerance, domain=domain)
    progress("bridging gaps", 0.65)
    before = len(outcome.filled)
    outcome = bridged(outcome, after, decisions, deadline)
    if len(outcome.filled) > before:
        after = diagnose(outcome.assembly, tolerance=tolerance, domain=domain)
    problems = tuple(
        _problem(d) for d in after.defects if d.severity == "error" and d.kind not in LEFT and not outcome.decided(d)
    )
    if openings == "close" and not problems:
        progress("filling openings", 0.7)
        outcome, problems = closed(outcome, decisions, deadline)
    if problems and not union.made:
        late = united(outcome.assembly, after, deadline)
        if late.made:
            ledger = (*first, *ledger_of(once, outcome, after, deadline), *late.entries)
            progress("repairing the united bodies", 0.7)
            return _continued(model, outcome, late, ledger, tolerance, openings, decisions, deadline, progress)
    ledger = (*first, *ledger_of(once, outcome, after, deadline))
    body, deviation = _triangulated(outcome.assembly, tolerance), None
    if problems:
        return Repaired(
            Verdict.REFUSED, (), (), body, ledger, None, 0.0, problems, Assembly((), model.unit, model.source)
        )
    progress("measuring seams", 0.8)
    seams = _seams(outcome.assembly, tolerance)
    grid, without = cad_grid(outcome.assembly)
    if without and grid is not None:
        ledger += (
            LedgerEntry(
                "faces without a grid block", Rung.KEEP, without, "they are not four-sided", count=len(without)
            ),
        )
    made_up = _invented(outcome)
    areas = np.array([part.triangulation.areas.sum() for part in outcome.assembly.parts])
    deviation = two_sided(
        model.triangulation,
        body,
        tolerance.fit,
        skip_after=None if body.tags is None else made_up[body.tags],
        hidden=union.hidden,
    )
    untouched = outcome.sewn is None and not outcome.changes and not copies and not union.made
    verdict = Verdict.CLEAN if untouched else Verdict.REPAIRED
    if made_up.any():
        verdict = Verdict.INVENTED
    blocks = (grid is not None and len(grid.blocks)) or 0
    return Repaired(
        verdict,
        union.labelled(_faces(outcome, areas)),
        seams,
        body,
        ledger,
        deviation,
        float(areas[made_up].sum() / areas.sum()),
        (),
        outcome.assembly,
        grid=grid,
        figures=_figures(outcome.assembly, seams, blocks, after, len(outcome.filled)),
    )


def _continued(
    model: Assembly,
    outcome: Outcome,
    late: Union,
    ledger: tuple[LedgerEntry, ...],
    tolerance: Tolerance,
    openings: str,
    decisions: Decisions | None,
    deadline: Deadline,
    progress: Progress,
) -> Repaired:
    """The repair of bodies that could be united only after their own faces were sewn or healed."""
    domain = decisions.surroundings.domain if decisions is not None else None
    again = repair_cad(
        late.model,
        tolerance,
        openings=openings,
        diagnosis=diagnose(late.model, tolerance=tolerance, domain=domain),
        decisions=decisions,
        time_limit=deadline.left(deadline.limit),
        progress=progress,
    )
    ledger = (*ledger, *again.ledger)
    if again.deviation is None:
        return replace(again, ledger=ledger)
    deviation = two_sided(model.triangulation, again.triangulation, tolerance.fit, hidden=late.hidden)
    verdict = Verdict.REPAIRED if again.verdict is Verdict.CLEAN else again.verdict
    areas = np.array([part.triangulation.areas.sum() for part in outcome.assembly.parts])
    faces = late.labelled(again.faces, _faces(outcome, areas))
    return replace(again, verdict=verdict, faces=faces, ledger=ledger, deviation=deviation)


def _folded(model: Assembly, diagnosis: Diagnosis) -> set[int]:
    """The faces that pass through themselves, as far as their names tell which they are."""
    alone = {d.parts[0] for d in diagnosis.defects if d.kind == "self-intersection" and len(set(d.parts)) == 1}
    names = model.names
    return {i for i, name in enumerate(names) if name in alone and names.count(name) == 1}


def _invented(outcome: Outcome) -> BoolArray:
    """(f,) the faces that stand for nothing of the input: what fills openings and gaps, and surfaces made up."""
    out = np.zeros(len(outcome.assembly.parts), dtype=np.bool_)
    out[[filled.part for filled in outcome.filled]] = True
    for change in outcome.changes:
        if change.rung is Rung.BRIDGE:
            out[list(change.faces)] = True
    return out


def _faces(outcome: Outcome, areas: Array) -> tuple[Face, ...]:
    """Every output face with the rung that made or changed it and how far that moved it."""
    names = outcome.assembly.names
    around = {filled.part: filled.around for filled in outcome.filled}
    made_up = _invented(outcome).tolist()
    changed: dict[int, Change] = {}
    for change in outcome.changes:
        for face in change.faces:
            if face not in changed or change.largest_move > changed[face].largest_move:
                changed[face] = change
    untouched = Rung.KEEP if outcome.sewn is None else Rung.WELD
    faces = []
    for i, (name, area) in enumerate(zip(names, areas.tolist(), strict=True)):
        if i in around:
            faces.append(Face(name, tuple(names[k] for k in around[i]), Rung.BRIDGE, float("nan"), 1.0, area))
        elif i in changed:
            faces.append(Face(name, (name,), changed[i].rung, changed[i].largest_move, float(made_up[i]), area))
        else:
            faces.append(Face(name, (name,), untouched, 0.0, 0.0, area))
    return tuple(faces)


def _problem(defect: Defect) -> Problem:
    words = f"{defect.message}; no rung of --scope least closes it, --scope all resurfaces the tessellation"
    return Problem(defect.kind, point(defect.where), float(defect.size), words)


def _triangulated(assembly: Assembly, tolerance: Tolerance) -> Triangulation:
    """All faces' triangles, tagged by name, points on shared edges stored once."""
    return weld(assembly.triangulation, tolerance.gap).triangulation


def _seams(assembly: Assembly, tolerance: Tolerance) -> tuple[Seam, ...]:
    return tuple(
        Seam(s.faces, s.gap, s.angle, "sharp" if s.angle > tolerance.angle else "smooth", s.length, s.at)
        for s in measure_seams(assembly)
    )


def _figures(
    assembly: Assembly, seams: tuple[Seam, ...], blocks: int, after: Diagnosis, caps: int
) -> dict[str, float | int | str | bool]:
    smooth = np.array([s.angle for s in seams if s.kind == "smooth"] or [0.0])
    free = free_edges(assembly)
    return {
        "faces": len(assembly.parts),
        "grid blocks": blocks,
        "closed": free == 0,
        "free edges": free,
        "openings kept": 0 if free == 0 else max(len(after.of("opening")) - caps, 0),
        "largest seam gap": max((s.gap for s in seams), default=0.0),
        "largest smooth seam angle": float(smooth.max()),
        "median smooth seam angle": float(np.median(smooth)),
    }
