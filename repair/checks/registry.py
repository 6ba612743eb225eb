"""The registry of checks: what each looks at, and the kinds of defect it may find."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, Literal

from patchwright.repair.checks.examination import Examination
from patchwright.repair.diagnosis import Defect

Looks = Literal["mesh", "cad", "any"]


@dataclass(frozen=True, slots=True, eq=False)
class Finding:
    """What one check found: its defects, and figures for the summary."""

    defects: tuple[Defect, ...] = ()
    figures: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Check:
    """A named check; `looks` says whether it applies to triangulations, to CAD faces or to both."""

    name: str
    looks: Looks
    kinds: tuple[str, ...]
    run: Callable[[Examination], Finding]


_REGISTRY: dict[str, Check] = {}

# the modules in the order their checks run
_MODULES = (
    "edges",
    "junctions",
    "faces",
    "orientation",
    "components",
    "rims",
    "crossings",
    "layers",
    "thin",
    "domain",
    "cad",
    "cad_rims",
    "cad_crossings",
    "parametrisation",
)


def check(
    name: str, *, looks: Looks, kinds: tuple[str, ...]
) -> Callable[[Callable[[Examination], Finding]], Callable[[Examination], Finding]]:
    """Register a check."""

    def register(run: Callable[[Examination], Finding]) -> Callable[[Examination], Finding]:
        _REGISTRY[name] = Check(name, looks, kinds, run)
        return run

    return register


def checks() -> tuple[Check, ...]:
    """All checks, in order."""
    for module in _MODULES:
        import_module(f"patchwright.repair.checks.{module}")
    return tuple(_REGISTRY.values())
