"""Names of faces and bodies as a STEP or IGES file gives them."""

from __future__ import annotations

from typing import Any

from patchwright.models.cad import kernel
from patchwright.models.cad.native import faces_of

_FEW = 100  # bodies: above, the kernel's search for each one's entity takes too long
_NO_NAME = {"", "none", "unknown", "noname"}


def names_of(reader: Any, shape: Any, faces: list[Any]) -> tuple[list[str], list[str]]:
    """Per face its own name and its body's; unnamed faces are "face-12", bodies take the product's name."""
    transfer = reader.WS().TransferReader()
    process = transfer.TransientProcess()
    entities = [process.Mapped(i) for i in range(1, process.NbMapped() + 1)]
    products = [
        name for e in entities if isinstance(e, kernel.StepBasic_ProductDefinition) if (name := _product_name(e))
    ]
    named = any(_entity_name(e) for e in entities if _is_face(e))
    own = _face_names(transfer, shape, faces) if named else {}
    return [own.get(i, f"face-{i + 1}") for i in range(len(faces))], _body_names(transfer, shape, faces, products)


def unlocated(shape: Any) -> Any:
    """The shape as the file defines it, without the place an assembly puts it."""
    return shape.Located(kernel.TopLoc_Location())


def children(shape: Any, kinds: tuple[Any, ...]) -> list[Any]:
    """The direct sub-shapes of the kinds, in stored order."""
    out, it = [], kernel.TopoDS_Iterator(shape)
    while it.More():
        if it.Value().ShapeType() in kinds:
            out.append(it.Value())
        it.Next()
    return out


def bodies_of(shape: Any) -> list[Any]:
    """Every solid, and every shell that belongs to none."""
    solids = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    kernel.TopExp.MapShapes_s(shape, kernel.SOLID, solids)
    shells = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    inner = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    kernel.TopExp.MapShapes_s(shape, kernel.SHELL, shells)
    for i in range(1, solids.Size() + 1):
        kernel.TopExp.MapShapes_s(solids.FindKey(i), kernel.SHELL, inner)
    loose = [shells.FindKey(i) for i in range(1, shells.Size() + 1) if not inner.Contains(shells.FindKey(i))]
    return [solids.FindKey(i) for i in range(1, solids.Size() + 1)] + loose


def face_index(faces: list[Any]) -> Any:
    """The kernel's map from a face (whatever its orientation) to its place, counted from 1."""
    index = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    for face in faces:
        index.Add(face)
    return index


def _is_face(entity: Any) -> bool:
    step = (kernel.StepShape_FaceSurface, kernel.StepGeom_Surface)
    trimmed = (kernel.IGESGeom_TrimmedSurface, kernel.IGESGeom_BoundedSurface, kernel.IGESGeom_BSplineSurface)
    return isinstance(entity, (*step, *trimmed, kernel.IGESSolid_Face))


def _entity_name(entity: Any) -> str:
    text = ""
    if isinstance(entity, kernel.StepRepr_RepresentationItem):
        name = entity.Name()
        text = "" if name is None else name.ToCString()
    elif isinstance(entity, kernel.IGESData_IGESEntity):
        text = entity.NameValue().ToCString() if entity.HasName() else ""
        label = entity.ShortLabel().ToCString().strip() if entity.HasShortLabel() else ""
        number = entity.SubScriptNumber() if entity.HasSubScriptNumber() else 0
        if label and text.startswith(label) and text.rstrip().endswith(f"({number})"):
            text = f"{label}{number}"  # the kernel's rendering of label and subscript is padded with blanks
    elif isinstance(entity, kernel.StepBasic_ProductDefinition):
        text = _product_name(entity)
    text = text.strip()
    return "" if text.lower() in _NO_NAME else text


def _product_name(definition: Any) -> str:
    formation = definition.Formation()
    product = None if formation is None else formation.OfProduct()
    name = None if product is None or product.Name() is None else product.Name().ToCString().strip()
    return "" if name is None or name.lower() in _NO_NAME else name


