"""Equidistant points along many polylines at once."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, IntArray


def resample(points: Array, offsets: IntArray, count: int) -> Array:
    """Equidistant (by arc length) points on each of many polylines.

    Parameters
    ----------
    points, offsets : (k, 3) vertices of all polylines in order and (e + 1,) where each starts
    count : points per polyline, both ends included

    Returns
    -------
    (e, count, 3); the ends are the polylines' own, bit for bit.
    """
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    step[offsets[1:-1] - 1] = 0.0  # the jump from one polyline to the next has no length
    along = np.concatenate([[0.0], np.cumsum(step)])
    start, stop = along[offsets[:-1]], along[offsets[1:] - 1]
    wanted = start[:, None] + (stop - start)[:, None] * np.linspace(0.0, 1.0, count)
    segment = np.searchsorted(along, wanted, side="right") - 1
    segment = np.clip(segment, offsets[:-1, None], np.maximum(offsets[1:, None] - 2, offsets[:-1, None]))
    length = along[segment + 1] - along[segment]
    share = np.divide(wanted - along[segment], length, out=np.zeros_like(wanted), where=length > 0)
    share = np.clip(share, 0.0, 1.0)[..., None]
    out = (1.0 - share) * points[segment] + share * points[segment + 1]
    out[:, 0], out[:, -1] = points[offsets[:-1]], points[offsets[1:] - 1]
    return np.asarray(out)
