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
    if len(triangulation) < 2:
        return np.zeros((0, 2), dtype=np.int64)
    return _crossing(triangulation, Tree.of(triangulation).touching(), depth)


def crossing_pairs_after(
    triangulation: Triangulation, depth: float, earlier: Triangulation, before: IntArray, trace: IntArray
) -> IntArray:
    """`crossing_pairs` of a triangulation most of which is known: only new triangles are looked at.

    Parameters
    ----------
    earlier, before : a triangulation and its crossing pairs (k, 2) at the same depth
    trace : (m,) the triangle of the earlier one that each triangle is, -1 for new ones, none twice; where its corners
        have moved since, it counts as new
    """
    from patchwright.repair.mender._crossing_kernel import same_boxes

    same = same_boxes(earlier.vertices, earlier.triangles, triangulation.vertices, triangulation.triangles, trace)
    fresh = np.flatnonzero(same < 0)
    if 2 * len(fresh) > len(triangulation):
        return crossing_pairs(triangulation, depth)
    now = np.full(max(int(same.max(initial=-1)), int(before.max(initial=-1))) + 1, -1, dtype=np.int64)
    now[same[same >= 0]] = np.flatnonzero(same >= 0)
    kept = np.sort(now[before], axis=1)
    pairs = kept[kept[:, 0] >= 0]
    if len(fresh):
        some = triangulation.take(fresh)
        meets = Tree.of(triangulation).touching(Tree.of(some))
        meets[:, 1] = fresh[meets[:, 1]]
        # a pair of two new ones comes both ways
        meets = np.sort(meets[(same[meets[:, 0]] >= 0) | (meets[:, 0] < meets[:, 1])], axis=1)
        pairs = np.concatenate([pairs, _crossing(triangulation, meets, depth)])
    return np.asarray(pairs[np.lexsort(pairs.T[::-1])])


def _crossing(triangulation: Triangulation, pairs: IntArray, depth: float) -> IntArray:
    """Those of some pairs (k, 2) of triangles that cross, in lexicographic order."""
    from patchwright.repair.mender._crossing_kernel import crossing

    pairs = np.ascontiguousarray(pairs, dtype=np.int64).reshape(-1, 2)
    found = pairs[crossing(pairs, triangulation.vertices, triangulation.triangles, depth)]
    return np.asarray(found[np.lexsort(found.T[::-1])])
