"""A study in words for the terminal and as plain values for machines; both tell the same figures."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from patchwright.pipelines.check import Checked
from patchwright.pipelines.study import Study
from patchwright.repair.deviation import Spread
from patchwright.repair.diagnosis import Diagnosis
from patchwright.repair.plan import Plan
from patchwright.repair.result import Repaired, Verdict

MOST_LINES = 12
COUNTS = (
    ("triangles", "triangles"),
    ("faces", "faces"),
    ("open_edges", "open edges"),
    ("non_manifold_edges", "multiply connected edges"),
    ("components", "unconnected parts"),
    ("collapsed_faces", "collapsed"),
    ("zero_area_faces", "degenerate"),
    ("duplicate_faces", "duplicate"),
    ("needles", "needle"),
    ("orientation_zones", "orientation zones"),
    ("self_intersecting_faces", "self-intersecting faces"),
    ("invalid_faces", "invalid faces"),
    ("gaps", "gaps"),
    ("holes", "holes"),
    ("openings", "openings"),
)


def checked_lines(result: Checked) -> list[str]:
    """One file's check: the diagnosis, then what counts against the baseline."""
    assert result.diagnosis is not None
    lines = defect_lines(str(result.file), result.diagnosis)
    if result.known or result.gone:
        lines.append(
            f"  against the baseline: {len(result.failing)} new that count, {len(result.known)} known, "
            f"{result.gone} gone"
        )
        lines += [f"  new      {d.kind:<18} at {_place(d.where)}  {d.message}" for d in result.failing[:MOST_LINES]]
    return lines


def defect_lines(name: str, diagnosis: Diagnosis) -> list[str]:
    """The diagnosis of one file: a headline, the counts, the free-edge curve, then the defects, gravest first."""
    if diagnosis.clean:
        lines = [f"{name}: clean"]
    else:
        errors = sum(d.severity == "error" for d in diagnosis.defects)
        warnings = sum(d.severity == "warning" for d in diagnosis.defects)
        lines = [f"{name}: {_plural(errors, 'error')}, {_plural(warnings, 'warning')}"]
    lines += count_lines(diagnosis)
    rank = {"error": 0, "warning": 1, "info": 2}
    ordered = sorted(diagnosis.defects, key=lambda d: (rank[d.severity], -d.size))
    for defect in ordered[:MOST_LINES]:
        lines.append(f"  {defect.severity:<7} {defect.kind:<18} at {_place(defect.where)}  {defect.message}")
    if len(ordered) > MOST_LINES:
        lines.append(f"  and {len(ordered) - MOST_LINES} more; --json lists all")
    return lines


def count_lines(diagnosis: Diagnosis) -> list[str]:
    """The counts other tools tell as well, and how many free edges remain at which tolerance."""
    told = diagnosis.summary
    words = [f"{told[key]} {word}" for key, word in COUNTS if told.get(key) is not None]
    lines = [f"  {', '.join(words)}"] if words else []
    curve = told.get("free_edges_by_tolerance") or []
    if curve and curve[0]["free_edges"]:
        steps = ", ".join(f"{row['free_edges']} at {row['share']:.0e}" if row["share"] else str(row["free_edges"])
                          for row in curve)  # fmt: skip
        lines.append(f"  free edges by tolerance (shares of the diagonal): {steps}")
        lines.append(f"  {told['free_edge_reading']}")
    return lines + [f"  domain: {sentence}" for sentence in told.get("domain") or ()]


def plan_lines(plan: Plan) -> list[str]:
    """What a repair would do, item by item."""
    lines = [f"{plan.source}: {_plural(len(plan.items), 'change')} planned"]
    for item in plan.items:
        word = "rejected" if not item.accepted else "optional" if item.optional else ""
        place = "" if item.where is None else f" at {_place(item.where)}, {item.size:.3g} large"
        parts = f" ({', '.join(item.parts)})" if any(item.parts) else ""
        lines.append(f"  {item.id:<28} {item.rung:<10} {word:<8} {item.count:>8}{place}{parts}: {item.reason}")
    lines += [f"  domain: {sentence}" for sentence in plan.domain]
    lines += [f"  would be refused: {p.kind} at {_place(p.where)}: {p.message}" for p in plan.problems]
    return lines


