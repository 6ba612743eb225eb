"""Kernel of `mesh_topology`: segments joined to curves."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.models.arrays import BoolArray, IntArray


@njit(cache=True, nogil=True)
def trace(
    segments: IntArray, offsets: IntArray, uses: IntArray, ends: BoolArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Offsets, points and segments of the curves: those that begin at an end point first, then the loops.

    `uses[offsets[i]:offsets[i + 1]]` are the segments at point i in the order to be followed; no curve runs through a
    point marked in `ends`. A curve of k segments has k + 1 points, so its points start at offset + its number.
    """
    count = segments.shape[0]
    done = np.zeros(count, np.bool_)
    start = np.empty(count + 1, np.int64)
    points = np.empty(2 * count, np.int64)
    chain = np.empty(count, np.int64)
    curves, filled = 0, 0
    start[0] = 0
    for loops in range(2):
        for first in range(ends.shape[0]):
            if ends[first] == (loops == 1):
                continue
            for use in range(offsets[first], offsets[first + 1]):
                if done[uses[use]]:
                    continue
                segment, at = uses[use], first
                points[filled + curves] = at
                while segment >= 0:
                    done[segment] = True
                    chain[filled] = segment
                    at = segments[segment, 0] + segments[segment, 1] - at
                    filled += 1
                    points[filled + curves] = at
                    segment = -1
                    if not ends[at]:
                        for other in range(offsets[at], offsets[at + 1]):
                            if not done[uses[other]]:
                                segment = uses[other]
                                break
                curves += 1
                start[curves] = filled
    return start[: curves + 1].copy(), points[: filled + curves].copy(), chain[:filled].copy()
