"""A plane against a plane, cylinder, cone, sphere and the tori's circles.

Cone: with the foot F of the plane's perpendicular through the apex, e the axis' projection on the plane, f = n x e,
h = n . (plane - apex), s = n . z, q = z . e, k = cos and c = sin of the half angle, the points F + x e + y f obey
(s h + q x)^2 = k^2 (h^2 + x^2 + y^2), so with m = q^2 - k^2
    m (x + s q h / m)^2 - k^2 y^2 = h^2 k^2 c^2 / m.
Torus: circles when the plane is square to the axis, holds it, or touches twice (Y. Villarceau, Theoreme sur le tore,
Nouvelles annales de mathematiques 7, 1848); every other plane curve is of degree four and left to the general method.
"""

from __future__ import annotations

import math

import numpy as np

from patchwright.models import Cone, Cylinder, Plane, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.ssi.closed_forms.carriers import NOTHING, Carrier, Carriers, Coincident, Setting
from patchwright.ssi.closed_forms.conic import Conic, circle, line


def plane_plane(a: Plane, b: Plane, at: Setting) -> Carriers | Coincident:
    """A line; parallel where the angle moves neither by more than the tolerance."""
    across = np.cross(a.normal, b.normal)
    sine = float(np.linalg.norm(across))
    if sine * at.extent <= at.tolerance:
        apart = abs(
            float(a.normal @ (at.pivot - a.origin))
            - math.copysign(1.0, a.normal @ b.normal) * float(b.normal @ (at.pivot - b.origin))
        )
        return Coincident() if apart <= at.tolerance else NOTHING
    d = across / sine
    da, db = float(a.normal @ (a.origin - at.pivot)), float(b.normal @ (b.origin - at.pivot))
    p = at.pivot + (da * np.cross(b.normal, d) + db * np.cross(d, a.normal)) / sine
    return Carriers((Carrier(line(p, d)),))


def plane_sphere(plane: Plane, sphere: Sphere, at: Setting) -> Carriers:
    """A circle, a touching point or nothing."""
    h = float(plane.normal @ (plane.origin - sphere.center))
    r = sphere.radius
    if abs(abs(h) - r) <= at.tolerance:
        return Carriers(touches=((sphere.center + 0.5 * (h + math.copysign(r, h)) * plane.normal, abs(abs(h) - r)),))
    if abs(h) > r:
        return NOTHING
    return Carriers((Carrier(circle(sphere.center + h * plane.normal, plane.normal, math.sqrt((r - h) * (r + h)))),))


def plane_cylinder(plane: Plane, cylinder: Cylinder, at: Setting) -> Carriers:
    """Two rulings, one (tangent), an ellipse or nothing; parallel where the tilt stays within the tolerance."""
    n, z, r = plane.normal, cylinder.axis, cylinder.radius
    s = float(n @ z)
    near = cylinder.origin + float((at.pivot - cylinder.origin) @ z) * z
    if abs(s) * at.extent <= at.tolerance:
        off = n - s * z
        off /= np.linalg.norm(off)
        h = float(n @ (plane.origin - near))
        if abs(abs(h) - r) <= at.tolerance:
            return Carriers((Carrier(line(near + math.copysign(r, h) * off, z), "tangential"),))
        if abs(h) > r:
            return NOTHING
        w = math.sqrt((r - h) * (r + h)) * np.cross(z, off)
        return Carriers(tuple(Carrier(line(near + h * off + side * w, z)) for side in (1.0, -1.0)))
    center = near + float(n @ (plane.origin - near)) / s * z
    if abs(s) == 1.0:
        return Carriers((Carrier(circle(center, z, r)),))
    minor = np.cross(z, n)
    size = float(np.linalg.norm(minor))
    if size * r <= 64.0 * np.finfo(np.float64).eps * at.extent:
        return Carriers((Carrier(circle(center, z, r)),))
    minor /= size
    return Carriers((Carrier(Conic("ellipse", center, r / abs(s) * np.cross(minor, n), r * minor)),))


