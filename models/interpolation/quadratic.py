"""Quadratic B-spline interpolation at the maxima of the basis functions, and at the midpoints of the same knots.

Source: Cheng, Wang and Barsky 2001, see `maxima_knots`; the midpoint method is Marsden's, in the form the paper
compares with: the knots found by maxima, their midpoints as sites.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.interpolation.claims import Interpolated, scheme
from patchwright.models.interpolation.local_slopes import parabola_slopes
from patchwright.models.interpolation.maxima_knots import Ends, MaximaKnots, Meeting, maxima_knots
from patchwright.models.interpolation.splines import tangent
from patchwright.models.nurbs_curve import NurbsCurve


@scheme("quadratic-maxima", exact_degree=2, continuity=1, reach=None, least=3, source="Cheng, Wang, Barsky 2001")
def maxima(
    P: Array, s: Array, *, ends: Ends = "repeated",
    start_tangent: npt.ArrayLike | None = None, end_tangent: npt.ArrayLike | None = None,
) -> Interpolated:  # fmt: skip
    """The C1 quadratic whose points lie where the basis functions are greatest.

    Parameters
    ----------
    ends : "repeated" (3.5, the paper's maximum-1) or "stepped" (3.6, maximum-2)
    start_tangent, end_tangent : D_0 and D_n of (3.12), default Bessel's
    """
    found = maxima_knots(s, ends)
    return Interpolated(_solved(found.knots, s, P, start_tangent, end_tangent), s, _told(found))


@scheme(
    "quadratic-midpoint", exact_degree=2, continuity=1, reach=None, least=3,
    source="Marsden 1974, after Cheng, Wang, Barsky 2001",
)  # fmt: skip
def midpoint(
    P: Array, s: Array, *, ends: Ends = "repeated",
    start_tangent: npt.ArrayLike | None = None, end_tangent: npt.ArrayLike | None = None,
) -> Interpolated:  # fmt: skip
    """The C1 quadratic on the knots of `maxima` whose points lie midway between the knots: not at the parameters
    asked for. It is there to compare with, and oscillates where steps are unequal."""
    found = maxima_knots(s, ends)
    middles = (found.knots[2:-3] + found.knots[3:-2]) / 2.0
    return Interpolated(_solved(found.knots, middles, P, start_tangent, end_tangent), middles, _told(found))


def _solved(T: Array, s: Array, P: Array, start: npt.ArrayLike | None, end: npt.ArrayLike | None) -> NurbsCurve:
    """The quadratic on knots T (n + 6,) through P at s, one in each span, with its end derivatives, on [s_0, s_n]."""
    from scipy.linalg import LinAlgError, solve_banded

    from patchwright.models._nurbs_kernel import basis_table
    from patchwright.models.knots import locked

    slopes = parabola_slopes(s, P)
    D0, Dn = tangent(start, slopes[0], "start_tangent"), tangent(end, slopes[-1], "end_tangent")
    first, (values, slopes_of) = basis_table(locked(T), 2, locked(s), 1)
    n = len(s) - 1
    band = np.zeros((5, n + 3))  # rows: C'(s_0), C(s_0), ..., C(s_n), C'(s_n); two diagonals either side

    def put(row: IntArray, column: IntArray, value: Array) -> None:
        kept = value != 0.0  # a site that is a knot has its last function, zero there, one column further out
        band[(2 + row - column)[kept], column[kept]] = value[kept]

    for j in range(3):
        put(np.arange(1, n + 2), first + j, values[:, j])  # 3.11
        put(np.array([0, n + 2]), first[[0, -1]] + j, slopes_of[[0, -1], j])  # 3.12
    rhs = np.concatenate((D0[None], P, Dn[None]))
    try:
        net = solve_banded((2, 2), band, rhs, check_finite=False)
    except LinAlgError:
        net = np.full_like(rhs, np.nan)
    if not np.isfinite(net).all():
        raise ParameterError("the quadratic has no solution for these parameters: their steps are too unequal")
    return NurbsCurve(2, T, net).restricted(float(s[0]), float(s[-1]))


def _told(found: MaximaKnots) -> tuple[str, ...]:
    if found.meeting is Meeting.EXACT:
        return ()
    where = f" at points {', '.join(map(str, found.kept_apart))}" if found.kept_apart.size else ""
    return (f"{found.meeting.value}{where} (F = {found.F:.3e})",)
