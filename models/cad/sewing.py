"""Joining faces along coincident borders: the CAD kernel's sewing, with evidence of what it did and did not change.

Sewing joins whatever lies within its tolerance and hides the rest in the edges' tolerances. Its result is therefore
judged by `measure_seams` of the sewn assembly, and its tolerance is chosen by `free_edge_curve`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.cad import contained
from patchwright.models.cad.seams import edge_deviation
from patchwright.models.errors import ParameterError
from patchwright.models.triangulation import Triangulation

SECONDS, SECONDS_PER_FACE = 120.0, 1.0
SHARES = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)  # of the diagonal: round-off cracks vanish by 1e-6, real gaps stay
_NOTHING = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))


@dataclass(frozen=True, slots=True, eq=False)
class SewnResult:
    """The sewn assembly (parts in the same order, less those the kernel dropped) and the evidence.

    `new_index` (n,) is each input part's place in it, -1 where it was dropped; `surface_change` (n,) the largest
    difference of any defining number of its surface (infinite where kind or size changed or the part was dropped).
    """

    assembly: Assembly
    new_index: IntArray
    surface_change: Array
    free_edges: int
    multiple_edges: int
    tolerance: float

    @property
    def dropped(self) -> tuple[int, ...]:
        """The input parts that are gone."""
        return tuple(int(i) for i in np.flatnonzero(self.new_index < 0))


@dataclass(frozen=True, slots=True, eq=False)
class FreeEdgeCurve:
    """Edge counts after sewing at each tolerance (k,), in the model's unit, poles not counted."""

    tolerances: Array
    free: IntArray
    multiple: IntArray


def sew(assembly: Assembly, tolerance: float, *, time_limit: float | None = None) -> SewnResult:
    """Faces joined where their borders lie within `tolerance`; closed shells become solids.

    Raises
    ------
    ParameterError : a part without a surface, a tolerance that is not positive. EngineError : the kernel failed.
    """
    light = _checked(assembly, (tolerance,))
    limit = _limit(assembly, time_limit)
    sewn, places, free, multiple = contained.call_named(
        "patchwright.models.cad.sewing:sew_here", light, edge_deviation(assembly), float(tolerance),
        time_limit=limit, what=f"sewing {len(assembly.parts)} faces at {tolerance:.3g}",
    )  # fmt: skip
    new_index = np.asarray(places, dtype=np.int64)
    change = np.full(len(assembly.parts), np.inf)
    for i, at in enumerate(new_index):
        if at >= 0:
            change[i] = surface_difference(assembly.parts[i].surface, sewn.parts[at].surface)
    return SewnResult(sewn, new_index, change, free, multiple, float(tolerance))


def free_edge_curve(
    assembly: Assembly, tolerances: Array | None = None, *, time_limit: float | None = None
) -> FreeEdgeCurve:
    """Free and multiply used edges as a function of the sewing tolerance; None means 1e-8 ... 1e-3 of the diagonal."""
    lengths = assembly.diagonal * np.array(SHARES) if tolerances is None else np.asarray(tolerances, dtype=np.float64)
    light = _checked(assembly, tuple(lengths.tolist()))
    limit = _limit(assembly, time_limit) * len(lengths)
    counts = contained.call_named(
        "patchwright.models.cad.sewing:count_here", light, edge_deviation(assembly), lengths.tolist(),
        time_limit=limit, what=f"counting the free edges of {len(assembly.parts)} faces",
    )  # fmt: skip
    free, multiple = np.array(counts, dtype=np.int64).reshape(-1, 2).T
    return FreeEdgeCurve(lengths, free, multiple)


def surface_difference(a: Any, b: Any) -> float:
    """Largest difference of any number that defines two surfaces of one kind (ranges aside); infinite otherwise."""
    if type(a) is not type(b):
        return float("inf")
    worst = 0.0
    for x, y in zip(_numbers(a), _numbers(b), strict=True):
        if x.shape != y.shape:
            return float("inf")
        worst = max(worst, float(np.abs(x - y).max(initial=0.0)))
    return worst


