"""Where the inner points go: all at once, by sparse Gauss-Newton steps on the penalty E (see `penalty`).

There are as many residuals as unknowns, two for every inner point, so that E falls to zero wherever a chord-length
net exists. Levenberg's damping comes in where a full step would raise E, and every step is cut so that no point
leaves the domain and no cell of the grid turns over. The queue of the paper minimises the same E point by point, see
`placement_queue`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.surface import Surface
from patchwright.reparam.folds import corner_areas
from patchwright.reparam.penalty import residuals, size_of, step_shares

MOST_STEPS = 60
LEAST_AREA = 0.1  # of its own before a step: a corner of a cell does not shrink more than to this at once
STILL = 1e-13  # of the domain: steps below it end the search
HALVINGS = 3  # of an undamped step that would raise E
GAIN = 1e-10  # of E: less is no gain


class Status(Enum):
    """How the search for the points ended."""

    CONVERGED = "no point moves any more"
    STALLED = "no step lowers the penalty without a fold"
    LIMIT = f"still moving after {MOST_STEPS} steps"


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Points in the domain and what their penalty came to."""

    uv: Array
    """(m + 1, n + 1, 2)"""
    penalty: float
    steps: int
    """Newton steps, or moves of single points."""
    status: Status


def place(surface: Surface, uv: Array, s: Array, t: Array, *, held: BoolArray | None = None) -> Placement:
    """Move the inner points of a grid until their chords have the shares of the parameter steps.

    Parameters
    ----------
    uv : (m + 1, n + 1, 2) parameters to start from, without folds; those on the border stay
    s, t : (m + 1,) and (n + 1,) increasing, the new parameters of the grid's rows and columns
    held : (m + 1, n + 1, 2) coordinates that stay besides: their residual is not counted
    """
    grid = _Grid.of(surface, s, t, uv.shape, held)
    at, limits = uv.copy(), np.array(surface.domain)
    width = limits[:, 1] - limits[:, 0]
    r, jacobian = grid.linearised(at)
    energy, damping, status, steps = float(r @ r), 0.0, Status.LIMIT, 0
    while steps < MOST_STEPS:
        move = grid.spread(_step(jacobian, r, damping))
        largest = float((np.abs(move) / width).max(initial=0.0))
        if largest <= STILL or not grid.unknowns:
            status = Status.CONVERGED
            break
        steps += 1
        new, share = _without_folds(at, move, limits)
        new_r, new_jacobian = grid.linearised(new)
        for _ in range(HALVINGS if damping == 0.0 else 0):
            if float(new_r @ new_r) < energy:
                break
            share *= 0.5
            new = np.clip(at + share * move, limits[:, 0], limits[:, 1])
            new_r, new_jacobian = grid.linearised(new)
        new_energy = float(new_r @ new_r)
        if share > 0.0 and new_energy < energy:
            settled = energy - new_energy <= GAIN * energy and largest <= 1e-8
            at, r, jacobian, energy = new, new_r, new_jacobian, new_energy
            damping = 0.1 * damping if damping > 1e-6 else 0.0
            if settled:
                status = Status.CONVERGED
                break
        elif largest <= 1e-9:  # round-off decides now
            status = Status.CONVERGED
            break
        elif damping >= 1e6:
            status = Status.STALLED
            break
        else:
            damping = max(10.0 * damping, 1e-4)
    return Placement(at, energy, steps, status)


