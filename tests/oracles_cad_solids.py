"""CAD made by the CAD kernel alone: a box with all edges rounded, a tapered lofted wing, a tube with a hole."""

from __future__ import annotations

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepLib import BRepLib
from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.collections import HArray1_gp_Pnt
from OCP.Geom import Geom_CylindricalSurface
from OCP.Geom2d import Geom2d_Line
from OCP.GeomAbs import GeomAbs_Shape
from OCP.GeomAPI import GeomAPI_Interpolate
from OCP.gp import gp_Ax3, gp_Dir, gp_Dir2d, gp_Pnt, gp_Pnt2d
from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopoDS import TopoDS, TopoDS_Compound
from oracles_cad_damage import SIZES, parts_of

from patchwright.models.io import read


def stored(path, *shapes):
    """The kernel's shapes in one STEP file, read back as an assembly."""
    builder, whole = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(whole)
    for shape in shapes:
        builder.Add(whole, shape)
    writer = STEPControl_Writer()
    writer.Transfer(whole, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))
    return read(path)


def filleted_box(radius: float = 1.0):
    """Six planes, twelve cylinders, eight spheres, every edge smooth."""
    box = BRepPrimAPI_MakeBox(*SIZES).Shape()
    fillet = BRepFilletAPI_MakeFillet(box)
    for edge in parts_of(box, TopAbs_ShapeEnum.TopAbs_EDGE):
        fillet.Add(radius, TopoDS.Edge(edge))
    return fillet.Shape()


def airfoil(chord: float, twist: float, at: np.ndarray, thickness: float = 0.12) -> np.ndarray:
    """(41, 3) a NACA four-digit profile from the upper trailing edge round the nose; blunt, y constant."""
    x = 0.5 * (1.0 + np.cos(np.linspace(0.0, 2.0 * np.pi, 41)))
    half = 5 * thickness * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1015 * x**4)
    z = np.where(np.arange(41) <= 20, half, -half) + 0.04 * 4.0 * x * (1.0 - x)
    c, s = np.cos(twist), np.sin(twist)
    return at + chord * np.stack([c * x + s * z, np.zeros_like(x), c * z - s * x], axis=1)


def lofted_wing():
    """A solid of one skin, a blunt trailing edge and two flat ends."""
    loft = BRepOffsetAPI_ThruSections(True, False, 1e-6)
    for share in (0.0, 0.5, 1.0):
        points = airfoil(1.0 - 0.5 * share, 0.05 * share, np.array([0.4 * share, 3.0 * share, 0.1 * share**2]))
        stored = HArray1_gp_Pnt(1, len(points))
        for k, point in enumerate(points.tolist()):
            stored.SetValue(k + 1, gp_Pnt(*point))
        spline = GeomAPI_Interpolate(stored, False, 1e-9)
        spline.Perform()
        first, last = gp_Pnt(*points[0].tolist()), gp_Pnt(*points[-1].tolist())
        wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(spline.Curve()).Edge())
        wire.Add(BRepBuilderAPI_MakeEdge(last, first).Edge())
        loft.AddWire(wire.Wire())
    loft.Build()
    return loft.Shape()


def pierced_tube(corners: np.ndarray, radius: float = 1.0, height: float = 4.0):
    """The wall of a tube without the polygon of `corners` (k, 2), counter-clockwise in angle and height."""
    frame = gp_Ax3(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))
    surface = Geom_CylindricalSurface(frame, radius)
    wire = BRepBuilderAPI_MakeWire()
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        size = float(np.linalg.norm(b - a))
        line = Geom2d_Line(gp_Pnt2d(*a.tolist()), gp_Dir2d(*(b - a).tolist()))
        wire.Add(BRepBuilderAPI_MakeEdge(line, surface, 0.0, size).Edge())
    whole = BRepBuilderAPI_MakeFace(surface, 0.0, 2.0 * np.pi, 0.0, height, 1e-9).Face()
    pierced = BRepBuilderAPI_MakeFace(whole, TopoDS.Wire(wire.Wire().Reversed())).Face()
    BRepLib.BuildCurves3d_s(pierced, 1e-10, GeomAbs_Shape.GeomAbs_C1, 14, 100)
    return pierced
