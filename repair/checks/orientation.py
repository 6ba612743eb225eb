"""Orientation: triangles that run against their neighbours, bodies turned inside out, one-sided surfaces."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import BoolArray, IntArray
from patchwright.repair.checks.examination import Examination, box_of, corners_of
from patchwright.repair.checks.regions import plural, regional
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.diagnosis import Defect, Severity
from patchwright.repair.mender.untangle import winding


@check("orientation", looks="mesh", kinds=("flipped",))
def orientation(exam: Examination) -> Finding:
    """The triangles a consistent, outward orientation would reverse, zone by zone."""
    if not len(exam.body):
        return Finding(figures={"inconsistent_edges": 0, "orientation_zones": 0, "flipped_faces": 0, "volume": 0.0})
    oriented = exam.oriented
    component, flipped = oriented.components, oriented.flipped
    parts = int(component.max()) + 1
    total = np.bincount(component, minlength=parts)
    turned = np.bincount(component, weights=flipped, minlength=parts)
    whole = turned == total
    cavity = _cavities(exam, whole)
    zones = _zones(exam)
    outer = _outer(exam, parts)
    # what bounds the fluid from outside may face either way: its fewer triangles are those that run against the others
    flipped = flipped ^ (outer & ~whole & (turned > 0.5 * total))[component]
    mixed = flipped & ~whole[component]
    index = np.flatnonzero(mixed)

    def say(count: int, size: float) -> str:
        return f"{plural(count, 'triangle')} run against the surface around them, over {exam.length(size)}"

    defects = regional(
        exam, "flipped", "error", exam.body.triangles[index], corners_of(exam.body, index), exam.body_index[index], say,
        labels=np.unique(zones[index], return_inverse=True)[1].astype(np.int64),
    )  # fmt: skip
    inward = whole & ~cavity & _closed(exam, parts)
    defects += _bodies(exam, inward & ~outer, "error", "faces inward: the body is inside out")
    defects += _bodies(exam, inward & outer, "info", "faces inward round the model: the fluid's outer bound")
    defects += _bodies(exam, whole & cavity, "info", "faces inward inside another body: a cavity")
    defects += _bodies(exam, oriented.one_sided, "error", "is one-sided: no orientation is consistent")
    figures = {
        "inconsistent_edges": int(np.count_nonzero(exam.adjacency.inconsistent)),
        "orientation_zones": int(zones.max()) + 1,
        "flipped_faces": int(np.count_nonzero(mixed) + total[whole & ~cavity & ~outer].sum()),
        "volume": oriented.triangulation.volume
        if exam.component_closed.all() and not (cavity | outer).any()
        else _volume(exam, cavity, outer),
    }
    return Finding(tuple(defects), figures)


def _volume(exam: Examination, cavity: BoolArray, outer: BoolArray) -> float | None:
    """Enclosed volume with cavities taken off, without the domain's outer bounds; None while something is open."""
    if not exam.component_closed.all():
        return None
    body = exam.oriented.triangulation
    hollow = cavity[exam.oriented.components]
    solid = ~hollow & ~outer[exam.oriented.components]
    return body.take(solid).volume - body.take(hollow).volume


def _closed(exam: Examination, parts: int) -> BoolArray:
    """(c,) components, labelled as in `oriented`, without a free edge."""
    rim = exam.body_adjacency.free[exam.body_adjacency.triangle_edges].any(axis=1)
    return np.asarray(np.bincount(exam.oriented.components, weights=rim, minlength=parts) == 0)


def _zones(exam: Examination) -> IntArray:
    """(b,) label of each triangle's zone: triangles connected through edges that both run consistently."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    adjacency = exam.body_adjacency
    count = len(exam.body)
    neighbours = adjacency.neighbours
    ok = (neighbours >= 0) & ~adjacency.inconsistent[adjacency.triangle_edges]
    i, k = np.nonzero(ok)
    graph = coo_array((np.ones(len(i), dtype=np.int8), (i, neighbours[i, k])), shape=(count, count))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _cavities(exam: Examination, whole: BoolArray) -> BoolArray:
    """(c,) closed components that face inward and lie inside the other closed ones."""
    parts = len(whole)
    inner = np.flatnonzero(whole & _closed(exam, parts))
    cavity = np.zeros(parts, dtype=np.bool_)
    if not len(inner) or parts == 1:
        return cavity
    body, component = exam.oriented.triangulation, exam.oriented.components
    outside = body.take(~whole[component] & _closed(exam, parts)[component])
    if not len(outside):
        return cavity
    _, first = np.unique(component, return_index=True)
    centre = corners_of(body, first[inner]).mean(axis=1)
    cavity[inner] = [winding(outside.corners, point) > 0.5 for point in centre]
    return cavity


def _outer(exam: Examination, parts: int) -> BoolArray:
    """(c,) components that bound the flow domain from outside: those face the fluid when they face inward."""
    aside = exam.surroundings.aside[exam.body_index]
    return np.asarray(np.bincount(exam.oriented.components, weights=aside, minlength=parts) > 0)


def _bodies(exam: Examination, which: BoolArray, severity: Severity, what: str) -> list[Defect]:
    """One defect per component."""
    component = exam.oriented.components
    defects = []
    for k in np.flatnonzero(which):
        own = np.flatnonzero(component == k)
        box = box_of(corners_of(exam.body, own))
        parts = exam.parts_of(exam.body_index[own])
        message = f"a component of {plural(len(own), 'triangle')} {what}"
        size = float(np.linalg.norm(box[1] - box[0]))
        defects.append(Defect("flipped", severity, box.mean(axis=0), size, parts, len(own), message, box))
    return defects
