"""Find defects; mend with the least change; lay out, project, fill, fit, connect."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from patchwright.repair.diagnosing import diagnose
    from patchwright.repair.diagnosis import Defect, Diagnosis
    from patchwright.repair.domain import Domain
    from patchwright.repair.ladder import plan_repair, repair
    from patchwright.repair.plan import Plan
    from patchwright.repair.result import Repaired, Verdict

__all__ = ["Defect", "Diagnosis", "Domain", "Plan", "Repaired", "Verdict", "diagnose", "plan_repair", "repair"]

_HOMES = {
    "Defect": "diagnosis",
    "Diagnosis": "diagnosis",
    "Domain": "domain",
    "Plan": "plan",
    "Repaired": "result",
    "Verdict": "result",
    "diagnose": "diagnosing",
    "plan_repair": "ladder",
    "repair": "ladder",
}


def __getattr__(name: str) -> Any:
    """The public names, imported when first used."""
    if name not in _HOMES:
        raise AttributeError(f"module 'patchwright.repair' has no attribute {name!r}")
    return getattr(import_module(f"patchwright.repair.{_HOMES[name]}"), name)