def study_lines(study: Study) -> list[str]:
    """What a repair did, in at most a screenful."""
    lines = []
    repaired = study.repaired
    if repaired is None:
        if study.before is not None:
            lines += defect_lines(study.source, study.before)
    else:
        lines.append(f"{study.source}: {repaired.verdict.value}")
        for problem in repaired.problems[:MOST_LINES]:
            x, y, z = problem.where
            lines.append(f"  refused  {problem.kind} at ({x:.6g}, {y:.6g}, {z:.6g}): {problem.message}")
        for entry in repaired.ledger[:MOST_LINES]:
            parts = f" ({', '.join(entry.parts)})" if any(entry.parts) else ""
            reason = f": {entry.reason}" if entry.reason else ""
            lines.append(f"  {entry.rung.value:<24} {entry.count:>8} {entry.what}{parts}{reason}")
        if len(repaired.ledger) > MOST_LINES:
            lines.append(f"  and {len(repaired.ledger) - MOST_LINES} more entries in report.html")
        if repaired.deviation is not None:
            lines.append(f"  input -> output  {_spread(repaired.deviation.input_to_output)}")
            lines.append(f"  output -> input  {_spread(repaired.deviation.output_to_input)}")
        if repaired.verdict is not Verdict.REFUSED:
            lines.append(f"  invented surface {100.0 * repaired.invented:.3g} % of the area")
        for key, value in repaired.figures.items():
            lines.append(f"  {key:<28} {_short(value)}")
    if study.truth:
        lines.append("  against the known truth")
        lines += [f"    {key:<52} {_short(value)}" for key, value in study.truth.items()]
    if study.before is not None and repaired is not None:
        lines += [f"  domain: {sentence}" for sentence in study.before.summary.get("domain") or ()]
    lines += [f"  note: {note}" for note in study.notes]
    if study.files:
        lines.append(f"  written to {study.folder}/: {', '.join(study.files)}")
    lines.append(f"  {sum(r.seconds for r in study.reports):.1f} s")
    return lines


def study_json(study: Study) -> dict[str, Any]:
    """Everything a machine may want to know of a study."""
    out: dict[str, Any] = {
        "source": study.source,
        "unit": study.assembly.unit,
        "parts": list(study.assembly.names),
        "diagonal": study.assembly.diagonal,
        "tolerance": asdict(study.tolerance),
        "stages": [{"stage": r.stage, "seconds": round(r.seconds, 3), **r.figures} for r in study.reports],
        "files": list(study.files),
        "notes": list(study.notes),
    }
    if study.truth:
        out["truth"] = study.truth
    if study.before is not None:
        out["before"] = study.before.to_json()
    if study.repaired is not None:
        out.update(_repaired_json(study.repaired))
    plain: dict[str, Any] = _plain(out)
    return plain


def _repaired_json(repaired: Repaired) -> dict[str, Any]:
    return {
        "verdict": repaired.verdict.value,
        "invented": repaired.invented,
        "deviation": None if repaired.deviation is None else asdict(repaired.deviation),
        "figures": repaired.figures,
        "problems": [asdict(p) for p in repaired.problems],
        "ledger": [asdict(e) for e in repaired.ledger],
        "faces": [asdict(f) for f in repaired.faces],
        "seams": [asdict(s) for s in repaired.seams],
        "regions": [asdict(r) for r in repaired.regions],
    }


def _plain(value: Any) -> Any:
    """JSON knows no NaN, no infinity, no enums and no numpy scalars."""
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if hasattr(value, "item") and not isinstance(value, str):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return getattr(value, "value", value)


def _spread(spread: Spread) -> str:
    return (
        f"median {spread.median:.3g}, 99 % {spread.p99:.3g}, largest {spread.largest:.3g}, "
        f"{100.0 * spread.coverage:.2f} % within {spread.tolerance:.3g}"
    )


def _place(where: Any) -> str:
    x, y, z = where
    return f"({x:.6g}, {y:.6g}, {z:.6g})"


def _plural(count: int, word: str) -> str:
    return f"{count} {word}" if count == 1 else f"{count} {word}s"


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
