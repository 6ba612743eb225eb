"""The stages a recipe is made of; each maps (study, options) to (study, figures) and is found by its name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from patchwright.models.errors import ParameterError
from patchwright.pipelines.progress import Report
from patchwright.pipelines.study import Study

if TYPE_CHECKING:
    from patchwright.repair.layout.quad_layout import QuadLayout

Outcome = tuple[Study, dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Stage:
    """A named step; `options` are the names it understands, with their defaults."""

    name: str
    action: Callable[[Study, dict[str, Any], Report], Outcome]
    options: dict[str, Any]

    def settings(self, given: dict[str, Any]) -> dict[str, Any]:
        """The defaults with the given options put over them.

        Raises
        ------
        ParameterError : an option the stage does not know.
        """
        unknown = sorted(set(given) - set(self.options))
        if unknown:
            known = ", ".join(sorted(self.options)) or "none"
            raise ParameterError(f"stage {self.name!r} has no option {', '.join(map(repr, unknown))}; it has: {known}")
        return {**self.options, **given}


def _diagnose(study: Study, options: dict[str, Any], report: Report) -> Outcome:
    from patchwright.repair import diagnose

    report("diagnosing", 0.0)
    before = diagnose(study.assembly, tolerance=study.tolerance, domain=study.domain, progress=report)
    return replace(study, before=before), {"defects": len(before.defects), "clean": before.clean}


def _repair(study: Study, options: dict[str, Any], report: Report) -> Outcome:
    from patchwright.pipelines.planning import against_plan
    from patchwright.repair import repair

    repaired = repair(
        study.assembly,
        scope=options["scope"],
        openings=options["openings"],
        layout=_layout(options["layout"], study),
        tolerance=study.tolerance,
        domain=study.domain,
        plan=study.plan,
        diagnosis=study.before,
        time_limit=_seconds(options["time_limit"]),
        progress=report,
    )
    notes = study.notes if study.plan is None else (*study.notes, against_plan(study.plan, repaired))
    figures = {"verdict": repaired.verdict.value, "faces": len(repaired.faces)}
    return replace(study, repaired=repaired, notes=notes), figures


def _seconds(wanted: Any) -> float:
    """A time limit as given by a recipe."""
    if isinstance(wanted, bool) or not isinstance(wanted, int | float) or not wanted > 0:
        raise ParameterError(f"time_limit must be a positive number of seconds, got {wanted!r}")
    return float(wanted)


def _layout(wanted: str, study: Study) -> QuadLayout | list[Any] | str:
    """The layout of a file, the patches of a list of patches, or "auto"."""
    from patchwright.pipelines.patch_list import load_patches
    from patchwright.repair.layout.layout_file import load_layout

    if wanted == AUTO:
        return wanted
    if not wanted.lower().endswith(".toml"):
        return load_layout(wanted)
    patches = load_patches(Path(wanted), study.assembly, study.tolerance.fit).patches
    return [[p.sides.south.curve, p.sides.east.curve, p.sides.north.curve, p.sides.west.curve] for p in patches]


def _write(study: Study, options: dict[str, Any], report: Report) -> Outcome:
    from patchwright.pipelines.outputs import write_outputs

    files = write_outputs(study, tuple(options["files"]), report)
    return replace(study, files=study.files + files), {"files": list(files)}


def _pictures(study: Study, options: dict[str, Any], report: Report) -> Outcome:
    from patchwright.pipelines.pictures import draw

    files, notes = draw(study, report)
    return replace(study, files=study.files + files, notes=study.notes + notes), {"files": list(files)}


def _report(study: Study, options: dict[str, Any], report: Report) -> Outcome:
    from patchwright.pipelines.report import write_report

    files = write_report(study, report)
    return replace(study, files=study.files + files), {"files": list(files)}


AUTO = "auto"
SECONDS = 600.0  # default time limit of a repair that keeps CAD faces
GEOMETRY_FILES = ("repaired.step", "repaired.igs", "repaired.stl", "grid.xyz", "layout.json")

STAGES: dict[str, Stage] = {
    stage.name: stage
    for stage in (
        Stage("diagnose", _diagnose, {}),
        Stage("repair", _repair, {"scope": "least", "openings": "keep", "layout": AUTO, "time_limit": SECONDS}),
        Stage("write", _write, {"files": GEOMETRY_FILES}),
        Stage("pictures", _pictures, {}),
        Stage("report", _report, {}),
    )
}
