"""New parametrisations for old shapes: the same surface, its parameter lines spaced as they lie in space.

reparametrize(surface, 1e-4)                       one surface, or several that share sides
face_region(part)                                  the four sides of a trimmed CAD face
parametrisation_defect(surface)                    how far a parametrisation is from chord length
approximate_curve(curve, 1e-4)                     fewest points from arc length and curvature
distribution("tanh", 41, first=1e-4)               how points spread along a side, from 0 to 1
curve_parameters(curve, shares)                    the parameters whose arc lengths have these shares
surface_parameters(surface, shares_u, shares_v)    the same for both directions of a surface
compose_curve(curve, rational_linear(x, y))        the same curve, of the same degree, at another speed
"""

from patchwright.reparam.curve_sites import CurveApproximation, approximate_curve
from patchwright.reparam.defect import parametrisation_defect
from patchwright.reparam.distributions import DISTRIBUTIONS, Distribution, distribution
from patchwright.reparam.face_region import face_region
from patchwright.reparam.rational_linear import compose_curve, compose_surface, inverted, rational_linear
from patchwright.reparam.region import Region
from patchwright.reparam.reparametrize import Reparametrized, reparametrize
from patchwright.reparam.yu_soni import curve_parameters, surface_parameters

__all__ = [
    "DISTRIBUTIONS",
    "CurveApproximation",
    "Distribution",
    "Region",
    "Reparametrized",
    "approximate_curve",
    "face_region",
    "compose_curve",
    "compose_surface",
    "curve_parameters",
    "distribution",
    "inverted",
    "parametrisation_defect",
    "rational_linear",
    "reparametrize",
    "surface_parameters",
]
