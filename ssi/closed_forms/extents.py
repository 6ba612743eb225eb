"""Boxes of bounded analytic surfaces, and of the part of space where two of them can meet."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.ssi.closed_forms.carriers import Setting
from patchwright.ssi.closed_forms.inversion import Analytic

EPS = float(np.finfo(np.float64).eps)


def box(surface: Analytic) -> Array:
    """(2, 3) lower and upper corner of the hull of the exact NURBS form's control points."""
    points = surface.to_nurbs().control_points
    return np.stack((points.min(axis=(0, 1)), points.max(axis=(0, 1))))


def setting(a: Analytic, b: Analytic, tolerance: float) -> Setting | None:
    """Where the pair is judged, None when the boxes are farther apart than the tolerance.

    Tolerances below the round-off of the coordinates are raised to it.
    """
    one, other = box(a), box(b)
    tol = max(tolerance, 64.0 * EPS * float(max(np.abs(one).max(), np.abs(other).max())))
    low, high = np.maximum(one[0], other[0]), np.minimum(one[1], other[1])
    if (low - high > tol).any():
        return None
    shared = float(np.linalg.norm(np.maximum(high - low, 0.0)))
    smaller = min(float(np.linalg.norm(b[1] - b[0])) for b in (one, other))
    return Setting(0.5 * (low + high), max(shared, smaller), tol)
