"""Kernels: the sign of a determinant of coordinate differences, as exact arithmetic has it.

A difference of two coordinates is two numbers, its rounded value and what rounding lost; a determinant of such
differences is a sum of products, kept as an expansion of numbers that do not overlap (Shewchuk, "Adaptive precision
floating-point arithmetic", Discrete & Computational Geometry 18, 1997). Exact barring overflow and underflow.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import inner, making
from patchwright.models.arrays import Array

LONGEST = 200  # terms of a determinant: 6 products of three two-term factors, four terms each


@inner
def two_product_tail(a: float, b: float, p: float) -> float:
    """a b - p exactly, for p = fl(a b) (Dekker 1971)."""
    c = 134217729.0 * a
    ah = c - (c - a)
    al = a - ah
    c = 134217729.0 * b
    bh = c - (c - b)
    bl = b - bh
    return al * bl - (((p - ah * bh) - al * bh) - ah * bl)


@inner
def difference_tail(a: float, b: float, d: float) -> float:
    """a - b exactly, less d = fl(a - b)."""
    z = d - a
    return (a - (d - z)) + (-b - z)


@inner
def grow(expansion: Array, n: int, term: float) -> int:
    """Add a number to an expansion of n terms; the new count of terms, none of them zero."""
    if term == 0.0:
        return n
    kept = 0
    q = term
    for i in range(n):
        s = q + expansion[i]
        z = s - q
        tail = (q - (s - z)) + (expansion[i] - z)
        q = s
        if tail != 0.0:
            expansion[kept] = tail
            kept += 1
    if q != 0.0:
        expansion[kept] = q
        kept += 1
    return kept


@making
def determinant(rows: Array, tails: Array) -> float:
    """det(rows + tails), (3, 3) each: the sign it has in exact arithmetic, the value to rounding."""
    expansion = np.empty(LONGEST)
    part = np.empty(4)
    n = np.int64(0)
    # one flat loop whose length the compiler does not know: unrolled it would take it many seconds
    for term in range(16 * rows.shape[0]):
        k, a, b, c = term >> 4, (term >> 1) & 1, (term >> 2) & 1, (term >> 3) & 1
        i, j = (k + 1) % 3, (k + 2) % 3
        sign = 1.0
        if term & 1:
            i, j, sign = j, i, -1.0
        x = tails[0, k] if a else rows[0, k]
        y = tails[1, i] if b else rows[1, i]
        z = sign * (tails[2, j] if c else rows[2, j])
        if x == 0.0 or y == 0.0 or z == 0.0:
            continue
        p = x * y
        e = two_product_tail(x, y, p)
        part[1], part[3] = p * z, e * z
        part[0], part[2] = two_product_tail(p, z, part[1]), two_product_tail(e, z, part[3])
        for m in range(part.shape[0]):
            n = grow(expansion, n, part[m])
    if n == 0:
        return 0.0
    total = 0.0  # smallest first: the largest alone has the sign, and up to twice the value
    for m in range(n):
        total += expansion[m]
    return total if total != 0.0 else expansion[n - 1]
