"""Kernel of conforming: which free edge each rim vertex lies on."""

from __future__ import annotations

import numpy as np
from numba import njit
from patchwright.models.arrays import Array, IntArray


@njit(cache=True)
def nearest_edges(
    rim: IntArray,
    points: Array,
    start: IntArray,
    end: IntArray,
    apex: IntArray,
    order: IntArray,
    low: Array,
    high: Array,
    distance: float,
    share: float,
) -> tuple[IntArray, Array, Array]:
    """For each vertex of `rim` the nearest free edge it lies on: edge (-1 none), parameter, distance.

    It lies on an edge when it is within `distance` and within `share` of the triangle's height over it, and its foot
    is nearer to neither end than that. `order` sorts the edges by their lowest x, `low` are those x in that
    order, `high` the running maximum of the highest x.
    """
    edge = np.full(len(rim), -1, dtype=np.int64)
    at = np.zeros(len(rim))
    gap = np.full(len(rim), np.inf)
    for i in range(len(rim)):
        v = rim[i]
        p = points[v]
        first = np.searchsorted(high, p[0] - distance)
        for place in range(first, len(order)):
            if low[place] > p[0] + distance:
                break
            e = order[place]
            a, b, c = start[e], end[e], apex[e]
            if v in (a, b, c):
                continue
            ab = 0.0
            ap = 0.0
            pp = 0.0
            ac = 0.0
            cc = 0.0
            for k in range(3):
                t = points[b, k] - points[a, k]
                u = p[k] - points[a, k]
                w = points[c, k] - points[a, k]
                ab += t * t
                ap += t * u
                pp += u * u
                ac += t * w
                cc += w * w
            if ab == 0.0:
                continue
            t = ap / ab
            if t <= 0.0 or t >= 1.0:
                continue
            d = np.sqrt(max(0.0, pp - ap * ap / ab))
            height = np.sqrt(max(0.0, cc - ac * ac / ab))
            if d > distance or d > share * height or d >= gap[i]:
                continue
            length = np.sqrt(ab)
            if min(t, 1.0 - t) * length <= d or min(t, 1.0 - t) < 1e-9:
                continue
            gap[i] = d
            edge[i] = e
            at[i] = t
    return edge, at, gap
