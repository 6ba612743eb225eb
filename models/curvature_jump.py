"""The largest jump of normal curvature across the inner knot lines of a surface.

Across a knot line of multiplicity p - 1 or more the second derivative may jump; the normal curvature of the curves that
cross the line then jumps, which shows in reflections and in a pressure distribution.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_surface import NurbsSurface

PLACES = 5  # of every span along a knot line
INSIDE = 1e-9  # of a span: the sides of a knot line are read this far inside it


def curvature_jump(surface: NurbsSurface) -> float:
    """The largest jump, 1 / length, over `PLACES` places of every span of every inner knot line; 0 without any.

    Cost: linear in the spans. Limits: places where the surface has no tangent plane are left out.
    """
    return max(_across(surface, "u"), _across(surface, "v"))


def _across(surface: NurbsSurface, direction: Literal["u", "v"]) -> float:
    """The jumps across lines on which the direction's parameter is constant."""
    lines, along = surface.breaks if direction == "u" else surface.breaks[::-1]
    if len(lines) < 3:
        return 0.0
    step = INSIDE * np.diff(lines)
    places = (along[:-1, None] + np.diff(along)[:, None] * np.linspace(0.05, 0.95, PLACES)).reshape(-1)
    sides = [_curvature(surface, at, places, direction) for at in (lines[1:-1] - step[:-1], lines[1:-1] + step[1:])]
    jump = np.abs(sides[0] - sides[1])
    return float(np.nan_to_num(jump).max(initial=0.0))


def _curvature(surface: NurbsSurface, at: Array, along: Array, direction: Literal["u", "v"]) -> Array:
    """Normal curvature in the direction that crosses the lines, on the grid of lines and places; NaN where none."""
    if direction == "u":
        u, v, first, second = at[:, None], along[None], (1, 0), (2, 0)
    else:
        u, v, first, second = along[None], at[:, None], (0, 1), (0, 2)
    normal = np.cross(surface(u, v, (1, 0)), surface(u, v, (0, 1)))
    tangent = surface(u, v, first)
    size, speed = np.linalg.norm(normal, axis=-1), np.einsum("...i,...i->...", tangent, tangent)
    bend = np.einsum("...i,...i->...", surface(u, v, second), normal)
    bottom = size * speed
    return np.asarray(np.divide(bend, bottom, out=np.full_like(bend, np.nan), where=bottom > 0.0))
