"""The geometry everything works on: curves, surfaces, triangulations, grids, assemblies and the tolerances they
imply."""

from patchwright.models.analytic import Cone, Cylinder, Plane, Sphere, Torus
from patchwright.models.assembly import Assembly, Part
from patchwright.models.errors import (
    CorruptFile,
    EngineError,
    GeometryError,
    KnotError,
    ParameterError,
    RepairWarning,
    UnsupportedEntity,
    UnsupportedFormat,
)
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.structured_grid import StructuredGrid
from patchwright.models.surface import Surface
from patchwright.models.tolerance import Tolerance
from patchwright.models.topology import EdgeUse, Topology
from patchwright.models.triangulation import Triangulation, concatenate

__all__ = [
    "Assembly",
    "Cone",
    "CorruptFile",
    "Cylinder",
    "EdgeUse",
    "EngineError",
    "GeometryError",
    "KnotError",
    "NurbsCurve",
    "NurbsSurface",
    "ParameterError",
    "Part",
    "Plane",
    "RepairWarning",
    "Sphere",
    "StructuredGrid",
    "Surface",
    "Tolerance",
    "Topology",
    "Torus",
    "Triangulation",
    "UnsupportedEntity",
    "UnsupportedFormat",
    "concatenate",
]
