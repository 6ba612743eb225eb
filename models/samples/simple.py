"""Exact shapes with closed-form truth: sphere, ellipsoid, torus, capsule, cube, two spheres."""

from __future__ import annotations

import numpy as np

from patchwright.models import knots as knot_tools
from patchwright.models.arrays import Array
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples.body import Body
from patchwright.models.samples.sample import Sample

QUARTERS = np.array([0.0, 0.0, 0.0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1.0, 1.0, 1.0])
HALVES = np.array([0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0, 1.0])
QUARTER = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
CIRCLE = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]], dtype=np.float64)
WEIGHTS = np.where(np.arange(9) % 2, np.sqrt(0.5), 1.0)


def revolved(profile: Array, weights: Array, knots: Array) -> NurbsSurface:
    """The surface of revolution about z of a quadratic profile (n, 2) of radius and height; u runs round, v along it.

    Piegl and Tiller, The NURBS Book, section 8.5. Its normal is on the right of the profile's direction.
    """
    net = np.empty((9, len(profile), 3))
    net[..., :2] = CIRCLE[:, None] * profile[None, :, :1]
    net[..., 2] = profile[:, 1]
    return NurbsSurface((2, 2), (QUARTERS, knots), net, WEIGHTS[:, None] * weights[None])


def _body(name: str, surfaces: dict[str, NurbsSurface], lines: dict[str, Array], *directions: tuple[str, str]) -> Body:
    return Body(name, tuple(surfaces), tuple(surfaces.values()), lines, directions)


