"""Rows with lists of their own length in PLY files, walked in compiled loops."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.models.arrays import Array, IntArray
from patchwright.models.io.opening import Bytes

WHOLE, CUT_OFF, NOT_COUNT = 0, 1, 2


@njit(cache=True, nogil=True)
def _integer(data: Bytes, i: int, width: int, signed: bool, big: bool) -> int:
    """The integer of `width` bytes at i."""
    value = np.int64(0)
    for k in range(width):
        value = (value << 8) | np.int64(data[i + k if big else i + width - 1 - k])
    if signed and value >> (8 * width - 1):
        value -= np.int64(1) << (8 * width)
    return value  # type: ignore[return-value]


@njit(cache=True, nogil=True)
def walk_bytes(
    data: Bytes, i: int, count: int, layout: IntArray, target: int, big: bool, offsets: IntArray, items: IntArray
) -> tuple[int, int, int]:
    """Walks `count` binary rows from byte i and takes the list of property `target` (−1: none).

    layout (p, 5) int64 per property: whether a list, bytes of its count, count signed, bytes of an item, item signed.
    Returns (status, position, whole rows); offsets (count + 1,) tells where each row's items begin.
    """
    stop = len(data)
    n = 0
    offsets[0] = 0
    for row in range(count):
        for p in range(len(layout)):
            if layout[p, 0] == 0:
                i += layout[p, 3]
                continue
            if i + layout[p, 1] > stop:
                return CUT_OFF, i, row
            times = _integer(data, i, layout[p, 1], layout[p, 2] == 1, big)
            if times < 0:
                return NOT_COUNT, i, row
            i += layout[p, 1]
            if times * layout[p, 3] > stop - i:
                return CUT_OFF, i, row
            if p == target:
                for k in range(times):
                    items[n] = _integer(data, i + k * layout[p, 3], layout[p, 3], layout[p, 4] == 1, big)
                    n += 1
            i += times * layout[p, 3]
        if i > stop:
            return CUT_OFF, i, row
        offsets[row + 1] = n
    return WHOLE, i, count


@njit(cache=True, nogil=True)
def walk_numbers(
    values: Array, i: int, count: int, layout: IntArray, target: int, offsets: IntArray, items: IntArray
) -> tuple[int, int, int]:
    """As `walk_bytes`, the rows given as numbers: every value of `values` is one count or item."""
    stop = len(values)
    n = 0
    offsets[0] = 0
    for row in range(count):
        for p in range(len(layout)):
            if i >= stop:
                return CUT_OFF, i, row
            if layout[p, 0] == 0:
                i += 1
                continue
            if not 0.0 <= values[i] <= 1e15 or values[i] != np.floor(values[i]):
                return NOT_COUNT, i, row
            times = int(values[i])
            i += 1
            if times > stop - i:
                return CUT_OFF, i, row
            if p == target:
                for k in range(times):
                    value = values[i + k]
                    items[n] = int(value) if np.abs(value) < 1e15 and value == np.floor(value) else -1
                    n += 1
            i += times
        offsets[row + 1] = n
    return WHOLE, i, count
