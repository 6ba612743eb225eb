"""Kernels that find the knot span of a parameter: one alone by bisection, many by a table."""
# mypy: disable-error-code="untyped-decorator,no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.models._compile_kernel import making
from patchwright.models.arrays import Array, IntArray


@njit(cache=True, nogil=True, inline="always")
def find_span(U: Array, p: int, n: int, u: float) -> int:
    """The non-empty span of the domain [U[p], U[n]] that holds u; the last one at the domain's end."""
    low = p
    width = n - p
    while width > 1:
        half = width >> 1
        low = low + half if U[low + half] <= u else low
        width -= half
    while low > p and U[low] == U[low + 1]:
        low -= 1
    return low


@making
def span_table(U: Array, p: int, n: int, count: int) -> tuple[IntArray, float]:
    """The spans at the starts of equal parts of the domain and parts / width, for `count` look-ups by `near_span`.

    Random parameters make every branch of a bisection a surprise: with eight parts to a span most parts hold no knot,
    and the table answers without one.
    """
    parts = max(1, min(8 * (n - p), count))
    width = U[n] - U[p]
    scale = parts / width
    if not np.isfinite(scale):  # a domain too narrow for reciprocals
        parts = 1
        scale = 0.0
    table = np.empty(parts + 2, dtype=np.int64)
    for k in range(parts):
        table[k] = find_span(U, p, n, U[p] + width * (k / parts))
    table[parts] = find_span(U, p, n, U[n])
    table[parts + 1] = table[parts]
    return table, scale


@njit(cache=True, nogil=True, inline="always")
def near_span(U: Array, p: int, table: IntArray, scale: float, u: float) -> int:
    """As `find_span`, between the spans at both ends of the part of the table that holds u."""
    part = int((u - U[p]) * scale)
    low = table[part]
    high = table[part + 1]
    while low > p and u < U[low]:  # the round-off of a part's start
        low -= 1
    while low < high:
        half = (low + high + 1) >> 1
        if U[half] <= u:
            low = half
        else:
            high = half - 1
    return low
