"""One-dimensional cubic splines the samples are built from, as clamped knots and control values."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from patchwright.models import knots as knot_tools
from patchwright.models.arrays import Array


def cubic(
    t: npt.ArrayLike, values: npt.ArrayLike, slopes: tuple[npt.ArrayLike, npt.ArrayLike] | None = None
) -> tuple[Array, Array]:
    """Clamped knots and control values (n, ...) of the cubic spline through values (k, ...) at t (k,).

    `slopes` are the derivatives at both ends; without them the spline is not-a-knot.
    """
    from scipy.interpolate import make_interp_spline

    data = np.asarray(values, dtype=np.float64)
    ends: Any = None if slopes is None else ([(1, np.asarray(slopes[0]))], [(1, np.asarray(slopes[1]))])
    spline = make_interp_spline(np.asarray(t, dtype=np.float64), data, k=3, bc_type=ends)
    net = np.array(spline.c)
    net[0], net[-1] = data[0], data[-1]  # the ends without round-off: neighbours meet there
    return np.asarray(spline.t), net


def periodic_cubic(values: npt.ArrayLike) -> tuple[Array, Array]:
    """Clamped knots on [0, 1] and control values of the periodic cubic through values (k, ...), last = first."""
    from scipy.interpolate import make_interp_spline

    data = np.asarray(values, dtype=np.float64)
    spline = make_interp_spline(np.linspace(0.0, 1.0, len(data)), data, k=3, bc_type="periodic")
    knots, net = knot_tools.restrict(3, np.asarray(spline.t), np.asarray(spline.c), 0.0, 1.0)
    net = np.array(net)
    net[0] = net[-1] = data[0]
    return np.asarray(knots), net


def half_circle() -> tuple[Array, Array]:
    """Clamped knots on [0, pi] and control values (n, 2) of cos and sin as C2 cubics, exact at the ends."""
    angle = np.linspace(0.0, np.pi, 7)
    values = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    values[0], values[-1] = (1.0, 0.0), (-1.0, 0.0)
    return cubic(angle, values, ([0.0, 1.0], [0.0, -1.0]))


def ruled(nets: Sequence[Array], stations: npt.ArrayLike) -> tuple[Array, Array]:
    """Cubic knots, creased at inner stations, and the net (n, 3 k - 2, 3) of straight lines between k section nets."""
    s = np.asarray(stations, dtype=np.float64)
    rows = [nets[0]]
    for a, b in pairwise(nets):
        rows += [a + (b - a) / 3.0, b + (a - b) / 3.0, b]
    knots = np.concatenate([[s[0]], np.repeat(s, 3), [s[-1]]])
    return knots, np.stack(rows, axis=1)
