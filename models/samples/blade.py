"""A twisted blade, open at hub and tip."""

from __future__ import annotations

import numpy as np

from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples.body import Body
from patchwright.models.samples.lifting import Station, chord_lines, placed, section
from patchwright.models.samples.sample import Sample
from patchwright.models.samples.splines import cubic


def blade(*, span: float = 1.0, cells: tuple[int, int] = (30, 40)) -> Sample:
    """Both sides of a compressor-like blade: chord 0.45 to 0.32, thickness 10 to 5 %, twisted by 35 degrees.

    Sections are lofted by cubic splines along the span (y); suction and pressure side meet in the leading edge with a
    common tangent, in the sharp trailing edge with an angle; both ends are open.
    """
    r = np.linspace(0.0, 1.0, 6)
    stations = [
        Station(span * t, -0.11 + 0.04 * t**2, 0.02 * t**2, 0.45 - 0.13 * t, 0.10 - 0.05 * t, 0.07 - 0.04 * t, twist)
        for t, twist in zip(r, np.radians(-20.0 - 35.0 * r + 6.0 * np.sin(np.pi * r)), strict=True)
    ]
    shapes = [section(s.thickness, s.camber) for s in stations]
    U = shapes[0].knots
    V, upper = cubic(r, np.stack([placed(s, shape.upper) for s, shape in zip(stations, shapes, strict=True)]))
    _, lower = cubic(r, np.stack([placed(s, shape.lower) for s, shape in zip(stations, shapes, strict=True)]))
    suction = NurbsSurface((3, 3), (U, V), upper.swapaxes(0, 1))
    pressure = NurbsSurface((3, 3), (V, U), lower)
    lines = {"chord": chord_lines(cells[0]), "span": np.linspace(0.0, 1.0, cells[1] + 1)}
    directions = (("chord", "span"), ("span", "chord"))
    body = Body("blade", ("suction", "pressure"), (suction, pressure), lines, directions, closed=False)
    return Sample.of("blade", (body,))
