"""Kernels of conforming: which free edge each rim vertex lies on.

Edges lie in a grid, each in all cells its box reaches; a vertex looks at those of its own cell. The cells are as small
as a few per edge allow: where long edges would lie in too many, they are made larger.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import filling, inner
from patchwright.models.arrays import Array, IntArray
from patchwright.repair.mender._group_kernel import grouped

MOST_CELLS = 8  # per edge, on average
ROUNDING = 1e-9  # of the distance and of the coordinates: boxes are so much wider


def nearest_edges(
    rim: IntArray, points: Array, start: IntArray, end: IntArray, apex: IntArray, distance: float, share: float
) -> tuple[IntArray, Array, Array]:
    """For each vertex of `rim` the nearest free edge it lies on: edge (-1 none), parameter, distance.

    It lies on an edge when it is within `distance` and within `share` of the triangle's height over it, and its foot
    is nearer to neither end than that. Of equally near edges the one that begins at the lowest x counts.
    """
    edge, at, gap = np.full(len(rim), -1, dtype=np.int64), np.zeros(len(rim)), np.full(len(rim), np.inf)
    a, b = points[start], points[end]
    reach = distance + ROUNDING * (distance + float(np.abs(points[rim]).max(initial=0.0)))
    low, high = np.minimum(a, b) - reach, np.maximum(a, b) + reach
    corner = points[rim].min(axis=0) - reach
    size = 2.0 * max(reach, float(np.finfo(np.float64).tiny))
    while True:
        first, last = np.floor((low - corner) / size), np.floor((high - corner) / size)
        counts = np.prod(last - first + 1.0, axis=1)
        if counts.sum() <= MOST_CELLS * len(start):
            break
        size *= 2.0
    slots = 16
    while slots < 2 * len(start):
        slots *= 2
    # edges by rank, so that each cell has them in the order in which equals are told apart
    order = np.argsort(np.minimum(a[:, 0], b[:, 0]), kind="stable")
    cells = first[order].astype(np.int64), last[order].astype(np.int64)
    cell_of = np.empty(int(counts.sum()), dtype=np.int64)
    edge_of = np.empty(len(cell_of), dtype=np.int64)
    _enter(*cells, slots, cell_of, edge_of)
    offsets, within = grouped(cell_of, slots)
    candidates = order[edge_of[within]]
    own = np.floor((points[rim] - corner) / size).astype(np.int64)
    _nearest_edges(rim, points, start, end, apex, own, offsets, candidates, distance, share, edge, at, gap)
    return edge, at, gap


@inner
def _slot(i: int, j: int, k: int, slots: int) -> int:
    h = i * 73856093
    h ^= j * 19349663
    h ^= k * 83492791
    h *= -49064778989728563
    h ^= h >> 29
    return h & (slots - 1)


@filling
def _enter(first: IntArray, last: IntArray, slots: int, cell_of: IntArray, edge_of: IntArray) -> None:
    at = 0
    for e in range(len(first)):
        for i in range(first[e, 0], last[e, 0] + 1):
            for j in range(first[e, 1], last[e, 1] + 1):
                for k in range(first[e, 2], last[e, 2] + 1):
                    cell_of[at] = _slot(i, j, k, slots)
                    edge_of[at] = e
                    at += 1


@filling
def _nearest_edges(
    rim: IntArray,
    points: Array,
    start: IntArray,
    end: IntArray,
    apex: IntArray,
    own: IntArray,
    offsets: IntArray,
    candidates: IntArray,
    distance: float,
    share: float,
    edge: IntArray,
    at: Array,
    gap: Array,
) -> None:
    slots = len(offsets) - 1
    for i in range(len(rim)):
        v = rim[i]
        s = _slot(own[i, 0], own[i, 1], own[i, 2], slots)
        for place in range(offsets[s], offsets[s + 1]):
            e = candidates[place]
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
