"""A wavy patch: one open bicubic surface."""

from __future__ import annotations

import numpy as np

from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples.body import Body
from patchwright.models.samples.sample import Sample
from patchwright.models.samples.splines import cubic


def wavy_patch(*, points: int = 13, cells: int = 32) -> Sample:
    """The bicubic not-a-knot interpolant of z = 0.15 sin(2 pi x) cos(pi y) + 0.1 x y on a grid of `points` a side.

    The truth is the spline, not the formula; x = u and y = v exactly.
    """
    t = np.linspace(0.0, 1.0, points)
    x, y = np.meshgrid(t, t, indexing="ij")
    values = np.stack([x, y, 0.15 * np.sin(2.0 * np.pi * x) * np.cos(np.pi * y) + 0.1 * x * y], axis=-1)
    U, half = cubic(t, values)
    V, net = cubic(t, half.swapaxes(0, 1))
    surface = NurbsSurface((3, 3), (U, V), net.swapaxes(0, 1))
    lines = {"edge": np.linspace(0.0, 1.0, cells + 1)}
    return Sample.of("wavy patch", (Body("patch", ("patch",), (surface,), lines, (("edge", "edge"),), closed=False),))
