"""The exact bilinear Coons patch of four boundary curves as one B-spline surface.

Source: Coons 1967; Hamann, Jean and Razdan, section 3 (HJR 4) in its continuous form
S(u, v) = (1 - v) c_s(u) + v c_n(u) + (1 - u) c_w(v) + u c_e(v) - the bilinear surface of the four corners.
Every term is a B-spline, so the sum is one too and its borders are the curves themselves.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.knots import distinct
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface

SAME = 1e-9  # of [0, 1]: knots nearer to each other are one
_LINE = np.array([0.0, 0.0, 1.0, 1.0])


def coons_surface(south: NurbsCurve, north: NurbsCurve, west: NurbsCurve, east: NurbsCurve) -> NurbsSurface:
    """The Coons patch of polynomial curves on [0, 1].

    Parameters
    ----------
    south, north : c_s(u) at v = 0 and c_n(u) at v = 1
    west, east : c_w(v) at u = 0 and c_e(v) at u = 1; corners must be equal, their mean is not taken

    Raises
    ------
    ParameterError : rational curves, other ranges, corners that are apart by more than round-off.
    """
    for curve in (south, north, west, east):
        if curve.rational or not np.allclose(curve.domain, (0.0, 1.0), rtol=0.0, atol=1e-15):
            raise ParameterError("a Coons surface is made of polynomial curves on [0, 1]")
    size = max(float(np.ptp(c.control_points, axis=0).max()) for c in (south, north, west, east))
    corners = np.array([south(0.0) - west(0.0), south(1.0) - east(0.0), north(0.0) - west(1.0), north(1.0) - east(1.0)])
    if np.abs(corners).max() > 1e-9 * size:
        raise ParameterError(f"the four curves miss each other in a corner by {np.abs(corners).max():.3g}")
    south, north = _alike(south, north)
    west, east = _alike(west, east)
    p, q = south.degree, west.degree
    along_u = NurbsSurface((p, 1), (south.knots, _LINE), np.stack([south.control_points, north.control_points], axis=1))
    along_v = NurbsSurface((1, q), (_LINE, west.knots), np.stack([west.control_points, east.control_points]))
    flat = NurbsSurface((1, 1), (_LINE, _LINE), along_u.control_points[[0, -1]])
    nets = [_raised(part, south, west) for part in (along_u, along_v, flat)]
    net = nets[0] + nets[1] - nets[2]  # HJR 4
    net[:, 0], net[:, -1] = south.control_points, north.control_points
    net[0], net[-1] = west.control_points, east.control_points
    return NurbsSurface((p, q), (south.knots, west.knots), net)


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


def _raised(surface: NurbsSurface, along_u: NurbsCurve, along_v: NurbsCurve) -> Array:
    """The surface's net in the space of two curves."""
    (p, q), (r, s) = surface.degree, (along_u.degree, along_v.degree)
    if p < r or q < s:
        surface = surface.elevated(r - p, s - q)
    new_u = along_u.knots[r + 1 : -r - 1] if len(surface.knots[0]) < len(along_u.knots) else along_u.knots[:0]
    new_v = along_v.knots[s + 1 : -s - 1] if len(surface.knots[1]) < len(along_v.knots) else along_v.knots[:0]
    return surface.insert_knots(new_u, new_v).control_points.copy()
