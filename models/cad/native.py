"""Opaque handles of the CAD kernel's shapes: bytes until a shape is needed, so that assemblies can be pickled."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any
from uuid import uuid4

from patchwright.models.arrays import Array
from patchwright.models.errors import EngineError

_KEPT = 8  # decoded shapes kept per process
_decoded: OrderedDict[str, tuple[Any, list[Any]]] = OrderedDict()


@dataclass(frozen=True, slots=True, eq=False)
class NativeShape:
    """A kernel shape in the kernel's binary form, coordinates in the assembly's unit.

    `edge_tolerances` (e,) is the kernel's tolerance of every edge, in the order of the assembly's topology, None when
    that is not known. `key` is the same only for copies of one handle.
    """

    data: bytes = field(repr=False)
    edge_tolerances: Array | None = field(default=None, repr=False)
    key: str = field(default_factory=lambda: uuid4().hex)


@dataclass(frozen=True, slots=True, eq=False)
class NativeFace:
    """Face number `index` of a kernel shape."""

    shape: NativeShape
    index: int


def encode(shape: Any, edge_tolerances: Array | None = None) -> NativeShape:
    """The handle of a kernel shape, without its triangulation."""
    from patchwright.models.cad import kernel

    stream = BytesIO()
    current = kernel.BinTools_FormatVersion.BinTools_FormatVersion_CURRENT
    kernel.BinTools.Write_s(shape, stream, False, False, current)
    return NativeShape(stream.getvalue(), edge_tolerances)


def decode(native: NativeShape) -> tuple[Any, list[Any]]:
    """The kernel shape and its faces in order; decoded once per process.

    Raises
    ------
    EngineError : the bytes are no shape.
    """
    if native.key in _decoded:
        _decoded.move_to_end(native.key)
        return _decoded[native.key]
    from patchwright.models.cad import kernel

    shape = kernel.TopoDS_Shape()
    kernel.BinTools.Read_s(shape, BytesIO(native.data))
    if shape.IsNull():
        raise EngineError(f"the CAD kernel cannot read back its own shape of {len(native.data)} bytes")
    _decoded[native.key] = shape, faces_of(shape)
    while len(_decoded) > _KEPT:
        _decoded.popitem(last=False)
    return _decoded[native.key]


def decode_face(native: NativeFace) -> Any:
    """The kernel's face; faces of one shape share their edges."""
    return decode(native.shape)[1][native.index]


def faces_of(shape: Any) -> list[Any]:
    """The distinct faces of a kernel shape in the order of its parts."""
    from patchwright.models.cad import kernel

    found = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    kernel.TopExp.MapShapes_s(shape, kernel.FACE, found)
    return [kernel.as_face(found.FindKey(i)) for i in range(1, found.Size() + 1)]
