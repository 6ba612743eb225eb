"""The paper's bicubic approximant: a C1 piecewise bicubic Bezier surface through a grid of points.

Source: Hamann, Jean, Razdan, section 3 (HJR 14-16): (3M + 1) x (3N + 1) control points, quadruple end knots, triple
interior knots. Departure: knots may be given (chord shares); the paper's uniform ones are the default.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.interpolation.local_slopes import parabola_slopes
from patchwright.models.nurbs_surface import NurbsSurface


def bicubic_approximant(
    points: Array, *, u: Array | None = None, v: Array | None = None, twist: str = "zero"
) -> NurbsSurface:
    """The C1 bicubic B-spline surface through a grid of points.

    Parameters
    ----------
    points : (M + 1, N + 1, 3), M, N >= 1
    u, v : (M + 1,), (N + 1,) increasing parameters from 0 to 1; default i / M and j / N (HJR 15)
    twist : "zero" (HJR 16), "adini" or "bessel"; how the four inner control points of each cell are set

    Raises
    ------
    ParameterError : too few points, parameters that do not increase, an unknown twist.
    """
    points = np.asarray(points, dtype=np.float64)
    if points.ndim != 3 or points.shape[2] != 3 or min(points.shape[:2]) < 2:
        raise ParameterError(f"an approximant needs a grid of at least 2 x 2 points, got shape {points.shape}")
    if twist not in TWISTS:
        raise ParameterError(f"unknown twist {twist!r}; known are {', '.join(sorted(TWISTS))}")
    xi = _sites(u, points.shape[0], "u")
    eta = _sites(v, points.shape[1], "v")
    x_u = parabola_slopes(xi, points)
    x_v = np.swapaxes(parabola_slopes(eta, np.swapaxes(points, 0, 1)), 0, 1)
    x_uv = TWISTS[twist](points, x_u, x_v, xi, eta)
    m, n = len(xi) - 1, len(eta) - 1
    control = np.empty((3 * m + 1, 3 * n + 1, 3))
    du, dv = np.diff(xi)[:, None, None] / 3.0, np.diff(eta)[None, :, None] / 3.0
    control[::3, ::3] = points
    control[1::3, ::3] = points[:-1] + du * x_u[:-1]
    control[2::3, ::3] = points[1:] - du * x_u[1:]
    control[::3, 1::3] = points[:, :-1] + dv * x_v[:, :-1]
    control[::3, 2::3] = points[:, 1:] - dv * x_v[:, 1:]
    for i, side_u in ((1, 1.0), (2, -1.0)):
        a = slice(None, -1) if i == 1 else slice(1, None)
        for j, side_v in ((1, 1.0), (2, -1.0)):
            b = slice(None, -1) if j == 1 else slice(1, None)
            corner = points[a, b] + side_u * du * x_u[a, b] + side_v * dv * x_v[a, b]
            control[i::3, j::3] = corner + side_u * side_v * du * dv * x_uv[a, b]  # HJR 16 where x_uv = 0
    return NurbsSurface((3, 3), (_knots(xi), _knots(eta)), control)


def _sites(given: Array | None, count: int, name: str) -> Array:
    sites = np.linspace(0.0, 1.0, count) if given is None else np.asarray(given, dtype=np.float64)
    if sites.shape != (count,) or not (np.diff(sites) > 0).all():
        raise ParameterError(f"{name} must be {count} increasing parameters")
    return sites


def _knots(sites: Array) -> Array:
    return np.concatenate([sites[:1].repeat(4), sites[1:-1].repeat(3), sites[-1:].repeat(4)])


def _zero(points: Array, x_u: Array, x_v: Array, xi: Array, eta: Array) -> Array:
    return np.zeros_like(points)


def _adini(points: Array, x_u: Array, x_v: Array, xi: Array, eta: Array) -> Array:
    """Adini's twist: of the bilinearly blended Coons patch over the 2 x 2 cells round each point."""
    d_u = np.gradient(x_v, xi, axis=0)
    d_v = np.gradient(x_u, eta, axis=1)
    return np.asarray(d_u + d_v - np.gradient(np.gradient(points, xi, axis=0), eta, axis=1))


def _bessel(points: Array, x_u: Array, x_v: Array, xi: Array, eta: Array) -> Array:
    """Bessel's twist: of the biquadratic through the 3 x 3 points round each point."""
    return np.swapaxes(parabola_slopes(eta, np.swapaxes(x_u, 0, 1)), 0, 1)


TWISTS: dict[str, Callable[[Array, Array, Array, Array, Array], Array]] = {
    "zero": _zero,
    "adini": _adini,
    "bessel": _bessel,
}
