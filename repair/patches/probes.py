"""Directions of the probes a patch sends out: its normals, smoothed until neighbouring probes no longer cross.

Source: Hamann, Jean, Razdan, section 3.3 (HJR 5-6). Departure: over waved sides the Coons patch waves more than the
geometry, its normals meet within the offset distance, and probes then miss or land on one another's ground. The
directions are those of a fixed grid, so that they do not change when grid lines are added.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array
from patchwright.repair.patches.coons import offset_normals

SIDE = 33  # points of the grid of directions along a side
CLEAR = 0.25  # of a step along the patch: how far apart the ends of neighbouring probes stay


@dataclass(frozen=True, slots=True, eq=False)
class Probes:
    """Unit directions (SIDE, SIDE, 3) at even shares of both parameters, and half the probes' length."""

    directions: Array
    distance: float

    @classmethod
    def of(cls, coons: Array, distance: float, sign: int = 1) -> Probes:
        """The normals (HJR 5) of a patch's points (SIDE, SIDE, 3) times `sign`, smoothed as little as may be."""
        normal = sign * offset_normals(coons)
        width = 0.5
        while width <= SIDE and _crossing(coons, normal, distance):
            normal = _smoothed(sign * offset_normals(coons), width)
            width *= 1.5
        return cls(normal, distance)

    def at(self, u: Array, v: Array) -> Array:
        """(m, n, 3) the directions at shares u (m,) and v (n,), bilinear between those of the grid, unit."""
        out = _along(_along(self.directions, u).swapaxes(0, 1), v).swapaxes(0, 1)
        return np.asarray(out / np.linalg.norm(out, axis=-1, keepdims=True))


def line_directions(points: Array, directions: Array, distance: float) -> Array:
    """Unit directions (n, 3) for probes from the points of a line, smoothed as little as may be so that none cross."""
    from scipy.ndimage import gaussian_filter1d

    out, width = directions, 1.0
    step = np.diff(points, axis=0)
    size = np.einsum("ij,ij->i", step, step)
    while width <= len(points):
        closing = np.abs(np.einsum("ij,ij->i", step, distance * np.diff(out, axis=0)))
        if not (closing > (1.0 - CLEAR) * size).any():
            break
        out = gaussian_filter1d(directions, width, axis=0, mode="nearest")
        length = np.linalg.norm(out, axis=1, keepdims=True)
        out = np.divide(out, length, out=np.array(directions), where=length > 1e-6)
        width *= 1.5
    return np.asarray(out)


def _along(values: Array, at: Array) -> Array:
    """Linear interpolation along the first axis."""
    place = np.clip(at, 0.0, 1.0) * (len(values) - 1)
    k = np.minimum(place.astype(np.int64), len(values) - 2)
    w = (place - k).reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray((1.0 - w) * values[k] + w * values[k + 1])


def _crossing(coons: Array, normal: Array, distance: float) -> bool:
    """Whether the ends of any two neighbouring probes come too near each other or change places."""
    for axis in (0, 1):
        step, turn = np.diff(coons, axis=axis), distance * np.diff(normal, axis=axis)
        size = np.einsum("ijk,ijk->ij", step, step)
        closing = np.abs(np.einsum("ijk,ijk->ij", step, turn))
        if (closing > (1.0 - CLEAR) * size).any():
            return True
    return False


def _smoothed(normal: Array, width: float) -> Array:
    """The directions averaged with a Gaussian of this standard deviation, in grid steps."""
    from scipy.ndimage import gaussian_filter

    out = gaussian_filter(normal, (width, width, 0.0), mode="nearest")
    length = np.linalg.norm(out, axis=-1, keepdims=True)
    return np.asarray(np.divide(out, length, out=np.array(normal), where=length > 1e-6))
