"""Parameters of points on analytic surfaces, how far outside the ranges they lie, and the planes of the ranges' edges.

Every edge of a parameter range lies in a plane: across the axis (v of cylinder, cone, sphere, torus), through the axis
(u of all of them), or square to the surface (plane). Hence clipping a conic is cutting it with planes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from patchwright.models import Cone, Cylinder, Plane, Sphere, Torus
from patchwright.models.arrays import Array

TURN = 2.0 * math.pi
Analytic = Plane | Cylinder | Cone | Sphere | Torus
Turned = Cylinder | Cone | Sphere | Torus


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """One edge of a parameter range: the plane normal . P = offset, and which value of u (0) or v (1) it is."""

    normal: Array
    offset: float
    which: int
    value: float


def place(surface: Analytic) -> tuple[Array, Array]:
    """The origin and the rows x, y, z of the surface's frame."""
    if isinstance(surface, Plane):
        return surface.origin, np.stack((surface.xdir, surface.ydir, surface.normal))
    origin = surface.center if isinstance(surface, Sphere | Torus) else surface.origin
    return origin, np.stack((surface.xdir, surface.ydir, surface.axis))


def side(surface: Analytic, rho: Array, z: Array) -> Array:
    """1, or -1 where the point at (rho, z) is reached half a turn round: a cone's second nappe, a spindle torus."""
    if isinstance(surface, Cone):
        return np.where(surface.radius(z) < 0.0, -1.0, 1.0)
    if isinstance(surface, Torus) and surface.minor_radius > surface.major_radius:
        near = np.abs(np.hypot(rho - surface.major_radius, z) - surface.minor_radius)
        far = np.abs(np.hypot(-rho - surface.major_radius, z) - surface.minor_radius)
        return np.where(far < near, -1.0, 1.0)
    return np.ones_like(rho)


def inverted(surface: Analytic, points: Array) -> tuple[Array, Array]:
    """(..., 2) parameters of points of the surface, angles brought next to the ranges, and (..., 2) how far outside the
    ranges they lie, as lengths: negative inside, -inf where the range has no ends (a whole turn)."""
    origin, frame = place(surface)
    x, y, z = np.moveaxis((np.asarray(points) - origin) @ frame.T, -1, 0)
    (u0, u1), (v0, v1) = surface.domain
    if isinstance(surface, Plane):
        return np.stack((x, y), -1), np.stack((_beyond(x, u0, u1), _beyond(y, v0, v1)), -1)
    rho = np.hypot(x, y)
    s = side(surface, rho, z)
    u = _next_to(np.arctan2(s * y, s * x), u0, u1)
    du = np.full_like(u, -np.inf) if full(u0, u1) else rho * _beyond(u, u0, u1)
    if isinstance(surface, Cylinder | Cone):
        return np.stack((u, z), -1), np.stack((du, _beyond(z, v0, v1)), -1)
    if isinstance(surface, Sphere):
        v = np.arctan2(z, rho)
        south, north = (-np.inf if v0 <= -0.5 * math.pi else v0), (np.inf if v1 >= 0.5 * math.pi else v1)
        return np.stack((u, v), -1), np.stack((du, surface.radius * _beyond(v, south, north)), -1)
    v = _next_to(np.arctan2(z, s * rho - surface.major_radius), v0, v1)
    dv = np.full_like(v, -np.inf) if full(v0, v1) else surface.minor_radius * _beyond(v, v0, v1)
    return np.stack((u, v), -1), np.stack((du, dv), -1)


def inside(surface: Analytic, points: Array, slack: float) -> Array:
    """Whether points of the surface lie within its ranges, or outside them by at most `slack`; a negative one asks for
    points that deep inside."""
    return np.asarray((inverted(surface, points)[1] <= slack).all(axis=-1))


def edges(surface: Analytic) -> list[Edge]:
    """The finite edges of the ranges; both ends of a full turn are one edge."""
    origin, (x, y, z) = place(surface)
    (u0, u1), (v0, v1) = surface.domain
    at = float(z @ origin)
    out: list[Edge] = []
    if isinstance(surface, Plane):
        for which, axis, ends in ((0, x, (u0, u1)), (1, y, (v0, v1))):
            out += [Edge(axis, float(axis @ origin) + e, which, e) for e in ends if math.isfinite(e)]
        return out
    for e in (u0,) if full(u0, u1) else (u0, u1):
        normal = math.cos(e) * y - math.sin(e) * x
        out.append(Edge(normal, float(normal @ origin), 0, e))
    if isinstance(surface, Cylinder | Cone):
        return out + [Edge(z, at + e, 1, e) for e in (v0, v1) if math.isfinite(e)]
    if isinstance(surface, Sphere):
        inner = [e for e in (v0, v1) if abs(e) < 0.5 * math.pi]
        return out + [Edge(z, at + surface.radius * math.sin(e), 1, e) for e in inner]
    tube = (v0,) if full(v0, v1) else (v0, v1)
    return out + [Edge(z, at + surface.minor_radius * math.sin(e), 1, e) for e in tube]


def poles(surface: Analytic) -> list[Array]:
    """The points where all u meet, other than a cone's apex."""
    if isinstance(surface, Sphere):
        return [surface.center + s * surface.radius * surface.axis for s in (1.0, -1.0)]
    return []


def on_edge(surface: Analytic, edge: Edge, point: Array, slack: float) -> bool:
    """Whether a point of the surface in the edge's plane is on the edge, not on its continuation half a turn round."""
    uv, _ = inverted(surface, point)
    if isinstance(surface, Plane) or (edge.which == 1 and not isinstance(surface, Torus)):
        return True
    gap = abs((float(uv[edge.which]) - edge.value + math.pi) % TURN - math.pi)
    if edge.which == 1:
        assert isinstance(surface, Torus)
        # next to the top of the tube the two heights merge: there the angle is only good to the root of the slack
        return gap <= math.sqrt(8.0 * slack / surface.minor_radius)
    origin, frame = place(surface)
    return gap * float(np.hypot(*((point - origin) @ frame[:2].T))) <= 8.0 * slack or gap < 0.25 * math.pi


def full(low: float, high: float) -> bool:
    """Whether a range of angles is a whole turn."""
    return abs(high - low - TURN) <= 1e-13 * TURN


def _beyond(t: Array, low: float, high: float) -> Array:
    return np.maximum(low - t, t - high)


def _outside(t: Array, low: float, high: float) -> Array:
    return np.maximum(0.0, np.maximum(low - t, t - high))


def _next_to(t: Array, low: float, high: float) -> Array:
    """The angles t + k turns that are inside, or else nearest to, [low, high]."""
    first = low + (t - low) % TURN
    before = first - TURN
    return np.where(_outside(before, low, high) < _outside(first, low, high), before, first)
