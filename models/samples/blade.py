"""A twisted blade, open at hub and tip or closed by flat ends."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples.body import Body
from patchwright.models.samples.lifting import Station, chord_lines, placed, section
from patchwright.models.samples.sample import Sample
from patchwright.models.samples.splines import cubic, ruled


def blade(*, span: float = 1.0, cells: tuple[int, int] = (30, 40), closed: bool = False) -> Sample:
    """Both sides of a compressor-like blade: chord 0.45 to 0.32, thickness 10 to 5 %, twisted by 35 degrees.

    Sections are lofted by cubic splines along the span (y); suction and pressure side meet in the leading edge with a
    common tangent, in the sharp trailing edge with an angle; both ends are open unless `closed`, which adds planes.
    """
    r = np.linspace(0.0, 1.0, 6)
    stations = [
        Station(span * t, -0.11 + 0.04 * t**2, 0.02 * t**2, 0.45 - 0.13 * t, 0.10 - 0.05 * t, 0.07 - 0.04 * t, twist)
        for t, twist in zip(r, np.radians(-20.0 - 35.0 * r + 6.0 * np.sin(np.pi * r)), strict=True)
    ]
    shapes = [section(s.thickness, s.camber) for s in stations]
    U = shapes[0].knots
    top = [placed(s, shape.upper) for s, shape in zip(stations, shapes, strict=True)]
    bottom = [placed(s, shape.lower) for s, shape in zip(stations, shapes, strict=True)]
    V, upper = cubic(r, np.stack(top))
    _, lower = cubic(r, np.stack(bottom))
    faces = {
        "suction": NurbsSurface((3, 3), (U, V), upper.swapaxes(0, 1)),
        "pressure": NurbsSurface((3, 3), (V, U), lower),
    }
    lines: dict[str, Array] = {"chord": chord_lines(cells[0]), "span": np.linspace(0.0, 1.0, cells[1] + 1)}
    directions = [("chord", "span"), ("span", "chord")]
    if closed:
        across, hub = ruled([bottom[0], top[0]], [0.0, 1.0])
        _, end = ruled([bottom[-1], top[-1]], [0.0, 1.0])
        faces["hub"] = NurbsSurface((3, 3), (U, across), hub)
        faces["tip"] = NurbsSurface((3, 3), (U, across), end).transposed()
        lines["across"] = np.linspace(0.0, 1.0, 3)
        directions += [("chord", "across"), ("across", "chord")]
    body = Body("blade", tuple(faces), tuple(faces.values()), lines, tuple(directions), closed=closed)
    return Sample.of("blade", (body,))
