"""The shim: the one place that imports OCP, so that a kernel release that renames things costs one file.

Importing this module takes about a second and removes the kernel's message printers. Units: the kernel's length unit is
process-wide; everything here is in millimetres and scaling is done by the caller.
"""

from __future__ import annotations

from OCP.BinTools import BinTools, BinTools_FormatVersion
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_Sewing
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepLib import BRepLib
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools, BRepTools_WireExplorer
from OCP.collections import (
    Array1_double,
    Array1_gp_Pnt,
    Array1_gp_Pnt2d,
    Array1_int,
    Array2_double,
    Array2_gp_Pnt,
    IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher,
    List_TopoDS_Shape,
)
from OCP.Geom import (
    Geom_BezierCurve,
    Geom_BezierSurface,
    Geom_BSplineCurve,
    Geom_BSplineSurface,
    Geom_Circle,
    Geom_ConicalSurface,
    Geom_CylindricalSurface,
    Geom_Ellipse,
    Geom_Line,
    Geom_Plane,
    Geom_RectangularTrimmedSurface,
    Geom_SphericalSurface,
    Geom_SurfaceOfLinearExtrusion,
    Geom_SurfaceOfRevolution,
    Geom_ToroidalSurface,
    Geom_TrimmedCurve,
)
from OCP.Geom2d import (
    Geom2d_BezierCurve,
    Geom2d_BSplineCurve,
    Geom2d_Circle,
    Geom2d_Ellipse,
    Geom2d_Line,
    Geom2d_TrimmedCurve,
)
from OCP.GeomAbs import GeomAbs_Shape
from OCP.GeomConvert import GeomConvert, GeomConvert_ApproxSurface
from OCP.gp import gp_Ax3, gp_Dir, gp_Pnt, gp_Pnt2d
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.IGESBasic import IGESBasic_Name
from OCP.IGESControl import IGESControl_Controller, IGESControl_Reader, IGESControl_Writer
from OCP.IGESData import IGESData_IGESEntity, IGESData_IGESWriter
from OCP.IGESGeom import IGESGeom_BoundedSurface, IGESGeom_BSplineSurface, IGESGeom_TrimmedSurface
from OCP.IGESSelect import IGESSelect_WorkLibrary
from OCP.IGESSolid import IGESSolid_Face, IGESSolid_ManifoldSolid, IGESSolid_Shell
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.Standard import Standard_Failure
from OCP.StepAP214 import StepAP214
from OCP.StepBasic import StepBasic_ProductDefinition
from OCP.STEPConstruct import STEPConstruct
from OCP.STEPControl import STEPControl_Controller, STEPControl_Reader, STEPControl_StepModelType, STEPControl_Writer
from OCP.StepData import StepData_StepWriter
from OCP.StepGeom import StepGeom_Surface
from OCP.StepRepr import StepRepr_RepresentationItem
from OCP.StepShape import (
    StepShape_ConnectedFaceSet,
    StepShape_FaceSurface,
    StepShape_ShellBasedSurfaceModel,
    StepShape_SolidModel,
)
from OCP.TCollection import TCollection_HAsciiString
from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
from OCP.TopExp import TopExp
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import (
    TopoDS,
    TopoDS_Compound,
    TopoDS_Edge,
    TopoDS_Face,
    TopoDS_Iterator,
    TopoDS_Shape,
    TopoDS_Shell,
    TopoDS_Solid,
    TopoDS_Vertex,
    TopoDS_Wire,
)

