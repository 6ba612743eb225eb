"""`patchwright demo`: a dirty aircraft made in code, repaired like any file, and held against the known truth."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

from patchwright.models.io import write
from patchwright.pipelines.outputs import prepare_folder
from patchwright.pipelines.progress import Terminal
from patchwright.pipelines.recipe import Recipe, repair_recipe
from patchwright.pipelines.report import write_report
from patchwright.pipelines.run import run
from patchwright.pipelines.study import StageReport, Study
from patchwright.pipelines.truth import against_injected, against_truth
from patchwright.pipelines.warm import start

INPUT = "dirty.stl"


def run_demo(folder: Path, *, seed: int = 1, terminal: Terminal | None = None) -> Study:
    """Make the aircraft, write it as `dirty.stl`, run the recipe of `repair` on it, compare, report."""
    from patchwright.models.samples import demo_aircraft

    shown = terminal or Terminal(quiet=True)
    prepare_folder(folder)
    if terminal is not None:
        start(terminal)
    started = time.perf_counter()
    with shown.stage("sample") as report:
        report("making a dirty aircraft", 0.2)
        dirty = demo_aircraft(seed)
        write(folder / INPUT, dirty.assembly)
    made = StageReport("sample", time.perf_counter() - started)
    plan = repair_recipe(folder / INPUT, folder)
    study = run(Recipe(plan.source, folder, plan.steps[:-1]), assembly=dirty.assembly, terminal=shown)
    started = time.perf_counter()
    with shown.stage("truth") as report:
        report("comparing with the truth", 0.3)
        truth: dict[str, object] = {}
        if study.repaired is not None and study.before is not None:
            jitter = max((i.size for i in dirty.defects if i.kind == "open-edge"), default=study.tolerance.gap)
            truth.update(against_truth(study.repaired, dirty.truth, study.assembly.diagonal))
            truth.update(against_injected(dirty.defects, study.before, study.repaired, jitter))
    compared = StageReport("truth", time.perf_counter() - started)
    study = replace(study, truth=truth, files=(INPUT, *study.files), reports=(made, *study.reports, compared))
    with shown.stage("report") as report:
        files = write_report(study, report)
    return replace(study, files=study.files + files)
