"""`diagnose`: what is wrong with a model, in the words its users know, with coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from patchwright.models.assembly import Assembly
from patchwright.models.errors import ParameterError
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation
from patchwright.repair.checks.bare_faces import completed
from patchwright.repair.checks.examination import Examination
from patchwright.repair.checks.registry import checks
from patchwright.repair.diagnosis import KINDS, Defect, Diagnosis
from patchwright.repair.domain import Domain
from patchwright.repair.fingerprint import labels
from patchwright.repair.surroundings import surroundings

Progress = Callable[[str, float], None]

_RANK = {"error": 0, "warning": 1, "info": 2}


def diagnose(
    assembly: Assembly | Triangulation,
    *,
    tolerance: Tolerance | float | None = None,
    domain: Domain | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Examine a model; nothing is changed.

    Parameters
    ----------
    assembly : what `read` returned, or a triangulation
    tolerance : a `Tolerance`, or the fit tolerance as a length; default born from the size of the model without its
        far field
    domain : what is known of the flow domain; the rest is guessed, and `summary["domain"]` says why
    progress : called with a check's name and a share in [0, 1]

    Returns
    -------
    Diagnosis; `clean` when nothing is worse than "info". An opening (a rim the surface does not go on across) is a
    "warning": repair keeps it, and `check` still says that the model is open, because only its owner knows whether it
    is meant to be. Facts (several closed bodies, cavities, thin places, a symmetry plane) are "info".

    Raises
    ------
    ParameterError : nothing to examine: no triangles and no faces; a domain that names what is not there.
    """
    model = Assembly.of(assembly) if isinstance(assembly, Triangulation) else assembly
    if not model.parts or not (model.is_cad or any(len(part.triangulation) for part in model.parts)):
        raise ParameterError(
            f"{model.source or 'the assembly'} holds no triangles and no faces: there is nothing to diagnose"
        )
    model = completed(model)
    around = surroundings(model, domain)
    limits = tolerance if isinstance(tolerance, Tolerance) else Tolerance.of(around.body_size(model), fit=tolerance)
    exam = Examination(model, limits, around)
    looks = "cad" if model.is_cad else "mesh"
    todo = [check for check in checks() if check.looks in (looks, "any")]
    defects: list[Defect] = []
    summary: dict[str, Any] = {"unit": model.unit, "diagonal": exam.diagonal, "parts": len(model.parts)}
    for i, check in enumerate(todo):
        if progress is not None:
            progress(check.name, i / len(todo))
        finding = check.run(exam)
        defects += finding.defects
        summary.update(finding.figures)
    return Diagnosis(_ordered(defects, exam.diagonal), summary)


def _ordered(defects: list[Defect], diagonal: float) -> tuple[Defect, ...]:
    """Gravest first, then by kind, then largest first; with their ids."""
    ranked = sorted(defects, key=lambda d: (_RANK[d.severity], KINDS.index(d.kind), -d.size, -d.count))
    names = labels([d.fingerprint for d in ranked], diagonal)
    return tuple(replace(defect, id=name) for defect, name in zip(ranked, names, strict=True))
