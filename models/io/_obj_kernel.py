"""The lines of an OBJ file that make a surface, read in one compiled loop."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.models.arrays import Array, IntArray
from patchwright.models.io._number_kernel import BAD, SLOW, is_blank, number, remember
from patchwright.models.io.opening import Bytes

WHOLE, BAD_NUMBER, BAD_INDEX, ZERO_INDEX = 0, 1, 2, 3
OBJECT, GROUP = 0, 1


@njit(cache=True, nogil=True)
def _skip(data: Bytes, i: int, stop: int) -> int:
    """The next position on this line that is not blank; a backslash before the line's end joins the next line."""
    while i < stop:
        if data[i] == 92 and i + 1 < stop and (data[i + 1] == 10 or data[i + 1] == 13):
            i += 3 if data[i + 1] == 13 and i + 2 < stop and data[i + 2] == 10 else 2
        elif data[i] != 10 and data[i] != 13 and is_blank(data[i]):
            i += 1
        else:
            break
    return i


@njit(cache=True, nogil=True)
def scan(
    data: Bytes, points: Array, corners: IntArray, offsets: IntArray, places: IntArray
) -> tuple[int, int, int, int, IntArray, IntArray]:
    """Reads "v", "f", "o" and "g" lines; everything else is skipped.

    points flat (coordinates), corners (indices from 0; negative ones of the file resolved), offsets (where each face's
    corners begin) and places (the byte each face begins at) take the results. Returns (status, position, coordinates,
    faces, names (s, 3): kind·2^32 + faces before it, where the name begins and ends, slow as in `remember`).
    """
    stop = len(data)
    names = np.empty((16, 3), dtype=np.int64)
    found = 0
    slow = np.empty((16, 3), dtype=np.int64)
    later = 0
    n = 0
    c = 0
    f = 0
    offsets[0] = 0
    i = 0
    while i < stop:
        i = _skip(data, i, stop)
        line = i
        if i < stop and (i + 1 == stop or is_blank(data[i + 1]) or data[i + 1] == 92):
            kind = data[i]
            i += 1
            if kind == 118:  # v
                for _ in range(3):
                    i = _skip(data, i, stop)
                    if i >= stop:
                        return BAD_NUMBER, line, n, f, names[:found], slow[:later]
                    begin = i
                    value, i, status = number(data, i, stop)
                    if status == BAD or (i < stop and not is_blank(data[i]) and data[i] != 92):
                        return BAD_NUMBER, begin, n, f, names[:found], slow[:later]
                    if status == SLOW:
                        slow = remember(slow, later, begin, i, n)
                        later += 1
                    points[n] = value
                    n += 1
            elif kind == 102:  # f
                places[f] = line
                while True:
                    i = _skip(data, i, stop)
                    if i >= stop or data[i] == 10 or data[i] == 13 or data[i] == 35:
                        break
                    begin = i
                    minus = data[i] == 45
                    if minus:
                        i += 1
                    index = 0
                    digits = 0
                    while i < stop and 48 <= data[i] <= 57 and digits < 18:
                        index = index * 10 + int(data[i] - 48)
                        digits += 1
                        i += 1
                    if i < stop and data[i] == 47:  # the texture and normal of v/vt/vn
                        while i < stop and (47 <= data[i] <= 57 or data[i] == 45):
                            i += 1
                    if digits == 0 or (i < stop and not is_blank(data[i]) and data[i] != 92):
                        return BAD_INDEX, begin, n, f, names[:found], slow[:later]
                    if index == 0:
                        return ZERO_INDEX, begin, n, f, names[:found], slow[:later]
                    corners[c] = n // 3 - index if minus else index - 1
                    c += 1
                f += 1
                offsets[f] = c
            elif kind == 111 or kind == 103:  # o, g
                begin = i
                while i < stop and data[i] != 10 and data[i] != 13:
                    i += 1
                names = remember(names, found, (OBJECT if kind == 111 else GROUP) * 4294967296 + f, begin, i)
                found += 1
        while i < stop and data[i] != 10 and data[i] != 13:
            i += 1
        i += 1
    return WHOLE, stop, n, f, names[:found], slow[:later]
