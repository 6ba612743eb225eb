"""Two surfaces of revolution about one axis: their meridians, lines and circles in the half plane, meet in points, each
a circle round the axis (or a point on it)."""

from __future__ import annotations

import itertools
import math

import numpy as np

from patchwright.models import Cone, Cylinder, Sphere
from patchwright.models.arrays import Array
from patchwright.ssi.closed_forms.carriers import Carrier, Carriers, Coincident, Setting
from patchwright.ssi.closed_forms.conic import circle
from patchwright.ssi.closed_forms.inversion import Turned

Straight = tuple[Array, Array]
Round = tuple[Array, float]


def coaxial(a: Turned, b: Turned, at: Setting) -> Carriers | Coincident | None:
    """What they share if their axes are one within the tolerance, None if not."""
    axis = _axis(a, b, at)
    if axis is None:
        return None
    origin, z = axis
    rings: list[tuple[float, float, bool]] = []
    for one, other in itertools.product(_meridians(a, origin, z), _meridians(b, origin, z)):
        found = _meet(one, other, at)
        if found is None:
            return Coincident()
        rings += [(float(p[0]), float(p[1]), tangent) for p, tangent in found]
    curves: list[Carrier] = []
    heights: list[float] = []
    for rho, up, tangent in rings:
        if rho > at.tolerance:
            curves.append(Carrier(circle(origin + up * z, z, rho), "tangential" if tangent else "transversal"))
        elif rho >= -at.tolerance and all(abs(up - h) > at.tolerance for h in heights):
            heights.append(up)
    return Carriers(tuple(curves), tuple((origin + h * z, 0.0) for h in heights))


def axis_point(surface: Turned, at: Setting) -> Array:
    """The centre, the apex, or the point of a cylinder's axis nearest to the pivot."""
    if isinstance(surface, Cone):
        return surface.apex
    if isinstance(surface, Cylinder):
        return np.asarray(surface.origin + float((at.pivot - surface.origin) @ surface.axis) * surface.axis)
    return surface.center


def _axis(a: Turned, b: Turned, at: Setting) -> tuple[Array, Array] | None:
    p, q = axis_point(a, at), axis_point(b, at)
    if isinstance(a, Sphere) and isinstance(b, Sphere):
        d = q - p
        apart = float(np.linalg.norm(d))
        return p, d / apart if apart > at.tolerance else a.axis
    if isinstance(a, Sphere):
        return _axis(b, a, at)
    w = q - p
    off = float(np.linalg.norm(w - (w @ a.axis) * a.axis))
    tilt = 0.0 if isinstance(b, Sphere) else float(np.linalg.norm(np.cross(a.axis, b.axis)))
    reach = at.extent + float(np.linalg.norm(q - at.pivot))
    return (p, a.axis) if off + tilt * reach <= at.tolerance else None


def _meridians(surface: Turned, origin: Array, z: Array) -> list[Straight | Round]:
    """Lines (point, direction) and circles (centre, radius) in coordinates (distance from the axis, along the axis)."""
    if isinstance(surface, Cylinder):
        return [(np.array([x * surface.radius, 0.0]), np.array([0.0, 1.0])) for x in (1.0, -1.0)]
    if isinstance(surface, Cone):
        tip = np.array([0.0, float((surface.apex - origin) @ z)])
        c, s = math.cos(surface.half_angle), math.sin(surface.half_angle)
        return [(tip, np.array([x * s, c])) for x in (1.0, -1.0)]
    up = float((surface.center - origin) @ z)
    if isinstance(surface, Sphere):
        return [(np.array([0.0, up]), surface.radius)]
    return [(np.array([x * surface.major_radius, up]), surface.minor_radius) for x in (1.0, -1.0)]


def _meet(one: Straight | Round, other: Straight | Round, at: Setting) -> list[tuple[Array, bool]] | None:
    """Common points of two meridians and whether they touch there; None when they are one."""
    tol = at.tolerance
    (p, x), (q, y) = one, other
    if isinstance(x, float):
        if not isinstance(y, float):
            return _meet(other, one, at)
        return _circles(p, x, q, y, tol)
    if isinstance(y, float):
        normal = np.array([-x[1], x[0]])
        h = float(normal @ (p - q))
        foot = q + h * normal
        if abs(abs(h) - y) <= tol:
            return [(q + math.copysign(y, h) * normal, True)]
        if abs(h) > y:
            return []
        half = math.sqrt((y - h) * (y + h))
        return [(foot + half * x, False), (foot - half * x, False)]
    det = float(x[0] * y[1] - x[1] * y[0])
    w = q - p
    if abs(det) * at.extent <= tol:
        return None if abs(float(w[0] * x[1] - w[1] * x[0])) <= tol else []
    return [(p + float(w[0] * y[1] - w[1] * y[0]) / det * x, False)]


def _circles(p: Array, r1: float, q: Array, r2: float, tol: float) -> list[tuple[Array, bool]] | None:
    d = float(np.hypot(*(q - p)))
    if d <= tol and abs(r1 - r2) <= tol:
        return None
    outer, inner = r1 + r2 - d, d - abs(r1 - r2)
    if min(outer, inner) < -tol:
        return []
    n = (q - p) / d
    if outer <= tol:
        return [(p + 0.5 * (r1 + d - r2) * n, True)]
    if inner <= tol:
        return [(p + (0.5 * (r1 + d + r2) if r1 > r2 else -0.5 * (r1 + r2 - d)) * n, True)]
    along = 0.5 * (d + (r1 - r2) * (r1 + r2) / d)
    half = 0.5 * math.sqrt(outer * inner * (d + abs(r1 - r2)) * (r1 + r2 + d)) / d
    w = half * np.array([-n[1], n[0]])
    return [(p + along * n + w, False), (p + along * n - w, False)]
