"""Exact merging: points whose coordinates are equal become one vertex. There is no tolerance here; welding is repair.

Negative zero equals zero. Keys are the bits of the coordinates, so the result does not depend on rounding or order of
the search; vertices come in order of first appearance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import IntArray
from patchwright.models.triangulation import Triangulation


def merge_points(points: npt.NDArray[np.float32] | npt.NDArray[np.float64]) -> tuple[IntArray, IntArray]:
    """Which of (n, 3) float32 or float64 `points` are the same.

    Returns
    -------
    first : (k,) the row in which each different point first appears
    index : (n,) the number of each row's point, so that `points[first][index]` equals `points`
    """
    from patchwright.models.io._merge_kernel import first_equal

    # adding zero turns -0.0 into 0.0
    words = np.ascontiguousarray(points + points.dtype.type(0)).view(
        np.uint32 if points.dtype == np.float32 else np.uint64
    )
    first = np.empty(len(words), dtype=np.int64)
    index = np.empty(len(words), dtype=np.int64)
    count = first_equal(words, first, index)
    return first[:count].copy(), index


def merged(triangulation: Triangulation) -> Triangulation:
    """The same triangles with equal vertices stored once and unused ones left out; the vertices' order is kept."""
    first, index = merge_points(triangulation.vertices)
    return replace(
        triangulation, vertices=triangulation.vertices[first], triangles=index[triangulation.triangles]
    ).compact()
