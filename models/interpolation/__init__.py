"""Curves and surfaces through points: one registry of schemes, one call.

interpolate(points, "catmull-rom", "centripetal")      the curve
interpolated(points, "quadratic-maxima").notes         the curve with its parameters and what could not be met
interpolate_surface(grid, "c2-cubic")                  the surface
SCHEMES["pchip"].monotone                              what a scheme claims
"""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from patchwright.models.errors import ParameterError
from patchwright.models.interpolation import (  # noqa: F401 - their schemes register themselves
    geometric_bezier,
    local_slopes,
    quadratic,
    rational_ball,
    splines,
    tcb,
)
from patchwright.models.interpolation.claims import SCHEMES, Interpolated, Scheme, scheme_named
from patchwright.models.interpolation.parameters import Wanted, checked_points, parametrize
from patchwright.models.interpolation.surface import interpolate_surface
from patchwright.models.nurbs_curve import NurbsCurve

__all__ = [
    "SCHEMES",
    "Interpolated",
    "Scheme",
    "interpolate",
    "interpolate_surface",
    "interpolated",
    "parametrize",
]


def interpolate(
    points: npt.ArrayLike, scheme: str = "c2-cubic", parameters: Wanted | None = None, **options: Any
) -> NurbsCurve:
    """The curve through points (n + 1, d), in the order given; see `interpolated` for what it could not meet.

    Parameters
    ----------
    scheme : a name in SCHEMES
    parameters : "uniform", "chord", "centripetal", "foley-nielson", "abscissa", an exponent of the chord length, or
        (n + 1,) increasing numbers; None: the scheme's own, "centripetal" unless it claims another
    options : those of the scheme, see SCHEMES[name].options

    Raises
    ------
    ParameterError : coincident neighbours, too few points, NaN, an option or parameters the scheme does not take.
    """
    return interpolated(points, scheme, parameters, **options).curve


def interpolated(
    points: npt.ArrayLike, scheme: str = "c2-cubic", parameters: Wanted | None = None, **options: Any
) -> Interpolated:
    """As `interpolate`, with the parameters of the points and a note for each condition that could not be met."""
    found = scheme_named(scheme)
    P = checked_points(points)
    if found.dimension is not None and P.shape[1] != found.dimension:
        raise ParameterError(f"{scheme} takes points in {found.dimension}-D, got {P.shape[1]}-D")
    if found.fixed and parameters is not None and not (isinstance(parameters, str) and parameters == found.parameters):
        raise ParameterError(f'{scheme} has its own parameters, "{found.parameters}", and takes no others')
    s = parametrize(P, found.parameters if parameters is None else parameters)
    return found(P, s, options)
