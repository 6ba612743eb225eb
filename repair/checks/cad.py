"""CAD faces: edges used too often, seams measured surface to surface, loose tolerances, invalid faces, winding."""

from __future__ import annotations

from typing import Any

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import EngineError
from patchwright.repair.checks.examination import Examination, box_of
from patchwright.repair.checks.regions import plural, regional
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.diagnosis import Defect

KINK = 1.0  # degrees: a smaller angle between two faces is smooth
KERNEL_SECONDS = 20.0  # the kernel's own validity check may run for minutes on few faces with many knots


@check(
    "cad",
    looks="cad",
    kinds=("non-manifold-edge", "flipped", "seam-gap", "seam-angle", "loose-tolerance", "invalid-face"),
)
def cad(exam: Examination) -> Finding:
    """What the topology, the measured seams and the kernel say."""
    assembly = exam.assembly
    figures: dict[str, Any] = {"faces": len(assembly.parts), "area": float(exam.raw.areas.sum())}
    if assembly.topology is None:
        return Finding(figures=figures | {"watertight": False})
    uses = assembly.topology.use_counts()
    real = ~np.isin(np.arange(len(uses)), _poles(exam))
    free = int(np.count_nonzero((uses == 1) & real))
    many = int(np.count_nonzero((uses > 2) & real))
    closed = free == 0 and many == 0
    invalid, note = _invalid_faces(exam)
    figures |= {
        "open_edges": free,
        "non_manifold_edges": many,
        "watertight": closed,
        "volume": exam.raw.volume if closed else None,
        "invalid_faces": None if invalid is None else len(invalid),
        "validity": note,
    }
    seams, seam_figures = _seams(exam)
    tolerances, tolerance_figures = _tolerances(exam)
    defects = [*_many(exam, (uses > 2) & real), *_winding(exam), *seams, *tolerances, *_face_defects(exam, invalid)]
    return Finding(tuple(defects), figures | seam_figures | tolerance_figures)


def _poles(exam: Examination) -> IntArray:
    """Edges without length: the poles of spheres and the like."""
    curves = exam.assembly.topology.curves if exam.assembly.topology else ()
    size = np.array([float(np.ptp(curve.control_points, axis=0).max()) for curve in curves])
    return np.flatnonzero(size <= 1e-3 * exam.tolerance.gap)


def _faces_of_edges(exam: Examination) -> list[list[int]]:
    topology = exam.assembly.topology
    owners: list[list[int]] = [[] for _ in (topology.curves if topology else ())]
    for face, loops in enumerate(topology.loops if topology else ()):
        for loop in loops:
            for use in loop:
                owners[use.edge].append(face)
    return owners


def _ends_and_middle(exam: Examination, edges: IntArray) -> Array:
    """(k, 5, 3) points along some edges."""
    topology = exam.assembly.topology
    assert topology is not None
    share = np.linspace(0.0, 1.0, 5)
    curves = [topology.curves[int(i)] for i in edges]
    return np.stack([curve(curve.domain[0] + share * (curve.domain[1] - curve.domain[0])) for curve in curves])


def _edge_regions(exam: Examination, kind: str, severity: Any, edges: IntArray, say: Any) -> list[Defect]:
    """Regions of edges that hang together by their end vertices; their parts are the faces that use them."""
    topology = exam.assembly.topology
    if topology is None or not len(edges):
        return []
    owners = _faces_of_edges(exam)
    some = [exam.triangles_of_face(owners[int(i)]) for i in edges]
    width = max(1, max(len(one) for one in some))
    faces = np.array([[*one, *[one[0] if len(one) else 0] * (width - len(one))] for one in some], dtype=np.int64)
    return regional(exam, kind, severity, topology.ends[edges], _ends_and_middle(exam, edges), faces, say)


def _many(exam: Examination, which: BoolArray) -> list[Defect]:
    def say(count: int, size: float) -> str:
        return f"{plural(count, 'edge')} used by more than two faces, over {exam.length(size)}"

    return _edge_regions(exam, "non-manifold-edge", "error", np.flatnonzero(which), say)


def _winding(exam: Examination) -> list[Defect]:
    """Edges both faces run along one way: one is flipped: one of them is flipped."""
    topology = exam.assembly.topology
    assert topology is not None
    flipped = topology.flipped
    runs: list[list[tuple[int, bool]]] = [[] for _ in topology.curves]
    for face, loops in enumerate(topology.loops):
        for loop in loops:
            for use in loop:
                runs[use.edge].append((face, use.reversed != flipped[face]))
    wrong = [i for i, run in enumerate(runs) if len(run) == 2 and run[0][0] != run[1][0] and run[0][1] == run[1][1]]
    poles = set(_poles(exam).tolist())

    def say(count: int, size: float) -> str:
        return f"{plural(count, 'edge')} both faces run along one way: one is flipped, over {exam.length(size)}"

    return _edge_regions(exam, "flipped", "error", np.array([i for i in wrong if i not in poles], dtype=np.int64), say)


