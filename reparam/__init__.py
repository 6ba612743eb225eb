"""New parametrisations for old shapes.

distribution("tanh", 41, first=1e-4)                   how points spread along a side, from 0 to 1
curve_parameters(curve, shares)                        the parameters whose arc lengths have these shares
surface_parameters(surface, shares_u, shares_v)        the same for both directions of a surface
compose_curve(curve, rational_linear(x, y))            the same curve, of the same degree, at another speed
"""

from patchwright.reparam.distributions import DISTRIBUTIONS, Distribution, distribution
from patchwright.reparam.rational_linear import compose_curve, compose_surface, inverted, rational_linear
from patchwright.reparam.yu_soni import curve_parameters, surface_parameters

__all__ = [
    "DISTRIBUTIONS",
    "Distribution",
    "compose_curve",
    "compose_surface",
    "curve_parameters",
    "distribution",
    "inverted",
    "rational_linear",
    "surface_parameters",
]