def _step(jacobian: Any, r: Array, damping: float) -> Array:
    """The Gauss-Newton step: undamped it is Newton's, for the Jacobian is square."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import splu

    if damping == 0.0:
        try:
            step = np.asarray(-splu(jacobian.tocsc()).solve(r))
        except RuntimeError:  # singular
            return _step(jacobian, r, 1e-8)
        return step if np.isfinite(step).all() else _step(jacobian, r, 1e-8)
    normal = (jacobian.T @ jacobian).tocsc()
    diagonal = normal.diagonal()
    floor = 1e-12 * float(diagonal.max(initial=0.0)) or 1.0
    # the normal equations only steer the step; what it is judged by is E itself
    return np.asarray(-splu((normal + diags_array(damping * diagonal + floor)).tocsc()).solve(jacobian.T @ r))


def _without_folds(at: Array, move: Array, limits: Array) -> tuple[Array, float]:
    """The furthest of the halved steps that keeps every cell upright, and its share; 0 where none does."""
    before = corner_areas(at)
    share = 1.0
    for _ in range(30):
        new = np.clip(at + share * move, limits[:, 0], limits[:, 1])
        if (corner_areas(new) > LEAST_AREA * np.minimum(before, before.mean())).all():
            return new, share
        share *= 0.5
    return at, 0.0


@dataclass(frozen=True, slots=True, eq=False)
class _Grid:
    """Which coordinates are unknown and which residuals count, and where they stand in the sparse Jacobian."""

    surface: Surface
    shares: tuple[Array, Array]
    shape: tuple[int, int]
    number: IntArray
    """(m + 1, n + 1, 2) number of each unknown, -1 where the coordinate stays."""
    unknowns: int
    counted: tuple[BoolArray, BoolArray]
    """(m - 1, n - 1) each."""

    @classmethod
    def of(cls, surface: Surface, s: Array, t: Array, shape: tuple[int, ...], held: BoolArray | None) -> _Grid:
        free = np.zeros(shape, dtype=bool)
        free[1:-1, 1:-1] = True
        if held is not None:
            free &= ~held
        number = np.full(shape, -1, dtype=np.int64)
        number[free] = np.arange(int(free.sum()))
        inner = free[1:-1, 1:-1]
        counted = (inner[..., 0], inner[..., 1])
        return cls(surface, (step_shares(s), step_shares(t)), (shape[0], shape[1]), number, int(free.sum()), counted)

    def linearised(self, uv: Array) -> tuple[Array, Any]:
        """The residuals that count, and their sparse Jacobian by the unknowns."""
        from scipy.sparse import csr_array

        u, v = uv[..., 0], uv[..., 1]
        points = self.surface(u, v)
        tangents = np.stack((self.surface(u, v, (1, 0)), self.surface(u, v, (0, 1))), axis=2)  # (m + 1, n + 1, 2, 3)
        size, (m, n) = size_of(points), self.shape
        i, j = np.meshgrid(np.arange(1, m - 1), np.arange(1, n - 1), indexing="ij")
        values, rows, columns, all_r, count = [], [], [], [], 0
        for axis in (0, 1):
            if axis == 0:
                along = residuals(points[:, 1:-1], self.shares[0], size)
                r, slopes = along.r, along.slopes
            else:
                along = residuals(points[1:-1].swapaxes(0, 1), self.shares[1], size)
                r, slopes = along.r.T, along.slopes.swapaxes(1, 2)
            use = self.counted[axis]
            row = count + np.cumsum(use.ravel()).reshape(use.shape) - 1
            count += int(use.sum())
            all_r.append(r[use])
            for k, shift in enumerate((-1, 0, 1)):
                a, b = (i + shift, j) if axis == 0 else (i, j + shift)
                column = self.number[a, b]  # (m - 1, n - 1, 2)
                value = np.einsum("ijc,ijkc->ijk", slopes[k], tangents[a, b])
                live = use[..., None] & (column >= 0)
                values.append(value[live])
                columns.append(column[live])
                rows.append(np.broadcast_to(row[..., None], column.shape)[live])
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return np.concatenate(all_r), csr_array(entries, shape=(count, self.unknowns))

    def spread(self, step: Array) -> Array:
        """(m + 1, n + 1, 2) the move of every coordinate."""
        return np.where(self.number >= 0, np.append(step, 0.0)[self.number], 0.0)
