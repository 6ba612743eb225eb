"""Plans on disk: made by a dry run, edited by a reviewer, followed by a repair."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from patchwright.models.errors import CorruptFile, ParameterError
from patchwright.models.io.atomic import replacing
from patchwright.pipelines.progress import Terminal
from patchwright.repair.plan import Plan
from patchwright.repair.result import Repaired

if TYPE_CHECKING:
    from patchwright.pipelines.recipe import Recipe


def run_plan(recipe: Recipe, *, write: Path | None = None, terminal: Terminal | None = None) -> Plan:
    """What the recipe's repair would do; a plan the recipe names lends its rejections.

    Raises
    ------
    GeometryError : as `run`. ParameterError : the plan cannot be written, the recipe repairs nothing.
    """
    from patchwright.pipelines.run import begin
    from patchwright.pipelines.stages import STAGES
    from patchwright.repair import plan_repair
    from patchwright.repair.plan import with_rejections

    shown = terminal or Terminal(quiet=True)
    study = begin(recipe, None, shown)
    step = next((step for step in recipe.steps if step.name == "repair"), None)
    if step is None:
        raise ParameterError("the recipe has no repair stage: there is nothing to plan")
    options = STAGES["repair"].settings(step.options)
    with shown.stage("plan") as report:
        made = plan_repair(
            study.assembly,
            scope=options["scope"],
            openings=options["openings"],
            time_limit=options["time_limit"],
            tolerance=study.tolerance,
            domain=study.domain,
            progress=report,
        )
    made = replace(made, source=study.source)
    if study.plan is not None:
        made = with_rejections(made, study.plan)
    if write is not None:
        with replacing(write) as beside:
            beside.write_text(json.dumps(made.to_json(), indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return made


def load_plan(path: Path, reject: Sequence[str] = ()) -> Plan:
    """Read a plan, with more items rejected by their ids.

    Raises
    ------
    CorruptFile : no such file, or not a plan. ParameterError : an id the plan does not have.
    """
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise CorruptFile(f"{path}: no such plan; make one with --dry-run --write-plan {path}") from None
    except (OSError, ValueError) as error:
        raise CorruptFile(f"{path}: is no plan of patchwright ({error}); make one with --dry-run") from None
    plan = Plan.from_json(table, str(path))
    unknown = sorted(set(reject) - {item.id for item in plan.items})
    if unknown:
        raise ParameterError(f"{path}: has no item {', '.join(unknown)}; list them with --dry-run")
    for item in plan.items:
        if item.id in reject and not item.optional:
            raise ParameterError(f"{path}: item {item.id} cannot be rejected, later steps stand on it")
    return replace(plan, items=tuple(replace(i, accepted=i.accepted and i.id not in reject) for i in plan.items))


def against_plan(plan: Plan, repaired: Repaired) -> str:
    """How a repair kept to its plan, in one sentence."""
    missing = sum("not met" in e.what for e in repaired.ledger)
    beside = sum(e.what.endswith("beside the plan") for e in repaired.ledger)
    told = f"the plan's {len(plan.items)} items ({len(plan.rejected)} rejected) were followed"
    if not missing and not beside:
        return told
    return f"{told}; {missing} were not met and {beside} changes are not in it: see the ledger"
