"""The ledger of the CAD route: what was kept, mended, sewn, filled, left, tried in vain, or not done in time."""

from __future__ import annotations

from patchwright.models.assembly import Assembly
from patchwright.repair.cad.deadline import Deadline
from patchwright.repair.cad.draft import Attempt, Change
from patchwright.repair.cad.face_steps import free_edges
from patchwright.repair.cad.outcome import Outcome, point
from patchwright.repair.diagnosis import Diagnosis
from patchwright.repair.mender.mended import LEFT_OUT
from patchwright.repair.result import LedgerEntry, Rung

LEFT = {"opening", "parametrisation", "component", "thin", "unit", "far-field", "seam-angle", "loose-tolerance"}
"""kinds of defect a repaired CAD model may have: they are told and left"""


def ledger_of(model: Assembly, outcome: Outcome, after: Diagnosis, deadline: Deadline) -> tuple[LedgerEntry, ...]:
    changes = outcome.changes
    touched = {face for change in changes for face in change.faces}
    kept = [p for i, p in enumerate(model.parts) if i not in touched]
    area = float(sum(p.triangulation.areas.sum() for p in kept))
    entries = [
        LedgerEntry("CAD faces kept", Rung.KEEP, (), "their surfaces are identical", count=len(kept), area=area),
        *(_entry(model, change) for change in changes),
        *(_in_vain(model, attempt) for attempt in outcome.in_vain),
        *(_undone(outcome, what, after, deadline) for what in outcome.undone),
    ]
    if outcome.healed and outcome.healed.opened:
        why = "their surfaces were farther apart than a closed seam; each face was given its own border"
        entries.append(LedgerEntry("shared edges taken apart", Rung.CUT, (), why, count=outcome.healed.opened))
    if outcome.sewn is not None:
        change = float(outcome.sewn.surface_change.max(initial=0.0))
        entries.append(
            LedgerEntry(
                "edges sewn",
                Rung.WELD,
                (),
                outcome.reason,
                count=free_edges(model) - outcome.sewn.free_edges,
                tolerance=outcome.sewn.tolerance,
                largest_move=change,
            )
        )
    elif not changes:
        entries.append(LedgerEntry("edges left as they were", Rung.KEEP, (), outcome.reason, count=0))
    for filled in outcome.filled:
        part = outcome.assembly.parts[filled.part]
        entries.append(
            LedgerEntry(
                filled.what,
                Rung.BRIDGE,
                tuple(outcome.assembly.parts[face].name for face in filled.around),
                f"{part.name} is {filled.how}; the faces around it are identical",
                area=float(part.triangulation.areas.sum()),
                where=point(part.triangulation.bounds.mean(axis=0)),
                size=part.triangulation.diagonal,
            )
        )
    for candidate, why in outcome.left:
        place = candidate.fingerprint
        entries.append(
            LedgerEntry(candidate.kind + LEFT_OUT, Rung.KEEP, candidate.parts, why, where=place.where, size=place.size)
        )
    for one in outcome.rejected:
        why = "the plan rejects it"
        entries.append(LedgerEntry(one.kind + LEFT_OUT, Rung.KEEP, one.parts, why, where=one.where, size=one.size))
    for defect in after.defects:
        if outcome.filled and defect.kind == "opening":
            continue
        if (defect.kind in LEFT and defect.severity != "info") or outcome.decided(defect):
            entries.append(
                LedgerEntry(
                    f"{defect.kind} left",
                    Rung.KEEP,
                    tuple(defect.parts),
                    defect.message,
                    count=int(defect.count),
                    where=point(defect.where),
                )
            )
    return tuple(entries)


def _entry(model: Assembly, change: Change) -> LedgerEntry:
    return LedgerEntry(
        change.what,
        change.rung,
        tuple(model.parts[face].name for face in change.faces),
        change.reason,
        count=len(change.faces),
        tolerance=change.tolerance,
        largest_move=change.largest_move,
        where=point(change.where),
        size=change.size,
    )


def _in_vain(model: Assembly, attempt: Attempt) -> LedgerEntry:
    names = tuple(model.parts[face].name for face in attempt.faces)
    what = f"{attempt.what}: tried in vain"
    return LedgerEntry(what, Rung.KEEP, names, attempt.reason, count=len(names), where=point(attempt.where))


def _undone(outcome: Outcome, what: str, after: Diagnosis, deadline: Deadline) -> LedgerEntry:
    """What the time did not suffice for, at the place of the gravest defect that is known."""
    worst = after.defects[0] if after.defects else None
    where = point(worst.where if worst is not None else outcome.assembly.bounds.mean(axis=0))
    limit = f"{deadline.limit:.0f} s of processor time"
    reason = f"the time limit of {limit} was reached before it was done: give --time-limit more"
    parts = tuple(worst.parts) if worst is not None else ()
    return LedgerEntry(f"{what}: not done in time", Rung.KEEP, parts, reason, count=0, where=where)
