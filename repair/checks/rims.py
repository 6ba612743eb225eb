"""Rims: gaps with their width, holes with their perimeter, openings that are kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.checks.examination import Examination, box_of
from patchwright.repair.checks.regions import MOST, plural
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.checks.rims_ahead import Ahead, facing_surfaces
from patchwright.repair.diagnosis import Defect, Severity
from patchwright.repair.mender.rims import Rim

SLIVER = 8  # edges: a hole of more is no sliver at a t-junction


@check("rims", looks="mesh", kinds=("gap", "opening", "overlap"))
def rims(exam: Examination) -> Finding:
    """What is still open after welding: gaps and holes to be bridged, openings to be kept.

    A seam whose sides coincide but are meshed differently is a t-junction, and the border of a fin ends at non-manifold
    edges: both are reported there and not here. A single loose triangle is a component, not an opening.
    """
    found = exam.rims
    figures = {
        "rims": len(found),
        "gaps": sum(rim.kind == "gap" for rim in found),
        "holes": sum(rim.kind == "hole" for rim in found),
        "openings": sum(rim.kind == "opening" for rim in found),
    }
    if not found:
        return Finding(figures=figures)
    points = exam.body.vertices
    seam = _coincident(exam, found)
    alone = np.bincount(exam.component)[exam.component] == 1
    told = [
        seam[i] or (rim.kind == "opening" and (not rim.closed or (len(found) > 1 and bool(alone[rim.triangles].all()))))
        for i, rim in enumerate(found)
    ]
    groups = [group for group in rim_groups(found) if not all(told[i] for i in group)]
    near = facing_surfaces(exam)
    defects = []
    for group in groups:
        defect = _defect(exam, found, group, points)
        if len(group) == 1 and defect.kind == "opening" and defect.severity != "info" and group[0] in near:
            defect = _between_parts(exam, defect, near[group[0]])
        defects.append(defect)
    return Finding(tuple(most_of_each(exam, defects)), figures)


def rim_groups(rims: tuple[Rim, ...]) -> list[list[int]]:
    """Rims that face or run past each other, together; every other rim for itself."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    other = [rim.partner if rim.partner is not None else rim.overlaps for rim in rims]
    partner = np.array([i if k is None else k for i, k in enumerate(other)], dtype=np.int64)
    count = len(rims)
    graph = coo_array((np.ones(count, dtype=np.int8), (np.arange(count), partner)), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    order = np.argsort(label, kind="stable")
    ends = np.cumsum(np.bincount(label))
    return [group.tolist() for group in np.split(order, ends[:-1])]


def describe(
    exam: Examination, some: list[Rim], points: Array, parts: tuple[str, ...]
) -> tuple[str, Severity, float, str]:
    """Kind, severity, size and message of a group of rims with their points (n, 3); what is planned is "info"."""
    kind, severity, size, message = _judged(exam, some)
    if planned := exam.surroundings.planned(points, exam.tolerance.fit):
        across = max(rim.diameter for rim in some)
        return "opening", "info", across, f"a planned opening {exam.length(across)} across: {planned}"
    if kind == "gap" and (kept := exam.surroundings.keeps_gaps(parts)):
        return kind, "info", size, f"{message}; {kept}"
    return kind, severity, size, message


def _judged(exam: Examination, some: list[Rim]) -> tuple[str, Severity, float, str]:
    first = max(some, key=lambda rim: rim.perimeter)
    if first.kind == "opening":
        if first.overlaps is not None:
            message = f"two open surfaces run past each other by {exam.length(first.width)} along {first.perimeter:.3g}"
            return "overlap", "error", first.width, message
        shape = f"planar to {first.planar:.2g}"
        message = (
            f"an opening {exam.length(first.diameter)} across, perimeter {first.perimeter:.4g}, {shape}: {first.reason}"
        )
        return "opening", "warning", first.diameter, message
    if first.kind == "hole":
        edges = plural(len(first.triangles), "edge")
        message = f"a hole with {edges}, perimeter {exam.length(first.perimeter)}: {first.reason}"
        return "gap", "error", first.diameter, message
    between = f"between {len(some)} rims" if len(some) > 1 else "between the two sides of one rim"
    along = 0.5 * sum(rim.perimeter for rim in some)
    message = (
        f"a gap {between}, {exam.length(first.width)} wide in the median and at most {first.widest:.3g}, "
        f"{along:.4g} long: {first.reason}"
    )
    return "gap", "error", first.width, message


def _defect(exam: Examination, found: tuple[Rim, ...], group: list[int], points: Array) -> Defect:
    some = [found[i] for i in group]
    loops: IntArray = np.concatenate([rim.loop for rim in some])
    weights = np.array([rim.perimeter for rim in some])
    centre = np.average([rim.centre for rim in some], axis=0, weights=weights if weights.sum() > 0 else None)
    triangles = exam.body_index[np.concatenate([rim.triangles for rim in some])]
    parts = exam.parts_of(triangles)
    kind, severity, size, message = describe(exam, some, points[loops], parts)
    edges = sum(len(rim.triangles) for rim in some)
    return Defect(kind, severity, centre, size, parts, edges, message, box_of(points[loops]))


def _between_parts(exam: Examination, defect: Defect, near: Ahead) -> Defect:
    """The opening as what it is: the gap between a part's end and the surface of another part."""
    other = exam.parts_of(exam.body_index[near.triangles])
    parts = tuple(dict.fromkeys((*defect.parts, *other)))
    message = (
        f"a gap between the end of {', '.join(defect.parts) or 'a body'} and the surface of "
        f"{', '.join(other) or 'another'}, {exam.length(near.width)} wide in the median and at most {near.widest:.3g}"
    )
    severity: Severity = "error"
    if kept := exam.surroundings.keeps_gaps(parts):
        severity, message = "info", f"{message}; {kept}"
    return replace(defect, kind="gap", severity=severity, size=near.width, parts=parts, message=message)


def _coincident(exam: Examination, found: tuple[Rim, ...]) -> list[bool]:
    """Which rims are seams of no width with t-junctions on them: slivers between a coarse and a fine side."""
    if not len(exam.junctions):
        return [False] * len(found)
    on = np.zeros(len(exam.body.vertices), dtype=np.bool_)
    on[exam.junctions[:, 0]] = True
    return [bool(on[rim.loop].any()) and _sliver_width(exam, rim) <= exam.tolerance.gap for rim in found]


def _sliver_width(exam: Examination, rim: Rim) -> float:
    """The gap's width, or the mean width of a small hole: its area over half its perimeter."""
    if rim.kind == "gap":
        return rim.widest
    if rim.kind == "opening" or len(rim.loop) > SLIVER:
        return float("inf")
    local = exam.body.vertices[rim.loop] - rim.centre
    area = 0.5 * float(np.linalg.norm(np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)))
    return 2.0 * area / rim.perimeter if rim.perimeter > 0.0 else 0.0


def most_of_each(exam: Examination, defects: list[Defect]) -> list[Defect]:
    """The largest `MOST` of each kind; the rest summed up in one more."""
    kept: list[Defect] = []
    for kind in dict.fromkeys(defect.kind for defect in defects):
        own = sorted((d for d in defects if d.kind == kind), key=lambda d: (-d.size, -d.count))
        kept += own[:MOST]
        rest = own[MOST:]
        if rest:
            box = np.stack([np.min([d.box[0] for d in rest], axis=0), np.max([d.box[1] for d in rest], axis=0)])
            count = sum(d.count for d in rest)
            message = f"{len(rest)} further places of this kind, each at most {exam.length(rest[0].size)}"
            parts = tuple(dict.fromkeys(name for d in rest for name in d.parts))
            where = np.mean([d.where for d in rest], axis=0)
            kept.append(Defect(kind, rest[0].severity, where, rest[0].size, parts, count, message, box))
    return kept
