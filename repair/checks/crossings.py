"""Crossings: surfaces that pass through each other or themselves, and bodies that overlap."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import IntArray
from patchwright.repair.checks.examination import Examination, box_of
from patchwright.repair.checks.regions import MOST, plural, regional
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.diagnosis import Defect


@check("crossings", looks="mesh", kinds=("self-intersection", "overlap"))
def crossings(exam: Examination) -> Finding:
    """Pairs of triangles that cross: an overlap when of two bodies, a self-intersection otherwise."""
    pairs = exam.crossing_pairs
    faces = np.unique(pairs)
    figures: dict[str, object] = {"self_intersecting_faces": len(faces), "crossing_pairs": len(pairs), "overlaps": 0}
    if not len(pairs):
        return Finding(figures=figures)
    label = exam.component[pairs]
    bodies = (label[:, 0] != label[:, 1]) & exam.bodies[label].all(axis=1)
    overlaps = _overlaps(exam, pairs[bodies])
    figures["overlaps"] = len(overlaps)
    return Finding((*_self(exam, pairs[~bodies]), *overlaps[:MOST]), figures)


def _self(exam: Examination, pairs: IntArray) -> list[Defect]:
    """One defect per connected region of crossing triangles."""
    index, local = np.unique(pairs, return_inverse=True)
    body = exam.body

    def say(count: int, size: float) -> str:
        return f"{plural(count, 'triangle')} pass through each other, over {exam.length(size)}"

    return regional(
        exam,
        "self-intersection",
        "error",
        body.triangles[index],
        body.corners[index],
        exam.body_index[index],
        say,
        links=local.reshape(-1, 2).astype(np.int64),
    )


def _overlaps(exam: Examination, pairs: IntArray) -> list[Defect]:
    """One defect per pair of bodies that cross."""
    if not len(pairs):
        return []
    label = np.sort(exam.component[pairs], axis=1)
    count = len(exam.component_closed)
    key = label[:, 0] * count + label[:, 1]
    order = np.argsort(key, kind="stable")
    corners = exam.body.corners
    found = []
    for own in np.split(order, np.flatnonzero(np.diff(key[order])) + 1):
        faces = np.unique(pairs[own])
        box = box_of(corners[faces])
        size = float(np.linalg.norm(box[1] - box[0]))
        a, b = label[own[0]]
        triangles = exam.body_index[faces]
        message = f"bodies {a + 1} and {b + 1} cross along {plural(len(faces), 'triangle')}"
        found.append(
            Defect("overlap", "error", box.mean(axis=0), size, exam.parts_of(triangles), len(faces), message, box)
        )
    return sorted(found, key=lambda defect: -defect.size)
