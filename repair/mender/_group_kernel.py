"""Kernels of grouping: numbers from a known range sorted by counting, in time linear in their count and the range."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import filling
from patchwright.models.arrays import BoolArray, IntArray


def grouped(labels: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Offsets (count + 1,) and order (n,): `order[offsets[g]:offsets[g + 1]]` are the places of label g, rising."""
    offsets = np.zeros(count + 1, dtype=np.int64)
    order = np.empty(len(labels), dtype=np.int64)
    _grouped(labels, offsets, order)
    return offsets, order


@filling
def _grouped(labels: IntArray, offsets: IntArray, order: IntArray) -> None:
    count = len(offsets) - 1
    for i in range(len(labels)):
        offsets[labels[i] + 1] += 1
    for g in range(count):
        offsets[g + 1] += offsets[g]
    # each group is filled from its end, so that its offset comes to stand at its beginning
    for back in range(len(labels)):
        i = len(labels) - 1 - back
        offsets[labels[i] + 1] -= 1
        order[offsets[labels[i] + 1]] = i
    for g in range(count):
        offsets[g] = offsets[g + 1]
    offsets[count] = len(labels)


def single_sides(triangles: IntArray, count: int) -> IntArray:
    """Sides 3 t + k, rising, that no other triangle has, either way round; `count` bounds the vertex numbers.

    Sides from a vertex to itself are none. Two stable passes, by the higher vertex and then by the lower one.
    """
    total = 3 * len(triangles)
    single = np.zeros(total, dtype=np.bool_)
    _single_sides(
        triangles, np.zeros(count + 1, dtype=np.int64), np.zeros(count + 1, dtype=np.int64),
        np.empty(total, dtype=np.int64), np.empty(total, dtype=np.int64), single,
    )  # fmt: skip
    return np.flatnonzero(single)


@filling
def _single_sides(
    triangles: IntArray, high: IntArray, low: IntArray, by_high: IntArray, by_low: IntArray, single: BoolArray
) -> None:
    count = len(high) - 1
    total = 3 * len(triangles)
    for t in range(len(triangles)):
        for k in range(3):
            a = triangles[t, k]
            b = triangles[t, 0 if k == 2 else k + 1]
            high[(b if a < b else a) + 1] += 1
            low[(a if a < b else b) + 1] += 1
    for v in range(count):
        high[v + 1] += high[v]
        low[v + 1] += low[v]
    for side in range(total):
        t = side // 3
        k = side - 3 * t
        a = triangles[t, k]
        b = triangles[t, 0 if k == 2 else k + 1]
        v = b if a < b else a
        by_high[high[v]] = side
        high[v] += 1
    for i in range(total):
        side = by_high[i]
        t = side // 3
        k = side - 3 * t
        a = triangles[t, k]
        b = triangles[t, 0 if k == 2 else k + 1]
        v = a if a < b else b
        by_low[low[v]] = side
        low[v] += 1
    # equal sides lie together now
    run = 0
    first_a, first_b = -1, -1
    for i in range(total + 1):
        a, b = -2, -2
        if i < total:
            side = by_low[i]
            t = side // 3
            k = side - 3 * t
            a = triangles[t, k]
            b = triangles[t, 0 if k == 2 else k + 1]
            if a > b:
                swap = a
                a = b
                b = swap
        if a == first_a and b == first_b:
            run += 1
        else:
            if run == 1 and first_a != first_b:
                single[by_low[i - 1]] = True
            run = 1
            first_a = a
            first_b = b