def _seams(exam: Examination) -> tuple[list[Defect], dict[str, Any]]:
    """Gaps beyond round-off are warnings, beyond the fit tolerance errors; kinks between smooth and sharp are facts."""
    from patchwright.models.cad.seams import measure_seams

    seams = measure_seams(exam.assembly)
    figures: dict[str, Any] = {"seams": len(seams)}
    if not seams:
        return [], figures
    edge = np.array([seam.edge for seam in seams])
    gap = np.array([seam.gap for seam in seams])
    angle = np.array([seam.angle for seam in seams])
    length = np.array([seam.length for seam in seams])
    figures |= {"largest_seam_gap": float(gap.max()), "largest_seam_angle": float(angle.max())}
    limit, fit = exam.tolerance.gap, exam.tolerance.fit
    defects: list[Defect] = []
    for which, severity in ((gap > fit, "error"), ((gap > limit) & (gap <= fit), "warning")):

        def say(count: int, size: float, widest: float = float(gap[which].max(initial=0.0))) -> str:
            return (
                f"{plural(count, 'shared edge')} whose two surfaces are up to {exam.length(widest)} apart, "
                f"over {exam.length(size)}"
            )

        defects += _edge_regions(exam, "seam-gap", severity, edge[which], say)
    # a very short edge has no direction worth a kink
    kink = (angle > KINK) & (angle < exam.tolerance.angle) & (length > fit)

    def tell(count: int, size: float) -> str:
        return (
            f"{plural(count, 'shared edge')} with a kink of {KINK:.0f} to {exam.tolerance.angle:.0f} degrees (largest "
            f"{angle[kink].max():.3g}), neither smooth nor sharp, over {exam.length(size)}"
        )

    defects += _edge_regions(exam, "seam-angle", "info", edge[kink], tell)
    return defects, figures


def _tolerances(exam: Examination) -> tuple[list[Defect], dict[str, Any]]:
    """Edges whose kernel tolerance is larger than round-off: what the file calls sewn may be apart by it."""
    native = getattr(exam.assembly.native, "edge_tolerances", None)
    topology = exam.assembly.topology
    if native is None or topology is None or len(native) != len(topology.curves) or not len(native):
        return [], {}
    loose = np.flatnonzero(native > exam.tolerance.gap)

    def say(count: int, size: float) -> str:
        return (
            f"{plural(count, 'edge')} with a tolerance up to {exam.length(float(native[loose].max()))}, "
            f"over {exam.length(size)}"
        )

    defects = _edge_regions(exam, "loose-tolerance", "warning", loose, say)
    vertices, figures = _vertex_tolerances(exam, loose)
    edges = {
        "largest_edge_tolerance": float(native.max()),
        "largest_edge_tolerance_share": float(native.max()) / max(exam.diagonal, np.finfo(float).tiny),
        "loose_edges": len(loose),
    }
    return [*defects, *vertices], edges | figures


def _vertex_tolerances(exam: Examination, loose: IntArray) -> tuple[list[Defect], dict[str, Any]]:
    """Vertices whose kernel tolerance is larger than round-off and that end no loose edge, which is told already."""
    from patchwright.models.cad.contained import call_named

    topology = exam.assembly.topology
    assert topology is not None
    try:
        rows: Array = call_named(
            "patchwright.repair.checks.cad_validity:vertex_tolerances", exam.assembly.native,
            time_limit=KERNEL_SECONDS, what="reading the vertices",
        )  # fmt: skip
    except EngineError:
        return [], {}
    if not len(rows):
        return [], {}
    told = topology.vertices[np.unique(topology.ends[loose])]
    near = np.zeros(len(rows), dtype=np.bool_)
    if len(told):
        from scipy.spatial import cKDTree

        near = cKDTree(told).query(rows[:, :3])[0] <= rows[:, 3]
    some = np.flatnonzero((rows[:, 3] > exam.tolerance.gap) & ~near)
    figures = {"largest_vertex_tolerance": float(rows[:, 3].max()), "loose_vertices": len(some)}
    if not len(some):
        return [], figures
    box = box_of(rows[some, :3])
    size = float(np.linalg.norm(box[1] - box[0]))
    most = exam.length(float(rows[some, 3].max()))
    message = f"{plural(len(some), 'corner')} with a tolerance up to {most} at edges without one"
    return [Defect("loose-tolerance", "warning", box.mean(axis=0), size, (), len(some), message, box)], figures


def _invalid_faces(exam: Examination) -> tuple[list[tuple[int, str]] | None, str]:
    """Faces the kernel's own check calls invalid and why; None and the reason when it gives no answer."""
    from patchwright.models.cad.contained import call_named

    if exam.assembly.native is None:
        return None, "the faces never saw the CAD kernel"
    try:
        found = call_named(
            "patchwright.repair.checks.cad_validity:invalid_faces", exam.assembly.native,
            time_limit=KERNEL_SECONDS, what="checking the faces",
        )  # fmt: skip
    except EngineError as error:
        return None, str(error)
    return [(int(i), str(why)) for i, why in found], "checked by the CAD kernel"


def _face_defects(exam: Examination, invalid: list[tuple[int, str]] | None) -> list[Defect]:
    defects = []
    for face, why in invalid or ():
        part = exam.assembly.parts[face]
        if not len(part.triangulation):
            corners = _ends_and_middle(
                exam, np.array([use.edge for loop in _loops(exam, face) for use in loop], np.int64)
            )
        else:
            corners = part.triangulation.corners
        box = box_of(corners)
        size = float(np.linalg.norm(box[1] - box[0]))
        name = part.name or f"face {face + 1}"
        message = f"the CAD kernel calls {name} (face {face + 1}) invalid ({why}); it is {exam.length(size)} large"
        defects.append(Defect("invalid-face", "error", box.mean(axis=0), size, (part.name,), 1, message, box))
    return defects


def _loops(exam: Examination, face: int) -> Any:
    assert exam.assembly.topology is not None
    return exam.assembly.topology.loops[face]
