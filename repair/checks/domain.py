"""Domain: what looks like a far field, a symmetry plane, or a wrong unit; suspicions that nothing acts on by itself."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.checks.examination import Examination
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.diagnosis import Defect

FAR = 4.0  # times the diagonal of everything else: a body that large around it is a far field
PLANE = 1e-5  # of the diagonal: how flat a symmetry plane's rim or face is
PLANE_SHARE = 0.5  # of the model's extent that rims or faces on a symmetry plane must cover in one direction
SENSIBLE = (1e-3, 1e3)  # metres: diagonals of real things that flow goes round
METRES = {"mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0, "km": 1e3, "in": 0.0254, "ft": 0.3048}


@check("domain", looks="any", kinds=("far-field", "unit"))
def domain(exam: Examination) -> Finding:
    """Far field, symmetry plane, unit."""
    far, names = _far_field(exam)
    plane = _symmetry(exam)
    figures = {"far_field": names, "symmetry_plane": plane}
    return Finding((*far, *_unit(exam)), figures)


def _pieces(exam: Examination) -> tuple[Array, Array, IntArray, list[tuple[str, ...]]]:
    """Boxes (p, 3), (p, 3), triangle counts and part names of the pieces: CAD faces or connected components."""
    if exam.assembly.is_cad:
        parts = [part for part in exam.assembly.parts if len(part.triangulation)]
        bounds = np.array([part.triangulation.bounds for part in parts]).reshape(-1, 2, 3)
        counts = np.array([len(part.triangulation) for part in parts], dtype=np.int64)
        return bounds[:, 0], bounds[:, 1], counts, [(part.name,) for part in parts]
    label = exam.component
    order = np.argsort(label, kind="stable")
    counts = np.bincount(label)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
    corners = exam.body.corners[order]
    low = np.minimum.reduceat(corners.min(axis=1), starts)
    high = np.maximum.reduceat(corners.max(axis=1), starts)
    tags = exam.body.tags
    names: list[tuple[str, ...]] = [()] * len(counts)
    if tags is not None:
        names = [(exam.raw.tag_names[k],) for k in tags[order[starts]]]
    return low, high, counts, names


def _far_field(exam: Examination) -> tuple[list[Defect], list[str]]:
    """Pieces that reach far around all smaller ones: split the pieces by size where the size jumps most."""
    if not exam.assembly.is_cad and not len(exam.body):
        return [], []
    low, high, counts, names = _pieces(exam)
    if len(low) < 2:
        return [], []
    size = np.linalg.norm(high - low, axis=1)
    order = np.argsort(size)
    # what the pieces up to each size span together
    reach_low = np.minimum.accumulate(low[order])
    reach_high = np.maximum.accumulate(high[order])
    inner = np.linalg.norm(reach_high - reach_low, axis=1)
    jump = size[order][1:] / np.maximum(inner[:-1], np.finfo(float).tiny)
    k = int(np.argmax(jump))
    if jump[k] < FAR:
        return [], []
    outer = order[k + 1 :]
    outer_low, outer_high = low[outer].min(axis=0), high[outer].max(axis=0)
    slack = PLANE * float(np.linalg.norm(outer_high - outer_low))
    if (reach_low[k] < outer_low - slack).any() or (reach_high[k] > outer_high + slack).any():
        return [], []
    box = np.stack([outer_low, outer_high])
    parts = tuple(dict.fromkeys(name for i in outer for name in names[i]))
    reach = float(np.linalg.norm(outer_high - outer_low))
    message = (
        f"{len(outer)} of {len(size)} pieces look like a far field: they reach {reach:.3g} around a model of "
        f"{inner[k]:.3g}; tolerances should come from the model alone"
    )
    count = int(counts[outer].sum())
    return [Defect("far-field", "info", box.mean(axis=0), reach, parts, count, message, box)], list(parts)


def _symmetry(exam: Examination) -> dict[str, float | str] | None:
    """The coordinate plane that a large planar rim lies on, with the model on one side only."""
    mesh = exam.raw
    if not len(mesh):
        return None
    low, high = mesh.bounds
    slack = PLANE * exam.diagonal
    rim = _rim_segments(exam)
    length = np.linalg.norm(rim[:, 1] - rim[:, 0], axis=1)
    best: tuple[float, dict[str, float | str]] | None = None
    for axis, name in enumerate("xyz"):
        for value in (low[axis], high[axis]):
            on = (np.abs(rim[:, :, axis] - value) <= slack).all(axis=1)
            along = float(length[on].sum())
            # halves of a model are cut where a coordinate is zero, or nearly
            if abs(value) > 1e-3 * exam.diagonal or along <= slack or (best is not None and along <= best[0]):
                continue
            span = np.ptp(rim[on].reshape(-1, 3), axis=0) / np.maximum(high - low, np.finfo(float).tiny)
            share = float(np.delete(span, axis).max())
            if share >= PLANE_SHARE:
                best = along, {"axis": name, "value": float(value), "share": share}
    return None if best is None else best[1]


def _rim_segments(exam: Examination) -> Array:
    """(n, 2, 3) chords along the free edges: of the faces' topology for CAD, of the welded triangles otherwise."""
    if not exam.assembly.is_cad:
        return exam.body.vertices[exam.body_adjacency.edges[exam.body_adjacency.free]]
    topology = exam.assembly.topology
    if topology is None or not topology.curves:
        return np.zeros((0, 2, 3))
    share = np.linspace(0.0, 1.0, 9)
    curves = [topology.curves[int(i)] for i in np.flatnonzero(topology.use_counts() == 1)]
    points = [curve(curve.domain[0] + share * (curve.domain[1] - curve.domain[0])) for curve in curves]
    return np.concatenate([np.stack([p[:-1], p[1:]], axis=1) for p in points]) if points else np.zeros((0, 2, 3))


def _unit(exam: Examination) -> list[Defect]:
    """A diagonal that no real thing has in the file's unit."""
    scale = METRES.get(exam.assembly.unit)
    if scale is None or exam.diagonal <= 0.0:
        return []
    metres = exam.diagonal * scale
    if SENSIBLE[0] <= metres <= SENSIBLE[1]:
        return []
    low, high = exam.assembly.bounds
    message = f"the model is {metres:.3g} m across if its unit is {exam.assembly.unit}: the unit is probably wrong"
    box = np.stack([low, high])
    return [Defect("unit", "warning", box.mean(axis=0), exam.diagonal, (), len(exam.assembly.parts), message, box)]
