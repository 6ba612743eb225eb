"""The CAD kernel's own validity check. Runs where the kernel may crash or hang: call it through `contained`."""

from __future__ import annotations

from patchwright.models.cad import kernel
from patchwright.models.cad.native import NativeShape, decode


def invalid_faces(native: NativeShape) -> list[int]:
    """Indices of the faces that BRepCheck does not call valid."""
    shape, faces = decode(native)
    checked = kernel.BRepCheck_Analyzer(shape)
    if checked.IsValid():
        return []
    return [i for i, face in enumerate(faces) if not checked.IsValid(face)]
