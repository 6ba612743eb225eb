"""Assemblies to STEP and IGES files. Runs where the CAD kernel may crash or hang: call it through `contained`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly
from patchwright.models.cad import kernel
from patchwright.models.cad.build import build_faces, natural_face
from patchwright.models.cad.connectivity import components, is_closed
from patchwright.models.cad.convert_surface import surface_to_kernel, v_scale_of
from patchwright.models.cad.labels import label_iges, label_step
from patchwright.models.cad.names import bodies_of, face_index
from patchwright.models.cad.native import NativeFace, NativeShape, decode, decode_face, faces_of
from patchwright.models.errors import EngineError

_UNITS = {"mm": "MM", "cm": "CM", "m": "M", "km": "KM", "in": "INCH", "ft": "FT", "um": "UM"}


def write_file(
    path: Path,
    kind: str,
    assembly: Assembly,
    own_unit: str,
    file_unit: str,
    deviation: Array,
    volumes: dict[int, float],
) -> None:
    """The assembly's faces as STEP or IGES.

    Parameters
    ----------
    own_unit, file_unit : of the coordinates, and of the file
    deviation : (e,) as `build_faces`
    volumes : enclosed volume of closed components by their first face, where the caller knows it

    Raises
    ------
    EngineError : the kernel refuses a face or cannot write.
    """
    shape, faces = shape_of(assembly, deviation, volumes)
    label = label_step if kind == "STEP" else label_iges
    product = Path(assembly.source).stem
    write_shape(path, kind, shape, own_unit, file_unit, product, lambda writer: label(writer, shape, faces, assembly))


def write_shape(
    path: Path,
    kind: str,
    shape: Any,
    own_unit: str,
    file_unit: str,
    product: str = "",
    label: Callable[[Any], None] = lambda writer: None,
) -> None:
    """A kernel shape as STEP or IGES; `label` names what the writer has made of it.

    Raises
    ------
    EngineError : the kernel cannot write it.
    """
    kernel.Interface_Static.SetCVal_s("xstep.cascade.unit", _UNITS[own_unit])
    try:
        if kind == "STEP":
            _write_step(path, shape, file_unit, product or "patchwright", label)
        else:
            _write_iges(path, shape, file_unit, label)
    finally:
        kernel.Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")


def shape_of(assembly: Assembly, deviation: Array, volumes: dict[int, float] | None = None) -> tuple[Any, list[Any]]:
    """The kernel's shape of an assembly and its face of every part.

    The sewn native shape is taken as it is when it holds every part; otherwise the topology gives the edges (kept faces
    keep their own surface); otherwise native faces stay in their bodies and bare surfaces become faces of their own.
    """
    parts = assembly.parts
    own = assembly.native
    if isinstance(own, NativeShape) and all(
        isinstance(p.native, NativeFace) and p.native.shape.key == own.key for p in parts
    ):
        shape, faces = decode(own)
        chosen = [faces[p.native.index] for p in parts]
        if len({p.native.index for p in parts}) == len(faces):
            return shape, chosen
        return compound(_kept_bodies(assembly, list(range(len(parts))))), chosen
    if assembly.topology is not None:
        surfaces = {i: _native_surface(p.native) for i, p in enumerate(parts) if isinstance(p.native, NativeFace)}
        faces = build_faces(assembly, deviation, surfaces)
        groups = components(assembly.topology)
        closed = [is_closed(assembly.topology, g) for g in groups]
        known = volumes or {}
        bodies = [body_shape([faces[i] for i in g], c, known.get(g[0])) for g, c in zip(groups, closed, strict=True)]
        return compound(bodies), faces
    kept = [i for i, p in enumerate(parts) if isinstance(p.native, NativeFace)]
    made: dict[int, Any] = {i: decode_face(parts[i].native) for i in kept}
    for i, part in enumerate(parts):
        if i not in made and part.surface is not None:
            made[i] = natural_face(part.surface, *surface_to_kernel(part.surface))
    loose = [made[i] for i in range(len(parts)) if i not in set(kept)]
    listed = [made[i] for i in range(len(parts))]
    index = face_index(listed)
    # one flat compound in the order of the parts: the writer forgets the names inside a compound within another
    bodies = sorted(
        [*_kept_bodies(assembly, kept), *loose],
        key=lambda body: min(index.FindIndex(f) or math.inf for f in faces_of(body)),
    )
    return compound(bodies), listed


def _native_surface(native: NativeFace) -> tuple[Any, float]:
    """The kernel's surface of a kept face, and the factor from our v to its."""
    surface = kernel.BRep_Tool.Surface_s(decode_face(native))
    return surface, 1.0 / v_scale_of(surface)


