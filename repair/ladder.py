"""`repair` and `plan_repair`: the ways in. They choose the route by what the input is; the routes climb the ladder."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from patchwright.models.assembly import Assembly
from patchwright.models.errors import ParameterError
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation
from patchwright.repair.checks.bare_faces import tessellated
from patchwright.repair.decisions import Decisions
from patchwright.repair.diagnosis import Diagnosis
from patchwright.repair.domain import Domain
from patchwright.repair.plan import Plan, compared, plan_of
from patchwright.repair.regions import regions
from patchwright.repair.result import LedgerEntry, Progress, Repaired, Rung, Verdict
from patchwright.repair.surroundings import Surroundings, surroundings

SCOPES = ("least", "all")
OPENINGS = ("keep", "close")
SECONDS = 600.0  # default time limit for CAD faces that are kept


def repair(
    assembly: Assembly | Triangulation,
    *,
    scope: str = "least",
    layout: Any = "auto",
    openings: Literal["keep", "close"] = "keep",
    tolerance: Tolerance | float | None = None,
    domain: Domain | None = None,
    plan: Plan | None = None,
    diagnosis: Diagnosis | None = None,
    time_limit: float = SECONDS,
    progress: Progress | None = None,
) -> Repaired:
    """Mend a model with the least change.

    Parameters
    ----------
    assembly : what `read` returned, or a triangulation
    scope : "least" keeps what is good, "all" resurfaces everything
    layout : "auto", a `QuadLayout`, or a list of patches, each given by four boundary curves or four corner points
    openings : "keep" reports planned openings and leaves them, "close" caps them
    tolerance : a `Tolerance`, or the fit tolerance as a length; default 1e-4 of the diagonal of the body
    domain : the flow domain round the body; what it does not say is guessed
    plan : a reviewed plan: its rejected items are left out, and what does not fit it is told in the ledger
    diagnosis : of the same assembly, when it has been made already
    time_limit : seconds after which nothing new is begun on CAD faces that are kept; what was not done is told with its
        place (a mesh, and `scope="all"`, have no limit)
    progress : called with a label and a share in [0, 1]

    Returns
    -------
    Repaired; a model that cannot be repaired comes back with verdict "refused" and the coordinates of the reasons.
    What bounds the domain from outside (far field, symmetry parts) is in `.triangulation` as it came, without patches.

    Raises
    ------
    ParameterError : an option without meaning, an empty assembly, a domain that names what is not there.
    """
    say = progress or _silent
    if isinstance(layout, str) and layout != "auto":
        raise ParameterError(f'layout must be "auto", a QuadLayout or a list of patches, got {layout!r}')
    task = _task(assembly, scope, openings, tolerance, domain, plan, diagnosis, say)
    if task.model.is_cad and scope == "least":
        if not isinstance(layout, str):
            raise ParameterError(
                "a layout is for patches that replace a surface: CAD faces are kept unless scope is all"
            )
        result = _cad(task, openings, say, time_limit)
        result = replace(result, ledger=(*task.entries, *result.ledger))
    else:
        from patchwright.repair.aside import with_aside
        from patchwright.repair.layout.quad_layout import QuadLayout
        from patchwright.repair.mesh_route import repair_mesh
        from patchwright.repair.patches.given_layout import layout_of

        given = layout if isinstance(layout, str) else layout_of(layout, task.limits)
        result = repair_mesh(
            task.body,
            task.limits,
            scope=scope,
            layout=given,
            merged=isinstance(layout, str | QuadLayout),
            openings=openings,
            clean=not any(d.severity == "error" for d in task.diagnosis.defects) and not task.entries,
            decisions=task.decisions,
            progress=say,
        )
        result = with_aside(replace(result, ledger=(*task.entries, *result.ledger)), task.model, task.around)
    if result.verdict is not Verdict.REFUSED:
        say("measuring part by part", 0.0)
        inside = task.model.triangulation, result.triangulation
        result = replace(result, regions=regions(*inside, task.limits))
    if plan is None:
        return result
    return replace(result, ledger=(*result.ledger, *_against(plan, result.ledger, task.decisions.diagonal)))


def plan_repair(
    assembly: Assembly | Triangulation,
    *,
    scope: str = "least",
    openings: Literal["keep", "close"] = "keep",
    tolerance: Tolerance | float | None = None,
    domain: Domain | None = None,
    diagnosis: Diagnosis | None = None,
    time_limit: float = SECONDS,
    progress: Progress | None = None,
) -> Plan:
    """What `repair` would do with the same arguments, item by item; nothing is fitted, nothing is written.

    Raises
    ------
    ParameterError : as `repair`.
    """
    say = progress or _silent
    task = _task(assembly, scope, openings, tolerance, domain, None, diagnosis, say)
    size = task.decisions.diagonal
    reasons = task.around.reasons
    if task.model.is_cad and scope == "least":
        made = _cad(task, openings, say, time_limit)
        return plan_of(task.model.source, (*task.entries, *made.ledger), size, made.problems, reasons)
    from patchwright.repair.mender.mend import mend
    from patchwright.repair.mesh_route import mending_ledger, problems_of

    mended = mend(
        task.body.triangulation, task.limits.careful, openings=openings, decisions=task.decisions, progress=say
    )
    ledger = (*task.entries, *mending_ledger(mended))
    return plan_of(task.model.source, ledger, size, problems_of(mended), reasons)


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """A checked request: the model, the body in it, and all that was decided before any mending."""

    model: Assembly
    body: Assembly
    around: Surroundings
    limits: Tolerance
    diagnosis: Diagnosis
    decisions: Decisions
    entries: tuple[LedgerEntry, ...]


def _task(
    assembly: Assembly | Triangulation,
    scope: str,
    openings: str,
    tolerance: Tolerance | float | None,
    domain: Domain | None,
    plan: Plan | None,
    diagnosis: Diagnosis | None,
    say: Progress,
) -> _Task:
    if scope not in SCOPES:
        raise ParameterError(f"scope must be one of {', '.join(SCOPES)}, got {scope!r}")
    if openings not in OPENINGS:
        raise ParameterError(f"openings must be one of {', '.join(OPENINGS)}, got {openings!r}")
    if not isinstance(domain, Domain | None):
        raise ParameterError(f"domain must be a Domain or None, got {type(domain).__name__}")
    model = Assembly.of(assembly) if isinstance(assembly, Triangulation) else assembly
    model = tessellated(model)
    if not any(len(part.triangulation) for part in model.parts):
        raise ParameterError(
            f"{model.source or 'the assembly'} holds no triangles and no faces: there is nothing to repair"
        )
    around = surroundings(model, domain)
    limits = tolerance if isinstance(tolerance, Tolerance) else fit_tolerance(model, around, tolerance)
    if diagnosis is None:
        from patchwright.repair.diagnosing import diagnose

        say("diagnosing", 0.0)
        diagnosis = diagnose(model, tolerance=limits, domain=domain)
    body, entries = (model, ()) if model.is_cad and scope == "least" else _body(model, around, limits)
    rejected = tuple(item.fingerprint for item in plan.rejected) if plan is not None else ()
    decisions = Decisions(around, around.body_size(model).diagonal, limits.fit, rejected)
    return _Task(model, body, around, limits, diagnosis, decisions, entries)


def fit_tolerance(model: Assembly, around: Surroundings, fit: float | None) -> Tolerance:
    """The tolerances of a model: from its body's size, and those given for single parts."""
    limits = Tolerance.of(around.body_size(model), fit=fit)
    return replace(limits, parts=tuple(sorted(around.domain.tolerances.items())))


