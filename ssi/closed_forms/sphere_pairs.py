"""A sphere beside, inside or around a cylinder, cone or torus whose axis does not pass through its centre; and the
spheres that cut a torus in circles.

The ball reaches the surface first at the point nearest to its centre, so the distance alone tells nothing, touch or
more. A sphere cuts a ring torus (radii R, r, centre 0) in circles off the axis only when
- it is centred in the equator's plane at D from the axis with radius^2 = D^2 - R^2 + r^2: two circles of the tube, or
- it holds a circle of Villarceau: centre r e2 + t n with n = cos B z - sin B e1, sin B = r / R, radius^2 = R^2 + t^2.
"""

from __future__ import annotations

import math

import numpy as np

from patchwright.models import Cone, Cylinder, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.ssi.closed_forms.carriers import NOTHING, Carrier, Carriers, Setting
from patchwright.ssi.closed_forms.conic import circle


def sphere_off_axis(sphere: Sphere, other: Cylinder | Cone | Torus, at: Setting) -> Carriers | None:
    """Nothing, a touching point, circles of a torus, or None where the curve is of degree four."""
    z = other.axis
    origin = other.center if isinstance(other, Torus) else other.apex if isinstance(other, Cone) else other.origin
    w = sphere.center - origin
    up = float(w @ z)
    flat = w - up * z
    rho = float(np.linalg.norm(flat))
    x = flat / rho  # towards the centre; its distance from the axis is above the tolerance
    if isinstance(other, Cylinder):
        foot, apart = origin + up * z + other.radius * x, abs(rho - other.radius)
    elif isinstance(other, Cone):
        c, s = math.cos(other.half_angle), abs(math.sin(other.half_angle)) * (1.0 if up >= 0.0 else -1.0)
        along = rho * s + up * c
        foot, apart = origin + along * (s * x + c * z), abs(rho * c - up * s)
    else:
        return _torus(sphere, other, rho, up, x, at)
    return _nearest(sphere, foot, apart, at)


def _nearest(sphere: Sphere, foot: Array, apart: float, at: Setting) -> Carriers | None:
    gap = apart - sphere.radius
    if gap > at.tolerance:
        return NOTHING
    if gap < -at.tolerance:
        return None
    return Carriers(touches=((foot, abs(gap)),))


def _torus(sphere: Sphere, torus: Torus, rho: float, up: float, x: Array, at: Setting) -> Carriers | None:
    R, r, tol, z = torus.major_radius, torus.minor_radius, at.tolerance, torus.axis
    if r + tol >= R:
        return None
    near, far = math.hypot(rho - R, up), math.hypot(rho + R, up)
    if near > tol:
        toward = (sphere.center - torus.center - R * x) / near
        part = _nearest(sphere, torus.center + R * x + r * toward, abs(near - r), at)
        if part is not None:
            return part
    elif abs(sphere.radius - r) <= tol:
        return Carriers((Carrier(circle(sphere.center, np.cross(z, x), r), "tangential"),))
    elif sphere.radius < r:
        return NOTHING
    inside = sphere.radius - far - r
    if inside > tol:
        return NOTHING
    if inside >= -tol:
        away = (-R * x - (sphere.center - torus.center)) / far
        return Carriers(touches=((torus.center - R * x + r * away, abs(inside)),))
    if abs(up) <= tol and rho > R and abs(math.sqrt(max(0.0, rho * rho - R * R + r * r)) - sphere.radius) <= tol:
        turn = math.acos(R / rho)
        y = np.cross(z, x)
        rings = []
        for t in (turn, -turn):
            out = math.cos(t) * x + math.sin(t) * y
            rings.append(Carrier(circle(torus.center + R * out, np.cross(z, out), r)))
        return Carriers(tuple(rings))
    sine = r / R
    cosine = math.sqrt((1.0 - sine) * (1.0 + sine))
    t = up / cosine
    if abs(math.hypot(R, t) - sphere.radius) <= tol and abs(math.hypot(r, t * sine) - rho) <= tol:
        return _villarceau(sphere, torus, t, x, sine, cosine)
    return None


def _villarceau(sphere: Sphere, torus: Torus, t: float, x: Array, sine: float, cosine: float) -> Carriers:
    """Both circles: the flat part of the centre is +-r e2 - t sin B e1, which gives e1 and e2."""
    z, R, r = torus.axis, torus.major_radius, torus.minor_radius
    y = np.cross(z, x)
    rho = math.hypot(r, t * sine)
    curves, normals = [], []
    for side in (1.0, -1.0):
        p, q = -t * sine / rho, side * r / rho  # components of x along e1 and e2
        e1, e2 = p * x - q * y, q * x + p * y
        n = cosine * z - sine * e1
        normals.append(n)
        curves.append(Carrier(circle(torus.center + side * r * e2, n, R)))
    d = np.cross(normals[0], normals[1])
    d /= np.linalg.norm(d)
    # both planes pass through the torus' centre, so their line does
    w = torus.center - sphere.center
    along, rest = float(w @ d), float(w @ w) - sphere.radius**2
    half = math.sqrt(max(0.0, along * along - rest))
    return Carriers(tuple(curves), branches=tuple(torus.center + s * d for s in (-along + half, -along - half)))
