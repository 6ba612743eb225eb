"""Where triangles cross, as curves: the exact intersection of the crossing triangles, traced by `ssi`."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.triangulation import Triangulation

MOST_POINTS = 2000  # of one curve that are told; longer ones are thinned out


def crossing_curves(body: Triangulation, pairs: IntArray, label: IntArray) -> list[tuple[Array, ...]]:
    """The intersection curves of crossing triangles, region by region.

    Parameters
    ----------
    body : the triangles
    pairs : (k, 2) those that cross
    label : (k,) region 0..r-1 of each pair

    Returns
    -------
    For each region its polylines, each (n, 3); coplanar overlaps are bounded by theirs.
    """
    from patchwright.ssi.mesh_mesh import mesh_intersection

    regions: list[list[Array]] = [[] for _ in range(int(label.max(initial=-1)) + 1)]
    index, local = np.unique(pairs, return_inverse=True)
    found = mesh_intersection(body.take(index).compact())
    count = len(index)
    key = np.sort(local.reshape(-1, 2), axis=1) @ [count, 1]
    order = np.argsort(key)
    own = np.sort(found.triangles, axis=1) @ [count, 1] if len(found.segments) else np.zeros(0, dtype=np.int64)
    at = np.minimum(np.searchsorted(key[order], own), len(key) - 1)
    region = np.where(key[order][at] == own, label[order][at], -1)
    traced = found.traced
    for i in range(len(traced)):
        of = region[traced.chain[traced.offsets[i] : traced.offsets[i + 1]]]
        if (of >= 0).any():  # some segments are of pairs that only touch
            points = found.points[traced.curve(i)]
            step = -(-len(points) // MOST_POINTS)
            regions[int(of[of >= 0][0])].append(np.concatenate([points[:-1:step], points[-1:]]))
    return [tuple(some) for some in regions]


def total_length(curves: tuple[Array, ...]) -> float:
    """Of all curves together."""
    return float(sum(np.linalg.norm(np.diff(points, axis=0), axis=1).sum() for points in curves))
