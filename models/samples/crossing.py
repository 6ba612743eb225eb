"""An injector of crossing surfaces: a second closed body through the first."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import IntArray
from patchwright.models.errors import GeometryError
from patchwright.models.samples.defects import Damaged, Injected
from patchwright.models.samples.truth import united
from patchwright.models.triangulation import Triangulation, concatenate


def crossing(triangulation: Triangulation, other: Triangulation, *, seed: int = 0) -> Damaged:
    """Add a closed body that crosses a closed one; a "self-intersection" per connected intersection curve.

    The points of a label are the curve's, taken from the union of both; its size is the curve's length (`seed` is not
    used).

    Raises
    ------
    GeometryError : a body is not closed, or the two do not cross.
    """
    outer, body, _ = united((triangulation, other))
    pairs = np.stack([outer.triangles, np.roll(outer.triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    edges, which = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
    low, high = np.full(len(edges), 2), np.full(len(edges), -1)
    np.minimum.at(low, which.reshape(-1), np.repeat(body, 3))
    np.maximum.at(high, which.reshape(-1), np.repeat(body, 3))
    shared = edges[low < high]
    if not len(shared):
        raise GeometryError("the two bodies do not cross")
    ends = outer.vertices[shared]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    label = _connected(shared, len(outer.vertices))
    labels = [
        Injected.of("self-intersection", ends[label == k].reshape(-1, 3), size=length[label == k].sum())
        for k in np.unique(label)
    ]
    m = len(triangulation)
    origin = np.concatenate([np.arange(m), np.full(len(other), -1)])
    return Damaged(concatenate([triangulation, other]), tuple(labels), origin)


def _connected(edges: IntArray, vertices: int) -> IntArray:
    """(k,) which connected curve each edge is of."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(vertices, vertices))
    _, label = connected_components(graph, directed=False)
    return np.asarray(label[edges[:, 0]], dtype=np.int64)
