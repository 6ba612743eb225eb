"""Crossings: surfaces that pass through each other or themselves, and bodies that overlap."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import IntArray
from patchwright.repair.checks.crossing_curves import crossing_curves, total_length
from patchwright.repair.checks.examination import Examination, box_of, corners_of
from patchwright.repair.checks.regions import MOST, plural, region_labels, regional
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
    left = pairs[~bodies & ~exam.run_past(label)]
    return Finding((*_self(exam, left), *overlaps[:MOST]), figures)


def _self(exam: Examination, pairs: IntArray) -> list[Defect]:
    """One defect per connected region of crossing triangles, with the curves they cross in."""
    if not len(pairs):
        return []
    index, local = np.unique(pairs, return_inverse=True)
    body = exam.body
    links = local.reshape(-1, 2).astype(np.int64)
    label = region_labels(body.triangles[index], links)
    curves = crossing_curves(body, pairs, label[links[:, 0]])

    def say(count: int, size: float) -> str:
        return f"{plural(count, 'triangle')} pass through each other, over {exam.length(size)}"

    found = regional(
        exam,
        "self-intersection",
        "error",
        body.triangles[index],
        corners_of(body, index),
        exam.body_index[index],
        say,
        labels=label,
        curves=curves,
    )
    return [_along(exam, defect) for defect in found]


def _along(exam: Examination, defect: Defect) -> Defect:
    """The same defect with its curves' number and length in its message."""
    if not defect.curves:
        return defect
    length = exam.length(total_length(defect.curves))
    words = f"along {plural(len(defect.curves), 'curve')}, {length} long"
    return replace(defect, message=f"{defect.message}, {words}")


def _overlaps(exam: Examination, pairs: IntArray) -> list[Defect]:
    """One defect per pair of bodies that cross, with the curves they cross in."""
    if not len(pairs):
        return []
    label = np.sort(exam.component[pairs], axis=1)
    count = len(exam.component_closed)
    which = np.unique(label[:, 0] * count + label[:, 1], return_inverse=True)[1].reshape(-1)
    curves = crossing_curves(exam.body, pairs, which)
    order = np.argsort(which, kind="stable")
    found = []
    for own in np.split(order, np.flatnonzero(np.diff(which[order])) + 1):
        faces = np.unique(pairs[own])
        box = box_of(corners_of(exam.body, faces))
        size = float(np.linalg.norm(box[1] - box[0]))
        a, b = label[own[0]]
        parts = exam.parts_of(exam.body_index[faces])
        message = f"bodies {a + 1} and {b + 1} cross along {plural(len(faces), 'triangle')}"
        defect = Defect(
            "overlap", "error", box.mean(axis=0), size, parts, len(faces), message, box, curves=curves[which[own[0]]]
        )
        found.append(_along(exam, defect))
    return sorted(found, key=lambda defect: -defect.size)
