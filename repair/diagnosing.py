"""`diagnose`: what is wrong with a model, in the words its users know, with coordinates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from patchwright.models.assembly import Assembly
from patchwright.models.errors import ParameterError
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation
from patchwright.repair.checks.examination import Examination
from patchwright.repair.checks.registry import checks
from patchwright.repair.diagnosis import KINDS, Defect, Diagnosis

Progress = Callable[[str, float], None]

_RANK = {"error": 0, "warning": 1, "info": 2}


def diagnose(
    assembly: Assembly | Triangulation,
    *,
    tolerance: Tolerance | float | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Examine a model; nothing is changed.

    Parameters
    ----------
    assembly : what `read` returned, or a triangulation
    tolerance : a `Tolerance`, or the fit tolerance as a length; default born from the model's size
    progress : called with a check's name and a share in [0, 1]

    Returns
    -------
    Diagnosis; `clean` when nothing is worse than "info". An opening (a rim the surface does not go on across) is a
    "warning": repair keeps it, and `check` still says that the model is open, because only its owner knows whether it
    is meant to be. Facts (several closed bodies, cavities, thin places, a symmetry plane) are "info".

    Raises
    ------
    ParameterError : nothing to examine: no triangles and no faces.
    """
    model = Assembly.of(assembly) if isinstance(assembly, Triangulation) else assembly
    if not model.parts or not (model.is_cad or any(len(part.triangulation) for part in model.parts)):
        raise ParameterError(
            f"{model.source or 'the assembly'} holds no triangles and no faces: there is nothing to diagnose"
        )
    limits = tolerance if isinstance(tolerance, Tolerance) else Tolerance.of(model, fit=tolerance)
    exam = Examination(model, limits)
    looks = "cad" if model.is_cad else "mesh"
    todo = [check for check in checks() if check.looks in (looks, "any")]
    defects: list[Defect] = []
    summary: dict[str, Any] = {"unit": model.unit, "diagonal": model.diagonal, "parts": len(model.parts)}
    for i, check in enumerate(todo):
        if progress is not None:
            progress(check.name, i / len(todo))
        finding = check.run(exam)
        defects += finding.defects
        summary.update(finding.figures)
    return Diagnosis(_ordered(defects), summary)


def _ordered(defects: list[Defect]) -> tuple[Defect, ...]:
    """Gravest first, then by kind, then largest first; with their ids."""
    ranked = sorted(defects, key=lambda d: (_RANK[d.severity], KINDS.index(d.kind), -d.size, -d.count))
    seen: Counter[str] = Counter()
    named = []
    for defect in ranked:
        seen[defect.kind] += 1
        named.append(replace(defect, id=f"{defect.kind}-{seen[defect.kind]}"))
    return tuple(named)
