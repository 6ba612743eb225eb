"""`run`: a recipe from file to folder."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

from patchwright.models.assembly import Assembly
from patchwright.models.errors import ParameterError
from patchwright.pipelines.planning import load_plan
from patchwright.pipelines.progress import Terminal
from patchwright.pipelines.recipe import Recipe, load_recipe
from patchwright.pipelines.stages import STAGES
from patchwright.pipelines.study import StageReport, Study
from patchwright.pipelines.warm import start
from patchwright.repair.ladder import fit_tolerance
from patchwright.repair.surroundings import surroundings


def run(recipe: Recipe | Path | str, *, assembly: Assembly | None = None, terminal: Terminal | None = None) -> Study:
    """Run a recipe.

    Parameters
    ----------
    recipe : a `Recipe` or the path of one
    assembly : taken instead of reading the recipe's source
    terminal : where progress is shown; None is silent

    Returns
    -------
    Study : every stage's artefact; `.files` lists what was written.

    Raises
    ------
    GeometryError : unreadable input, an option without meaning. A refusal raises nothing: see `.repaired.verdict`.
    """
    task = recipe if isinstance(recipe, Recipe) else load_recipe(Path(recipe))
    shown = terminal or Terminal(quiet=True)
    study = begin(task, assembly, shown)
    if terminal is not None:
        start(terminal)  # not before the input is known to be good
    for step in task.steps:
        stage = STAGES[step.name]
        options = stage.settings(step.options)
        started = time.perf_counter()
        with shown.stage(step.name) as report:
            study, figures = stage.action(study, options, report)
        seconds = time.perf_counter() - started
        study = replace(study, reports=(*study.reports, StageReport(step.name, seconds, figures)))
    return study


def begin(task: Recipe, assembly: Assembly | None, shown: Terminal) -> Study:
    """Read the source (unless the assembly is given) and resolve what every stage needs.

    Raises
    ------
    GeometryError : unreadable input, nothing to work on, a domain or plan without meaning.
    """
    known = None if task.plan is None else load_plan(task.plan, task.reject)
    started = time.perf_counter()
    if assembly is None:
        from patchwright.models.io import read

        with shown.stage("read") as report:
            report("reading", 0.0)
            assembly = read(task.source, unit=task.unit)
    count = sum(len(part.triangulation) for part in assembly.parts)
    if count == 0:
        raise ParameterError(f"{task.source}: holds no faces and no triangles; there is nothing to work on")
    if count == 1 and not assembly.is_cad:
        raise ParameterError(f"{task.source}: holds a single triangle; a surface to repair needs more than that")
    around = surroundings(assembly, task.domain)
    return Study(
        str(task.source),
        task.folder,
        assembly,
        fit_tolerance(assembly, around, task.tolerance),
        domain=task.domain,
        plan=known,
        reports=(StageReport("read", time.perf_counter() - started),),
    )
