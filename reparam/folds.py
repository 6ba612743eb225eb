"""Folds of a grid of parameters: cells that have turned over in the plane."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array


def corner_areas(uv: Array) -> Array:
    """(4, m, n) twice the signed areas of the four corner triangles of every cell of (m + 1, n + 1, 2) parameters.

    All positive: every cell is convex and the grid, taken bilinear, does not fold.
    """
    a, b, c, d = uv[:-1, :-1], uv[1:, :-1], uv[1:, 1:], uv[:-1, 1:]
    return np.stack([_cross(q - p, r - p) for p, q, r in ((a, b, d), (b, c, a), (c, d, b), (d, a, c))])


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
