"""Kernels: the sign of a determinant of coordinate differences, as exact arithmetic has it.

A difference of two coordinates is two numbers, its rounded value and what rounding lost; a determinant of such
differences is a sum of products, kept as an expansion of numbers that do not overlap (Shewchuk, "Adaptive precision
floating-point arithmetic", Discrete & Computational Geometry 18, 1997). Exact barring overflow and underflow.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.models.arrays import Array

LONGEST = 200  # terms of a determinant: 6 products of three two-term factors, four terms each


@njit(cache=True, nogil=True)
def two_product_tail(a: float, b: float, p: float) -> float:
    """a b - p exactly, for p = fl(a b) (Dekker 1971)."""
    c = 134217729.0 * a
    ah = c - (c - a)
    al = a - ah
    c = 134217729.0 * b
    bh = c - (c - b)
    bl = b - bh
    return al * bl - (((p - ah * bh) - al * bh) - ah * bl)


@njit(cache=True, nogil=True)
def difference_tail(a: float, b: float, d: float) -> float:
    """a - b exactly, less d = fl(a - b)."""
    z = d - a
    return (a - (d - z)) + (-b - z)


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def grow_product(expansion: Array, n: int, a: float, b: float, c: float) -> int:
    """Add a b c to an expansion."""
    p = a * b
    e = two_product_tail(a, b, p)
    for factor in (p, e):
        if factor != 0.0 and c != 0.0:
            q = factor * c
            n = grow(expansion, n, two_product_tail(factor, c, q))
            n = grow(expansion, n, q)
    return n


@njit(cache=True, nogil=True)
def determinant(rows: Array, tails: Array) -> float:
    """det(rows + tails), (3, 3) each, with the sign it has in exact arithmetic."""
    expansion = np.empty(LONGEST)
    n = 0
    for k in range(3):
        for turn in range(2):
            i, j = (k + 1) % 3, (k + 2) % 3
            sign = 1.0
            if turn:
                i, j, sign = j, i, -1.0
            for a in range(2):
                x = (tails if a else rows)[0, k]
                for b in range(2):
                    y = (tails if b else rows)[1, i]
                    for c in range(2):
                        z = (tails if c else rows)[2, j]
                        if x != 0.0 and y != 0.0 and z != 0.0:
                            n = grow_product(expansion, n, x, y, sign * z)
    return expansion[n - 1] if n else 0.0
