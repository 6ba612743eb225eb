"""Part names into STEP and IGES entities."""

from __future__ import annotations

from typing import Any

from patchwright.models.assembly import Assembly
from patchwright.models.cad import kernel
from patchwright.models.cad.names import bodies_of, children, face_index, unlocated
from patchwright.models.cad.native import faces_of

_LABEL = 8  # characters of an IGES label


def label_step(writer: Any, shape: Any, faces: list[Any], assembly: Assembly) -> None:
    """Names the faces after their parts, solids and shells after their bodies."""
    process = writer.WS().TransferWriter().FinderProcess()
    for face, part in zip(faces, assembly.parts, strict=True):
        _name_step(_step_entity(process, face), part.name)
    for body, name in _named_bodies(shape, faces, assembly):
        _name_step(_step_entity(process, body), name)


def label_iges(writer: Any, shape: Any, faces: list[Any], assembly: Assembly) -> None:
    """Names the B-rep faces after their parts: the label takes eight characters, a name property takes all."""
    model = writer.Model()
    entities = [model.Entity(i) for i in range(1, model.NbEntities() + 1)]
    shells = [e for e in entities if isinstance(e, kernel.IGESSolid_Shell)]
    index = face_index(faces)
    own = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    kernel.TopExp.MapShapes_s(shape, kernel.SHELL, own)
    listed = [children(own.FindKey(i), (kernel.FACE,)) for i in range(1, own.Size() + 1)]
    solids = [e for e in entities if isinstance(e, kernel.IGESSolid_ManifoldSolid)]
    bodies = _named_bodies(shape, faces, assembly)
    named = [(b, name) for b, name in bodies if b.ShapeType() == kernel.SOLID]
    if len(solids) == len(named):
        for entity, (_, name) in zip(solids, named, strict=True):
            _name_iges(writer, entity, name)
    if len(shells) != len(listed):
        return
    for number, (shell, inside) in enumerate(zip(shells, listed, strict=True), 1):
        for body, name in bodies:
            if body.IsSame(own.FindKey(number)):
                _name_iges(writer, shell, name)
        if shell.NbFaces() != len(inside):
            continue
        for place, face in enumerate(inside, 1):
            at = index.FindIndex(face) - 1
            if at >= 0:
                _name_iges(writer, shell.Face(place), assembly.parts[at].name)


def _named_bodies(shape: Any, faces: list[Any], assembly: Assembly) -> list[tuple[Any, str]]:
    index, out = face_index(faces), []
    for body in bodies_of(shape):
        names = {assembly.parts[i - 1].body for f in faces_of(body) if (i := index.FindIndex(f))}
        if len(names) == 1 and (name := names.pop()):
            out.append((body, name))
    return out


def _step_entity(process: Any, shape: Any) -> Any:
    """The entity of a shape; the writer knows what an assembly places by its form without the place."""
    found = kernel.STEPConstruct.FindEntity_s(process, shape)
    return kernel.STEPConstruct.FindEntity_s(process, unlocated(shape)) if found is None else found


def _name_step(item: Any, name: str) -> None:
    if item is not None:
        item.SetName(kernel.TCollection_HAsciiString(name))


def _name_iges(writer: Any, entity: Any, name: str) -> None:
    """Eight characters and a number as the label; any other name as a property beside its first eight characters."""
    stem = name.rstrip("0123456789")
    number = name[len(stem) :]
    if stem and len(stem) <= _LABEL and number and number[0] != "0" and len(number) <= _LABEL:
        entity.SetLabel(kernel.TCollection_HAsciiString(stem), int(number))
        return
    entity.SetLabel(kernel.TCollection_HAsciiString(name[:_LABEL]))
    if len(name) > _LABEL:
        whole = kernel.IGESBasic_Name()
        whole.Init(1, kernel.TCollection_HAsciiString(name))
        writer.AddEntity(whole)  # the model's own AddEntity takes milliseconds each
        entity.AddProperty(whole)
