"""Kernel of conforming: which free edge each rim vertex lies on."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import filling
from patchwright.models.arrays import Array, IntArray


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
    edge, at, gap = np.full(len(rim), -1, dtype=np.int64), np.zeros(len(rim)), np.full(len(rim), np.inf)
    first = np.searchsorted(high, points[rim, 0] - distance)
    _nearest_edges(rim, points, start, end, apex, order, low, first, distance, share, edge, at, gap)
    return edge, at, gap


@filling
def _nearest_edges(
    rim: IntArray,
    points: Array,
    start: IntArray,
    end: IntArray,
    apex: IntArray,
    order: IntArray,
    low: Array,
    first: IntArray,
    distance: float,
    share: float,
    edge: IntArray,
    at: Array,
    gap: Array,
) -> None:
    for i in range(len(rim)):
        v = rim[i]
        reach = points[v, 0] + distance
        for place in range(first[i], len(order)):
            if low[place] > reach:
                break
            e = order[place]
            a = start[e]
            b = end[e]
            c = apex[e]
            if v == a or v == b or v == c:  # noqa: SIM109  (a tuple costs compile time)
                continue
            ab = 0.0
            ap = 0.0
            pp = 0.0
            ac = 0.0
            cc = 0.0
            for k in range(3):
                t = points[b, k] - points[a, k]
                u = points[v, k] - points[a, k]
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
            square = pp - ap * ap / ab
            d = np.sqrt(square) if square > 0.0 else 0.0
            square = cc - ac * ac / ab
            height = np.sqrt(square) if square > 0.0 else 0.0
            if d > distance or d > share * height or d >= gap[i]:
                continue
            rest = t if t < 1.0 - t else 1.0 - t
            if rest * np.sqrt(ab) <= d or rest < 1e-9:
                continue
            gap[i] = d
            edge[i] = e
            at[i] = t
