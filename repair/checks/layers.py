"""Layers: a second skin laid over a first one, and bodies that touch or all but touch each other."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.checks.examination import Examination, box_of, corners_of
from patchwright.repair.checks.regions import plural, region_labels
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.diagnosis import Defect, Severity

MOST = 300_000  # triangles that are probed
REACH = 10.0  # fit tolerances: a skin of the same orientation so near is a copy, not a design
CLEAR = 2.0  # fit tolerances: a clearance so narrow cannot be kept open by what strays that far
PARALLEL = 0.9  # cosine
MOSTLY = 0.1  # of the smaller body's area: bodies that cross and share less than that merely cross at a small angle
MOST_REGIONS = 200  # that are told, the largest first
LEAST = 1e-4  # of the area: less of a skin over itself is noise


@check("layers", looks="mesh", kinds=("overlap", "gap"))
def layers(exam: Examination) -> Finding:
    """What lies right above or below each triangle, along its normal.

    The next skin turned the same way, within `REACH`, is a second layer. One turned the other way, with the void
    between, is another body's: it touches within round-off, or the clearance is told, as a warning below `CLEAR`.
    """
    body = exam.oriented.triangulation
    if len(body) < 2:
        return Finding(figures={"double_layers": 0, "contacts": 0})
    own, other, height = _next_skins(exam)
    component = exam.component
    normal = exam.normals
    turn = np.einsum("ij,ij->i", normal[own], normal[other])
    apart = np.abs(height)
    strange = component[own] != component[other]
    same = turn >= PARALLEL
    area = exam.areas
    if area[own[same & ~strange]].sum() < LEAST * area.sum():
        same &= strange
    same &= ~_crossing(exam, own, other, same)
    near = exam.tolerance.gap
    facing = strange & (turn <= -PARALLEL) & (height >= -near)
    facing &= ~_crossing(exam, own, other, facing)
    touching = facing & (apart <= near)
    narrow = facing & ~touching & (apart <= CLEAR * exam.tolerance.fit)
    clear = facing & (apart > CLEAR * exam.tolerance.fit)

    skins = own, other, apart
    defects = [
        *_found(exam, "overlap", "error", skins, same, "lie in two layers"),
        *_found(exam, "overlap", "warning", skins, touching, "of two bodies touch face to face"),
        *_found(exam, "gap", "warning", skins, narrow, "of two bodies all but touch"),
        *_found(exam, "gap", "info", skins, clear, "of two bodies face each other across a narrow clearance"),
    ]
    figures = {"double_layers": int(np.count_nonzero(same)), "contacts": int(np.count_nonzero(touching))}
    return Finding(tuple(defects), figures)


def _crossing(exam: Examination, own: IntArray, other: IntArray, along: BoolArray) -> BoolArray:
    """(k,) pairs of two bodies that cross, or run past, each other and lie along each other only where they do."""
    count = len(exam.component_closed)
    bodies = np.sort(exam.component[np.stack([own, other], axis=1)], axis=1)
    label = bodies @ [count, 1]
    crossing = np.unique(np.sort(exam.component[exam.crossing_pairs], axis=1) @ [count, 1])
    key, which = np.unique(label, return_inverse=True)
    which = which.reshape(-1)
    area = exam.areas
    whole = np.bincount(exam.component, weights=area)
    both = np.bincount(which, weights=area[own] * along)
    smaller = np.minimum(whole[key // count], whole[key % count])
    merely = np.isin(key, crossing) & (both < MOSTLY * smaller)
    return np.asarray(merely[which] | exam.run_past(bodies))


def _next_skins(exam: Examination) -> tuple[IntArray, IntArray, Array]:
    """(k,) triangles, (k,) the next one above or below each that has no corner in common, (k,) its signed height.

    Triangles of the domain's outer bound are not asked.
    """
    from patchwright.models.tree import Tree

    body = exam.oriented.triangulation
    asked = np.flatnonzero(exam.normals.any(axis=1) & ~exam.surroundings.aside[exam.body_index])
    if len(asked) > MOST:
        asked = asked[np.unique(np.linspace(0, len(asked) - 1, MOST).astype(np.int64))]
    centre, normal = corners_of(body, asked).mean(axis=1), exam.normals[asked]
    reach = REACH * exam.tolerance.fit
    hits = Tree.of(body).all_hits(centre - reach * normal, centre + reach * normal)
    segment, triangle = hits.segment, hits.triangle
    height = (2.0 * hits.t - 1.0) * reach
    corners, others = body.triangles[asked[segment]], body.triangles[triangle]
    apart = ~(corners[:, :, None] == others[:, None, :]).any(axis=(1, 2))
    segment, triangle, height = segment[apart], triangle[apart], height[apart]
    order = np.lexsort((np.abs(height), segment))
    first = np.unique(segment[order], return_index=True)[1]
    nearest = order[first]
    return asked[segment[nearest]], np.asarray(triangle[nearest], dtype=np.int64), height[nearest]


def _found(
    exam: Examination,
    kind: str,
    severity: Severity,
    skins: tuple[IntArray, IntArray, Array],
    which: BoolArray,
    what: str,
) -> list[Defect]:
    """One defect per connected region of both skins; a gap's size is its width."""
    if not which.any():
        return []
    own, other, apart = (some[which] for some in skins)
    body = exam.body
    index, local = np.unique(np.stack([own, other], axis=1), return_inverse=True)
    links = local.reshape(-1, 2).astype(np.int64)
    label = region_labels(body.triangles[index], links)
    pair_label = label[links[:, 0]]
    counts = np.bincount(label)
    found = []
    for r in np.argsort(-counts, kind="stable")[:MOST_REGIONS]:
        triangles = index[label == r]
        box = box_of(corners_of(body, triangles))
        heights = apart[pair_label == r]
        size = float(np.median(heights)) if kind == "gap" else float(np.linalg.norm(box[1] - box[0]))
        width = exam.length(float(np.median(heights)))
        message = (
            f"{plural(len(triangles), 'triangle')} {what}, {width} apart in the median, at most {heights.max():.3g}"
        )
        parts = exam.parts_of(exam.body_index[triangles])
        found.append(Defect(kind, severity, box.mean(axis=0), size, parts, len(triangles), message, box))
    return found
