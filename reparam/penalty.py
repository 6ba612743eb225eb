"""The penalty E of points on a surface: how far their chords are from the shares the parameters ask for.

E is the sum, over all inner points and both directions, of (chord share - step share) squared, where the chord share
is l- / (l- + l+) of the chords to both neighbours and the step share that of the parameter steps. It makes the
condition of Hamann, Jean and Razdan (1999), section 2, a number; the paper leaves its penalty undefined.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.reparam.defect import NO_LENGTH


@dataclass(frozen=True, slots=True, eq=False)
class Residuals:
    """chord share - step share at the inner points of one direction, with its derivatives.

    `r` is (m - 1, k) for points (m + 1, k, 3); `slopes` (3, m - 1, k, 3) the derivatives by the point before, the point
    itself and the point after.
    """

    r: Array
    slopes: Array


def step_shares(t: Array) -> Array:
    """(m - 1,) share of the step before every inner parameter t (m + 1,) in the two steps at it."""
    return np.asarray((t[1:-1] - t[:-2]) / (t[2:] - t[:-2]))


def residuals(points: Array, share: Array, size: float) -> Residuals:
    """Along the first axis of points (m + 1, k, 3); chords below round-off of `size` are poles and have none."""
    chord = np.diff(points, axis=0)
    length = np.linalg.norm(chord, axis=2)
    unit = chord / np.maximum(length, 1e-300)[..., None]
    before, after = length[:-1], length[1:]
    both = before + after
    live = both > NO_LENGTH * size
    scale = np.where(live, 1.0 / np.where(live, both, 1.0) ** 2, 0.0)[..., None]
    r = np.where(live, before / np.where(live, both, 1.0) - share[:, None], 0.0)
    from_before = -(after[..., None] * unit[:-1]) * scale
    to_after = -(before[..., None] * unit[1:]) * scale
    return Residuals(r, np.stack((from_before, -(from_before + to_after), to_after)))


def penalty(points: Array, s: Array, t: Array, counted: tuple[BoolArray, BoolArray] | None = None) -> float:
    """E of points (m + 1, n + 1, 3) with parameters s (m + 1,) and t (n + 1,).

    `counted` (m - 1, n - 1) marks, for each direction, the inner points whose residual counts; None: all do.
    """
    size = size_of(points)
    along_s = residuals(points[:, 1:-1], step_shares(s), size).r
    along_t = residuals(points[1:-1].swapaxes(0, 1), step_shares(t), size).r.T
    if counted is not None:
        along_s, along_t = along_s * counted[0], along_t * counted[1]
    return float((along_s**2).sum() + (along_t**2).sum())


def size_of(points: Array) -> float:
    """The diagonal of the box round points (..., 3); 1 for a single spot."""
    flat = points.reshape(-1, points.shape[-1])
    return float(np.linalg.norm(np.ptp(flat, axis=0))) or 1.0
