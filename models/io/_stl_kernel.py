"""The words of an ascii STL file, read and written in compiled loops."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.models.arrays import Array, IntArray
from patchwright.models.io._number_kernel import BAD, SLOW, is_blank, number, remember
from patchwright.models.io.opening import Bytes

WHOLE, UNKNOWN_WORD, BAD_NUMBER, WRONG_CORNERS, OPEN_FACET, OPEN_SOLID = 0, 1, 2, 3, 4, 5


@njit(cache=True, nogil=True)
def _word(data: Bytes, i: int, stop: int, word: Bytes) -> bool:
    """True when the lower-case letters `word` stand at i in any case, ended by a blank or the end."""
    n = len(word)
    if i + n > stop or (i + n < stop and not is_blank(data[i + n])):
        return False
    for k in range(n):  # noqa: SIM110
        if data[i + k] | 32 != word[k]:
            return False
    return True


@njit(cache=True, nogil=True)
def _line_end(data: Bytes, i: int, stop: int) -> int:
    while i < stop and data[i] != 10 and data[i] != 13:
        i += 1
    return i


@njit(cache=True, nogil=True)
def scan(data: Bytes, out: Array, words: tuple[Bytes, ...]) -> tuple[int, int, int, IntArray, IntArray]:
    """Reads all facets; `words` are solid, facet, outer, vertex, endloop, endfacet, endsolid, loop as bytes.

    out (n,) takes the coordinates, nine a facet. Returns (status, position, number of coordinates, solids (s, 3):
    where the name begins and ends and the facets before it, slow as in `remember`).
    """
    solid, facet, outer, vertex, endloop, endfacet, endsolid, loop = words
    stop = len(data)
    names = np.empty((16, 3), dtype=np.int64)
    found = 0
    slow = np.empty((16, 3), dtype=np.int64)
    later = 0
    n = 0
    inside = False  # a solid
    open_facet = False
    corners = 0
    i = 0
    while True:
        while i < stop and is_blank(data[i]):
            i += 1
        if i >= stop:
            break
        if _word(data, i, stop, vertex):
            if not open_facet or corners == 3:
                return WRONG_CORNERS, i, n, names[:found], slow[:later]
            i += 6
            for _ in range(3):
                while i < stop and is_blank(data[i]):
                    i += 1
                if i >= stop:
                    return OPEN_FACET, stop, n, names[:found], slow[:later]
                begin = i
                value, i, status = number(data, i, stop)
                if status == BAD or (i < stop and not is_blank(data[i])):
                    return BAD_NUMBER, begin, n, names[:found], slow[:later]
                if status == SLOW:
                    slow = remember(slow, later, begin, i, n)
                    later += 1
                out[n] = value
                n += 1
            corners += 1
        elif _word(data, i, stop, facet):
            if open_facet or not inside:
                return UNKNOWN_WORD, i, n, names[:found], slow[:later]
            open_facet = True
            corners = 0
            i = _line_end(data, i, stop)
        elif _word(data, i, stop, outer):
            i += 5
            while i < stop and is_blank(data[i]):
                i += 1
            if not _word(data, i, stop, loop):
                return UNKNOWN_WORD, i, n, names[:found], slow[:later]
            i += 4
        elif _word(data, i, stop, endloop):
            i += 7
        elif _word(data, i, stop, endfacet):
            if not open_facet or corners != 3:
                return WRONG_CORNERS, i, n, names[:found], slow[:later]
            open_facet = False
            i += 8
        elif _word(data, i, stop, solid):
            if inside:
                return UNKNOWN_WORD, i, n, names[:found], slow[:later]
            inside = True
            begin = i + 5
            i = _line_end(data, begin, stop)
            names = remember(names, found, begin, i, n // 9)
            found += 1
        elif _word(data, i, stop, endsolid):
            if open_facet or not inside:
                return UNKNOWN_WORD, i, n, names[:found], slow[:later]
            inside = False
            i = _line_end(data, i, stop)
        else:
            return UNKNOWN_WORD, i, n, names[:found], slow[:later]
    status = OPEN_FACET if open_facet else (OPEN_SOLID if inside else WHOLE)
    return status, stop, n, names[:found], slow[:later]


@njit(cache=True, nogil=True)
def _put(out: Bytes, n: int, text: Bytes) -> int:
    for k in range(len(text)):
        out[n + k] = text[k]
    return n + len(text)


@njit(cache=True, nogil=True)
def facets(
    triangles: IntArray, normals: IntArray, lines: Bytes, offsets: IntArray, words: tuple[Bytes, ...], out: Bytes
) -> int:
    """Writes the facets of triangles (m, 3) into out (bytes) and returns their length.

    lines[offsets[v]:offsets[v + 1]] is vertex v's own line; normals (m, 3) int64 in units of 1e-7; `words` are the
    fixed texts between: before the normal, after it, after the corners.
    """
    before, between, after = words
    n = 0
    for t in range(len(triangles)):
        n = _put(out, n, before)
        for k in range(3):
            out[n] = 32
            n += 1
            value = normals[t, k]
            if value < 0:
                out[n] = 45
                n += 1
                value = -value
            out[n] = 48 + value // 10000000
            out[n + 1] = 46
            value = value % 10000000
            for digit in range(7):
                out[n + 8 - digit] = 48 + value % 10
                value //= 10
            n += 9
        n = _put(out, n, between)
        for k in range(3):
            v = triangles[t, k]
            n = _put(out, n, lines[offsets[v] : offsets[v + 1]])
        n = _put(out, n, after)
    return n
