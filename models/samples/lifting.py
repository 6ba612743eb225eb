"""Bodies lofted from wing sections: straight lines between stations, a sharp trailing edge, round tips.

Sections follow the NACA four-digit family (Jacobs, Ward and Pinkerton, NACA report 460, 1933) with the last thickness
coefficient changed to -0.1036, which closes the trailing edge. In xi = sqrt(x / chord) both thickness and camber are
smooth at the leading edge, so upper and lower surface meet there with a common tangent.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples.body import Body
from patchwright.models.samples.splines import cubic, half_circle, ruled

THICKNESS = (0.2969, -0.1260, -0.3516, 0.2843, -0.1036)


class Station(NamedTuple):
    """One section: where it stands along the span and its shape."""

    span: float
    x: float
    """leading edge, along the chord direction"""
    z: float
    """leading edge, along the thickness direction"""
    chord: float
    thickness: float
    """largest thickness over chord"""
    camber: float = 0.0
    """largest camber over chord, at 40 % of it"""
    twist: float = 0.0
    """radians, leading edge up, about the quarter chord"""


class Section(NamedTuple):
    """Control values over xi in [0, 1], from the leading to the trailing edge, on common knots."""

    knots: Array
    upper: Array
    """(n, 2) x and z"""
    lower: Array

    @property
    def mean(self) -> Array:
        """(n, 2) control values of the mean line."""
        return 0.5 * (self.upper + self.lower)


def section(thickness: float, camber: float = 0.0, *, pieces: int = 14) -> Section:
    """The unit-chord section as C2 cubics through `pieces` + 1 points of the four-digit formula."""
    xi = np.linspace(0.0, 1.0, pieces + 1)
    x = xi**2
    c = 5.0 * thickness * np.array(THICKNESS)
    half = c[0] * xi + c[1] * x + c[2] * x**2 + c[3] * x**3 + c[4] * x**4
    half[-1] = 0.0
    half_end = c[0] + 2.0 * (c[1] + 2.0 * c[2] + 3.0 * c[3] + 4.0 * c[4])
    fore, aft = camber / 0.16 * (0.8 * x - x**2), camber / 0.36 * (0.2 + 0.8 * x - x**2)
    line = np.where(x < 0.4, fore, aft)
    line[-1] = 0.0
    line_end = 2.0 * camber / 0.36 * (0.8 - 2.0)
    values = np.stack([x, line, half], axis=1)
    knots, net = cubic(xi, values, ([0.0, 0.0, c[0]], [2.0, line_end, half_end]))
    return Section(knots, net[:, :2] + net[:, 2:] * [0.0, 1.0], net[:, :2] - net[:, 2:] * [0.0, 1.0])


def chord_lines(cells: int) -> Array:
    """Values of xi: even in xi near the leading edge, denser towards the trailing edge."""
    t = np.linspace(0.0, 1.0, cells + 1)
    lines = 0.55 * t + 0.45 * np.sin(0.5 * np.pi * t)
    lines[-1] = 1.0
    return np.asarray(lines)


def placed(station: Station, net: Array) -> Array:
    """(n, 3) control points x, span, z of a unit-chord net (n, 2) at its station."""
    about = np.array([0.25, 0.0])
    cos, sin = np.cos(station.twist), np.sin(station.twist)
    turned = about + (net - about) @ np.array([[cos, -sin], [sin, cos]])
    x, z = station.x + station.chord * turned[:, 0], station.z + station.chord * turned[:, 1]
    return np.stack([x, np.full(len(net), station.span), z], axis=1)


def tip(station: Station, shape: Section, side: int) -> NurbsSurface:
    """The half body of revolution about the mean line that closes a loft at its low (`side` -1) or high (1) end."""
    knots, circle = half_circle()
    mean, upper = placed(station, shape.mean), placed(station, shape.upper)
    half = upper - mean
    depth = np.linalg.norm(half, axis=1) * np.sign(shape.upper[:, 1] - shape.mean[:, 1])
    net = mean[:, None] + half[:, None] * circle[None, :, :1]
    net[:, :, 1] += side * depth[:, None] * circle[None, :, 1]
    net[:, 0], net[:, -1] = upper, placed(station, shape.lower)
    surface = NurbsSurface((3, 3), (shape.knots, knots), net)
    return surface if side > 0 else surface.transposed()


def lifting_body(
    name: str, stations: Sequence[Station], cells: tuple[int, Sequence[int]], *, round_cells: int = 8
) -> Body:
    """A closed body of four surfaces: upper, lower and the two tips, x along the chord, y along the span.

    Parameters
    ----------
    stations : sections in order of increasing span
    cells : along the chord, and between each two stations
    round_cells : round the tips, from upper to lower side
    """
    shapes = [section(s.thickness, s.camber) for s in stations]
    upper = [placed(s, shape.upper) for s, shape in zip(stations, shapes, strict=True)]
    lower = [placed(s, shape.lower) for s, shape in zip(stations, shapes, strict=True)]
    spans = [s.span for s in stations]
    knots, top = ruled(upper, spans)
    _, bottom = ruled(lower, spans)
    U = shapes[0].knots
    surfaces = (
        NurbsSurface((3, 3), (U, knots), top),
        NurbsSurface((3, 3), (U, knots), bottom).transposed(),
        tip(stations[0], shapes[0], -1),
        tip(stations[-1], shapes[-1], 1),
    )
    pieces = [np.linspace(a, b, n + 1)[1:] for a, b, n in zip(spans[:-1], spans[1:], cells[1], strict=True)]
    lines = {
        "chord": chord_lines(cells[0]),
        "span": np.concatenate([[spans[0]], *pieces]),
        "round": np.linspace(0.0, np.pi, round_cells + 1),
    }
    directions = (("chord", "span"), ("span", "chord"), ("round", "chord"), ("chord", "round"))
    return Body(name, ("upper", "lower", "tip-low", "tip-high"), surfaces, lines, directions)
