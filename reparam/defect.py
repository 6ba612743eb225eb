"""How far a parametrisation is from chord length: the defect measure, reported before and after.

Hamann, Jean and Razdan (1999), section 2, call a surface chord-length parametrised when the chords between neighbouring
points are to each other as the steps of the parameter. They measure at the knots; a single span has none inside, so the
points here are those of equal steps.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.surface import Surface

STEPS = 33  # equal parameter steps per direction
NO_LENGTH = 1e-9  # of the longest line: shorter ones are poles


def parametrisation_defect(surface: Surface, box: npt.ArrayLike | None = None) -> float:
    """max |chord share / step share - 1| over the rows and columns of a grid of 33 equal parameter steps.

    Parameters
    ----------
    box : ((u0, u1), (v0, v1)); default the surface's domain, which must then be finite

    0 is a chord-length parametrisation; lines of zero length (poles) are left out.
    """
    return unevenness(surface(*steps(surface.domain if box is None else box)))


def steps(box: npt.ArrayLike) -> tuple[Array, Array]:
    """u (34, 1) and v (1, 34) of 33 equal steps over ((u0, u1), (v0, v1))."""
    low, high = np.asarray(box, dtype=np.float64).T
    u, v = np.linspace(low, high, STEPS + 1).T
    return u[:, None], v[None]


def unevenness(points: Array) -> float:
    """The same of points (n + 1, k + 1, 3) that belong to equal parameter steps in both directions."""
    return max(_of_lines(points), _of_lines(np.swapaxes(points, 0, 1)))


def _of_lines(points: Array) -> float:
    """Of the lines along the first axis of (n, k, 3)."""
    chords = np.linalg.norm(np.diff(points, axis=0), axis=2)
    total = chords.sum(axis=0)
    lines = total > NO_LENGTH * max(float(total.max(initial=0.0)), np.finfo(float).tiny)
    if not lines.any():
        return 0.0
    return float(np.abs(chords[:, lines] / total[lines] * len(chords) - 1.0).max())
