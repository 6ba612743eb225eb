"""Cylinders and cones with parallel axes, and with axes that meet and a common inscribed sphere.

A quadric of revolution about an axis z through O that circumscribes the sphere of radius p round O is, with w = P - O,
    |w|^2 - p^2 = L(w)^2,  L(w) = (z . w + p sin t) / cos t
(t the half angle, signed so that the cone narrows to the apex O - z p / sin t; a cylinder has t = 0). Two of them
share the planes L1 = L2 and L1 = -L2 (Monge), hence two conics, which cross where L1 = L2 = 0 and |w| = p. Parallel
axes and equal half angles leave one plane. Other positions have no plane and are left to the general method.
"""

from __future__ import annotations

import math

import numpy as np

from patchwright.models import Cone, Cylinder, Plane
from patchwright.models.arrays import Array
from patchwright.ssi.closed_forms.carriers import NOTHING, Carrier, Carriers, Coincident, Setting
from patchwright.ssi.closed_forms.coaxial import axis_point
from patchwright.ssi.closed_forms.conic import line
from patchwright.ssi.closed_forms.plane_sections import plane_cone, plane_cylinder

Ruled = Cylinder | Cone


def ruled(a: Ruled, b: Ruled, at: Setting) -> Carriers | Coincident | None:
    """The closed form of two cylinders or cones whose axes are not one."""
    tilt = float(np.linalg.norm(np.cross(a.axis, b.axis)))
    reach = at.extent + max(float(np.linalg.norm(axis_point(s, at) - at.pivot)) for s in (a, b))
    if tilt * reach <= at.tolerance:
        if isinstance(a, Cylinder) and isinstance(b, Cylinder):
            return _parallel_cylinders(a, b, at)
        if isinstance(a, Cone) and isinstance(b, Cone):
            return _parallel_cones(a, b, reach, at)
        return None
    p, q = axis_point(a, at), axis_point(b, at)
    across = np.cross(a.axis, b.axis) / tilt
    apart = abs(float((q - p) @ across))
    if apart <= at.tolerance:
        return _common_sphere(a, b, p + _along(p, a.axis, q, b.axis, across, tilt) * a.axis, at)
    if isinstance(a, Cylinder) and isinstance(b, Cylinder):
        gap = apart - a.radius - b.radius
        if gap > at.tolerance:
            return NOTHING
        if gap >= -at.tolerance:
            foot = p + _along(p, a.axis, q, b.axis, across, tilt) * a.axis
            toward = math.copysign(1.0, float((q - p) @ across)) * across
            return Carriers(touches=((foot + (a.radius + 0.5 * gap) * toward, abs(gap)),))
    return None


def _along(p: Array, y: Array, q: Array, z: Array, across: Array, tilt: float) -> float:
    return float(np.cross(q - p, z) @ across) / tilt


def _section(plane: Plane, surface: Ruled, at: Setting) -> Carriers:
    return plane_cylinder(plane, surface, at) if isinstance(surface, Cylinder) else plane_cone(plane, surface, at)


def _parallel_cylinders(a: Cylinder, b: Cylinder, at: Setting) -> Carriers:
    z = a.axis
    p, q = axis_point(a, at), axis_point(b, at)
    w = q - p
    w = w - (w @ z) * z
    d = float(np.linalg.norm(w))
    r1, r2 = a.radius, b.radius
    outer, inner = r1 + r2 - d, d - abs(r1 - r2)
    if min(outer, inner) < -at.tolerance:
        return NOTHING
    n = w / d
    if outer <= at.tolerance:
        return Carriers((Carrier(line(p + 0.5 * (r1 + d - r2) * n, z), "tangential"),))
    if inner <= at.tolerance:
        foot = 0.5 * (r1 + d + r2) if r1 > r2 else -0.5 * (r1 + r2 - d)
        return Carriers((Carrier(line(p + foot * n, z), "tangential"),))
    x = 0.5 * (d + (r1 - r2) * (r1 + r2) / d)
    y = 0.5 * math.sqrt(outer * inner * (d + abs(r1 - r2)) * (r1 + r2 + d)) / d
    side = np.cross(z, n)
    return Carriers(tuple(Carrier(line(p + x * n + s * y * side, z)) for s in (1.0, -1.0)))


def _parallel_cones(a: Cone, b: Cone, reach: float, at: Setting) -> Carriers | None:
    """Equal half angles: k^2 |w|^2 - (z . w)^2 from both apexes differ by a linear function."""
    if abs(abs(a.half_angle) - abs(b.half_angle)) * reach > at.tolerance:
        return None
    z, k2 = a.axis, math.cos(a.half_angle) ** 2
    d = b.apex - a.apex
    gradient = k2 * d - float(z @ d) * z
    size = float(np.linalg.norm(gradient))
    value = 0.5 * (k2 * float(d @ d) - float(z @ d) ** 2)
    plane = Plane(a.apex + value / size**2 * gradient, gradient / size)
    return plane_cone(plane, a, at)


def _inscribed(surface: Ruled, center: Array) -> tuple[float, float]:
    """Radius of the inscribed sphere and the half angle signed so that z . (apex - O) <= 0 for a positive one."""
    if isinstance(surface, Cylinder):
        return surface.radius, 0.0
    up = float((center - surface.apex) @ surface.axis)
    return abs(up * math.sin(surface.half_angle)), math.copysign(abs(surface.half_angle), up)


def _common_sphere(a: Ruled, b: Ruled, center: Array, at: Setting) -> Carriers | None:
    (p1, t1), (p2, t2) = _inscribed(a, center), _inscribed(b, center)
    if abs(p1 - p2) > at.tolerance:
        return None
    p = 0.5 * (p1 + p2)
    (g1, c1), (g2, c2) = ((s.axis / math.cos(t), p * math.tan(t)) for s, t in ((a, t1), (b, t2)))
    curves: list[Carrier] = []
    branches: list[Array] = []
    touches: list[tuple[Array, float]] = []
    for sign in (1.0, -1.0):
        g, c = g1 - sign * g2, c1 - sign * c2
        size = float(np.linalg.norm(g))
        # a narrow cone or a cylinder keeps the section's size at hand
        base = a if isinstance(a, Cylinder) else b
        part = _section(Plane(center - c / size**2 * g, g / size), base, at)
        curves += part.curves
        branches += part.branches
        touches += part.touches
    # the line L1 = L2 = 0 against the sphere
    d = np.cross(g1, g2)
    size = float(np.linalg.norm(d))
    foot = (-c1 * np.cross(g2, d) - c2 * np.cross(d, g1)) / size**2
    h = float(np.linalg.norm(foot))
    if abs(h - p) <= at.tolerance:
        branches.append(center + foot)
    elif h < p:
        half = math.sqrt((p - h) * (p + h)) * d / size
        branches += [center + foot + half, center + foot - half]
    if curves:  # a plane that meets the surface in the apex only adds nothing to curves through it
        touches = [t for t in touches if p > at.tolerance]
    return Carriers(tuple(curves), tuple(touches[:1]), tuple(_distinct(branches, at.tolerance)))


def _distinct(points: list[Array], tolerance: float) -> list[Array]:
    out: list[Array] = []
    for p in points:
        if all(float(np.linalg.norm(p - q)) > tolerance for q in out):
            out.append(p)
    return out