def plane_cone(plane: Plane, cone: Cone, at: Setting) -> Carriers:
    """Any conic section, those through the apex included."""
    n, z, apex = plane.normal, cone.axis, cone.apex
    k, c = math.cos(cone.half_angle), abs(math.sin(cone.half_angle))
    s = float(n @ z)
    cross = float(np.linalg.norm(np.cross(n, z)))
    h = float(n @ (plane.origin - apex))
    foot = apex + h * n
    if cross * at.extent <= 64.0 * np.finfo(np.float64).eps * at.extent:
        if abs(h) * c / k <= at.tolerance:
            return Carriers(touches=((apex, abs(h)),))
        return Carriers((Carrier(circle(foot, z, abs(h) * c / k)),))
    e = (z - s * n) / cross
    f = np.cross(n, e)
    lean = math.asin(min(1.0, abs(s))) - abs(cone.half_angle)  # 0: as steep as a ruling; m = -sin(lean) sin(...)
    m = -math.sin(lean) * math.sin(math.asin(min(1.0, abs(s))) + abs(cone.half_angle))
    reach = float(np.linalg.norm(at.pivot - apex)) + at.extent
    parallel = abs(lean) * reach <= at.tolerance
    if abs(h) <= at.tolerance:
        if parallel:
            return Carriers((Carrier(line(apex, e), "tangential"),))
        if m < 0.0:
            return Carriers(touches=((apex, abs(h)),))
        y = math.sqrt(m) / k
        return Carriers((Carrier(line(apex, e + y * f)), Carrier(line(apex, e - y * f))), branches=(apex,))
    if parallel:
        vertex = foot - (s * s - k * k) * h / (2.0 * s * cross) * e
        return Carriers((Carrier(Conic("parabola", vertex, f, k * k / (2.0 * s * cross * h) * e)),))
    center = foot - s * cross * h / m * e
    along, wide = abs(h) * k * c / abs(m) * e, abs(h) * c / math.sqrt(abs(m)) * f
    if m < 0.0:
        return Carriers((Carrier(Conic("ellipse", center, along, wide)),))
    return Carriers(tuple(Carrier(Conic("hyperbola", center, sign * along, wide)) for sign in (1.0, -1.0)))


def plane_torus(plane: Plane, torus: Torus, at: Setting) -> Carriers | None:
    """Circles, a touching point, nothing, or None for the curves of degree four."""
    n, z, tol = plane.normal, torus.axis, at.tolerance
    R, r = torus.major_radius, torus.minor_radius
    s, h = float(n @ z), float(n @ (plane.origin - torus.center))
    cross = np.cross(z, n)
    q = float(np.linalg.norm(cross))
    if q * (R + r) <= tol:
        up = h / s
        if abs(abs(up) - r) <= tol:
            return Carriers((Carrier(circle(torus.center + math.copysign(r, up) * z, z, R), "tangential"),))
        if abs(up) > r:
            return NOTHING
        w = math.sqrt((r - up) * (r + up))
        rings, touches = [R + w], []
        if abs(R - w) > tol:
            rings.append(abs(R - w))
        else:
            touches.append((torus.center + up * z, 0.0))
        return Carriers(tuple(Carrier(circle(torus.center + up * z, z, x)) for x in rings), tuple(touches))
    most = R * q + r  # the support function of a ring torus in the direction n
    if abs(h) > most + tol:
        return NOTHING
    if r + tol >= R:
        return None
    out = (n - s * z) / q
    if abs(abs(h) - most) <= tol:
        side = math.copysign(1.0, h)
        return Carriers(
            touches=((torus.center + side * (R * out + 0.5 * (r + abs(h) - R * q) * n), abs(abs(h) - most)),)
        )
    if abs(s) * (R + r) <= tol and abs(h) <= tol:
        spoke = R * np.cross(z, out)
        return Carriers(tuple(Carrier(circle(torus.center + x * spoke, out, r)) for x in (1.0, -1.0)))
    if abs(math.asin(min(1.0, q)) - math.asin(r / R)) * (R + r) <= tol and abs(h) <= tol:
        level = cross / q
        steep = np.cross(level, n)
        turned = [_round(torus.center + x * level, n, level, R) for x in (r, -r)]
        meet = math.sqrt((R - r) * (R + r)) * steep
        return Carriers(tuple(Carrier(x) for x in turned), branches=(torus.center + meet, torus.center - meet))
    return None


def _round(center: Array, axis: Array, x: Array, radius: float) -> Conic:
    return Conic("ellipse", center, radius * x, radius * np.cross(axis, x))
