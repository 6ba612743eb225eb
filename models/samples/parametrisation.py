"""Poor parametrisations: the same shape, run through at badly uneven speed."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_surface import NurbsSurface


def poor_parametrisation(surface: NurbsSurface, ratio: float = 20.0) -> NurbsSurface:
    """The same surface over the same domain, its speed at the ends of both directions `ratio` squared apart.

    Each parameter is composed with the monotone map u = t / (t + r (1 - t)) of the unit interval, r = `ratio`. A
    piecewise rational surface stays one of the same degree under such a map: knots move to t, weights are multiplied
    by products of the map's denominator (Piegl and Tiller, The NURBS Book, section 6.4). The shape is unchanged to
    round-off, the result is rational.
    """
    if not ratio > 0.0:
        raise ParameterError(f"the speed ratio must be positive, got {ratio:g}")
    weights = np.ones(surface.control_points.shape[:2]) if surface.weights is None else surface.weights
    U, in_u = _mapped(surface.degree[0], surface.knots[0], *surface.domain[0], ratio)
    V, in_v = _mapped(surface.degree[1], surface.knots[1], *surface.domain[1], ratio)
    return NurbsSurface(surface.degree, (U, V), surface.control_points, weights * in_u[:, None] * in_v[None])


def _mapped(degree: int, knots: Array, low: float, high: float, ratio: float) -> tuple[Array, Array]:
    """The moved knots and the factor of each control point's weight."""
    u = (knots - low) / (high - low)
    t = ratio * u / (1.0 + (ratio - 1.0) * u)
    # t + ratio (1 - t) at the new knot, scaled to stay near 1
    denominator = (t + ratio * (1.0 - t)) / np.sqrt(ratio)
    windows = np.lib.stride_tricks.sliding_window_view(denominator[1:-1], degree)
    moved = low + (high - low) * t
    moved[knots == low], moved[knots == high] = low, high
    return moved, np.asarray(windows.prod(axis=1))


def uneven_knots(surface: NurbsSurface, strength: float = 0.8, *, points: int = 40) -> NurbsSurface:
    """A bicubic interpolant on even knots of `points` squared surface points at wavy parameters: speed varies inside.

    The true parameter is u = t + strength sin(4 pi t) / (4 pi) on the unit interval, monotone below 1. The shape is
    kept up to the interpolation error, which falls with the fourth power of `points`.
    """
    from patchwright.models.samples.splines import cubic

    if not 0.0 <= strength < 1.0:
        raise ParameterError(f"the strength must be in [0, 1), got {strength:g}")
    t = np.linspace(0.0, 1.0, points)
    wavy = t + strength * np.sin(4.0 * np.pi * t) / (4.0 * np.pi)
    wavy[-1] = 1.0
    (u0, u1), (v0, v1) = surface.domain
    values = surface.grid(u0 + (u1 - u0) * wavy, v0 + (v1 - v0) * wavy)
    U, half = cubic(u0 + (u1 - u0) * t, values)
    V, net = cubic(v0 + (v1 - v0) * t, half.swapaxes(0, 1))
    return NurbsSurface((3, 3), (U, V), net.swapaxes(0, 1))