__all__ = [
    "Array1_double",
    "Array1_gp_Pnt",
    "Array1_gp_Pnt2d",
    "Array1_int",
    "Array2_double",
    "Array2_gp_Pnt",
    "BRepAdaptor_Curve",
    "BRepAlgoAPI_Fuse",
    "BRepBuilderAPI_MakeEdge",
    "BRepBuilderAPI_MakeFace",
    "BRepBuilderAPI_Sewing",
    "BRepCheck_Analyzer",
    "BRepLib",
    "BRepMesh_IncrementalMesh",
    "BRepTools",
    "BRepTools_WireExplorer",
    "BRep_Builder",
    "BRep_Tool",
    "BinTools",
    "BinTools_FormatVersion",
    "COMPOUND",
    "DONE",
    "EDGE",
    "FACE",
    "FORWARD",
    "Geom2d_BSplineCurve",
    "Geom2d_BezierCurve",
    "Geom2d_Circle",
    "Geom2d_Ellipse",
    "Geom2d_Line",
    "Geom2d_TrimmedCurve",
    "GeomAbs_Shape",
    "GeomConvert",
    "GeomConvert_ApproxSurface",
    "Geom_BSplineCurve",
    "Geom_BSplineSurface",
    "Geom_BezierCurve",
    "Geom_BezierSurface",
    "Geom_ConicalSurface",
    "Geom_CylindricalSurface",
    "Geom_Circle",
    "Geom_Ellipse",
    "Geom_Line",
    "Geom_Plane",
    "Geom_RectangularTrimmedSurface",
    "Geom_SphericalSurface",
    "Geom_SurfaceOfLinearExtrusion",
    "Geom_SurfaceOfRevolution",
    "Geom_ToroidalSurface",
    "Geom_TrimmedCurve",
    "IFSelect_ReturnStatus",
    "IGESBasic_Name",
    "IGESControl_Controller",
    "IGESControl_Reader",
    "IGESControl_Writer",
    "IGESData_IGESEntity",
    "IGESData_IGESWriter",
    "IGESGeom_BSplineSurface",
    "IGESGeom_BoundedSurface",
    "IGESGeom_TrimmedSurface",
    "IGESSelect_WorkLibrary",
    "IGESSolid_Face",
    "IGESSolid_ManifoldSolid",
    "IGESSolid_Shell",
    "IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher",
    "Interface_Static",
    "List_TopoDS_Shape",
    "Message",
    "REVERSED",
    "SHELL",
    "SOLID",
    "STEPConstruct",
    "STEPControl_Controller",
    "STEPControl_Reader",
    "STEPControl_StepModelType",
    "STEPControl_Writer",
    "Standard_Failure",
    "StepAP214",
    "StepBasic_ProductDefinition",
    "StepData_StepWriter",
    "StepGeom_Surface",
    "StepRepr_RepresentationItem",
    "StepShape_ConnectedFaceSet",
    "StepShape_FaceSurface",
    "StepShape_ShellBasedSurfaceModel",
    "StepShape_SolidModel",
    "TCollection_HAsciiString",
    "TopAbs_Orientation",
    "TopAbs_ShapeEnum",
    "TopExp",
    "TopLoc_Location",
    "TopoDS",
    "TopoDS_Compound",
    "TopoDS_Edge",
    "TopoDS_Face",
    "TopoDS_Iterator",
    "TopoDS_Shape",
    "TopoDS_Shell",
    "TopoDS_Solid",
    "TopoDS_Vertex",
    "TopoDS_Wire",
    "VERTEX",
    "WIRE",
    "as_edge",
    "as_face",
    "as_shell",
    "as_solid",
    "as_vertex",
    "as_wire",
    "gp_Ax3",
    "gp_Dir",
    "gp_Pnt",
    "gp_Pnt2d",
]

for _printer in list(Message.DefaultMessenger_s().Printers()):
    Message.DefaultMessenger_s().RemovePrinter(_printer)
STEPControl_Controller.Init_s()
IGESControl_Controller.Init_s()

FACE, EDGE, VERTEX = TopAbs_ShapeEnum.TopAbs_FACE, TopAbs_ShapeEnum.TopAbs_EDGE, TopAbs_ShapeEnum.TopAbs_VERTEX
WIRE, SHELL, SOLID = TopAbs_ShapeEnum.TopAbs_WIRE, TopAbs_ShapeEnum.TopAbs_SHELL, TopAbs_ShapeEnum.TopAbs_SOLID
COMPOUND = TopAbs_ShapeEnum.TopAbs_COMPOUND
FORWARD, REVERSED = TopAbs_Orientation.TopAbs_FORWARD, TopAbs_Orientation.TopAbs_REVERSED
DONE = IFSelect_ReturnStatus.IFSelect_RetDone

as_face, as_edge, as_vertex = TopoDS.Face, TopoDS.Edge, TopoDS.Vertex
as_wire, as_shell, as_solid = TopoDS.Wire, TopoDS.Shell, TopoDS.Solid
