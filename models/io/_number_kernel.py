"""Decimal text to the nearest float64, inside compiled loops.

Up to 19 digits w·10^q: exact arithmetic where w and 10^|q| are float64 numbers, else the 128-bit product of Lemire,
"Number parsing at a gigabyte per second", Software: Practice and Experience 51 (2021) 1700, section 5; that no further
case exists for up to 19 digits is proved by Mushtak & Lemire, "Fast number parsing without fallback", ibid. 53 (2023).
More digits: accepted when w and w + 1 round to the same number, else left to the caller (`SLOW`).
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from numba import njit

from patchwright.models.arrays import Array, IntArray
from patchwright.models.io.opening import Bytes

GOOD, SLOW, BAD = 0, 1, 2
Words: TypeAlias = npt.NDArray[np.uint64]
LOWEST, HIGHEST = -342, 308  # powers of ten beyond which 19 digits give 0 or infinity


def _powers_of_five() -> Words:
    """(651, 2) uint64: the leading 128 bits of 5^q, cut for q ≥ 0 and rounded up for the reciprocals."""
    rows = []
    for q in range(LOWEST, HIGHEST + 1):
        power = 5 ** abs(q)
        bits = power.bit_length()
        if q >= 0:
            lead = power << (128 - bits) if bits <= 128 else power >> (bits - 128)
        else:
            lead = (1 << (bits + 127)) // power + 1
        rows.append((lead >> 64, lead & (2**64 - 1)))
    return np.array(rows, dtype=np.uint64)


POWERS_OF_FIVE = _powers_of_five()
POWERS_OF_TEN = np.array([10.0**q for q in range(23)])  # exact


@njit(cache=True, nogil=True)
def _product(a: np.uint64, b: np.uint64) -> tuple[np.uint64, np.uint64]:
    """The high and low words of the 128-bit product of two 64-bit words."""
    low = np.uint64(0xFFFFFFFF)
    half = np.uint64(32)
    a0, a1, b0, b1 = a & low, a >> half, b & low, b >> half
    p00, p01, p10, p11 = a0 * b0, a0 * b1, a1 * b0, a1 * b1
    middle = (p00 >> half) + (p01 & low) + (p10 & low)
    return p11 + (p01 >> half) + (p10 >> half) + (middle >> half), a * b


@njit(cache=True, nogil=True)
def nearest(w: np.uint64, q: int) -> float:
    """The float64 nearest to w·10^q, ties to even; w uint64, q int64."""
    if w == np.uint64(0) or q < LOWEST:
        return 0.0
    if q > HIGHEST:
        return np.inf
    if w <= np.uint64(9007199254740992) and -22 <= q <= 22:
        if q < 0:
            return np.float64(w) / POWERS_OF_TEN[-q]
        return np.float64(w) * POWERS_OF_TEN[q]
    zeros = 0
    step = 32
    while step > 0:
        if w >> np.uint64(64 - step) == np.uint64(0):
            w <<= np.uint64(step)
            zeros += step
        step >>= 1
    high, low = _product(w, POWERS_OF_FIVE[q - LOWEST, 0])
    if high & np.uint64(0x1FF) == np.uint64(0x1FF):
        more, _ = _product(w, POWERS_OF_FIVE[q - LOWEST, 1])
        low += more
        if more > low:
            high += np.uint64(1)
    upper = np.int64(high >> np.uint64(63))
    mantissa = high >> np.uint64(upper + 9)
    power = ((217706 * q) >> 16) + 63 + upper - zeros + 1023
    if power <= 0:
        if 1 - power >= 64:
            return 0.0
        mantissa >>= np.uint64(1 - power)
        mantissa = (mantissa + (mantissa & np.uint64(1))) >> np.uint64(1)
        return math.ldexp(np.float64(mantissa), -1074)
    tie = low <= np.uint64(1) and -4 <= q <= 23 and mantissa & np.uint64(3) == np.uint64(1)
    if tie and mantissa << np.uint64(upper + 9) == high:
        mantissa &= ~np.uint64(1)
    mantissa = (mantissa + (mantissa & np.uint64(1))) >> np.uint64(1)
    if power >= 2047 or (power == 2046 and mantissa >= np.uint64(9007199254740992)):
        return np.inf
    return math.ldexp(np.float64(mantissa), power - 1075)  # type: ignore[arg-type]


@njit(cache=True, nogil=True)
def is_blank(byte: np.uint8) -> bool:
    """Space, tab, return, form feed, vertical tab or newline."""
    return byte == 32 or 9 <= byte <= 13  # type: ignore[return-value]


@njit(cache=True, nogil=True)
def number(data: Bytes, i: int, stop: int) -> tuple[float, int, int]:
    """The decimal number that starts at byte i < stop: (value, position after it, GOOD | SLOW | BAD).

    Accepts D for E in the exponent, nan and inf in any case. What follows the number is the caller's to judge.
    """
    begin = i
    negative = data[i] == 45
    if data[i] == 45 or data[i] == 43:
        i += 1
    w = np.uint64(0)
    kept = 0
    q = 0
    seen = False
    cut = False
    point = False
    while i < stop:
        byte = data[i]
        if 48 <= byte <= 57:
            seen = True
            if kept < 19:
                w = w * np.uint64(10) + np.uint64(byte - 48)
                if w > np.uint64(0):
                    kept += 1
                if point:
                    q -= 1
            else:
                cut = cut or byte != 48
                if not point:
                    q += 1
        elif byte == 46 and not point:
            point = True
        else:
            break
        i += 1
    if not seen:
        if not point and i + 3 <= stop:
            a, b, c = data[i] | 32, data[i + 1] | 32, data[i + 2] | 32
            if (a == 110 and b == 97 and c == 110) or (a == 105 and b == 110 and c == 102):
                while i < stop and not is_blank(data[i]):
                    i += 1
                return (np.nan if a == 110 else (-np.inf if negative else np.inf)), i, GOOD
        return 0.0, begin, BAD
    if i < stop and (data[i] | 32 == 101 or data[i] | 32 == 100):
        j = i + 1
        minus = j < stop and data[j] == 45
        if j < stop and (data[j] == 45 or data[j] == 43):
            j += 1
        if j >= stop or data[j] < 48 or data[j] > 57:
            return 0.0, begin, BAD
        exponent = 0
        while j < stop and 48 <= data[j] <= 57:
            if exponent < 100000:
                exponent = exponent * 10 + (data[j] - 48)
            j += 1
        q += -exponent if minus else exponent
        i = j
    value = nearest(w, q)
    status = GOOD
    if cut and value != nearest(w + np.uint64(1), q):
        status = SLOW
    return (-value if negative else value), i, status


@njit(cache=True, nogil=True)
def remember(slow: IntArray, count: int, begin: int, stop: int, target: int) -> IntArray:
    """Notes in row `count` of `slow` that out[target] is in bytes begin:stop; returns slow, grown if full."""
    if count == len(slow):
        grown = np.empty((2 * count, 3), dtype=np.int64)
        for row in range(count):  # a slice would take seconds to compile
            grown[row, 0], grown[row, 1], grown[row, 2] = slow[row, 0], slow[row, 1], slow[row, 2]
        slow = grown
    slow[count, 0], slow[count, 1], slow[count, 2] = begin, stop, target
    return slow


@njit(cache=True, nogil=True)
def numbers(data: Bytes, i: int, stop: int, comment: int, out: Array) -> tuple[int, int, int, IntArray]:
    """Blank-separated numbers of data[i:stop] into out; text from byte `comment` to the line's end is skipped.

    Commas count as blanks; "3*0.5" is three numbers (Fortran list-directed output). Returns (how many,
    position after the last, GOOD | BAD, slow (k, 3)); stops early when out is full.
    """
    slow = np.empty((16, 3), dtype=np.int64)
    later = 0
    n = 0
    repeat = 1
    while n < len(out):
        if repeat == 1:
            while i < stop and (is_blank(data[i]) or data[i] == 44):
                i += 1
            if i < stop and data[i] == comment:
                while i < stop and data[i] != 10:
                    i += 1
                continue
        if i >= stop:
            return n, i, GOOD if repeat == 1 else BAD, slow[:later]
        begin = i
        value, i, status = number(data, begin, stop)
        if i < stop and data[i] == 42 and repeat == 1 and status == GOOD and 2.0 <= value <= len(out) - n:
            repeat = int(value)
            i += 1
            continue
        if status == BAD or (i < stop and not is_blank(data[i]) and data[i] != 44):
            return n, begin, BAD, slow[:later]
        while repeat > 0:
            if status == SLOW:
                slow = remember(slow, later, begin, i, n)
                later += 1
            out[n] = value
            n += 1
            repeat -= 1
        repeat = 1
    return n, i, GOOD, slow[:later]
