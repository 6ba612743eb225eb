"""The local cure: small places where a body passes through itself are taken out and bridged anew."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import BoolArray
from patchwright.models.triangulation import Triangulation
from patchwright.repair.mender.clean import split_non_manifold
from patchwright.repair.mender.mend_gaps import bridge_gaps
from patchwright.repair.mender.mended import Work
from patchwright.repair.mender.orient import orient

CURES, CURE_SHARE = 4, 0.05  # rounds, each a ring wider; never more than this share of all triangles
PLACE = 60  # triangles of a small place


def cure(work: Work) -> None:
    """Take out triangles that cross others of their own body or crowd round one edge, and bridge what that opens.

    Small places only, each try a ring wider; a cure that opens what cannot be bridged is undone.
    """
    bad = _bad(work)
    for ring in range(CURES):
        if not bad.any():
            return
        small = _small_places(work.now, bad)
        wide = _grown(work.now, small, ring)
        if not small.any() or wide.mean() > CURE_SHARE:
            return
        before = work.mark()
        rims = _free_length(work)
        work.drop("crossing triangles", "they pass through others of their own body", np.flatnonzero(wide))
        opened = np.zeros(len(work.now.vertices), dtype=np.bool_)
        opened[work.now.triangles[wide]] = True
        left = np.flatnonzero(~wide)
        work.follow(work.now.take(left), left)
        work.now = split_non_manifold(work.now, work.adjacency())
        work.now = orient(work.now, work.adjacency()).triangulation
        bridge_gaps(work, opened)
        after = _bad(work)
        if after.sum() < bad.sum() and _free_length(work) <= rims * (1.0 + 1e-9):
            bad = after
        else:
            work.back(before)


def _free_length(work: Work) -> float:
    """Length of all free edges."""
    adjacency = work.adjacency()
    ends = work.now.vertices[adjacency.edges[adjacency.free]]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())


def _grown(triangulation: Triangulation, some: BoolArray, rings: int) -> BoolArray:
    """(m,) the triangles and those around them."""
    for _ in range(rings):
        near = np.zeros(len(triangulation.vertices), dtype=np.bool_)
        near[triangulation.triangles[some]] = True
        some = np.asarray(near[triangulation.triangles].any(axis=1))
    return some


def _small_places(triangulation: Triangulation, some: BoolArray) -> BoolArray:
    """(m,) those of the triangles that hang together in small groups."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    index = np.flatnonzero(some)
    if not len(index):
        return some
    used, local = np.unique(triangulation.triangles[index], return_inverse=True)
    local = local.reshape(-1, 3)
    graph = coo_array(
        (np.ones(2 * len(local)), (np.repeat(local[:, 0], 2), local[:, 1:].reshape(-1))), shape=(len(used), len(used))
    )
    label = connected_components(graph, directed=False)[1][local[:, 0]]
    small = np.zeros(len(some), dtype=np.bool_)
    small[index[np.bincount(label)[label] <= PLACE]] = True
    return small


def _bad(work: Work) -> BoolArray:
    """(m,) triangles at edges used too often or run the same way twice, or crossing others of their component."""
    adjacency = work.adjacency()
    wrong = (adjacency.use_count > 2) | adjacency.inconsistent
    bad = np.asarray(wrong[adjacency.triangle_edges].any(axis=1))
    pairs = work.crossings()
    if len(pairs):
        label = np.asarray(adjacency.components())
        pairs = pairs[label[pairs[:, 0]] == label[pairs[:, 1]]]
        bad[pairs] = True
    return bad
