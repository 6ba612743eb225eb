"""A car-like body: one closed smooth surface with creases along its sills."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples.body import Body
from patchwright.models.samples.sample import Sample

# rows of the control net from nose to tail, metres: x, half width at sill, at belt, at roof; height of floor, belt, top
ROWS = np.array(
    [
        [0.00, 0.00, 0.00, 0.00, 0.50, 0.50, 0.50],
        [0.00, 0.55, 0.58, 0.40, 0.28, 0.50, 0.66],
        [0.03, 0.78, 0.80, 0.60, 0.22, 0.55, 0.74],
        [0.35, 0.87, 0.89, 0.68, 0.18, 0.64, 0.86],
        [0.90, 0.90, 0.91, 0.72, 0.17, 0.70, 0.93],
        [1.35, 0.90, 0.92, 0.74, 0.17, 0.76, 0.98],
        [1.50, 0.90, 0.92, 0.70, 0.17, 0.80, 1.06],
        [2.05, 0.90, 0.92, 0.58, 0.17, 0.88, 1.44],
        [2.30, 0.90, 0.92, 0.56, 0.17, 0.90, 1.49],
        [2.80, 0.90, 0.92, 0.56, 0.17, 0.92, 1.50],
        [3.20, 0.90, 0.92, 0.56, 0.17, 0.93, 1.46],
        [3.80, 0.90, 0.91, 0.62, 0.18, 0.94, 1.16],
        [3.95, 0.89, 0.90, 0.66, 0.19, 0.94, 1.09],
        [4.30, 0.86, 0.87, 0.68, 0.22, 0.90, 1.07],
        [4.47, 0.80, 0.82, 0.64, 0.28, 0.84, 1.03],
        [4.50, 0.55, 0.58, 0.42, 0.38, 0.76, 0.92],
        [4.50, 0.00, 0.00, 0.00, 0.66, 0.66, 0.66],
    ]
)


def car(*, cells: tuple[int, int] = (112, 128)) -> Sample:
    """A notchback saloon 4.5 m long without wheels: bonnet, cabin, boot; the floor meets the sides in two creases.

    One C2 bicubic surface (C0 across the sills), round the section in u from the middle of the floor, nose to tail in
    v, both ends closed in poles.
    """
    right = np.stack([_section(*row) for row in ROWS], axis=1)  # (9, rows, 3)
    left = right[::-1] * [1.0, -1.0, 1.0]
    net = np.concatenate([right, left[1:]])
    crease = 3.0
    last = 2.0 * crease + 8.0  # u: 0..3 floor, 3..11 sides and roof, 11..14 floor
    inner = np.concatenate([[crease] * 3, np.arange(crease + 1.0, last - crease), [last - crease] * 3])
    U = np.concatenate([[0.0] * 4, inner, [last] * 4])
    rows = net.shape[1]
    V = np.concatenate([[0.0] * 3, np.linspace(0.0, 1.0, rows - 2), [1.0] * 3])
    surface = NurbsSurface((3, 3), (U, V), net)
    share = np.array([1.0, 4.0, 1.0]) / 6.0
    pieces = [round(cells[0] * s) for s in share]
    breaks = [0.0, crease, last - crease, last]
    round_lines = [np.linspace(a, b, n + 1)[1:] for a, b, n in zip(breaks[:-1], breaks[1:], pieces, strict=True)]
    lines = {"round": np.concatenate([[0.0], *round_lines]), "length": np.linspace(0.0, 1.0, cells[1] + 1)}
    return Sample.of("car", (Body("car", ("skin",), (surface,), lines, (("round", "length"),)),))


def _section(x: float, sill: float, belt: float, roof: float, floor: float, waist: float, top: float) -> Array:
    """(9, 3) control points of the right half, from the middle of the floor over the sill to the middle of the roof."""
    y = [0.0, sill / 3.0, 2.0 * sill / 3.0, sill, belt + 0.02 * (belt > 0.0), belt, roof, 0.5 * roof, 0.0]
    z = [floor, floor, floor, floor, 0.5 * (floor + waist), waist, top - 0.12 * (top - waist), top, top]
    return np.stack([np.full(len(y), x), y, z], axis=1)