def _numbers(surface: Any) -> list[Array]:
    names = [n for n in surface.__dataclass_fields__ if n not in ("u", "v", "homogeneous")]
    out: list[Array] = []
    for name in names:
        value = getattr(surface, name)
        for item in value if isinstance(value, tuple) else (value,):
            out.append(np.ravel(np.asarray([] if item is None else item, dtype=np.float64)))
    return out


def _checked(assembly: Assembly, tolerances: tuple[float, ...]) -> Assembly:
    """The assembly without its triangles, fit for the worker."""
    if not assembly.is_cad:
        raise ParameterError("only faces with surfaces can be sewn; weld a triangulation instead")
    bad = [t for t in tolerances if not (np.isfinite(t) and t > 0.0)]
    if bad or not tolerances:
        raise ParameterError(f"a sewing tolerance must be a positive length, got {bad or 'none'}")
    return replace(assembly, parts=tuple(replace(p, triangulation=_NOTHING, trims=None) for p in assembly.parts))


def _limit(assembly: Assembly, time_limit: float | None) -> float:
    return SECONDS + SECONDS_PER_FACE * len(assembly.parts) if time_limit is None else time_limit


def sew_here(assembly: Assembly, deviation: Array, tolerance: float) -> tuple[Assembly, list[int], int, int]:
    """`sew` in this process: the sewn assembly, the new place of each part, free and multiple edges."""
    from patchwright.models.cad import kernel
    from patchwright.models.cad.names import face_index
    from patchwright.models.cad.native import faces_of
    from patchwright.models.cad.reading import assembly_of
    from patchwright.models.cad.writing import shape_of

    _, faces = shape_of(assembly, deviation)
    sewing = _sewed(faces, tolerance)
    shape = _solids(sewing.SewedShape())
    stored = face_index(faces_of(shape))
    kept: list[tuple[int, Any]] = []
    places: list[int] = []
    for i, face in enumerate(faces):
        after = sewing.ModifiedSubShape(face)
        at = 0 if after.IsNull() or after.ShapeType() != kernel.FACE else stored.FindIndex(after)
        places.append(len(kept) if at else -1)
        if at:
            kept.append((i, kernel.as_face(stored.FindKey(at))))
    names, bodies = [assembly.parts[i].name for i, _ in kept], [assembly.parts[i].body for i, _ in kept]
    sewn = assembly_of(shape, names, bodies, assembly.source, faces=[face for _, face in kept])
    sewn = replace(sewn, unit=assembly.unit)
    return sewn, places, *_counts(sewing)


def count_here(assembly: Assembly, deviation: Array, tolerances: list[float]) -> list[tuple[int, int]]:
    """`free_edge_curve` in this process."""
    from patchwright.models.cad.writing import shape_of

    _, faces = shape_of(assembly, deviation)
    return [_counts(_sewed(faces, tolerance)) for tolerance in tolerances]


def _sewed(faces: list[Any], tolerance: float) -> Any:
    from patchwright.models.cad import kernel

    sewing = kernel.BRepBuilderAPI_Sewing(tolerance)
    for face in faces:
        sewing.Add(face)
    sewing.Perform()
    return sewing


def _counts(sewing: Any) -> tuple[int, int]:
    from patchwright.models.cad import kernel

    free = [kernel.as_edge(sewing.FreeEdge(i)) for i in range(1, sewing.NbFreeEdges() + 1)]
    return sum(not kernel.BRep_Tool.Degenerated_s(e) for e in free), int(sewing.NbMultipleEdges())


def _solids(shape: Any) -> Any:
    """The sewn shape with every closed shell made a solid."""
    from patchwright.models.cad import kernel
    from patchwright.models.cad.names import children

    builder, out = kernel.BRep_Builder(), kernel.TopoDS_Compound()
    builder.MakeCompound(out)
    whole = shape.ShapeType() != kernel.COMPOUND
    kinds = (kernel.SHELL, kernel.FACE, kernel.SOLID, kernel.COMPOUND)
    for item in [shape] if whole else children(shape, kinds):
        if item.ShapeType() == kernel.SHELL and kernel.BRep_Tool.IsClosed_s(item):
            solid = kernel.TopoDS_Solid()
            builder.MakeSolid(solid)
            builder.Add(solid, item)
            kernel.BRepLib.OrientClosedSolid_s(solid)
            item = solid
        builder.Add(out, item)
    return out
