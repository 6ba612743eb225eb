"""The CAD kernel (OpenCASCADE through OCP), kept behind `kernel` and run in a child process (`contained`).

`sew`, `free_edge_curve`, `measure_seams` and `brep_status` work on assemblies read from STEP and IGES or built with a
topology; importing this package does not import the kernel.
"""

from patchwright.models.cad.seams import Seam, edge_deviation, measure_seams
from patchwright.models.cad.sewing import FreeEdgeCurve, SewnResult, free_edge_curve, sew, surface_difference
from patchwright.models.cad.status import BrepStatus, FaceStatus, brep_status

__all__ = [
    "BrepStatus",
    "FaceStatus",
    "FreeEdgeCurve",
    "Seam",
    "SewnResult",
    "brep_status",
    "edge_deviation",
    "free_edge_curve",
    "measure_seams",
    "sew",
    "surface_difference",
]
