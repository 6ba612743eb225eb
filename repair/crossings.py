"""Self-intersections: pairs of triangles that pass through each other."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import IntArray
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation

CROSSING = 1e-3  # of the round-off: edges that end nearer to the other triangle's plane touch it


def crossing_pairs(triangulation: Triangulation, depth: float) -> IntArray:
    """(k, 2) pairs of triangles where an edge of one passes through the inside of the other.

    Both ends of the edge lie farther than `depth` from the other triangle's plane: touching is not crossing.
    Overlaps within one plane are not found.
    """
    from patchwright.repair._crossing_kernel import crossing

    if len(triangulation) < 2:
        return np.zeros((0, 2), dtype=np.int64)
    pairs = np.ascontiguousarray(Tree.of(triangulation).touching(), dtype=np.int64).reshape(-1, 2)
    found = pairs[crossing(pairs, triangulation.vertices, triangulation.triangles, depth)]
    return np.asarray(found[np.lexsort(found.T[::-1])])
