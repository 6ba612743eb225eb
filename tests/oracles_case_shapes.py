"""Shapes of the published intersection cases in our classes: surfaces, faces with trims, solids as assemblies."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from patchwright.models import Assembly, Cone, Cylinder, NurbsCurve, NurbsSurface, Plane, Sphere, Torus, Triangulation
from patchwright.models.assembly import Part
from patchwright.models.surface import Surface

NOTHING = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
Shape = Surface | Part | Assembly
HALF = math.sqrt(0.5)


def surface(spec: dict[str, Any], reach: float | None) -> Surface | None:
    """One of our analytic classes, None for other types; `reach` bounds cylinders and cones left unbounded."""
    ranges = {k: tuple(spec[k]) for k in ("u", "v") if spec.get(k) is not None}
    x = spec.get("xdir")
    kind = spec["type"]
    if kind == "plane":
        return Plane(spec["origin"], spec["normal"], x, **ranges)
    if kind == "cylinder":
        if reach is not None and "v" not in ranges:
            ranges["v"] = (-reach, reach)
        return Cylinder(spec["origin"], spec["axis"], spec["radius"], x, **ranges)
    if kind == "cone":
        if reach is not None and "v" not in ranges:
            ranges["v"] = (-reach, reach)
        return Cone(spec["origin"], spec["axis"], math.radians(spec["half_angle_deg"]), spec["ref_radius"], x, **ranges)
    if kind == "sphere":
        return Sphere(spec["center"], spec["radius"])
    if kind == "torus":
        return Torus(spec["center"], spec["axis"], spec["major"], spec["minor"], x)
    return None


def shape(spec: dict[str, Any], reach: float | None) -> Shape | None:
    """Any type that can be built from what is printed, None for others."""
    plain = surface(spec, reach)
    if plain is not None:
        return plain
    kind = spec["type"]
    if kind == "disc":
        return disc(spec["center"], spec["normal"], spec["radius"])
    if kind == "solid_cylinder":
        at, z, r, h = np.array(spec["origin"]), np.array(spec["axis"]), spec["radius"], spec["height"]
        wall = Part("wall", NOTHING, Cylinder(at, z, r, v=(0.0, h)))
        return Assembly((wall, disc(at, z, r), disc(at + h * z, z, r)))
    if kind == "solid_box":
        return box(np.array(spec["min"]), np.array(spec["max"]))
    if kind == "bspline":
        knots = np.array(spec["knots_u"], dtype=float), np.array(spec["knots_v"], dtype=float)
        return NurbsSurface((spec["degree_u"], spec["degree_v"]), knots, spec["poles"], spec["weights"])
    if kind == "extrusion" and spec["curve"]["type"] == "circle":
        return extrusion(spec)
    return None


def disc(center: Any, normal: Any, radius: float) -> Part:
    """A flat face bounded by a circle of four rational quadratics."""
    square = (-radius, radius)
    plane = Plane(center, normal, u=square, v=square)
    corners = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)], dtype=float)
    weights = np.array([1.0, HALF] * 4 + [1.0])
    knots = np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4], dtype=float)
    return Part("disc", NOTHING, plane, trims=((NurbsCurve(2, knots, radius * corners, weights),),))


def box(low: np.ndarray, high: np.ndarray) -> Assembly:
    """Six rectangles facing outward."""
    parts = []
    for axis in range(3):
        for end, sign in ((low, -1.0), (high, 1.0)):
            normal, x = sign * np.eye(3)[axis], np.eye(3)[(axis + 1) % 3]
            y = np.cross(normal, x)
            corner = np.where(np.arange(3) == axis, end, low)
            span = high - low
            u, v = (0.0, float(span @ x)), sorted((0.0, float(span @ y)))
            parts.append(Part(f"side{len(parts)}", NOTHING, Plane(corner, normal, x, u, (v[0], v[1]))))
    return Assembly(tuple(parts))


def extrusion(spec: dict[str, Any]) -> NurbsSurface:
    """A circle or its right half, moved along a direction; a length of 100 radii where the source gives none."""
    circle = spec["curve"]
    z, x = np.array(circle["normal"], dtype=float), np.array(circle["xdir"], dtype=float)
    y, r = np.cross(z, x), circle["radius"]
    whole = circle.get("u") is None
    if not whole:
        assert np.allclose(circle["u"], (-0.5 * math.pi, 0.5 * math.pi))
    quarter = [(0, -1), (1, -1), (1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1)][: 9 if whole else 5]
    weights = np.array([1.0, HALF] * (4 if whole else 2) + [1.0])
    net = np.array([np.array(circle["center"]) + r * (p * x + q * y) for p, q in quarter])
    spans = (len(quarter) - 1) // 2
    knots = np.array([0.0, *np.repeat(np.arange(spans + 1.0), 2), spans])
    low, high = spec.get("v") or (-100.0 * r, 100.0 * r)
    d = np.array(spec["direction"], dtype=float)
    points = np.stack([net + low * d, net + high * d], axis=1)
    return NurbsSurface((2, 1), (knots, np.array([0.0, 0.0, 1.0, 1.0])), points, np.stack([weights, weights], axis=1))
