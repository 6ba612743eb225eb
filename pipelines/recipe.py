"""Recipes: a TOML file that names the source, the folder and the stages, and the default recipe of `repair`.

source = "wing.stl"
folder = "wing-patchwright"
tolerance = 0.001        # fit tolerance, model units; left out: 1e-4 of the diagonal

plan = "plan.json"       # a reviewed plan; its rejected items are left out

[domain]                 # what is left out is guessed, with reasons
far_field = ["box"]
symmetry = "y"
fluid = [0.0, 0.0, 5.0]
gaps.flap = "keep"       # a slot is no panel gap

[[stage]]
name = "repair"
openings = "close"
time_limit = 600         # seconds after which nothing new is begun on CAD faces
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from patchwright.models.errors import CorruptFile, ParameterError
from patchwright.repair.domain import Domain

_TOP_LEVEL = {"source", "folder", "tolerance", "unit", "domain", "plan", "stage"}


@dataclass(frozen=True, slots=True)
class Step:
    """One stage of a recipe with its options."""

    name: str
    options: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Recipe:
    """What to read, where to write, and the stages in order; `reject` are ids of items of `plan`, besides its own."""

    source: Path
    folder: Path
    steps: tuple[Step, ...]
    tolerance: float | None = None
    unit: str | None = None
    domain: Domain | None = None
    plan: Path | None = None
    reject: tuple[str, ...] = ()


def default_folder(source: Path) -> Path:
    """`<stem>-patchwright` in the working folder; a ".gz" is dropped with the suffix before it."""
    stem = source.name
    for _ in range(2 if stem.lower().endswith(".gz") else 1):
        stem = Path(stem).stem
    return Path(f"{stem}-patchwright")


def repair_recipe(
    source: Path,
    folder: Path | None,
    *,
    scope: str = "least",
    openings: str = "keep",
    layout: str = "auto",
    time_limit: float = 600.0,
    tolerance: float | None = None,
    domain: Domain | None = None,
    plan: Path | None = None,
    reject: tuple[str, ...] = (),
) -> Recipe:
    """What `patchwright repair` does."""
    steps = (
        Step("diagnose", {}),
        Step("repair", {"scope": scope, "openings": openings, "layout": layout, "time_limit": time_limit}),
        Step("write", {}),
        Step("pictures", {}),
        Step("report", {}),
    )
    place = folder or default_folder(source)
    return Recipe(source, place, steps, tolerance, domain=domain, plan=plan, reject=reject)


def load_recipe(path: Path) -> Recipe:
    """Read a recipe; relative paths in it are taken from the recipe's own folder.

    Raises
    ------
    CorruptFile : not TOML. ParameterError : a key or stage that does not exist, no source, no stage.
    """
    import tomllib

    from patchwright.pipelines.stages import AUTO, STAGES

    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise CorruptFile(f"{path}: no such recipe") from None
    except IsADirectoryError:
        raise CorruptFile(f"{path}: is a folder, not a recipe") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError) as error:
        raise CorruptFile(f"{path}: cannot be read as TOML: {error}") from None
    unknown = sorted(set(table) - _TOP_LEVEL)
    if unknown:
        raise ParameterError(f"{path}: unknown key {', '.join(unknown)}; known are {', '.join(sorted(_TOP_LEVEL))}")
    if not isinstance(table.get("source"), str):
        raise ParameterError(f'{path}: needs a line source = "file"')
    stages = table.get("stage", [])
    if not isinstance(stages, list) or not stages:
        raise ParameterError(f"{path}: needs at least one [[stage]]; known are {', '.join(STAGES)}")
    steps = []
    for i, entry in enumerate(stages, start=1):
        options = {k: v for k, v in entry.items() if k != "name"}
        if entry.get("name") not in STAGES:
            raise ParameterError(f"{path}: stage {i} is {entry.get('name')!r}; known are {', '.join(STAGES)}")
        STAGES[entry["name"]].settings(options)
        if options.get("layout", AUTO) != AUTO:
            options["layout"] = str(path.parent / str(options["layout"]))
        steps.append(Step(entry["name"], options))
    tolerance = table.get("tolerance")
    if tolerance is not None and not (isinstance(tolerance, int | float) and tolerance > 0):
        raise ParameterError(f"{path}: tolerance must be a positive length, got {tolerance!r}")
    source = path.parent / table["source"]
    folder = path.parent / table["folder"] if "folder" in table else path.parent / default_folder(source)
    domain = None
    if "domain" in table:
        try:
            domain = Domain.from_table(table["domain"])
        except ParameterError as error:
            raise ParameterError(f"{path}: {error}") from None
    plan = path.parent / table["plan"] if "plan" in table else None
    return Recipe(source, folder, tuple(steps), tolerance, table.get("unit"), domain, plan)
