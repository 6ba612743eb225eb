"""Components: pieces that no edge connects."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import BoolArray
from patchwright.repair.checks.examination import Examination, corners_of
from patchwright.repair.checks.regions import plural, regional
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.diagnosis import Defect, Severity

STRAY = 1e-3  # of the area: a smaller open piece is a leftover


@check("components", looks="mesh", kinds=("component",))
def components(exam: Examination) -> Finding:
    """One fact per component when there are several; a tiny open one is a warning."""
    figures: dict[str, object] = {"components": int(_before(exam)), "parts": len(exam.assembly.parts)}
    if not len(exam.body):
        return Finding(figures=figures)
    label, closed = exam.component, exam.component_closed
    figures["components_after_welding"] = len(closed)
    figures["closed_components"] = int(np.count_nonzero(closed))
    if len(closed) == 1:
        return Finding(figures=figures)
    area = np.bincount(label, weights=exam.areas)
    outer = np.bincount(label, weights=exam.surroundings.aside[exam.body_index]) > 0
    stray = (area < STRAY * area[~outer].sum()) & ~closed & ~outer
    defects: list[Defect] = []
    cases: tuple[tuple[BoolArray, Severity, str], ...] = (
        (stray, "warning", "a small open piece, connected to nothing"),
        (~stray & closed, "info", "a closed component"),
        (~stray & ~closed, "info", "an open component, connected to nothing else by an edge"),
    )
    for which, severity, what in cases:
        index = np.flatnonzero(which[label])

        def say(count: int, size: float, what: str = what) -> str:
            return f"{what}: {plural(count, 'triangle')}, {exam.length(size)} large"

        own = np.unique(label[index], return_inverse=True)[1].astype(np.int64)
        defects += regional(
            exam, "component", severity, exam.body.triangles[index], corners_of(exam.body, index),
            exam.body_index[index], say, labels=own,
        )  # fmt: skip
    return Finding(tuple(defects), figures)


def _before(exam: Examination) -> int:
    """Components before any weld but that of equal coordinates."""
    labels = exam.adjacency.components()
    return int(np.max(labels, initial=-1)) + 1
