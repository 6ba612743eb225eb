"""`Study`: what travels from stage to stage, each stage adding its own artefact."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from patchwright.models.assembly import Assembly
from patchwright.models.tolerance import Tolerance
from patchwright.repair.diagnosis import Diagnosis
from patchwright.repair.domain import Domain
from patchwright.repair.plan import Plan
from patchwright.repair.result import Repaired


@dataclass(frozen=True, slots=True, eq=False)
class StageReport:
    """One stage's name, wall-clock seconds and figures."""

    stage: str
    seconds: float
    figures: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """One model on its way through a recipe.

    `source` is the file (or "demo"); `folder` is where outputs go; `assembly` what was read; `domain` and `plan`
    what the user says about the flow domain and about single changes; `before` and `after` the diagnoses of input and
    output; `files` what has been written; `truth` the comparison with the known shape of a sample.
    """

    source: str
    folder: Path
    assembly: Assembly
    tolerance: Tolerance
    domain: Domain | None = None
    plan: Plan | None = None
    before: Diagnosis | None = None
    repaired: Repaired | None = None
    after: Diagnosis | None = None
    files: tuple[str, ...] = ()
    reports: tuple[StageReport, ...] = ()
    notes: tuple[str, ...] = ()
    truth: dict[str, Any] = field(default_factory=dict)
