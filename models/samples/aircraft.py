"""A transport aircraft of four overlapping closed bodies; proportions of a narrow-body twin, engines left off."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples.body import Body
from patchwright.models.samples.lifting import Station, lifting_body
from patchwright.models.samples.sample import Sample
from patchwright.models.samples.splines import cubic, periodic_cubic

RADIUS = 0.054
"""Fuselage radius; this and all lengths below in fuselage lengths, nose at the origin, x aft, y right, z up."""
NOSE, TAIL = 0.15, 0.62
"""Where the cylindrical part begins and ends; between `NOSE` and the wing only the fuselage meets a plane x = const."""


def fuselage() -> Body:
    """Nose and tail close to poles with a continuous tangent plane; one surface, its seam along the keel."""
    x, radius, centre = _profile()
    away = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(radius)))])
    V, values = cubic(away / away[-1], np.stack([x, radius, centre], axis=1))
    angle = np.linspace(0.0, 2.0 * np.pi, 33)
    U, circle = periodic_cubic(np.stack([np.sin(angle), -np.cos(angle)], axis=1))
    net = np.empty((len(circle), len(values), 3))
    net[..., 0] = values[:, 0]
    net[..., 1] = circle[:, :1] * values[:, 1]
    net[..., 2] = values[:, 2] + circle[:, 1:] * values[:, 1]
    lines = {"round": np.linspace(0.0, 1.0, 97), "length": _length_lines(112)}
    return Body("fuselage", ("skin",), (NurbsSurface((3, 3), (U, V), net),), lines, (("round", "length"),))


def _profile() -> tuple[Array, Array, Array]:
    """x, radius and height of the axis at the interpolated stations."""
    nose = np.linspace(0.0, 0.5 * np.pi, 13)
    x_nose, r_nose = NOSE * (1.0 - np.cos(nose)), RADIUS * np.sin(nose)
    droop = -0.016 * np.cos(nose) ** 3
    x_mid = np.linspace(NOSE, TAIL, 14)[1:-1]
    aft = np.linspace(0.0, 0.5 * np.pi, 17)
    x_aft = TAIL + (1.0 - TAIL) * np.sin(aft)
    r_aft = RADIUS * (0.16 * np.cos(aft) + 0.84 * np.cos(aft) ** 2)
    radius = np.concatenate([r_nose, np.full(len(x_mid), RADIUS), r_aft])
    radius[0] = radius[-1] = 0.0
    centre = np.concatenate([droop, np.zeros(len(x_mid)), 0.8 * (RADIUS - r_aft)])
    return np.concatenate([x_nose, x_mid, x_aft]), radius, centre


def _length_lines(cells: int) -> Array:
    """Even steps, finer towards both poles."""
    t = np.linspace(0.0, 1.0, cells + 1)
    lines = 0.7 * t + 0.15 * (1.0 - np.cos(np.pi * t))
    lines[-1] = 1.0
    return np.asarray(lines)


def wing() -> Body:
    """Both sides in one body, right through the fuselage: swept by 27 degrees, dihedral 5, kinked trailing edge."""
    root = Station(0.0, 0.300, -0.034, 0.200, 0.125, 0.018, np.radians(2.5))
    kink = Station(0.165, 0.390, -0.020, 0.110, 0.115, 0.018, np.radians(1.0))
    end = Station(0.465, 0.546, 0.008, 0.044, 0.105, 0.018, np.radians(-1.5))
    return lifting_body("wing", [*_mirrored(end, kink), root, kink, end], (34, [34, 26, 26, 34]))


def tail() -> Body:
    """The horizontal tail, both sides in one body."""
    root = Station(0.0, 0.845, 0.030, 0.120, 0.10)
    end = Station(0.165, 0.951, 0.047, 0.044, 0.09)
    return lifting_body("tail", [*_mirrored(end), root, end], (22, [26, 26]))


def fin() -> Body:
    """The fin; its root lies inside the fuselage."""
    stations = [Station(0.028, 0.770, 0.0, 0.170, 0.10), Station(0.215, 0.925, 0.0, 0.056, 0.09)]
    upright = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # span -> z, thickness -> -y
    return lifting_body("fin", stations, (24, [30])).moved(lambda points: points @ upright)


def _mirrored(*stations: Station) -> list[Station]:
    return [s._replace(span=-s.span) for s in stations]


def aircraft(*, length: float = 10.0, triangles: int | None = 50_000) -> Sample:
    """Fuselage, wing, tail and fin as overlapping closed bodies with about `triangles` triangles; lengths in metres."""
    bodies = tuple(b.moved(lambda points: points * length) for b in (fuselage(), wing(), tail(), fin()))
    return Sample.of("aircraft", bodies, triangles=triangles)
