"""Fair least squares in the cubic spline spaces: fits that bend no more from piece to piece than the data ask for.

The cost is the mean square distance from the samples, in each piece, plus `FAIRNESS` times the squares of the jumps of
the third derivative across the knots, as control points feel them. One polynomial has no jumps: a fit with more pieces
than its data need stays near the one with fewer, and facets and noise are not copied. On smooth data the jumps fall
with the fourth power of the piece, so the order of the error is kept.

Source: Eilers and Marx, Flexible smoothing with B-splines and penalties (1996), with differences of fourth order.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.patches.spline_space import collocation, uniform_collocation

FAIRNESS = 3e-4  # a jump that moves one control point by 1, its neighbours by 0, counts as 70 times this


@lru_cache(maxsize=64)
def jumps(cells: int) -> Array:
    """(cells - 1, cells + 3) jumps of the third derivative across the inner knots, times the cube of the piece.

    Away from the ends these are the fourth differences of the control points.
    """
    middles = (np.arange(cells) + 0.5) / cells
    return np.asarray(np.diff(collocation(cells, middles, 3), axis=0) / cells**3)


@lru_cache(maxsize=256)
def curve_normal(cells: int, count: int) -> Array:
    """(cells + 3, cells + 3) the normal matrix of a curve, from samples at `count` equidistant parameters."""
    basis, jump = uniform_collocation(cells, count), jumps(cells)
    return np.asarray((cells / count) * basis.T @ basis + FAIRNESS * jump.T @ jump)


@lru_cache(maxsize=256)
def curve_fit(cells: int, count: int, held: int) -> tuple[Array, Array]:
    """Maps to the free control points of a curve whose first and last `held` ones are given.

    Returns
    -------
    (free, count) from the samples at equidistant parameters, ends included, and (free, cells + 3) from the control
    points given (those of the free ones are not looked at).
    """
    basis, normal = uniform_collocation(cells, count), curve_normal(cells, count)
    free = slice(held, cells + 3 - held)
    inverse = np.linalg.inv(normal[free, free])
    given = -inverse @ normal[free]
    given[:, free] = 0.0
    return inverse @ basis[:, free].T * (cells / count), given


@lru_cache(maxsize=256)
def patch_normal(cells: tuple[int, int], counts: tuple[int, int]) -> Array:
    """The normal matrix of a patch, ((M + 3) (N + 3), square), from samples at counts[0] x counts[1] parameters."""
    (m, n), (a, b) = cells, counts
    along_u, along_v = uniform_collocation(m, a), uniform_collocation(n, b)
    gram_u, gram_v = (m / a) * along_u.T @ along_u, (n / b) * along_v.T @ along_v
    jump_u, jump_v = jumps(m), jumps(n)
    fair = np.kron(jump_u.T @ jump_u, np.eye(n + 3)) + np.kron(np.eye(m + 3), jump_v.T @ jump_v)
    return np.asarray(np.kron(gram_u, gram_v) + FAIRNESS * fair)


@lru_cache(maxsize=64)
def patch_inverse(cells: tuple[int, int], counts: tuple[int, int]) -> Array:
    """The inverse of the inner control points' part of `patch_normal`, ((M + 1) (N + 1), square)."""
    inner = inner_points(cells)
    return np.asarray(np.linalg.inv(patch_normal(cells, counts)[np.ix_(inner, inner)]))


def inner_points(cells: tuple[int, int]) -> IntArray:
    """((M + 1) (N + 1),) numbers of the control points off the boundary of a patch."""
    return np.arange((cells[0] + 3) * (cells[1] + 3)).reshape(cells[0] + 3, cells[1] + 3)[1:-1, 1:-1].reshape(-1)


def fit_patches(nets: Array, grid: Array) -> Array:
    """Copies of nets (k, M + 3, N + 3, 3) with their inner control points fitted to grids (k, a, b, 3)."""
    k, m, n = len(nets), nets.shape[1] - 3, nets.shape[2] - 3
    a, b = grid.shape[1:3]
    cells, counts = (m, n), (a, b)
    held = nets.copy()
    held[:, 1:-1, 1:-1] = 0.0
    right = np.einsum("ai,kabd,bj->kijd", uniform_collocation(m, a), grid, uniform_collocation(n, b), optimize=True)
    right = right[:, 1:-1, 1:-1].reshape(k, -1, 3) * (m * n / (a * b))
    inner = inner_points(cells)
    right = right - patch_normal(cells, counts)[inner] @ held.reshape(k, -1, 3)
    out = held
    out[:, 1:-1, 1:-1] = (patch_inverse(cells, counts) @ right).reshape(k, m + 1, n + 1, 3)
    return out