def _body(model: Assembly, around: Surroundings, limits: Tolerance) -> tuple[Assembly, tuple[LedgerEntry, ...]]:
    """The triangles to be mended, the borders at symmetry planes put on them exactly, and the entry that says so."""
    body = around.body(model)
    if not around.planes or body.is_cad:
        return body, ()
    from patchwright.repair.checks.examination import Examination
    from patchwright.repair.symmetry import on_planes

    inside = replace(around, aside=around.aside[~around.aside])
    mesh, moved, farthest = on_planes(Examination(body, limits, inside))
    if not len(moved):
        return body, ()
    x, y, z = mesh.vertices[moved].mean(axis=0).tolist()
    names = ", ".join(plane.name for plane in around.planes)
    reason = f"border vertices within {limits.fit:.3g} of the symmetry plane {names} are put on it exactly"
    entry = LedgerEntry(
        "put on the symmetry plane", Rung.WELD, (), reason, count=len(moved), tolerance=limits.fit,
        largest_move=farthest, where=(x, y, z), size=body.diagonal,
    )  # fmt: skip
    parts, start = [], 0
    for part in body.parts:
        count = len(part.triangulation.vertices)
        points = mesh.vertices[start : start + count]
        start += count
        parts.append(replace(part, triangulation=replace(part.triangulation, vertices=points)))
    return replace(body, parts=tuple(parts)), (entry,)


def _cad(task: _Task, openings: str, say: Progress, time_limit: float) -> Repaired:
    if not time_limit > 0.0:
        raise ParameterError(f"a time limit must be a positive number of seconds, got {time_limit!r}")
    from patchwright.repair.cad.route import repair_cad

    return repair_cad(
        task.model,
        task.limits.careful,
        openings=openings,
        diagnosis=task.diagnosis,
        decisions=task.decisions,
        time_limit=time_limit,
        progress=say,
    )


def _against(plan: Plan, ledger: tuple[LedgerEntry, ...], diagonal: float) -> tuple[LedgerEntry, ...]:
    """What of a plan a run did not meet, and what it did beside the plan."""
    missing, unplanned = compared(plan, ledger, diagonal)
    gone = "the plan lists it and this model does not ask for it"
    new = "this model asks for it and the plan does not list it"
    return (
        *(
            LedgerEntry(f"planned item {i.id} not met", Rung.KEEP, i.parts, gone, count=0, where=i.where, size=i.size)
            for i in missing
        ),
        *(
            LedgerEntry(f"{e.what} beside the plan", Rung.KEEP, e.parts, new, count=0, where=e.where, size=e.size)
            for e in unplanned
        ),
    )


def _silent(label: str, share: float) -> None:
    """No progress wanted."""
