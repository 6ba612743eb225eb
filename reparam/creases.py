"""Lines of the domain across which a surface has a corner: a new surface needs a line of its own there."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.knots import distinct
from patchwright.models.nurbs_surface import NurbsSurface

CORNER = 1e-4  # radians: what turns less is smooth
LINES = 33


def crease_parameters(surface: NurbsSurface, axis: int, box: Array) -> Array:
    """(k,) parameters of the direction, inside the box (2, 2), where the tangent turns by more than 1e-4 radians.

    Only knots of full multiplicity can be such places: elsewhere the tangent is continuous.
    """
    values, counts = distinct(surface.knots[axis])
    low, high = box[axis]
    inside = (values > low) & (values < high) & (counts >= surface.degree[axis])
    found = []
    across = np.linspace(box[1 - axis, 0], box[1 - axis, 1], LINES)
    order = (1, 0) if axis == 0 else (0, 1)
    for knot in values[inside].tolist():
        gap = 1e-7 * float(np.diff(surface.breaks[axis]).min())
        at = np.array([knot - gap, knot + gap])
        d = surface.grid(at, across, order) if axis == 0 else surface.grid(across, at, order).swapaxes(0, 1)
        length = np.linalg.norm(d, axis=2)
        live = length.min(axis=0) > 1e-9 * length.max()
        unit = d[:, live] / length[:, live, None]
        if live.any() and float(np.linalg.norm(unit[1] - unit[0], axis=1).max()) > CORNER:
            found.append(knot)
    return np.array(found)
