"""The geometry everything works on: curves, surfaces, triangulations, grids, assemblies and the tolerances they imply."""

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
from patchwright.models.structured_grid import StructuredGrid
from patchwright.models.surface import Surface
from patchwright.models.tolerance import Tolerance
from patchwright.models.topology import EdgeUse, Topology
from patchwright.models.triangulation import Triangulation, concatenate

__all__ = [
    "Assembly",
    "CorruptFile",
    "EdgeUse",
    "EngineError",
    "GeometryError",
    "KnotError",
    "ParameterError",
    "Part",
    "RepairWarning",
    "StructuredGrid",
    "Surface",
    "Tolerance",
    "Topology",
    "Triangulation",
    "UnsupportedEntity",
    "UnsupportedFormat",
    "concatenate",
]
