"""Faces: doubled, degenerate and needle triangles."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.checks.examination import Examination, two_corners
from patchwright.repair.checks.regions import plural, regional
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.diagnosis import Defect, Severity

NEEDLE = 1000.0  # longest edge to height over it


@check("faces", looks="mesh", kinds=("duplicate-face", "degenerate-face", "needle"))
def faces(exam: Examination) -> Finding:
    """Triangles that are there twice, have no area, or are a thousand times longer than high.

    A degenerate triangle has a corner used twice, or a height below the rounding of its own coordinates.
    """
    points, corners = exam.raw.vertices, exam.raw.triangles.T
    sides = [
        np.linalg.norm(points[a] - points[b], axis=1)
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    longest = np.maximum(np.maximum(sides[0], sides[1]), sides[2])
    area = exam.raw.areas
    height = np.divide(2.0 * area, longest, out=np.zeros_like(area), where=longest > 0.0)
    collapsed = two_corners(exam.merged.triangles)
    flat = exam.flat
    welded_away = exam.collapsed & ~collapsed & ~flat
    needle = (longest > NEEDLE * height) & ~collapsed & ~flat & ~welded_away

    defects = [
        *_found(exam, "duplicate-face", "error", exam.duplicate, "that repeat others over the same three vertices"),
        *_found(exam, "degenerate-face", "warning", collapsed | flat, "without area"),
        *_found(exam, "degenerate-face", "warning", welded_away, "that welding collapses to an edge or a point"),
        *_found(exam, "needle", "warning", needle, f"more than {NEEDLE:.0f} times longer than high"),
    ]
    figures = {
        "triangles": len(exam.raw),
        "duplicate_faces": int(np.count_nonzero(exam.duplicate)),
        "collapsed_faces": int(np.count_nonzero(collapsed)),
        "zero_area_faces": int(np.count_nonzero(flat)),
        "needles": int(np.count_nonzero(needle)),
        "area": float(area.sum()),
    }
    return Finding(tuple(defects), figures)


def _found(exam: Examination, kind: str, severity: Severity, which: BoolArray, what: str) -> list[Defect]:
    index: IntArray = np.flatnonzero(which)
    points: Array = exam.raw.vertices[exam.raw.triangles[index]]

    def say(count: int, size: float) -> str:
        return f"{plural(count, 'triangle')} {what}, over {exam.length(size)}"

    return regional(exam, kind, severity, exam.welded.triangles[index], points, index, say)
