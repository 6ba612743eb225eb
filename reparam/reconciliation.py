"""Opposite sides get the same interpolation points: those of each, as shares of its length, are put into the other.

Hamann, Jean and Razdan (1999), section 2: for every point of one side one at the same share is sought on the other,
and put in where there is none within a tolerance.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array

NEAR = 0.25  # of the gap it falls into: a share this near to one of its ends is the same point


def reconciled(*sides: Array, near: float = NEAR) -> Array:
    """(k,) increasing shares good for all sides, each (n_i,) increasing with the same two ends.

    The side with the most points keeps all of them; a point of another is put in unless one is as near as the share
    `near` of the gap it falls into.
    """
    first, *others = sorted(sides, key=len, reverse=True)
    out = first
    for other in others:
        k = np.clip(np.searchsorted(out, other, side="right") - 1, 0, len(out) - 2)
        gap = out[k + 1] - out[k]
        missing = np.minimum(other - out[k], out[k + 1] - other) > near * gap
        out = np.sort(np.concatenate((out, other[missing])))
    return out
