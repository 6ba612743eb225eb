"""Edges: vertices that are not merged, edges used too often, and free edges as a function of tolerance."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import BoolArray, IntArray
from patchwright.models.tolerance import ROUND_OFF_SHARE
from patchwright.repair.checks.examination import CURVE_END, Examination, box_of
from patchwright.repair.checks.regions import plural, regional
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.diagnosis import Defect, Severity

SHARES = (0.0, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, CURVE_END)  # of the diagonal: where the free-edge curve is read


@check("edges", looks="mesh", kinds=("open-edge", "non-manifold-edge"))
def edges(exam: Examination) -> Finding:
    """Unmerged vertices, edges with three triangles or more, and the free-edge curve."""
    open_edges = exam.open_edges
    many = exam.adjacency.non_manifold
    curve = _curve(exam)
    figures = {
        "open_edges": open_edges,
        "non_manifold_edges": int(np.count_nonzero(many)),
        "watertight": open_edges == 0 and not bool(many.any()) and len(exam.raw) > 0,
        "free_edges_by_tolerance": curve,
        "free_edge_reading": reading(curve),
        "weld_distance": exam.weld_distance[0],
        "weld_reason": exam.weld_distance[1],
        "open_edges_after_welding": int(np.count_nonzero(exam.body_adjacency.free)),
    }
    return Finding((*_unmerged(exam), *_non_manifold(exam)), figures)


def _curve(exam: Examination) -> list[dict[str, float | int]]:
    """Free edges after welding at each of `SHARES` of the diagonal."""
    from patchwright.repair.mender.weld import free_edge_curve

    distances = np.array(SHARES) * exam.diagonal
    counts = (
        free_edge_curve(exam.raw, distances, exam.copies) if exam.open_edges else np.zeros(len(SHARES), dtype=np.int64)
    )
    return [
        {"share": share, "distance": float(distance), "free_edges": int(count)}
        for share, distance, count in zip(SHARES, distances, counts, strict=True)
    ]


def reading(curve: list[dict[str, float | int]]) -> str:
    """What a free-edge curve says: cracks of round-off vanish by `ROUND_OFF`, gaps and openings stay."""
    first, last = int(curve[0]["free_edges"]), int(curve[-1]["free_edges"])
    early = int(next(row["free_edges"] for row in curve if row["share"] >= ROUND_OFF_SHARE))
    if not first:
        return "no edge is free"
    return (
        f"{first - early} of {first} free edges are cracks of round-off (closed by {ROUND_OFF_SHARE:.0e} of the "
        f"diagonal), {early - last} close between there and {SHARES[-1]:.0e}, {last} are wider gaps or openings"
    )


def _unmerged(exam: Examination) -> tuple[Defect, ...]:
    """One defect for all the copies of points that a weld would merge."""
    left = int(np.count_nonzero(exam.body_adjacency.free))
    distance, reason = exam.weld_distance
    closed = exam.open_edges - left
    if closed <= 0 or distance <= 0.0:
        return ()
    triangles, points = exam.merged.triangles, exam.merged.vertices
    # sides of the body's triangles that were free and are not any more; what was left out of the body did not heal
    row = np.full(len(triangles), -1, dtype=np.int64)
    row[exam.body_index] = np.arange(len(exam.body_index))
    row = row[exam.merged_index]
    healed_side = exam.adjacency.free[exam.adjacency.triangle_edges]
    healed_side &= ~exam.body_adjacency.free[exam.body_adjacency.triangle_edges][row] & (row >= 0)[:, None]
    which, corner = np.nonzero(healed_side)
    if not len(which):
        return ()
    which = exam.merged_index[which]
    place = points[np.stack([triangles[which, corner], triangles[which, (corner + 1) % 3]], axis=1)]
    box = box_of(place)
    message = (
        f"vertices are not merged: {plural(exam.open_edges, 'free edge')}, {left} remain after welding at "
        f"{exam.length(distance)} ({reason})"
    )
    size = float(np.linalg.norm(box[1] - box[0]))
    parts = exam.parts_of(which)
    return (Defect("open-edge", "error", place.mean(axis=(0, 1)), size, parts, len(which), message, box),)


def _non_manifold(exam: Examination) -> list[Defect]:
    """Edges with three triangles or more once doubles are left out; a wall that parts share is meant, perhaps."""
    adjacency = exam.body_adjacency
    index = np.flatnonzero(adjacency.non_manifold)
    if not len(index):
        return []
    offsets, around = adjacency.edge_triangles
    use = adjacency.use_count[index]
    columns = np.arange(int(use.max()))
    member = offsets[index][:, None] + np.minimum(columns, use[:, None] - 1)
    owner = exam.body_index[around[member]]
    tags = exam.raw.tags
    shared = np.zeros(len(index), dtype=np.bool_) if tags is None else np.ptp(tags[owner], axis=1) > 0
    pairs = adjacency.edges[index]
    defects: list[Defect] = []
    cases: tuple[tuple[BoolArray, Severity, str], ...] = (
        (~shared, "error", ""),
        (shared, "warning", " of several parts: a wall between them"),
    )
    for which, severity, what in cases:

        def say(count: int, size: float, what: str = what, most: int = int(use[which].max(initial=0))) -> str:
            return f"{plural(count, 'edge')} shared by up to {most} triangles{what}, over {exam.length(size)}"

        points = exam.body.vertices[pairs[which]]
        defects += regional(exam, "non-manifold-edge", severity, pairs[which], points, owner[which], say)
    return defects


def edge_keys(start: IntArray, end: IntArray, count: int) -> IntArray:
    """One number per undirected edge."""
    return np.minimum(start, end) * count + np.maximum(start, end)
