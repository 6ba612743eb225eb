"""Global B-spline interpolation by scipy: C2 cubics with four kinds of ends, any degree, and Pollock's curve.

Source of the last: Pollock, Handbook of Time-Series Analysis, Signal Processing and Dynamics (1999), ch. 11: the
natural cubic in Bezier form at equal parameter steps.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.interpolation.claims import Interpolated, scheme
from patchwright.models.interpolation.local_slopes import parabola_slopes
from patchwright.models.nurbs_curve import NurbsCurve


def tangent(given: npt.ArrayLike | None, default: Array, name: str) -> Array:
    """(d,) the tangent given, or the default.

    Raises
    ------
    ParameterError : of another shape, or not finite.
    """
    if given is None:
        return default
    value = np.array(given, dtype=np.float64)
    if value.shape != default.shape or not np.isfinite(value).all():
        raise ParameterError(f"{name} must be {default.shape[0]} finite numbers, got {value.tolist()}")
    return value


def _spline(P: Array, s: Array, degree: int, ends: Any) -> Interpolated:
    from scipy.interpolate import make_interp_spline

    made = make_interp_spline(s, P, k=degree, bc_type=ends)
    return Interpolated(NurbsCurve(degree, made.t, made.c), s)


@scheme("c2-cubic", exact_degree=3, continuity=2, reach=None, least=4, source="de Boor 1978, IV")
def not_a_knot(P: Array, s: Array) -> Interpolated:
    """The C2 cubic with no knot at the second and the last but one point."""
    return _spline(P, s, 3, "not-a-knot")


@scheme("c2-cubic-natural", exact_degree=1, continuity=2, reach=None, least=3, source="de Boor 1978, IV")
def natural(P: Array, s: Array) -> Interpolated:
    """The C2 cubic of vanishing second derivative at its ends."""
    return _spline(P, s, 3, "natural")


@scheme("c2-cubic-clamped", exact_degree=2, continuity=2, reach=None, least=3, source="de Boor 1978, IV")
def clamped(
    P: Array, s: Array, *, start_tangent: npt.ArrayLike | None = None, end_tangent: npt.ArrayLike | None = None
) -> Interpolated:
    """The C2 cubic of given derivatives at its ends (None: of the parabola through the last three points); cubics
    with their own derivatives are reproduced."""
    slopes = parabola_slopes(s, P)
    first = tangent(start_tangent, slopes[0], "start_tangent")
    last = tangent(end_tangent, slopes[-1], "end_tangent")
    return _spline(P, s, 3, ([(1, first)], [(1, last)]))


@scheme("c2-cubic-periodic", exact_degree=0, continuity=2, reach=None, least=4, source="de Boor 1978, IV")
def periodic(P: Array, s: Array) -> Interpolated:
    """The closed C2 cubic; the last point repeats the first, and the curve is C2 there too."""
    if (P[0] != P[-1]).any():
        raise ParameterError(f"a closed curve needs its last point at its first, {P[0].tolist()}, got {P[-1].tolist()}")
    curve = _spline(P, s, 3, "periodic").curve.clamped()
    return Interpolated(curve, s)


@scheme("b-spline", exact_degree=5, continuity=4, reach=None, least=3, source="de Boor 1978, XIII")
def any_degree(P: Array, s: Array, *, degree: int = 5) -> Interpolated:
    """The C^(degree - 1) spline of the degree (from 1; the claims are for 5), whose knots are the points' parameters
    without the outermost, or their midpoints for even degrees; `degree` + 1 points at least."""
    if int(degree) != degree or degree < 1:
        raise ParameterError(f"the degree must be an integer of at least 1, got {degree}")
    if len(P) <= degree:
        raise ParameterError(f"degree {degree} needs at least {int(degree) + 1} points, got {len(P)}")
    return _spline(P, s, int(degree), None)


@scheme(
    "pollock", exact_degree=1, continuity=2, reach=None, least=3, parameters="uniform", fixed=True,
    source="Pollock 1999, ch. 11",
)  # fmt: skip
def pollock(P: Array, s: Array) -> Interpolated:
    """The natural C2 cubic at equal parameter steps.

    It is also what the vector equations p_1^k = 2 W_k - p_2^(k-1), p_2^k - p_1^(k-1) = 2 (p_1^k - p_2^(k-1)) of Fadhel
    and Omar give with the least bending energy.
    """
    return natural(P, s)