def _kept_bodies(assembly: Assembly, kept: list[int]) -> list[Any]:
    """Native faces in their own solids and shells where those are whole, in shells of what is left otherwise."""
    builder = kernel.BRep_Builder()
    shapes: dict[str, NativeShape] = {}
    wanted: dict[str, Any] = {}
    for i in kept:
        native: NativeFace = assembly.parts[i].native
        shapes.setdefault(native.shape.key, native.shape)
        if native.shape.key not in wanted:
            wanted[native.shape.key] = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
        wanted[native.shape.key].Add(decode_face(native))
    out = []
    for key, shape in shapes.items():
        placed = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
        for body in bodies_of(decode(shape)[0]):
            own = faces_of(body)
            inside = [f for f in own if wanted[key].Contains(f)]
            if len(inside) == len(own):
                out.append(body)
            elif inside:
                shell = kernel.TopoDS_Shell()
                builder.MakeShell(shell)
                for face in inside:
                    builder.Add(shell, face)
                out.append(shell)
            for face in inside:
                placed.Add(face)
        for i in range(1, wanted[key].Size() + 1):
            if not placed.Contains(wanted[key].FindKey(i)):
                out.append(wanted[key].FindKey(i))
    return out


def body_shape(faces: list[Any], closed: bool, volume: float | None = None, voids: Sequence[list[Any]] = ()) -> Any:
    """A face alone, an open shell, or a solid turned outward by its volume (by the kernel where that is unknown).

    A solid with `voids`, the faces of each, is left as its shells are turned.
    """
    if len(faces) == 1 and not closed:
        return faces[0]
    shell = _shell(faces, closed)
    if not closed:
        return shell
    builder, solid = kernel.BRep_Builder(), kernel.TopoDS_Solid()
    builder.MakeSolid(solid)
    builder.Add(solid, shell if volume is None or volume > 0.0 else shell.Reversed())
    for inner in voids:
        builder.Add(solid, _shell(inner, True))
    if volume is None and not voids:
        kernel.BRepLib.OrientClosedSolid_s(solid)
    return solid


def _shell(faces: list[Any], closed: bool) -> Any:
    builder, shell = kernel.BRep_Builder(), kernel.TopoDS_Shell()
    builder.MakeShell(shell)
    for face in faces:
        builder.Add(shell, face)
    shell.Closed(closed)
    return shell


def compound(shapes: list[Any]) -> Any:
    """One shape as it is, several as a compound."""
    if len(shapes) == 1:
        return shapes[0]
    builder, out = kernel.BRep_Builder(), kernel.TopoDS_Compound()
    builder.MakeCompound(out)
    for shape in shapes:
        builder.Add(out, shape)
    return out


def _write_step(path: Path, shape: Any, unit: str, product: str, label: Callable[[Any], None]) -> None:
    static = kernel.Interface_Static
    static.SetCVal_s("write.step.unit", _UNITS[unit])
    static.SetCVal_s("write.step.product.name", product)
    writer = kernel.STEPControl_Writer()
    if writer.Transfer(shape, kernel.STEPControl_StepModelType.STEPControl_AsIs) != kernel.DONE:
        raise EngineError(f"the CAD kernel cannot turn {product} into STEP")
    label(writer)
    text = kernel.StepData_StepWriter(writer.Model())
    _all_digits(text.FloatWriter())
    text.SendModel(kernel.StepAP214.Protocol_s())
    _print(text, path)


def _write_iges(path: Path, shape: Any, unit: str, label: Callable[[Any], None]) -> None:
    kernel.Interface_Static.SetCVal_s("write.iges.unit", _UNITS[unit])
    writer = kernel.IGESControl_Writer(_UNITS[unit], 1)  # 1: boundary model (type 186), faces share edges
    if not writer.AddShape(shape):
        raise EngineError(f"the CAD kernel cannot turn the model into IGES for {path.name}")
    label(writer)
    writer.ComputeModel()
    text = kernel.IGESData_IGESWriter(writer.Model())
    _all_digits(text.FloatWriter())
    text.SendModel(kernel.IGESSelect_WorkLibrary.DefineProtocol_s())
    _print(text, path)


def _all_digits(numbers: Any) -> None:
    """Has numbers written so that they come back bit for bit: the kernel keeps 6 decimals in IGES, 12 in STEP."""
    numbers.SetFormat("%.16E")
    numbers.SetFormatForRange("%#.17g", 0.1, 1000.0)
    numbers.SetZeroSuppress(False)  # it cuts a number at its first run of zeros


def _print(text: Any, path: Path) -> None:
    stream = BytesIO()
    if not text.Print(stream):
        raise EngineError(f"the CAD kernel cannot write {path.name}")
    path.write_bytes(stream.getvalue())
