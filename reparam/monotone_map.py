"""Increasing functions of one variable as tables of cubics: what turns arc shares into parameters and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class MonotoneMap:
    """A continuous, increasing, piecewise cubic function through (x, y), with a slope on either side of each x.

    Slopes above three times the steepness of their interval are cut to that, which keeps it monotone (Fritsch and
    Carlson 1980).
    """

    x: Array
    """(k + 1,) increasing."""
    y: Array
    """(k + 1,) increasing."""
    coefficients: Array
    """(4, k) powers of x - x_k, the highest first."""

    @classmethod
    def hermite(cls, x: Array, y: Array, slopes: tuple[Array, Array]) -> MonotoneMap:
        """Through (x, y) with `slopes` (k,) at the start and at the end of every interval."""
        h, rise = np.diff(x), np.diff(y)
        m = rise / h
        a, b = (np.clip(np.nan_to_num(s, nan=0.0, posinf=np.inf), 0.0, 3.0 * m) for s in slopes)
        return cls(x, y, np.stack(((a + b - 2.0 * m) / h**2, (3.0 * m - 2.0 * a - b) / h, a, y[:-1])))

    def __call__(self, t: npt.ArrayLike, nu: int = 0) -> Array:
        """The value, or the first derivative, at arguments of any shape, clipped to the range of x."""
        at = np.clip(np.asarray(t, dtype=np.float64), self.x[0], self.x[-1])
        k = np.clip(np.searchsorted(self.x, at, side="right") - 1, 0, len(self.x) - 2)
        d, (c3, c2, c1, c0) = at - self.x[k], self.coefficients[:, k]
        if nu == 1:
            return np.asarray((3.0 * c3 * d + 2.0 * c2) * d + c1)
        return np.asarray(np.clip(((c3 * d + c2) * d + c1) * d + c0, self.y[k], self.y[k + 1]))
