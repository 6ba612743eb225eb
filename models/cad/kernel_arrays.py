"""Coordinates between numpy arrays and the kernel's own array classes."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad import kernel


def points_3d(values: Iterable[Any]) -> Array:
    """(n, 3) coordinates of kernel points."""
    return np.array([(p.X(), p.Y(), p.Z()) for p in values], dtype=np.float64).reshape(-1, 3)


def points_2d(values: Iterable[Any]) -> Array:
    """(n, 2) coordinates of kernel points in a plane."""
    return np.array([(p.X(), p.Y()) for p in values], dtype=np.float64).reshape(-1, 2)


def items(line: Any) -> list[Any]:
    """The items of a kernel array; its own iterator costs half a millisecond to start."""
    value = line.Value
    return [value(i) for i in range(line.Lower(), line.Upper() + 1)]


def reals(line: Any) -> Array:
    """(n,) numbers of a kernel array."""
    return np.array(items(line), dtype=np.float64)


def curve_weights(curve: Any) -> Array | None:
    """(n,) weights of a spline curve, None when it is not rational.

    The kernel's own `Weights()` hands out a pointer that its bindings then free a second time: have it fill an array.
    """
    if not curve.IsRational():
        return None
    out = kernel.Array1_double(1, curve.NbPoles())
    curve.Weights(out)
    return reals(out)


def kernel_points(points: Array) -> Any:
    """A kernel array of (n, 3) or (n, 2) points."""
    if points.shape[1] == 3:
        out, make = kernel.Array1_gp_Pnt(1, len(points)), kernel.gp_Pnt
    else:
        out, make = kernel.Array1_gp_Pnt2d(1, len(points)), kernel.gp_Pnt2d
    for i, p in enumerate(points.tolist(), 1):
        out.SetValue(i, make(*p))
    return out


def kernel_net(points: Array) -> Any:
    """A kernel array of (n, m, 3) points."""
    out = kernel.Array2_gp_Pnt(1, points.shape[0], 1, points.shape[1])
    for i, row in enumerate(points.tolist(), 1):
        for j, p in enumerate(row, 1):
            out.SetValue(i, j, kernel.gp_Pnt(*p))
    return out


def kernel_reals(values: Array) -> Any:
    """A kernel array of (n,) or (n, m) numbers."""
    if values.ndim == 1:
        line = kernel.Array1_double(1, len(values))
        for i, x in enumerate(values.tolist(), 1):
            line.SetValue(i, x)
        return line
    table = kernel.Array2_double(1, values.shape[0], 1, values.shape[1])
    for i, row in enumerate(values.tolist(), 1):
        for j, x in enumerate(row, 1):
            table.SetValue(i, j, x)
    return table


def kernel_knots(knots: Array) -> tuple[Any, Any]:
    """The kernel's distinct knots and multiplicities of a full knot vector; equal vectors give the same arrays."""
    return _kernel_knots(knots.tobytes())


@lru_cache(maxsize=1024)
def _kernel_knots(knots: bytes) -> tuple[Any, Any]:
    distinct, counts = np.unique(np.frombuffer(knots), return_counts=True)
    multiplicities = kernel.Array1_int(1, len(counts))
    for i, k in enumerate(counts.tolist(), 1):
        multiplicities.SetValue(i, k)
    return kernel_reals(distinct), multiplicities
