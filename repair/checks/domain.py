"""Domain: far field and symmetry planes, named or suspected, and units that cannot be right."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.repair.checks.examination import Examination, box_of, corners_of
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.diagnosis import Defect
from patchwright.repair.domain import AXES
from patchwright.repair.surroundings import PLANE, SCALED

PLANE_SHARE = 0.5  # of the model's extent that rims or faces on a symmetry plane must cover in one direction
AT_ZERO = 1e-3  # of the diagonal: halves of a model are cut where a coordinate is zero, or nearly
SENSIBLE = (1e-3, 1e3)  # metres: diagonals of real things that flow goes round
METRES = {"mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0, "km": 1e3, "in": 0.0254, "ft": 0.3048}
ALIKE = 5.0  # times: parts of one model, brought to one unit, are that near in size


@check("domain", looks="any", kinds=("far-field", "unit"))
def domain(exam: Examination) -> Finding:
    """Far field, symmetry planes, units; suspicions that nothing acts on unless the user named them."""
    around = exam.surroundings
    plane = _symmetry(exam)
    said = [*around.reasons]
    if plane is not None and not around.planes:
        where = f"{plane['axis']} = {plane['value']:.4g}"
        said.append(f"{where} looks like a symmetry plane: {plane['why']}; name it with --symmetry")
    figures = {
        "far_field": list(around.far_field),
        "symmetry_plane": plane,
        "symmetry": [{"plane": p.name, "part": p.part, "reason": p.reason} for p in around.planes],
        "domain": said,
    }
    return Finding((*_far_field(exam), *_unit(exam), *_mixed_units(exam)), figures)


def _far_field(exam: Examination) -> list[Defect]:
    """What bounds the domain from outside, as one fact."""
    around = exam.surroundings
    own = np.flatnonzero(around.aside)
    if not len(own):
        return []
    box = box_of(corners_of(exam.raw, own))
    reach = float(np.linalg.norm(box[1] - box[0]))
    message = f"{'; '.join(around.reasons)}; tolerances come from the model alone, {exam.diagonal:.3g} large"
    return [Defect("far-field", "info", box.mean(axis=0), reach, exam.parts_of(own), len(own), message, box)]


def _symmetry(exam: Examination) -> dict[str, float | str] | None:
    """The coordinate plane that a large planar rim or face lies on, with the model on one side only."""
    body = exam.raw.take(~exam.surroundings.aside) if exam.surroundings.aside.any() else exam.raw
    if not len(body):
        return None
    low, high = body.corners.min(axis=(0, 1)), body.corners.max(axis=(0, 1))
    slack = PLANE * exam.diagonal
    rim = _rim_segments(exam)
    length = np.linalg.norm(rim[:, 1] - rim[:, 0], axis=1)
    best: tuple[float, dict[str, float | str]] | None = None
    for axis, name in enumerate(AXES):
        for value in (low[axis], high[axis]):
            on = (np.abs(rim[:, :, axis] - value) <= slack).all(axis=1)
            along = float(length[on].sum())
            if abs(value) > AT_ZERO * exam.diagonal or along <= slack or (best is not None and along <= best[0]):
                continue
            span = np.ptp(rim[on].reshape(-1, 3), axis=0) / np.maximum(high - low, np.finfo(float).tiny)
            share = float(np.delete(span, axis).max())
            if share >= PLANE_SHARE:
                why = f"free edges over {share:.0%} of the model lie in it and everything is on one side"
                best = along, {"axis": name, "value": float(value), "share": share, "why": why}
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


def _mixed_units(exam: Examination) -> list[Defect]:
    """Bodies (or parts) hundreds of times larger than the others, that would be of their size in another unit.

    Small parts on a large model are no suspicion: brought to the model's size they would lie elsewhere.
    """
    names, low, high = _bodies(exam)
    if len(names) < 2:
        return []
    size = np.linalg.norm(high - low, axis=1)
    order = np.argsort(size)
    order = order[size[order] > 0.0]
    jump = size[order][1:] / size[order][:-1]
    if not len(jump) or jump.max() < SCALED / ALIKE:
        return []
    k = int(np.argmax(jump))
    small, large = order[: k + 1], order[k + 1 :]
    boxes = [np.stack([low[g].min(axis=0), high[g].max(axis=0)]) for g in (small, large)]
    found = ""
    for factor, words in _FACTORS:
        scaled = factor * boxes[0]
        apart = np.maximum(0.0, np.maximum(scaled[0] - boxes[1][1], boxes[1][0] - scaled[1]))
        alike = 1.0 / ALIKE <= factor * size[small].max() / size[large].max() <= ALIKE
        if alike and np.linalg.norm(apart) <= 0.5 * size[large].max():
            found = words
            break
    if not found:
        return []
    few = small if len(small) <= len(large) else large
    box = boxes[0] if few is small else boxes[1]
    # of two alone either may be the wrong one
    some = tuple(dict.fromkeys(names[i] for i in (order if len(small) == len(large) else few)))
    parts = ", ".join(some[:5]) + (", …" if len(some) > 5 else "")
    message = (
        f"{parts}: sizes jump by {jump[k]:.4g} times from one part to the next; "
        f"with {found} all would be alike in size and place, so the units are probably mixed"
    )
    extent = float(np.linalg.norm(box[1] - box[0]))
    return [Defect("unit", "warning", box.mean(axis=0), extent, some, len(few), message, box)]


_FACTORS = ((1000.0, "millimetres and metres told apart"), (304.8, "millimetres and feet told apart"),
            (100.0, "centimetres and metres told apart"))  # fmt: skip


def _bodies(exam: Examination) -> tuple[list[str], Array, Array]:
    """Names and boxes of the bodies of CAD faces, or of the parts of a mesh."""
    groups: dict[str, list[Array]] = {}
    for i, part in enumerate(exam.assembly.parts):
        if len(part.triangulation):
            key = (part.body or "faces without a body") if exam.assembly.is_cad else part.name or f"part {i + 1}"
            groups.setdefault(key, []).append(np.asarray(part.triangulation.bounds))
    low = np.array([np.min([b[0] for b in some], axis=0) for some in groups.values()]).reshape(-1, 3)
    high = np.array([np.max([b[1] for b in some], axis=0) for some in groups.values()]).reshape(-1, 3)
    return list(groups), low, high