def sphere_body(
    name: str, radius: float = 1.0, centre: tuple[float, float, float] = (0.0, 0.0, 0.0), cells: int = 48
) -> Body:
    """A sphere as one rational biquadratic surface with poles on its z axis."""
    arc = radius * CIRCLE[[6, 7, 0, 1, 2]]
    surface = revolved(arc, WEIGHTS[:5], HALVES)
    lines = {"round": np.linspace(0.0, 1.0, cells + 1), "along": np.linspace(0.0, 1.0, cells // 2 + 1)}
    body = _body(name, {"skin": surface}, lines, ("round", "along"))
    return body.moved(lambda points: points + np.array(centre))


def sphere(radius: float = 1.0, *, cells: int = 48) -> Sample:
    """A sphere about the origin, `cells` round the equator."""

    def distance(points: Array) -> Array:
        return np.asarray(np.abs(np.linalg.norm(points, axis=1) - radius))

    return Sample.of(
        "sphere",
        (sphere_body("sphere", radius, cells=cells),),
        exact_distance=distance,
        exact_volume=4.0 / 3.0 * np.pi * radius**3,
        exact_area=4.0 * np.pi * radius**2,
    )


def two_spheres(apart: float = 1.0, *, cells: int = 48) -> Sample:
    """Two unit spheres in one assembly, `apart` between their centres on the x axis, less than 2."""
    bodies = (sphere_body("left", cells=cells), sphere_body("right", centre=(apart, 0.0, 0.0), cells=cells))
    lens = np.pi * (4.0 + apart) * (2.0 - apart) ** 2 / 12.0
    cap = 2.0 * np.pi * (1.0 - 0.5 * apart)
    return Sample.of("two spheres", bodies, exact_volume=8.0 / 3.0 * np.pi - lens, exact_area=2.0 * (4.0 * np.pi - cap))


def ellipsoid(axes: tuple[float, float, float] = (1.0, 0.6, 0.4), *, cells: int = 48) -> Sample:
    """An ellipsoid: the affine image of the sphere's control points."""
    body = sphere_body("ellipsoid", cells=cells).moved(lambda points: points * np.array(axes))
    return Sample.of("ellipsoid", (body,), exact_volume=float(4.0 / 3.0 * np.pi * np.prod(axes)))


def torus(major: float = 1.0, minor: float = 0.3, *, cells: int = 64) -> Sample:
    """A torus about the z axis."""
    arc = minor * CIRCLE + np.array([major, 0.0])
    surface = revolved(arc, WEIGHTS, QUARTERS)
    lines = {"round": np.linspace(0.0, 1.0, cells + 1), "tube": np.linspace(0.0, 1.0, cells // 2 + 1)}

    def distance(points: Array) -> Array:
        return np.asarray(np.abs(np.hypot(np.hypot(points[:, 0], points[:, 1]) - major, points[:, 2]) - minor))

    return Sample.of(
        "torus",
        (_body("torus", {"skin": surface}, lines, ("round", "tube")),),
        exact_distance=distance,
        exact_volume=2.0 * np.pi**2 * major * minor**2,
        exact_area=4.0 * np.pi**2 * major * minor,
    )


def capsule(gap: float = 0.1, *, cells: int = 48) -> Sample:
    """Two unit hemispheres and the cylinder of height `gap` between them, one closed body of three surfaces.

    Without its part "wall" it is the two hemispheres pushed apart: see `push_apart` for that defect.
    """
    low, high = -0.5 * gap, 0.5 * gap
    quarter = WEIGHTS[:3]
    south = CIRCLE[[6, 7, 0]] + np.array([0.0, low])
    north = CIRCLE[[0, 1, 2]] + np.array([0.0, high])
    wall = np.array([[1.0, low], [1.0, 0.0], [1.0, high]])
    surfaces = {
        "south": revolved(south, quarter, QUARTER),
        "wall": revolved(wall, np.ones(3), QUARTER),
        "north": revolved(north, quarter, QUARTER),
    }
    lines = {
        "round": np.linspace(0.0, 1.0, cells + 1),
        "along": np.linspace(0.0, 1.0, cells // 4 + 1),
        "wall": np.linspace(0.0, 1.0, max(1, round(gap * cells / 6.0)) + 1),
    }
    body = _body("capsule", surfaces, lines, ("round", "along"), ("round", "wall"), ("round", "along"))

    def distance(points: Array) -> Array:
        off = points - np.array([0.0, 0.0, 1.0]) * np.clip(points[:, 2:], low, high)
        return np.asarray(np.abs(np.linalg.norm(off, axis=1) - 1.0))

    return Sample.of(
        "capsule",
        (body,),
        exact_distance=distance,
        exact_volume=4.0 / 3.0 * np.pi + np.pi * gap,
        exact_area=4.0 * np.pi + 2.0 * np.pi * gap,
    )


CUBE_FACES = {
    "bottom": ((0, 0, 0), (0, 1, 0), (1, 0, 0)),
    "top": ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
    "front": ((0, 0, 0), (1, 0, 0), (0, 0, 1)),
    "back": ((0, 1, 0), (0, 0, 1), (1, 0, 0)),
    "left": ((0, 0, 0), (0, 0, 1), (0, 1, 0)),
    "right": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
}
"""Per face of the unit cube a corner and the two edges that leave it, their cross product outwards."""


def cube(size: float = 1.0, *, cells: int = 8) -> Sample:
    """The cube [0, size]^3 as six bilinear surfaces."""
    knots = knot_tools.bezier_knots(1)
    surfaces = {}
    for name, (corner, along_u, along_v) in CUBE_FACES.items():
        o, a, b = (size * np.array(x, dtype=np.float64) for x in (corner, along_u, along_v))
        surfaces[name] = NurbsSurface((1, 1), (knots, knots), np.array([[o, o + b], [o + a, o + a + b]]))
    body = _body("cube", surfaces, {"edge": np.linspace(0.0, 1.0, cells + 1)}, *[("edge", "edge")] * 6)

    def distance(points: Array) -> Array:
        q = np.abs(points - 0.5 * size) - 0.5 * size
        outside, inside = np.linalg.norm(np.maximum(q, 0.0), axis=1), np.minimum(q.max(axis=1), 0.0)
        return np.asarray(np.abs(outside + inside))

    return Sample.of("cube", (body,), exact_distance=distance, exact_volume=size**3, exact_area=6.0 * size**2)
