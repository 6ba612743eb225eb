"""STEP and IGES files to assemblies. Runs where the CAD kernel may crash or hang: call it through `contained`."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.assembly import Assembly, Part
from patchwright.models.cad import kernel
from patchwright.models.cad.blocks import RawMesh
from patchwright.models.cad.connectivity import is_point
from patchwright.models.cad.convert_topology import convert_faces, trims_of
from patchwright.models.cad.names import face_index, names_of
from patchwright.models.cad.native import NativeFace, encode, faces_of
from patchwright.models.cad.tessellate import ANGLE, tessellate
from patchwright.models.errors import CorruptFile, RepairWarning, UnsupportedEntity
from patchwright.models.surface import Surface
from patchwright.models.topology import Topology
from patchwright.models.triangulation import Triangulation


def read_file(path: Path, kind: str, deflection: float | None = None, angle: float = ANGLE) -> Assembly:
    """All faces of a file of the kind "STEP" or "IGES", coordinates in mm.

    Raises
    ------
    CorruptFile : the kernel cannot parse the file; UnsupportedEntity : it holds no face.
    """
    kernel.Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    reader = kernel.STEPControl_Reader() if kind == "STEP" else kernel.IGESControl_Reader()
    if reader.ReadFile(str(path)) != kernel.DONE:
        raise CorruptFile(f"{path}: the CAD kernel cannot parse it as {kind}")
    if kind == "STEP":
        reader.SetSystemLengthUnit(1.0)
    else:
        reader.SetReadVisible(False)
    reader.TransferRoots()
    shape = reader.OneShape()
    if shape is None or shape.IsNull() or not faces_of(shape):
        raise UnsupportedEntity(f"{path}: the file holds no face{_contents(reader)}")
    names, bodies = names_of(reader, shape, faces_of(shape))
    return assembly_of(shape, names, bodies, str(path), deflection=deflection, angle=angle)


def assembly_of(
    shape: Any,
    names: list[str],
    bodies: list[str],
    source: str,
    *,
    faces: list[Any] | None = None,
    deflection: float | None = None,
    angle: float = ANGLE,
) -> Assembly:
    """A kernel shape (in mm) as an assembly: one part per face, with tessellation, topology and native handles.

    `faces` gives the parts' order, all distinct faces of the shape; None means the shape's own.
    """
    stored = faces_of(shape)
    faces = stored if faces is None else faces
    place = face_index(stored)
    meshes = tessellate(shape, faces, deflection, angle)
    converted = convert_faces(shape, faces)
    native = encode(shape, converted.edge_tolerances)
    parts, bare = [], []
    for i, (name, body, mesh) in enumerate(zip(names, bodies, meshes, strict=True)):
        surface = converted.surfaces[i]
        outward = faces[i].Orientation() != kernel.REVERSED
        if mesh is None:
            bare.append(name)
        trims = trims_of(converted.topology.loops[i])
        seamed = _is_seamed(converted.topology, i)
        triangulation = _triangulation(mesh, surface, float(converted.v_scale[i]), outward, seamed)
        parts.append(Part(name, triangulation, surface, trims, body, NativeFace(native, place.FindIndex(faces[i]) - 1)))
    if bare:
        which = ", ".join(bare[:3])
        warnings.warn(
            RepairWarning(f"{source}: {len(bare)} of {len(faces)} faces could not be tessellated ({which})"),
            stacklevel=2,
        )
    lost = [(n, why) for n, why in zip(names, converted.lost, strict=True) if why]
    if lost:
        warnings.warn(
            RepairWarning(f"{source}: {len(lost)} faces lost their loops; the first is {lost[0][0]}: {lost[0][1]}"),
            stacklevel=2,
        )
    return Assembly(tuple(parts), unit="mm", source=source, topology=converted.topology, native=native)


def _triangulation(
    mesh: RawMesh | None, surface: Surface, v_scale: float, outward: bool, seamed: bool
) -> Triangulation:
    """The mesh wound outward, its (u, v) in our parameters; equal nodes merged where there is a seam or a pole."""
    if mesh is None:
        return Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    nodes, uv, triangles = mesh
    if v_scale != 1.0:
        uv = uv * np.array([1.0, v_scale])
    low, high = np.array(surface.domain).T
    corner_uv, corners = np.clip(uv, low, high)[triangles], triangles
    if seamed:
        corners = _merged(nodes)[triangles]
        flat = (corners[:, 0] == corners[:, 1]) | (corners[:, 1] == corners[:, 2]) | (corners[:, 2] == corners[:, 0])
        corners, corner_uv = corners[~flat], corner_uv[~flat]
    if not outward:
        corners, corner_uv = corners[:, ::-1], corner_uv[:, ::-1]
    made = Triangulation(nodes, corners, uv=corner_uv)
    return made.compact() if seamed else made


def _merged(nodes: Array) -> IntArray:
    """(n,) for every node the first of those at exactly its place."""
    order = np.lexsort(nodes.T)
    fresh = np.ones(len(nodes), dtype=bool)
    fresh[1:] = (nodes[order][1:] != nodes[order][:-1]).any(axis=1)
    out = np.empty(len(nodes), dtype=np.int64)
    out[order] = order[np.flatnonzero(fresh)[np.cumsum(fresh) - 1]]
    return out


def _is_seamed(topology: Topology, face: int) -> bool:
    """Whether the face meets itself: an edge it uses twice, or a pole."""
    edges = [use.edge for loop in topology.loops[face] for use in loop]
    return not edges or len(set(edges)) < len(edges) or any(is_point(topology.curves[e]) for e in edges)


def _contents(reader: Any) -> str:
    """What a file without faces does hold, for the error's sentence."""
    model = reader.WS().Model()
    count = model.NbEntities()
    return f" ({count} entities, none of them a surface that can be used)" if count else " (it is empty)"