def _face_names(transfer: Any, shape: Any, faces: list[Any]) -> dict[int, str]:
    """Names by the faces' places."""
    plain = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    for face in faces:
        plain.Add(unlocated(face))
    process = transfer.TransientProcess()
    entities = [e for i in range(1, process.NbMapped() + 1) if _is_face(e := process.Mapped(i))]
    by_plain: dict[int, str] = {}
    for entity in entities:
        if isinstance(entity, kernel.StepRepr_RepresentationItem) and (name := _entity_name(entity)):
            found = kernel.STEPConstruct.FindShape_s(process, entity)
            if found is not None and not found.IsNull():
                for face in [found] if found.ShapeType() == kernel.FACE else faces_of(found):
                    by_plain[plain.FindIndex(unlocated(face))] = name
    for shell, entity in _iges_shells(transfer, shape, entities):
        for place, face in enumerate(children(shell, (kernel.FACE,)), 1):
            by_plain[plain.FindIndex(unlocated(face))] = _entity_name(entity.Face(place))
    out = {}
    for i, face in enumerate(faces):
        number = plain.FindIndex(unlocated(face))
        if number not in by_plain and entities and isinstance(entities[0], kernel.IGESData_IGESEntity):
            by_plain[number] = _entity_name(transfer.EntityFromShapeResult(unlocated(face), 1))
        if by_plain.get(number):
            out[i] = by_plain[number]
    return out


def _iges_shells(transfer: Any, shape: Any, entities: list[Any]) -> list[tuple[Any, Any]]:
    """Kernel shells and their IGES entities with as many faces.

    The kernel finds a shape's entity by a scan over all, so it is asked per shell and the faces follow in order.
    """
    if not any(isinstance(e, kernel.IGESSolid_Face) for e in entities):
        return []
    shells = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    kernel.TopExp.MapShapes_s(shape, kernel.SHELL, shells)
    out = []
    for i in range(1, shells.Size() + 1):
        shell = unlocated(shells.FindKey(i))
        entity = transfer.EntityFromShapeResult(shell, 1)
        if isinstance(entity, kernel.IGESSolid_Shell) and entity.NbFaces() == len(children(shell, (kernel.FACE,))):
            out.append((shell, entity))
    return out


def _body_names(transfer: Any, shape: Any, faces: list[Any], products: list[str]) -> list[str]:
    """A body's own name, else its product's, else its kind and number; equal names are told apart by a number."""
    index = face_index(faces)
    names: list[str] = [""] * len(faces)
    bodies = bodies_of(shape)
    own = _step_body_names(transfer, bodies)
    raw = []
    for number, body in enumerate(bodies, 1):
        name = own.get(number, "")
        if not name and len(bodies) <= _FEW:
            name = _entity_name(transfer.EntityFromShapeResult(unlocated(body), 1))
        if not name and len(set(products)) == 1:
            name = products[0]
        raw.append(name or (f"solid-{number}" if body.ShapeType() == kernel.SOLID else f"shell-{number}"))
    seen: dict[str, int] = {}
    for name, body in zip(raw, bodies, strict=True):
        seen[name] = seen.get(name, 0) + 1
        unique = name if seen[name] == 1 else f"{name}-{seen[name]}"
        for face in faces_of(body):
            at = index.FindIndex(face) - 1
            names[at] = names[at] or unique
    return names


def _step_body_names(transfer: Any, bodies: list[Any]) -> dict[int, str]:
    """Names of the STEP entities of solids and shells, by the body's number."""
    places = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    for body in bodies:
        places.Add(unlocated(body))
    process = transfer.TransientProcess()
    out: dict[int, str] = {}
    kinds = (kernel.StepShape_SolidModel, kernel.StepShape_ConnectedFaceSet, kernel.StepShape_ShellBasedSurfaceModel)
    for i in range(1, process.NbMapped() + 1):
        entity = process.Mapped(i)
        if isinstance(entity, kinds) and (name := _entity_name(entity)):
            found = kernel.STEPConstruct.FindShape_s(process, entity)
            if found is not None and not found.IsNull() and (at := places.FindIndex(unlocated(found))):
                out.setdefault(at, name)
    return out
