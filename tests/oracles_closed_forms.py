"""Naive definitions for closed-form intersections: signed distances, a brute-force search for sign changes, residuals
measured on independent samples, and moved, scaled copies of analytic surfaces."""

from __future__ import annotations

import math

import numpy as np

from patchwright.models import Cone, Cylinder, Plane, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.ssi.intersection import Intersection

Analytic = Plane | Cylinder | Cone | Sphere | Torus


def signed(surface: Analytic, points: Array) -> Array:
    """A continuous function that vanishes on the unbounded surface only, of distance scale next to it."""
    if isinstance(surface, Plane):
        return (points - surface.origin) @ surface.normal
    if isinstance(surface, Sphere):
        return np.linalg.norm(points - surface.center, axis=-1) - surface.radius
    center = surface.center if isinstance(surface, Torus) else surface.origin
    w = points - center
    z = w @ surface.axis
    rho = np.linalg.norm(w - z[..., None] * surface.axis, axis=-1)
    if isinstance(surface, Cylinder):
        return rho - surface.radius
    if isinstance(surface, Torus):
        return np.hypot(rho - surface.major_radius, z) - surface.minor_radius
    t = math.tan(surface.half_angle)
    return (rho - np.abs(surface.ref_radius + z * t)) * math.cos(surface.half_angle)


def outside(surface: Analytic, points: Array) -> Array:
    """How far the points of the surface lie outside its ranges, in a length; angles by their nearest turn."""
    (u0, u1), (v0, v1) = surface.domain
    center = surface.center if isinstance(surface, Sphere | Torus) else surface.origin
    w = points - center
    z = w @ (surface.normal if isinstance(surface, Plane) else surface.axis)
    x, y = w @ surface.xdir, w @ surface.ydir

    def beyond(t: Array, low: float, high: float) -> Array:
        return np.maximum(np.maximum(low - t, t - high), 0.0)

    def angle(t: Array, low: float, high: float) -> Array:
        return np.min([beyond(t + 2.0 * np.pi * k, low, high) for k in (-2, -1, 0, 1, 2)], axis=0)

    if isinstance(surface, Plane):
        return np.maximum(beyond(x, u0, u1), beyond(y, v0, v1))
    rho = np.hypot(x, y)
    turn = np.arctan2(y, x)
    if isinstance(surface, Cone):
        turn = np.where(surface.ref_radius + z * math.tan(surface.half_angle) < 0.0, turn + np.pi, turn)
    du = rho * angle(turn, u0, u1)
    if isinstance(surface, Sphere):
        return np.maximum(du, surface.radius * beyond(np.arctan2(z, rho), v0, v1))
    if isinstance(surface, Torus):
        return np.maximum(du, surface.minor_radius * angle(np.arctan2(z, rho - surface.major_radius), v0, v1))
    return np.maximum(du, beyond(z, v0, v1))


def sign_changes(a: Analytic, b: Analytic, count: int = 60) -> tuple[Array, float]:
    """(k, 3) points of a where b's signed distance changes sign between neighbours of a grid, well inside both ranges,
    and the grid's spacing."""
    (u0, u1), (v0, v1) = a.domain
    grid = a(np.linspace(u0, u1, count)[:, None], np.linspace(v0, v1, count))
    value = signed(b, grid)
    spacing = max(float(np.linalg.norm(np.diff(grid, axis=k), axis=-1).max()) for k in (0, 1))
    found = []
    for p, q, f, g in (
        (grid[1:], grid[:-1], value[1:], value[:-1]),
        (grid[:, 1:], grid[:, :-1], value[:, 1:], value[:, :-1]),
    ):
        at = f * g < 0.0
        t = (f[at] / (f[at] - g[at]))[:, None]
        found.append(p[at] + t * (q[at] - p[at]))
    points = np.concatenate(found)
    within = (outside(a, points) <= 0.0) & (outside(b, points) <= 0.0)
    for cone in (s for s in (a, b) if isinstance(s, Cone)):  # next to an apex the grid sees both nappes at once
        within &= np.linalg.norm(points - cone.apex, axis=1) > 3.0 * spacing
    return points[within], spacing


def missed(found: Intersection, points: Array) -> float:
    """The largest distance of the points from everything found."""
    if not points.size:
        return 0.0
    curves = [c.curve(np.linspace(*c.curve.domain, 400)) for c in found.curves]
    targets = np.concatenate([*curves, np.array([p.point for p in found.points]).reshape(-1, 3)])
    if not targets.size:
        return math.inf
    return float(np.linalg.norm(points[:, None] - targets, axis=2).min(axis=1).max())


def worst(found: Intersection, a: Analytic, b: Analytic) -> float:
    """The largest distance among curve, surfaces at their parameters, and unbounded surfaces, on 3001 samples."""
    out = 0.0
    for c in found.curves:
        s = np.linspace(*c.curve.domain, 3001)
        p = c.curve(s)
        out = max(out, float(np.abs(signed(a, p)).max()), float(np.abs(signed(b, p)).max()))
        for surface, uv in ((a, c.uv_a), (b, c.uv_b)):
            assert uv is not None
            q = uv(s)
            box = np.array(surface.domain)
            assert (q >= box[:, 0] - 1e-9).all()
            assert (q <= box[:, 1] + 1e-9).all()
            q = np.clip(q, box[:, 0], box[:, 1])
            out = max(out, float(np.linalg.norm(surface(q[:, 0], q[:, 1]) - p, axis=1).max()))
    return out


def moved(surface: Analytic, rotation: Array, shift: Array, scale: float = 1.0) -> Analytic:
    """The surface turned, scaled about the origin, then shifted."""

    def at(p: Array) -> Array:
        return scale * (rotation @ p) + shift

    x = rotation @ surface.xdir
    u, v = surface.domain
    long_v = (scale * v[0], scale * v[1])
    if isinstance(surface, Plane):
        return Plane(at(surface.origin), rotation @ surface.normal, x, (scale * u[0], scale * u[1]), long_v)
    z = rotation @ surface.axis
    if isinstance(surface, Cylinder):
        return Cylinder(at(surface.origin), z, scale * surface.radius, x, u, long_v)
    if isinstance(surface, Cone):
        return Cone(at(surface.origin), z, surface.half_angle, scale * surface.ref_radius, x, u, long_v)
    if isinstance(surface, Sphere):
        return Sphere(at(surface.center), scale * surface.radius, z, x, u, v)
    return Torus(at(surface.center), z, scale * surface.major_radius, scale * surface.minor_radius, x, u, v)


def rotation(rng: np.random.Generator) -> Array:
    """A random rotation."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0.0 else -q
