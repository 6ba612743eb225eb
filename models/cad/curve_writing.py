"""Curves to STEP and IGES files, one edge each; to be called through `contained`, as the kernel may crash or hang."""

from __future__ import annotations

from pathlib import Path

from patchwright.models.cad import kernel
from patchwright.models.cad.convert_curve import curve_to_kernel
from patchwright.models.cad.writing import compound, write_shape
from patchwright.models.errors import EngineError
from patchwright.models.nurbs_curve import NurbsCurve


def write_curve_file(path: Path, kind: str, curves: tuple[NurbsCurve, ...], own_unit: str, file_unit: str) -> None:
    """Curves in space as loose edges of a STEP or IGES file.

    Raises
    ------
    EngineError : the kernel refuses a curve or cannot write.
    """
    edges = []
    for number, curve in enumerate(curves):
        made = kernel.BRepBuilderAPI_MakeEdge(curve_to_kernel(curve.clamped()))
        if not made.IsDone():
            raise EngineError(f"the CAD kernel refuses curve {number + 1} of {len(curves)} as an edge")
        edges.append(made.Edge())
    write_shape(path, kind, compound(edges), own_unit, file_unit)
