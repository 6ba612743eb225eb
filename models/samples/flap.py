"""A wing section with a slotted flap: two closed bodies that nearly touch."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples.body import Body
from patchwright.models.samples.lifting import Section, Station, chord_lines, placed, section
from patchwright.models.samples.sample import Sample
from patchwright.models.samples.splines import ruled

MAIN = Station(0.0, 0.0, 0.0, 1.0, 0.12, 0.02)
FLAP = Station(0.0, 0.96, 0.0, 0.30, 0.13, 0.03, np.radians(30.0))


def slotted_flap(*, slot: float = 0.015, span: float = 0.6, cells: tuple[int, int] = (48, 24)) -> Sample:
    """Main element of unit chord and a flap of 30 % at 30 degrees below its trailing edge, extruded, with flat ends.

    `slot` is the smallest distance between the two bodies, in chords, met to about 1e-5 of itself.
    """
    main, flap = section(MAIN.thickness, MAIN.camber), section(FLAP.thickness, FLAP.camber)
    here = _slotted(main, flap, slot)
    bodies = (_extruded("main", MAIN, main, span, cells), _extruded("flap", here, flap, span, cells))
    return Sample.of("slotted flap", bodies)


def _slotted(main: Section, flap: Section, slot: float) -> Station:
    """The flap's station, lowered until the smallest distance between the sections' outlines is `slot`.

    Raised from well below by what the distance exceeds the slot, again and again: the flap never passes the slot.
    """
    from scipy.spatial import cKDTree

    fixed = cKDTree(_outline(MAIN, main))
    moving = _outline(FLAP, flap)
    drop, excess = 0.25, np.inf
    while excess > 1e-9:
        excess = float(np.min(fixed.query(moving - [0.0, drop])[0])) - slot
        drop -= excess
    return FLAP._replace(z=FLAP.z - drop)


def _outline(station: Station, shape: Section) -> Array:
    """Dense points x, z of both sides; denser than 1e-3 of the chord."""
    xi = np.linspace(0.0, 1.0, 3_001)
    sides = [NurbsCurve(3, shape.knots, placed(station, net)[:, [0, 2]])(xi) for net in (shape.upper, shape.lower)]
    return np.concatenate(sides)


def _extruded(name: str, station: Station, shape: Section, span: float, cells: tuple[int, int]) -> Body:
    """A prism of one section from y = 0 to `span`; its flat ends are ruled between lower and upper side."""
    ends = [station._replace(span=0.0), station._replace(span=span)]
    knots, upper = ruled([placed(s, shape.upper) for s in ends], [0.0, span])
    _, lower = ruled([placed(s, shape.lower) for s in ends], [0.0, span])
    U = shape.knots
    across, left = ruled([lower[:, 0], upper[:, 0]], [0.0, 1.0])
    _, right = ruled([lower[:, -1], upper[:, -1]], [0.0, 1.0])
    surfaces = (
        NurbsSurface((3, 3), (U, knots), upper),
        NurbsSurface((3, 3), (U, knots), lower).transposed(),
        NurbsSurface((3, 3), (U, across), left),
        NurbsSurface((3, 3), (U, across), right).transposed(),
    )
    lines: dict[str, Array] = {
        "chord": chord_lines(cells[0]),
        "span": np.linspace(0.0, span, cells[1] + 1),
        "across": np.linspace(0.0, 1.0, 5),
    }
    directions = (("chord", "span"), ("span", "chord"), ("chord", "across"), ("across", "chord"))
    return Body(name, ("upper", "lower", "end-left", "end-right"), surfaces, lines, directions)
