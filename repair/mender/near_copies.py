"""Triangles that came twice with scattered corners: the later one takes the corners of the first.

A soup whose every triangle has corners of its own holds its doubled triangles as near copies. Edge by edge they would
be matched with the neighbours they cover, and what is left over would tear; with equal corners they are plain doubles.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import IntArray
from patchwright.models.triangulation import Triangulation
from patchwright.repair.mender.weld import free_edges

ROOM = 4.0  # times the distance: what is lower is as near to its neighbours as to its copies
TURNS = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]])


def near_copies(triangulation: Triangulation, distance: float) -> tuple[Triangulation, IntArray]:
    """The triangulation with near copies over the corners of their first, and which triangles were changed.

    Parameters
    ----------
    distance : corners of copies are no farther apart; triangles lower than `ROOM` times this are left alone

    A surface without free edges holds none, and is returned as it is.

    Cost: n log n.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    from patchwright.repair.mender._clean_kernel import triangle_heights

    none = np.zeros(0, dtype=np.int64)
    if not len(free_edges(triangulation.triangles, None).start):
        return triangulation, none
    corners = triangulation.corners
    able = np.flatnonzero(triangle_heights(triangulation.vertices, triangulation.triangles) > ROOM * distance)
    if not len(able) or distance <= 0.0:
        return triangulation, none
    pairs = cKDTree(corners[able].mean(axis=1)).query_pairs(distance, output_type="ndarray")
    pairs = able[pairs]
    apart = np.linalg.norm(corners[pairs[:, 0], None] - corners[pairs[:, 1]][:, TURNS], axis=3).max(axis=2)
    pairs = pairs[apart.min(axis=1, initial=np.inf) <= distance]
    if not len(pairs):
        return triangulation, none
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(triangulation),) * 2)
    _, label = connected_components(graph, directed=False)
    _, lead = np.unique(label, return_index=True)
    lead = lead[label]
    copies = np.flatnonzero(lead != np.arange(len(lead)))
    turn = np.linalg.norm(corners[copies, None] - corners[lead[copies]][:, TURNS], axis=3).max(axis=2).argmin(axis=1)
    triangles = triangulation.triangles.copy()
    triangles[copies] = np.take_along_axis(triangles[lead[copies]], TURNS[turn], axis=1)
    return replace(triangulation, triangles=triangles), copies
