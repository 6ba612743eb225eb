"""The cubic spline spaces patches and edges live in: C2, uniform knots i/cells on [0, 1], quadruple ends.

Cell counts are powers of two times a common base, so the spaces are nested: a coarse edge is carried exactly into the
space of a finer neighbour, which is what makes the joins exact.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from patchwright.models.arrays import Array

DEGREE = 3


@lru_cache(maxsize=256)
def knots(cells: int) -> Array:
    """(cells + 7,) the clamped uniform knot vector."""
    inner = np.arange(1, cells) / cells
    vector = np.concatenate([np.zeros(4), inner, np.ones(4)])
    vector.flags.writeable = False
    return vector


def greville(cells: int) -> Array:
    """(cells + 3,) the Greville abscissae: where each control point acts most."""
    t = knots(cells)
    return (t[1:-3] + t[2:-2] + t[3:-1]) / 3.0


def collocation(cells: int, parameters: Array, derivative: int = 0) -> Array:
    """(len(parameters), cells + 3) values of every basis function's derivative at the parameters."""
    from scipy.interpolate import BSpline

    identity = np.eye(cells + DEGREE)
    spline = BSpline(knots(cells), identity, DEGREE)
    return np.asarray(spline(np.asarray(parameters, dtype=np.float64), nu=derivative))


@lru_cache(maxsize=256)
def uniform_collocation(cells: int, count: int, derivative: int = 0) -> Array:
    """`collocation` at `count` equidistant parameters including both ends."""
    matrix = collocation(cells, np.linspace(0.0, 1.0, count), derivative)
    matrix.flags.writeable = False
    return matrix


@lru_cache(maxsize=256)
def refinement(coarse: int, fine: int) -> Array:
    """(fine + 3, coarse + 3) knot insertion as one matrix: the same curve in the finer space."""
    if fine % coarse:
        raise ValueError(f"{fine} cells do not refine {coarse}")
    if fine == coarse:
        return np.eye(coarse + DEGREE)
    sites = greville(fine)
    matrix = np.asarray(np.linalg.solve(collocation(fine, sites), collocation(coarse, sites)), dtype=np.float64)
    matrix[np.abs(matrix) < 1e-15] = 0.0
    matrix[0], matrix[-1] = 0.0, 0.0
    matrix[0, 0] = matrix[-1, -1] = 1.0
    return matrix
