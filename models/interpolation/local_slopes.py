"""Local schemes that differ only in their slopes: Catmull-Rom, Bessel, Akima, modified Akima and PCHIP.

Sources: Catmull and Rom, A class of local interpolating splines (1974), for unequal parameters in the form of Barry and
Goldman, SIGGRAPH 22 (1988) 199-204; de Boor, A Practical Guide to Splines (1978) ch. IV (Bessel, Akima); Akima,
J. ACM 17 (1970) 589-602; Moler, Makima piecewise cubic interpolation (2019); Fritsch and Butland, SIAM J. Sci. Stat.
Comput. 5 (1984) 300-304. The last three come from scipy and act on each coordinate alone, so that turning the points
does not quite turn the curve; the others are affine-invariant.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.interpolation.claims import Interpolated, scheme
from patchwright.models.interpolation.hermite import cubic_from_tangents


def parabola_slopes(s: Array, P: Array) -> Array:
    """(n + 1, ...) derivatives of the parabolas through three neighbouring points (Bessel) of P (n + 1, ...); of two
    points, of the line."""
    h = np.diff(s).reshape(-1, *(1,) * (P.ndim - 1))
    velocity = np.diff(P, axis=0) / h
    if len(P) == 2:
        return np.repeat(velocity, 2, axis=0)
    slopes = np.empty_like(P)
    slopes[1:-1] = (h[1:] * velocity[:-1] + h[:-1] * velocity[1:]) / (h[1:] + h[:-1])
    slopes[0] = 2.0 * velocity[0] - slopes[1]
    slopes[-1] = 2.0 * velocity[-1] - slopes[-2]
    return slopes


def _through(P: Array, s: Array, slopes: Array) -> Interpolated:
    return Interpolated(cubic_from_tangents(s, P, slopes, slopes), s)


@scheme("bessel", exact_degree=2, continuity=1, reach=2, least=3, source="de Boor 1978, IV")
def bessel(P: Array, s: Array) -> Interpolated:
    """Slopes of the parabola through each three neighbours."""
    return _through(P, s, parabola_slopes(s, P))


@scheme("catmull-rom", exact_degree=1, continuity=1, reach=2, source="Catmull, Rom 1974; Barry, Goldman 1988")
def catmull_rom(P: Array, s: Array) -> Interpolated:
    """Uniform, centripetal or chordal by its parameters; at the ends the point before the first is its mirror image,
    which makes the end slope that of the first chord."""
    slopes = parabola_slopes(s, P)  # at inner points the slopes of Barry and Goldman's pyramid
    slopes[0], slopes[-1] = (P[1] - P[0]) / (s[1] - s[0]), (P[-1] - P[-2]) / (s[-1] - s[-2])
    return _through(P, s, slopes)


@scheme("akima", exact_degree=1, continuity=1, reach=3, linear=False, least=3, source="Akima 1970")
def akima(P: Array, s: Array) -> Interpolated:
    """Slopes weighted against outliers."""
    from scipy.interpolate import Akima1DInterpolator

    return _through(P, s, np.asarray(Akima1DInterpolator(s, P, method="akima")(s, nu=1)))


@scheme("modified-akima", exact_degree=1, continuity=1, reach=3, linear=False, least=3, source="Moler 2019")
def modified_akima(P: Array, s: Array) -> Interpolated:
    """Akima's slopes with less overshoot beside flat stretches."""
    from scipy.interpolate import Akima1DInterpolator

    return _through(P, s, np.asarray(Akima1DInterpolator(s, P, method="makima")(s, nu=1)))


@scheme("pchip", exact_degree=1, continuity=1, reach=2, linear=False, monotone=True, source="Fritsch, Butland 1984")
def pchip(P: Array, s: Array) -> Interpolated:
    """Slopes that keep every coordinate monotone where the points are."""
    from scipy.interpolate import PchipInterpolator

    return _through(P, s, np.asarray(PchipInterpolator(s, P)(s, nu=1)))
