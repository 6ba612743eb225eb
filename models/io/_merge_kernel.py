"""Equal points found by hashing: the loops of `merge`."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from numba import njit

from patchwright.models.arrays import IntArray

Words: TypeAlias = npt.NDArray[np.unsignedinteger[Any]]


@njit(cache=True, nogil=True)
def _home(words: Words, row: int, mask: np.uint64) -> int:
    """The slot a row's hash points to: a multiplicative mix, finished with two of the shifts of splitmix64."""
    h = np.uint64(words[row, 0]) * np.uint64(0x9E3779B97F4A7C15)
    h = (h ^ (h >> np.uint64(31))) + np.uint64(words[row, 1])
    h = h * np.uint64(0xBF58476D1CE4E5B9)
    h = (h ^ (h >> np.uint64(27))) + np.uint64(words[row, 2])
    h = h * np.uint64(0x94D049BB133111EB)
    h ^= h >> np.uint64(32)
    return np.int64(h & mask)  # type: ignore[return-value]


@njit(cache=True, nogil=True)
def first_equal(words: Words, first: IntArray, index: IntArray) -> int:
    """Open addressing with linear probing, the table grown by four when half full.

    `words` (n, 3) unsigned: a row is a key. Fills index (n,) with each row's key, numbered by first appearance, and
    first (n,) with the row a key first appeared in; returns how many keys there are.
    """
    size = 4096
    mask = np.uint64(size - 1)
    table = np.full(size, -1, dtype=np.int32)
    found = 0
    for i in range(len(words)):
        slot = _home(words, i, mask)
        while True:
            k = table[slot]
            if k < 0:
                table[slot] = found
                first[found] = i
                index[i] = found
                found += 1
                break
            j = first[k]
            if words[j, 0] == words[i, 0] and words[j, 1] == words[i, 1] and words[j, 2] == words[i, 2]:
                index[i] = k
                break
            slot = (slot + 1) & (size - 1)
        if 2 * found > size:
            size *= 4
            mask = np.uint64(size - 1)
            table = np.full(size, -1, dtype=np.int32)
            for k in range(found):
                slot = _home(words, first[k], mask)
                while table[slot] >= 0:
                    slot = (slot + 1) & (size - 1)
                table[slot] = k
    return found
