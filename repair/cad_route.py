"""The ladder for CAD faces: keep, sew round-off, heal open seams, cap planar openings when asked, or refuse.

A kept face has the surface it came with, checked to 1e-12. The sewing tolerance is found from the data, and a seam
counts as closed only by the distance measured between its two surfaces. What healing does is in `cad_heal`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly
from patchwright.models.cad.capping import cap, free_loops, reason_against
from patchwright.models.cad.seams import measure_seams
from patchwright.models.cad.sewing import SewnResult, free_edge_curve, sew
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation
from patchwright.repair.cad_draft import LOOSE_SHARE, Attempt, Change, Draft, Limits
from patchwright.repair.cad_grid import cad_grid
from patchwright.repair.cad_heal import Healed, heal
from patchwright.repair.decisions import CAPPED, Candidate, Decisions
from patchwright.repair.deviation import two_sided
from patchwright.repair.diagnosing import diagnose
from patchwright.repair.diagnosis import Defect, Diagnosis
from patchwright.repair.face_steps import widest
from patchwright.repair.mended import LEFT_OUT
from patchwright.repair.result import Face, LedgerEntry, Point, Problem, Progress, Repaired, Rung, Seam, Verdict
from patchwright.repair.retrace import retrace
from patchwright.repair.weld import weld

SHARES = np.array([1e-8, 1e-7, 1e-6, 1e-5, 1e-4])  # of the diagonal: sewing tolerances tried, smallest first
POINT = 1e-9  # of the diagonal: an edge this short is a pole
COINCIDENT = 1e-6  # of the diagonal: edges this near to each other are one edge that the file holds twice
SEAM_SHARE = 1e-6  # of the diagonal: the widest seam between kept faces that is closed
UNCHANGED = 1e-12  # of the diagonal: a kept surface's numbers may differ by round-off only
LEFT = {"opening", "parametrisation", "component", "thin", "unit", "far-field", "seam-angle", "loose-tolerance"}


@dataclass(frozen=True, slots=True, eq=False)
class _Outcome:
    """The assembly after keeping, sewing, healing and capping, with the words for the ledger.

    `caps` are the parts that close openings, `around` the faces along each; `left` the openings decided to stay open.
    """

    assembly: Assembly
    sewn: SewnResult | None
    reason: str
    healed: Healed | None = None
    caps: tuple[int, ...] = ()
    around: tuple[tuple[int, ...], ...] = ()
    left: tuple[tuple[Candidate, str], ...] = ()

    @property
    def changes(self) -> tuple[Change, ...]:
        """What healing changed."""
        return self.healed.changes if self.healed is not None else ()


def repair_cad(
    model: Assembly,
    tolerance: Tolerance,
    *,
    openings: str,
    diagnosis: Diagnosis,
    decisions: Decisions | None = None,
    progress: Progress,
) -> Repaired:
    """Keep the faces of a CAD model, sew them where only round-off separates them, and heal the seams that are open.

    What no rung closes is refused with its place; `scope="all"` resurfaces the whole tessellation on the true surfaces
    instead, and the message says so. `openings="close"` closes planar openings by trimmed planes on their own edges,
    but for those `decisions` keep open.
    """
    progress("sewing", 0.2)
    outcome = _sewn(model)
    progress("healing open seams", 0.3)
    outcome = _healed(model, outcome)
    after = diagnosis
    if outcome.sewn is not None or outcome.changes:
        progress("checking the mended shell", 0.6)
        domain = decisions.surroundings.domain if decisions is not None else None
        after = diagnose(outcome.assembly, tolerance=tolerance, domain=domain)
    problems = tuple(_problem(d) for d in after.defects if d.severity == "error" and d.kind not in LEFT)
    if openings == "close" and not problems:
        progress("capping openings", 0.7)
        outcome, problems = _capped(outcome, decisions)
    ledger = _ledger(model, outcome, diagnosis, after)
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
    caps = np.zeros(len(outcome.assembly.parts), dtype=bool)
    caps[list(outcome.caps)] = True
    areas = np.array([part.triangulation.areas.sum() for part in outcome.assembly.parts])
    on_cap = None if body.tags is None else caps[body.tags]
    deviation = two_sided(model.triangulation, body, tolerance.fit, skip_after=on_cap)
    verdict = Verdict.CLEAN if outcome.sewn is None and not outcome.changes else Verdict.REPAIRED
    if outcome.caps:
        verdict = Verdict.INVENTED
    faces = _faces(outcome, areas)
    invented = float(areas[caps].sum() / areas.sum()) if outcome.caps else 0.0
    return Repaired(
        verdict,
        faces,
        seams,
        body,
        ledger,
        deviation,
        invented,
        (),
        outcome.assembly,
        grid=grid,
        figures=_figures(
            outcome.assembly, seams, (grid is not None and len(grid.blocks)) or 0, after, len(outcome.caps)
        ),
    )


def _healed(model: Assembly, sewn: _Outcome) -> _Outcome:
    """The sewn model healed, or the model as it came where healing alone closes as much with narrower seams.

    Sewing takes edges within its tolerance for one; healing finds the curve where their surfaces meet. So where sewing
    left free edges or needed more than round-off, both are tried.
    """
    limits = Limits.of(model.diagonal)
    found = []
    if sewn.sewn is not None and (_free_edges(sewn.assembly) or sewn.sewn.tolerance > COINCIDENT * model.diagonal):
        alone = heal(model, limits)
        if alone is not None and alone.changes:
            found.append(_Outcome(alone.assembly, None, sewn.reason, alone))
    if not found or _free_edges(found[0].assembly):
        healed = heal(sewn.assembly, limits)
        found.append(sewn if healed is None else replace(sewn, assembly=healed.assembly, healed=healed))
    else:
        found.append(sewn)
    return min(found, key=lambda one: (_free_edges(one.assembly), widest(one.assembly)))


def _free_edges(assembly: Assembly) -> int:
    topology = assembly.topology
    if topology is None:
        return len(assembly.parts)
    lengths = np.array([np.ptp(c(np.linspace(*c.domain, 5)), axis=0).max() for c in topology.curves])
    return int(((topology.use_counts() == 1) & (lengths > POINT * assembly.diagonal)).sum())


def _sewn(model: Assembly) -> _Outcome:
    """The model sewn at the smallest tolerance that closes all that round-off keeps open, or as it came."""
    free = _free_edges(model)
    if free == 0:
        return _Outcome(model, None, "every edge is shared already")
    curve = free_edge_curve(model, SHARES * model.diagonal)
    counts = ", ".join(f"{n} at {t:.1g}" for t, n in zip(curve.tolerances, curve.free, strict=True))
    tried = [int(np.flatnonzero(curve.free == n)[0]) for n in np.unique(curve.free) if n < free]
    for k in tried:  # fewest free edges first, each at its smallest tolerance
        result = sew(model, float(curve.tolerances[k]))
        if result.dropped or result.surface_change.max(initial=0.0) > UNCHANGED * max(model.diagonal, 1.0):
            continue
        gap = _widest_to_be(result.assembly, model.diagonal)
        reason = f"{free} free edges become {result.free_edges}; free edges by tolerance: {counts}"
        if gap <= SEAM_SHARE * model.diagonal:
            return _Outcome(result.assembly, result, reason)
        if curve.tolerances[k] <= COINCIDENT * model.diagonal and gap <= LOOSE_SHARE * model.diagonal:
            reason += (
                f"; the edges coincide, and surfaces up to {gap:.2g} apart beside them are the file's own precision"
            )
            return _Outcome(result.assembly, result, reason)
    return _Outcome(
        model, None, f"no tolerance up to {curve.tolerances[-1]:.3g} closes a seam whose surfaces meet; {counts}"
    )


def _widest_to_be(sewn: Assembly, diagonal: float) -> float:
    """The widest seam once trims that stray from their edges are drawn anew, which is what comes next."""
    widest = max((s.gap for s in measure_seams(sewn)), default=0.0)
    if sewn.topology is None or widest <= SEAM_SHARE * diagonal:
        return widest
    drawn, _, _ = retrace(Draft(sewn, sewn.topology), Limits.of(diagonal))
    return max(
        (s.gap for s in measure_seams(replace(drawn.assembly, topology=drawn.topology, native=None))), default=0.0
    )


def _capped(outcome: _Outcome, decisions: Decisions | None) -> tuple[_Outcome, tuple[Problem, ...]]:
    """Every free loop closed by a plane but those decided upon, or the reasons why some cannot be."""
    model = outcome.assembly
    if model.topology is None:
        return outcome, ()
    flat, loops = SEAM_SHARE * model.diagonal, free_loops(model)
    if decisions is not None:
        names = model.names
        asked = [Candidate(CAPPED, loop.points, tuple(names[face] for face in loop.faces)) for loop in loops]
        against = decisions.against(asked)
        outcome = replace(outcome, left=tuple((c, why) for c, why in zip(asked, against, strict=True) if why))
        loops = tuple(loop for loop, why in zip(loops, against, strict=True) if not why)
    problems = []
    for loop in loops:
        if why := reason_against(loop, flat):
            along = ", ".join(model.parts[face].name for face in loop.faces)
            words = f"the opening along {along} cannot be capped: {why}; --scope all closes it on the tessellation"
            problems.append(Problem("opening", _point(loop.centre), loop.diagonal, words))
    if problems or not loops:
        return outcome, tuple(problems)
    made = cap(model, loops, flat)
    change = float(made.surface_change.max(initial=0.0))
    if change > UNCHANGED * max(model.diagonal, 1.0):
        words = f"building the caps would change a kept face by {change:.3g}"
        return outcome, (Problem("opening", _point(loops[0].centre), loops[0].diagonal, words),)
    return replace(outcome, assembly=made.assembly, caps=made.caps, around=made.around), ()


def _faces(outcome: _Outcome, areas: Array) -> tuple[Face, ...]:
    """Every output face with the rung that made or changed it and how far that moved it."""
    names = outcome.assembly.names
    around = dict(zip(outcome.caps, outcome.around, strict=True))
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
            faces.append(Face(name, (name,), changed[i].rung, changed[i].largest_move, 0.0, area))
        else:
            faces.append(Face(name, (name,), untouched, 0.0, 0.0, area))
    return tuple(faces)


def _problem(defect: Defect) -> Problem:
    words = f"{defect.message}; no rung of --scope least closes it, --scope all resurfaces the tessellation"
    return Problem(defect.kind, _point(defect.where), float(defect.size), words)


def _ledger(model: Assembly, outcome: _Outcome, before: Diagnosis, after: Diagnosis) -> tuple[LedgerEntry, ...]:
    changes = outcome.changes
    touched = {face for change in changes for face in change.faces}
    kept = [p for i, p in enumerate(model.parts) if i not in touched]
    area = float(sum(p.triangulation.areas.sum() for p in kept))
    entries = [
        LedgerEntry("CAD faces kept", Rung.KEEP, (), "their surfaces are identical", count=len(kept), area=area),
        *(_entry(model, change) for change in changes),
        *(_in_vain(model, attempt) for attempt in (outcome.healed.failed if outcome.healed else ())),
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
                count=_free_edges(model) - outcome.sewn.free_edges,
                tolerance=outcome.sewn.tolerance,
                largest_move=change,
            )
        )
    elif not changes:
        entries.append(LedgerEntry("edges left as they were", Rung.KEEP, (), outcome.reason, count=0))
    for at, around in zip(outcome.caps, outcome.around, strict=True):
        part = outcome.assembly.parts[at]
        entries.append(
            LedgerEntry(
                CAPPED,
                Rung.BRIDGE,
                tuple(outcome.assembly.parts[face].name for face in around),
                f"{part.name} is trimmed by the opening's own edges; the faces around it are identical",
                area=float(part.triangulation.areas.sum()),
                where=_point(part.triangulation.bounds.mean(axis=0)),
                size=part.triangulation.diagonal,
            )
        )
    for candidate, why in outcome.left:
        place = candidate.fingerprint
        entries.append(
            LedgerEntry(CAPPED + LEFT_OUT, Rung.KEEP, candidate.parts, why, where=place.where, size=place.size)
        )
    for defect in after.defects:
        if outcome.caps and defect.kind == "opening":
            continue
        if defect.kind in LEFT and defect.severity != "info":
            entries.append(
                LedgerEntry(
                    f"{defect.kind} left",
                    Rung.KEEP,
                    tuple(defect.parts),
                    defect.message,
                    count=int(defect.count),
                    where=_point(defect.where),
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
        where=_point(change.where),
    )


def _in_vain(model: Assembly, attempt: Attempt) -> LedgerEntry:
    names = tuple(model.parts[face].name for face in attempt.faces)
    what = f"{attempt.what}: tried in vain"
    return LedgerEntry(what, Rung.KEEP, names, attempt.reason, count=len(names), where=_point(attempt.where))


def _point(where: Array | Point) -> Point:
    x, y, z = np.asarray(where, dtype=np.float64).tolist()
    return x, y, z


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
    free = _free_edges(assembly)
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
