"""A grid without folds to start from: straight lines between the sides, smoothed where they cross.

Hamann, Jean and Razdan (1999) join opposite points of a rectangular domain by straight lines. Between curved sides the
same is the Coons patch in the domain; where that folds, Winslow's equations spread it out (their inverse is harmonic,
so that the continuous solution never folds).
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.reparam.folds import corner_areas

SWEEPS = 40


def start_grid(south: Array, north: Array, west: Array, east: Array) -> Array:
    """(m + 1, n + 1, 2) with the given borders: south and north (m + 1, 2), west and east (n + 1, 2).

    Raises
    ------
    ParameterError : no grid without folds was found.
    """
    grid = _lines(south, north, west, east)
    if np.median(corner_areas(grid)) < 0.0:
        raise ParameterError("the four sides run clockwise in the parameters; exchange south and north")
    if (corner_areas(grid) > 0.0).all():
        return grid
    for _ in range(SWEEPS):
        grid = _winslow(grid)
        if (corner_areas(grid) > 0.0).all():
            return grid
    raise ParameterError("no grid without folds fits between the four sides; split the face into simpler pieces")


def _lines(south: Array, north: Array, west: Array, east: Array) -> Array:
    x, y = _shares(south, north), _shares(west, east)
    # straight lines between opposite points: their parameters cross-determine each other
    a, b = x[0][:, None], x[1][:, None]
    c, d = y[0][None], y[1][None]
    u = (a + c * (b - a)) / (1.0 - (b - a) * (d - c))
    v = c + u * (d - c)
    u, v = u[..., None], v[..., None]
    m, n = len(south), len(west)
    ruled = (1 - u) * west[None] + u * east[None] + (1 - v) * south[:, None] + v * north[:, None]
    corners = (1 - u) * (1 - v) * south[0] + u * (1 - v) * south[-1] + (1 - u) * v * north[0] + u * v * north[-1]
    grid = np.asarray(ruled - corners)
    grid[:, 0], grid[:, -1], grid[0], grid[-1] = south, north, west, east
    assert grid.shape == (m, n, 2)
    return grid


def _shares(one: Array, other: Array) -> tuple[Array, Array]:
    """Where the points of both sides lie along their chords, from 0 to 1."""
    out = []
    for line in (one, other):
        length = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))))
        out.append(length / length[-1] if length[-1] > 0.0 else np.linspace(0.0, 1.0, len(line)))
    return out[0], out[1]


def _winslow(grid: Array) -> Array:
    """One step of Winslow's equations, the coefficients frozen."""
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import splu

    du, dv = 0.5 * (grid[2:, 1:-1] - grid[:-2, 1:-1]), 0.5 * (grid[1:-1, 2:] - grid[1:-1, :-2])
    alpha, gamma = (dv * dv).sum(axis=-1), (du * du).sum(axis=-1)
    beta = (du * dv).sum(axis=-1)
    m, n = grid.shape[:2]
    number = np.arange(m * n).reshape(m, n)
    here = number[1:-1, 1:-1].ravel()
    stencil = [
        (0, 0, -2.0 * (alpha + gamma)),
        (1, 0, alpha), (-1, 0, alpha), (0, 1, gamma), (0, -1, gamma),
        (1, 1, -0.5 * beta), (-1, -1, -0.5 * beta), (1, -1, 0.5 * beta), (-1, 1, 0.5 * beta),
    ]  # fmt: skip
    border = np.ones((m, n), dtype=bool)
    border[1:-1, 1:-1] = False
    fixed = number[border]
    rows = np.concatenate([here] * len(stencil) + [fixed])
    columns = np.concatenate([number[1 + i : m - 1 + i, 1 + j : n - 1 + j].ravel() for i, j, _ in stencil] + [fixed])
    values = np.concatenate([value.ravel() for _, _, value in stencil] + [np.ones(len(fixed))])
    right = np.where(border[..., None], grid, 0.0).reshape(-1, 2)
    matrix = csr_array((values, (rows, columns)), shape=(m * n, m * n)).tocsc()
    return np.asarray(splu(matrix).solve(right).reshape(m, n, 2))
