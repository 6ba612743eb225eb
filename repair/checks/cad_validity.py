"""What the CAD kernel says of its own shape. Runs where the kernel may crash or hang: call it through `contained`."""

from __future__ import annotations

from typing import Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad import kernel
from patchwright.models.cad.native import NativeShape, decode


def invalid_faces(native: NativeShape) -> list[tuple[int, str]]:
    """The faces that BRepCheck does not call valid, with the pieces of each that it blames.

    The binding does not hand out the kernel's own status words.
    """
    shape, faces = decode(native)
    checked = kernel.BRepCheck_Analyzer(shape)
    if checked.IsValid():
        return []
    return [(i, _blamed(checked, face)) for i, face in enumerate(faces) if not checked.IsValid(face)]


def _blamed(checked: Any, face: Any) -> str:
    """How many wires, edges and vertices of a face are invalid, in words; the face itself when none is."""
    words = []
    for kind, word in ((kernel.WIRE, "wire"), (kernel.EDGE, "edge"), (kernel.VERTEX, "vertex")):
        mapped = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
        kernel.TopExp.MapShapes_s(face, kind, mapped)
        bad = sum(not checked.IsValid(mapped.FindKey(i)) for i in range(1, mapped.Size() + 1))
        if bad:
            words.append(f"{bad} of its {mapped.Size()} {_PLURAL.get(word, word + 's')}")
    return ", ".join(words) or "the face against its own wires"


_PLURAL = {"vertex": "vertices"}


def vertex_tolerances(native: NativeShape) -> Array:
    """(v, 4) place and tolerance of every vertex, model length unit."""
    shape, _ = decode(native)
    mapped = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    kernel.TopExp.MapShapes_s(shape, kernel.VERTEX, mapped)
    rows = []
    for i in range(1, mapped.Size() + 1):
        vertex = kernel.as_vertex(mapped.FindKey(i))
        point = kernel.BRep_Tool.Pnt_s(vertex)
        rows.append((point.X(), point.Y(), point.Z(), kernel.BRep_Tool.Tolerance_s(vertex)))
    return np.array(rows, dtype=np.float64).reshape(-1, 4)
