"""Triangulations of a shape's faces with their (u, v), conforming along shared edges."""

from __future__ import annotations

from typing import Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad import kernel
from patchwright.models.cad.blocks import RawMesh, triangulations

DEFLECTION_SHARE = 2e-4  # of the box's diagonal: default distance between a face and its triangles
ANGLE = 0.25  # radians: default angle between neighbouring facets
_PARALLEL_FACES = 16  # below, starting threads costs more than it saves


def tessellate(shape: Any, faces: list[Any], deflection: float | None, angle: float = ANGLE) -> list[RawMesh | None]:
    """One mesh per face in the kernel's parameters, None where the kernel made none.

    Parameters
    ----------
    deflection : largest distance between a face and its triangles in mm; None means 2e-4 of the edges' diagonal
    angle : radians between neighbouring facets
    """
    length = DEFLECTION_SHARE * edge_diagonal(shape) if deflection is None else deflection
    if not length > 0.0:
        return [None] * len(faces)
    kernel.BRepMesh_IncrementalMesh(shape, length, False, angle, len(faces) >= _PARALLEL_FACES)
    return raw_meshes(faces)


def raw_meshes(faces: list[Any]) -> list[RawMesh | None]:
    """The triangulations the faces carry, None where there is none."""
    location = kernel.TopLoc_Location()
    known = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()  # copies of one face share one mesh
    meshes: list[Any] = []
    owner: list[int | None] = []
    transforms: list[Array | None] = []
    for face in faces:
        found = kernel.BRep_Tool.Triangulation_s(face, location)
        transforms.append(None if location.IsIdentity() else _matrix(location.Transformation()))
        if found is None or found.NbTriangles() == 0 or not found.HasUVNodes():
            owner.append(None)
            continue
        owner.append(known.Add(face.Located(kernel.TopLoc_Location())) - 1)
        if known.Size() > len(meshes):
            meshes.append(found)
    blocks = triangulations(meshes)
    out: list[RawMesh | None] = []
    for key, transform in zip(owner, transforms, strict=True):
        if key is None:
            out.append(None)
            continue
        nodes, uv, triangles = blocks[key]
        out.append((nodes if transform is None else nodes @ transform[:, :3].T + transform[:, 3], uv, triangles))
    return out


def edge_diagonal(shape: Any) -> float:
    """Diagonal of the box around five points of every edge: finite whatever the surfaces reach to."""
    edges = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    kernel.TopExp.MapShapes_s(shape, kernel.EDGE, edges)
    points = []
    for i in range(1, edges.Size() + 1):
        edge = kernel.as_edge(edges.FindKey(i))
        curve = kernel.BRep_Tool.Curve_s(edge, 0.0, 0.0)
        if curve is None:
            continue
        t0, t1 = kernel.BRep_Tool.Range_s(edge)
        if abs(t0) < 1e50 and abs(t1) < 1e50:
            points += [curve.Value(t0 + (t1 - t0) * share) for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    if not points:
        return 0.0
    low_high = np.array([(p.X(), p.Y(), p.Z()) for p in points])
    return float(np.linalg.norm(np.ptp(low_high, axis=0)))


def _matrix(transform: Any) -> Array:
    return np.array([[transform.Value(i, j) for j in range(1, 5)] for i in range(1, 4)])
