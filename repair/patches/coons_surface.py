"""The exact bilinear Coons patch of four boundary curves as one NURBS surface.

Source: Coons 1967; Hamann, Jean and Razdan, section 3 (HJR 4) in its continuous form
S(u, v) = (1 - v) c_s(u) + v c_n(u) + (1 - u) c_w(v) + u c_e(v) - the bilinear surface of the four corners.
Every term is a B-spline, so the sum is one too and its borders are the curves themselves: a linear factor has its
Greville abscissae for ordinates, in whatever space. Rational curves are summed in homogeneous coordinates, which is the
same formula where their weights are 1 at the corners.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.knots import distinct, greville
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface

SAME = 1e-9  # of [0, 1]: knots nearer to each other are one


def coons_surface(south: NurbsCurve, north: NurbsCurve, west: NurbsCurve, east: NurbsCurve) -> NurbsSurface:
    """The Coons patch of curves on [0, 1] whose weights are 1 at their ends.

    Parameters
    ----------
    south, north : c_s(u) at v = 0 and c_n(u) at v = 1
    west, east : c_w(v) at u = 0 and c_e(v) at u = 1; corners must be equal, their mean is not taken

    Raises
    ------
    ParameterError : other ranges, weights of the ends that are not 1, corners that are apart by more than round-off,
        weights that vanish inside.
    """
    curves = (south, north, west, east)
    for curve in curves:
        if not np.allclose(curve.domain, (0.0, 1.0), rtol=0.0, atol=1e-15):
            raise ParameterError("a Coons surface is made of curves on [0, 1]")
        if curve.weights is not None and np.abs(curve.weights[[0, -1]] - 1.0).max() > 1e-12:
            raise ParameterError("a Coons surface is made of curves whose weights are 1 at the ends")
    size = max(float(np.ptp(c.control_points, axis=0).max()) for c in curves)
    corners = np.array([south(0.0) - west(0.0), south(1.0) - east(0.0), north(0.0) - west(1.0), north(1.0) - east(1.0)])
    if np.abs(corners).max() > 1e-9 * size:
        raise ParameterError(f"the four curves miss each other in a corner by {np.abs(corners).max():.3g}")
    south, north = _alike(south, north)
    west, east = _alike(west, east)
    s, n, w, e = (_homogeneous(curve) for curve in (south, north, west, east))
    u = greville(south.degree, south.knots)[:, None, None]
    v = greville(west.degree, west.knots)[None, :, None]
    bilinear = (1 - u) * ((1 - v) * s[0] + v * n[0]) + u * ((1 - v) * s[-1] + v * n[-1])
    net = (1 - v) * s[:, None] + v * n[:, None] + (1 - u) * w[None] + u * e[None] - bilinear  # HJR 4
    net[:, 0], net[:, -1] = s, n
    net[0], net[-1] = w, e
    rational = any(curve.rational for curve in curves)
    if rational and not (net[..., 3] > 0.0).all():
        raise ParameterError("the weights of the Coons surface vanish inside")
    return NurbsSurface.from_homogeneous(
        (south.degree, west.degree), (south.knots, west.knots), net if rational else net[..., :3], rational=rational
    )


def _homogeneous(curve: NurbsCurve) -> Array:
    """(n, 4) w x, w y, w z, w."""
    if curve.rational:
        return curve.homogeneous
    return np.concatenate([curve.control_points, np.ones((len(curve.control_points), 1))], axis=1)


def _alike(a: NurbsCurve, b: NurbsCurve) -> tuple[NurbsCurve, NurbsCurve]:
    """Both curves, clamped, in one spline space."""
    degree = max(a.degree, b.degree)
    a, b = (c.elevated(degree - c.degree) if c.degree < degree else c.clamped() for c in (a, b))
    return _with_knots_of(a, b), _with_knots_of(b, _with_knots_of(a, b))


def _with_knots_of(curve: NurbsCurve, other: NurbsCurve) -> NurbsCurve:
    values, counts = distinct(other.knots)
    extra = []
    for value, count in zip(values.tolist(), counts.tolist(), strict=True):
        own = curve.knots[np.abs(curve.knots - value) <= SAME]
        if SAME < value < 1.0 - SAME:
            extra += [float(own[0]) if len(own) else value] * max(0, count - len(own))
    return curve.insert_knots(extra) if extra else curve
