"""Parametrisation: CAD faces whose parameter lines are spaced very unevenly, or collapse."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Part
from patchwright.repair.checks.examination import Examination, box_of
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.diagnosis import Defect, Severity
from patchwright.reparam.defect import parametrisation_defect, steps

UNEVEN = 1.0  # defect above which a face is mentioned: some step is twice as long as its share, or has no length
POOR = 5.0  # defect above which a grid on the face's own parameters is of no use


@check("parametrisation", looks="cad", kinds=("parametrisation",))
def parametrisation(exam: Examination) -> Finding:
    """Defect measure of every face, over the parameters its tessellation covers."""
    defects, worst = [], 0.0
    for i, part in enumerate(exam.assembly.parts):
        box = _parameters(part)
        if part.surface is None or box is None:
            continue
        measure = parametrisation_defect(part.surface, box)
        worst = max(worst, measure)
        if measure <= UNEVEN:
            continue
        severity: Severity = "warning" if measure > POOR else "info"
        extent = box_of(part.triangulation.corners if len(part.triangulation) else part.surface(*steps(box)))
        size = float(np.linalg.norm(extent[1] - extent[0]))
        name = part.name or f"face {i + 1}"
        message = (
            f"{name} (face {i + 1}) has uneven parameter lines: a step is up to {1.0 + measure:.3g} times its share"
        )
        defects.append(Defect("parametrisation", severity, extent.mean(axis=0), size, (part.name,), 1, message, extent))
    return Finding(tuple(defects), {"largest_parametrisation_defect": worst})


def _parameters(part: Part) -> Array | None:
    """The box of (u, v) a face covers."""
    if part.surface is None:
        return None
    if part.triangulation.uv is not None and len(part.triangulation):
        uv = part.triangulation.uv.reshape(-1, 2)
        box = np.stack([uv.min(axis=0), uv.max(axis=0)], axis=1)
    else:
        box = np.asarray(part.surface.domain, dtype=np.float64)
    return box if np.isfinite(box).all() and (box[:, 1] > box[:, 0]).all() else None
