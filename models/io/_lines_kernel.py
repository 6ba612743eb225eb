"""Rows of numbers and of polygons, one a line, read in compiled loops."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.models.arrays import Array, IntArray
from patchwright.models.io._number_kernel import BAD as BAD_WORD
from patchwright.models.io._number_kernel import SLOW, is_blank, number, remember
from patchwright.models.io.opening import Bytes

WHOLE, CUT_OFF, BAD, OUT_OF_RANGE = 0, 1, 2, 3


@njit(cache=True, nogil=True)
def _next_row(data: Bytes, i: int, stop: int) -> int:
    """The first byte at or after i that is neither blank nor in a comment ("#" to the line's end)."""
    while i < stop:
        if data[i] == 35:
            while i < stop and data[i] != 10 and data[i] != 13:
                i += 1
        elif is_blank(data[i]):
            i += 1
        else:
            break
    return i


@njit(cache=True, nogil=True)
def _line_end(data: Bytes, i: int, stop: int) -> int:
    while i < stop and data[i] != 10 and data[i] != 13:
        i += 1
    return i


@njit(cache=True, nogil=True)
def _in_line(data: Bytes, i: int, stop: int) -> int:
    while i < stop and data[i] != 10 and data[i] != 13 and is_blank(data[i]):
        i += 1
    return i


@njit(cache=True, nogil=True)
def rows(data: Bytes, i: int, out: Array, take: int) -> tuple[int, int, int, IntArray]:
    """The first `take` numbers of each of the next len(out) lines into out (n, k ≥ take); what follows them is skipped.

    Returns (status, position, whole rows, slow as in `remember`, targets counted in flat out).
    """
    stop = len(data)
    slow = np.empty((16, 3), dtype=np.int64)
    later = 0
    for row in range(len(out)):
        i = _next_row(data, i, stop)
        for k in range(take):
            i = _in_line(data, i, stop)
            if i >= stop:
                return CUT_OFF, i, row, slow[:later]
            begin = i
            value, i, status = number(data, i, stop)
            if status == BAD_WORD or (i < stop and not is_blank(data[i])):
                return BAD, begin, row, slow[:later]
            if status == SLOW:
                slow = remember(slow, later, begin, i, row * out.shape[1] + k)
                later += 1
            out[row, k] = value
        i = _line_end(data, i, stop)
    return WHOLE, i, len(out), slow[:later]


@njit(cache=True, nogil=True)
def polygons(data: Bytes, i: int, count: int, offsets: IntArray, corners: IntArray) -> tuple[int, int, int]:
    """Lines of "k i1 … ik" with 0 ≤ i < count into corners, where each begins into offsets; a line's rest is skipped.

    Returns (status, position, whole polygons).
    """
    stop = len(data)
    c = 0
    offsets[0] = 0
    for row in range(len(offsets) - 1):
        i = _next_row(data, i, stop)
        left = -1
        while left != 0:
            i = _in_line(data, i, stop)
            if i >= stop:
                return CUT_OFF, i, row
            begin = i
            value = 0
            while i < stop and 48 <= data[i] <= 57 and i - begin < 18:
                value = value * 10 + int(data[i] - 48)
                i += 1
            if i == begin or (i < stop and not is_blank(data[i])):
                return (OUT_OF_RANGE if data[begin] == 45 and left > 0 else BAD), begin, row
            if left < 0:
                left = value
            else:
                if value >= count:
                    return OUT_OF_RANGE, begin, row
                corners[c] = value
                c += 1
                left -= 1
        offsets[row + 1] = c
        i = _line_end(data, i, stop)
    return WHOLE, i, len(offsets) - 1
