"""CAD solids and damage of known kind and size done to their faces, by the CAD kernel alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_Copy,
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
)
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform as Transform
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepGProp import BRepGProp
from OCP.BRepOffsetAPI import BRepOffsetAPI_MakePipe
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere
from OCP.gp import gp_Ax1, gp_Ax2, gp_Circ, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.STEPControl import STEPControl_Reader, STEPControl_StepModelType, STEPControl_Writer
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Compound, TopoDS_Shell

SIZES = (10.0, 6.0, 4.0)
RADIUS = 1.0
ROUNDED_VOLUME = SIZES[0] * SIZES[1] * SIZES[2] - (4.0 - np.pi) * RADIUS**2 * SIZES[2]


def rounded_box():
    """A box with its four upright edges rounded: six planes, four cylinders that touch planes along lines."""
    box = BRepPrimAPI_MakeBox(*SIZES).Shape()
    fillet = BRepFilletAPI_MakeFillet(box)
    for edge in parts_of(box, TopAbs_ShapeEnum.TopAbs_EDGE):
        ends = BRepAdaptor_Curve(TopoDS.Edge(edge))
        a, b = ends.Value(ends.FirstParameter()), ends.Value(ends.LastParameter())
        if abs(a.Z() - b.Z()) > 1.0:
            fillet.Add(RADIUS, TopoDS.Edge(edge))
    return fillet.Shape()


def read_shape(path: Path):
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    return reader.OneShape()


def parts_of(shape, kind):
    """Distinct sub-shapes in the explorer's order."""
    found, explorer = [], TopExp_Explorer(shape, kind)
    while explorer.More():
        if not any(explorer.Current().IsSame(other) for other in found):
            found.append(explorer.Current())
        explorer.Next()
    return found


def faces_of(shape):
    return [TopoDS.Face(face) for face in parts_of(shape, TopAbs_ShapeEnum.TopAbs_FACE)]


def shifted(face, vector):
    """The face moved as a whole, its edges with it."""
    motion = gp_Trsf()
    motion.SetTranslation(gp_Vec(*map(float, vector)))
    return TopoDS.Face(Transform(face, motion, True).Shape())


def turned(face, axis, angle):
    """The face turned as a whole about its centre of area."""
    motion = gp_Trsf()
    motion.SetRotation(gp_Ax1(centre(face), gp_Dir(*map(float, axis))), float(angle))
    return TopoDS.Face(Transform(face, motion, True).Shape())


def shrunk(face, factor):
    """The face scaled about its centre of area; a plane stays the same plane."""
    motion = gp_Trsf()
    motion.SetScale(centre(face), float(factor))
    return TopoDS.Face(Transform(face, motion, True).Shape())


def reversed_face(face):
    """The face with its normal on the other side."""
    return TopoDS.Face(face.Reversed())


def with_own_edges(face):
    """A copy that shares no edge with any other face."""
    return TopoDS.Face(BRepBuilderAPI_Copy(face).Shape())


def pulled_back(face, width, which=0):
    """The face without the strip of a width along its longest edge (which=0), the next (1), ...; surface unchanged."""
    edges = [TopoDS.Edge(edge) for edge in parts_of(face, TopAbs_ShapeEnum.TopAbs_EDGE)]
    return without_strips(face, sorted(edges, key=length, reverse=True)[which : which + 1], width)


def cut_back(face, width):
    """The face without the strip of a width along all its edges; surface unchanged."""
    return without_strips(face, [TopoDS.Edge(edge) for edge in parts_of(face, TopAbs_ShapeEnum.TopAbs_EDGE)], width)


def without_strips(face, edges, width):
    left = face
    for edge in edges:
        curve = BRepAdaptor_Curve(edge)
        start, along = gp_Pnt(), gp_Vec()
        curve.D1(curve.FirstParameter(), start, along)
        ring = BRepBuilderAPI_MakeEdge(gp_Circ(gp_Ax2(start, gp_Dir(along)), width)).Edge()
        disc = BRepBuilderAPI_MakeFace(BRepBuilderAPI_MakeWire(ring).Wire()).Face()
        tube = BRepOffsetAPI_MakePipe(BRepBuilderAPI_MakeWire(edge).Wire(), disc).Shape()
        ends = [curve.Value(curve.FirstParameter()), curve.Value(curve.LastParameter())]
        for tool in (tube, *(BRepPrimAPI_MakeSphere(end, width).Shape() for end in ends)):
            left = BRepAlgoAPI_Cut(left, tool).Shape()
    (only,) = faces_of(left)
    return only


def length(edge) -> float:
    properties = GProp_GProps()
    BRepGProp.LinearProperties_s(edge, properties)
    return properties.Mass()


def perimeter_of(face) -> float:
    """The length of all edges of a face."""
    return sum(length(TopoDS.Edge(edge)) for edge in parts_of(face, TopAbs_ShapeEnum.TopAbs_EDGE))


def area_of(face) -> float:
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties)
    return properties.Mass()


def centre(face):
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties)
    return properties.CentreOfMass()


def written(path: Path, faces, damaged) -> Path:
    """All faces in one STEP file, the damaged ones outside the shell of the others; returns the path."""
    builder, shell, whole = BRep_Builder(), TopoDS_Shell(), TopoDS_Compound()
    builder.MakeShell(shell)
    builder.MakeCompound(whole)
    for i, face in enumerate(faces):
        if i in damaged:
            builder.Add(whole, face)
        else:
            builder.Add(shell, face)
    builder.Add(whole, shell)
    writer = STEPControl_Writer()
    writer.Transfer(whole, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))
    return path


def ring_of(faces, middle: int) -> list[int]:
    """Numbers of the faces that share an edge with one of them, its own among them."""
    edges = parts_of(faces[middle], TopAbs_ShapeEnum.TopAbs_EDGE)
    rows = [parts_of(face, TopAbs_ShapeEnum.TopAbs_EDGE) for face in faces]
    return [k for k, row in enumerate(rows) if any(a.IsSame(b) for a in row for b in edges)]


def solid_volume(shape) -> float:
    """The volume of the one solid of a shape that the kernel calls valid, by its exact surfaces."""
    (solid,) = parts_of(shape, TopAbs_ShapeEnum.TopAbs_SOLID)
    assert BRepCheck_Analyzer(solid).IsValid()
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid, properties, 1e-12)
    return properties.Mass()


def loosest(shape) -> float:
    """The largest tolerance of any edge."""
    edges = parts_of(shape, TopAbs_ShapeEnum.TopAbs_EDGE)
    return max(BRep_Tool.Tolerance_s(TopoDS.Edge(edge)) for edge in edges)
