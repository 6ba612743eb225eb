"""Kernels of NURBS evaluation and knot insertion; their readable definitions are the oracles in the tests.

Letters follow Piegl and Tiller, The NURBS Book (2nd ed. 1997): degrees p and q, knot vectors U and V, spans i with
U[i] <= u < U[i+1]. Basis rows are raised degree by degree (A2.2); a derivative of order r raises the last r degrees
with the derivative formula (2.9) instead, so no triangular tables are kept. Nets are homogeneous, (x w, y w, z w,
w), or plain. Large results are filled in, not made: numpy asks the system for large pages, numba does not, and a first
touch of every small one costs more than the arithmetic.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.models._compile_kernel import inner, kernel, making
from patchwright.models._span_kernel import find_span as find_span
from patchwright.models._span_kernel import near_span, span_table
from patchwright.models.arrays import Array, IntArray


@inner
def basis_row(U: Array, p: int, i: int, u: float, order: int, rows: Array, at: int) -> None:
    """rows[at, 0..p] = derivative of the given order of N_{i-p..i, p} at u."""
    if order > p:
        for j in range(p + 1):
            rows[at, j] = 0.0
        return
    rows[at, 0] = 1.0
    for k in range(1, p + 1):
        saved = 0.0
        if k <= p - order:
            for j in range(k):
                left = U[i + 1 - k + j]
                right = U[i + 1 + j]
                value = rows[at, j]
                share = (u - left) / (right - left)  # exactly 0 or 1 at the ends, which makes end points exact
                rows[at, j] = saved + (1.0 - share) * value
                saved = share * value
        else:
            for j in range(k):
                share = k * rows[at, j] / (U[i + 1 + j] - U[i + 1 - k + j])
                rows[at, j] = saved - share
                saved = share
        rows[at, k] = saved


@kernel
def basis_table(U: Array, p: int, u: Array, order: int) -> tuple[IntArray, Array]:
    """First active index (k,) and basis rows (order + 1, k, p + 1) of derivatives 0..order at the parameters u."""
    n = U.shape[0] - p - 1
    count = u.shape[0]
    first = np.empty(count, dtype=np.int64)
    rows = np.empty(((order + 1) * count, p + 1))
    for k in range(count):
        i = find_span(U, p, n, u[k])
        first[k] = i - p
        for r in range(order + 1):
            basis_row(U, p, i, u[k], r, rows, r * count + k)
    return first, rows.reshape(order + 1, count, p + 1)


@kernel
def banded_product(first: IntArray, rows: Array, net: Array) -> Array:
    """(k, c) sums over r of rows[k, r] * net[first[k] + r, :] for a net of (n, c)."""
    count, width = rows.shape
    columns = net.shape[1]
    out = np.empty((count, columns))
    for k in range(count):
        f = first[k]
        b = rows[k, 0]
        for c in range(columns):
            out[k, c] = b * net[f, c]
        for r in range(1, width):
            b = rows[k, r]
            for c in range(columns):
                out[k, c] += b * net[f + r, c]
    return out


@kernel
def tensor_product(
    first_u: IntArray, rows_u: Array, first_v: IntArray, rows_v: Array, net: Array, divide: bool, out: Array
) -> None:
    """out (k, l, 3) = points of the tensor grid, or (k, l, d) homogeneous sums when `divide` is false."""
    k_count, width_u = rows_u.shape
    l_count, width_v = rows_v.shape
    m = net.shape[1]
    d = net.shape[2]
    columns = m * d
    flat = net.reshape(net.shape[0], columns)
    line = np.empty(columns)
    for k in range(k_count):
        f = first_u[k]
        b = rows_u[k, 0]
        for c in range(columns):
            line[c] = b * flat[f, c]
        for r in range(1, width_u):
            b = rows_u[k, r]
            for c in range(columns):
                line[c] += b * flat[f + r, c]
        if d == 4:
            for j in range(l_count):
                x = 0.0
                y = 0.0
                z = 0.0
                w = 0.0
                at = first_v[j] * 4
                for s in range(width_v):
                    b = rows_v[j, s]
                    x += b * line[at]
                    y += b * line[at + 1]
                    z += b * line[at + 2]
                    w += b * line[at + 3]
                    at += 4
                if divide:
                    scale = 1.0 / w
                    out[k, j, 0] = x * scale
                    out[k, j, 1] = y * scale
                    out[k, j, 2] = z * scale
                else:
                    out[k, j, 0] = x
                    out[k, j, 1] = y
                    out[k, j, 2] = z
                    out[k, j, 3] = w
        else:
            for j in range(l_count):
                x = 0.0
                y = 0.0
                z = 0.0
                at = first_v[j] * 3
                for s in range(width_v):
                    b = rows_v[j, s]
                    x += b * line[at]
                    y += b * line[at + 1]
                    z += b * line[at + 2]
                    at += 3
                out[k, j, 0] = x
                out[k, j, 1] = y
                out[k, j, 2] = z


@making
def cubic_table(U: Array, n: int, low: int, high: int) -> Array:
    """(n, high + 1 - low, 4, 4) the derivatives low..high of the four cubics of each span as powers of its own t in
    [0, 1].

    The cubics lie in [0, 1] on their span, so the coefficients stay below 48 however unequal the knots are, and a
    sum of powers costs no divisions. [span, order - low, power, basis function]; span 0, which is none, holds the
    values at the domain's end.
    """
    table = np.zeros((n, high + 1 - low, 4, 4))
    row = np.empty((1, 4))
    cubic, first = np.int64(3), np.int64(0)
    for i in range(3, n):
        h = U[i + 1] - U[i]
        if h <= 0.0:
            continue
        taylor = 1.0  # h^k / k!
        for k in range(4):
            basis_row(U, cubic, i, U[i], k, row, first)
            fall = taylor  # h^(k - r) / (k - r)!
            for r in range(min(k, high) + 1):
                if r >= low:
                    for j in range(4):
                        table[i, r - low, k - r, j] = fall * row[0, j]
                fall *= (k - r) / h
            taylor *= h / (k + 1)
    if n > 0:
        i = find_span(U, 3, n, U[n])
        for r in range(low, high + 1):
            basis_row(U, cubic, i, U[n], r, row, first)
            for j in range(4):
                table[0, r - low, 0, j] = row[0, j]
    return table


@njit(cache=True, nogil=True, inline="always")
def cubic_basis(c: Array, i: int, e: int, t: float) -> tuple[float, float, float, float]:
    """The four functions of span i and table row e at its own t."""
    return (
        ((c[i, e, 3, 0] * t + c[i, e, 2, 0]) * t + c[i, e, 1, 0]) * t + c[i, e, 0, 0],
        ((c[i, e, 3, 1] * t + c[i, e, 2, 1]) * t + c[i, e, 1, 1]) * t + c[i, e, 0, 1],
        ((c[i, e, 3, 2] * t + c[i, e, 2, 2]) * t + c[i, e, 1, 2]) * t + c[i, e, 0, 2],
        ((c[i, e, 3, 3] * t + c[i, e, 2, 3]) * t + c[i, e, 1, 3]) * t + c[i, e, 0, 3],
    )


@njit(cache=True, nogil=True, inline="always")
def bicubic_sum(
    net: Array, i: int, j: int, x: int, a: tuple[float, float, float, float], b: tuple[float, float, float, float]
) -> float:
    """Coordinate x of the sum of a[r] b[s] net[i + r, j + s] over the 4 x 4 active points."""
    k = j + 1
    m = j + 2
    o = j + 3
    return (
        a[0] * (b[0] * net[i, j, x] + b[1] * net[i, k, x] + b[2] * net[i, m, x] + b[3] * net[i, o, x])
        + a[1] * (b[0] * net[i + 1, j, x] + b[1] * net[i + 1, k, x] + b[2] * net[i + 1, m, x] + b[3] * net[i + 1, o, x])
        + a[2] * (b[0] * net[i + 2, j, x] + b[1] * net[i + 2, k, x] + b[2] * net[i + 2, m, x] + b[3] * net[i + 2, o, x])
        + a[3] * (b[0] * net[i + 3, j, x] + b[1] * net[i + 3, k, x] + b[2] * net[i + 3, m, x] + b[3] * net[i + 3, o, x])
    )


@kernel
def bicubic_points(U: Array, V: Array, net: Array, u: Array, v: Array, out: Array) -> None:
    """out (k, 3) = points of a rational bicubic net (n, m, 4) at the parameters u, v, each (k,): the case that is asked
    for most."""
    n = net.shape[0]
    m = net.shape[1]
    table_u = cubic_table(U, n, 0, 0)
    table_v = cubic_table(V, m, 0, 0)
    spans_u, scale_u = span_table(U, 3, n, u.shape[0])
    spans_v, scale_v = span_table(V, 3, m, u.shape[0])
    for k in range(u.shape[0]):
        i = near_span(U, 3, spans_u, scale_u, u[k])
        j = near_span(V, 3, spans_v, scale_v, v[k])
        a = cubic_basis(table_u, 0 if u[k] == U[i + 1] else i, 0, (u[k] - U[i]) / (U[i + 1] - U[i]))
        b = cubic_basis(table_v, 0 if v[k] == V[j + 1] else j, 0, (v[k] - V[j]) / (V[j + 1] - V[j]))
        scale = 1.0 / bicubic_sum(net, i - 3, j - 3, 3, a, b)
        out[k, 0] = scale * bicubic_sum(net, i - 3, j - 3, 0, a, b)
        out[k, 1] = scale * bicubic_sum(net, i - 3, j - 3, 1, a, b)
        out[k, 2] = scale * bicubic_sum(net, i - 3, j - 3, 2, a, b)


@inner
def general_sums(
    U: Array, p: int, i: int, u: float, V: Array, q: int, j: int, v: float, net: Array,
    a: tuple[int, int], b: tuple[int, int], rows_u: Array, rows_v: Array, sums: Array,
) -> None:  # fmt: skip
    """sums[e, f, :] = derivative (e, f) of the net's sum at (u, v) in span (i, j), for e in range(*a) and f in
    range(*b)."""
    d = net.shape[2]
    for e in range(a[0], a[1]):
        basis_row(U, p, i, u, e, rows_u, e)
    for f in range(b[0], b[1]):
        basis_row(V, q, j, v, f, rows_v, f)
    for f in range(b[0], b[1]):
        for e in range(a[0], a[1]):
            for x in range(d):
                sums[e, f, x] = 0.0
        for r in range(p + 1):
            for x in range(d):
                total = 0.0
                for s in range(q + 1):
                    total += rows_v[f, s] * net[i - p + r, j - q + s, x]
                for e in range(a[0], a[1]):
                    sums[e, f, x] += rows_u[e, r] * total


@inner
def quotient(sums: Array, a1: int, b1: int, binomial: Array) -> None:
    """Turn homogeneous derivatives sums[e, f, 0..3] into those of the quotient, in place (4.20)."""
    scale = 1.0 / sums[0, 0, 3]
    for e in range(a1):
        for f in range(b1):
            for g in range(e + 1):
                for h in range(f + 1):
                    if g + h > 0:
                        c = binomial[e, g] * binomial[f, h] * sums[g, h, 3]
                        for x in range(3):
                            sums[e, f, x] -= c * sums[e - g, f - h, x]
            for x in range(3):
                sums[e, f, x] *= scale


@kernel
def scattered(
    U: Array, p: int, V: Array, q: int, net: Array, u: Array, v: Array, lowest: tuple[int, int],
    order: tuple[int, int], out: Array,
) -> None:  # fmt: skip
    """out (k, a, b, 3) = derivatives of orders lowest..order in u and v at the scattered parameters (u, v), each (k,).

    A net of (n, m, 4) is homogeneous: the quotient rule (4.20) then needs all lower orders, which are worked out on
    the way.
    """
    n = net.shape[0]
    m = net.shape[1]
    rational = net.shape[2] == 4
    cubic = p == 3 and q == 3
    a0 = 0 if rational else lowest[0]
    b0 = 0 if rational else lowest[1]
    a1 = order[0] + 1
    b1 = order[1] + 1
    rows_u = np.empty((a1, p + 1))
    rows_v = np.empty((b1, q + 1))
    sums = np.empty((a1, b1, 4))
    table_u = cubic_table(U, n if cubic else 0, a0, order[0])
    table_v = cubic_table(V, m if cubic else 0, b0, order[1])
    binomial = np.zeros((max(a1, b1), max(a1, b1)))
    for e in range(max(a1, b1)):
        binomial[e, 0] = 1.0
        for f in range(1, e + 1):
            binomial[e, f] = binomial[e - 1, f - 1] + binomial[e - 1, f]
    spans_u, scale_u = span_table(U, p, n, u.shape[0])
    spans_v, scale_v = span_table(V, q, m, u.shape[0])
    for k in range(u.shape[0]):
        i = near_span(U, p, spans_u, scale_u, u[k])
        j = near_span(V, q, spans_v, scale_v, v[k])
        if cubic:
            t_u = (u[k] - U[i]) / (U[i + 1] - U[i])
            t_v = (v[k] - V[j]) / (V[j + 1] - V[j])
            i_table = 0 if u[k] == U[i + 1] else i
            j_table = 0 if v[k] == V[j + 1] else j
            for e in range(a0, a1):
                a = cubic_basis(table_u, i_table, e - a0, t_u)
                for f in range(b0, b1):
                    b = cubic_basis(table_v, j_table, f - b0, t_v)
                    sums[e, f, 0] = bicubic_sum(net, i - 3, j - 3, 0, a, b)
                    sums[e, f, 1] = bicubic_sum(net, i - 3, j - 3, 1, a, b)
                    sums[e, f, 2] = bicubic_sum(net, i - 3, j - 3, 2, a, b)
                    if rational:
                        sums[e, f, 3] = bicubic_sum(net, i - 3, j - 3, 3, a, b)
        else:
            general_sums(U, p, i, u[k], V, q, j, v[k], net, (a0, a1), (b0, b1), rows_u, rows_v, sums)
        if rational:
            quotient(sums, a1, b1, binomial)
        for e in range(lowest[0], a1):
            for f in range(lowest[1], b1):
                for c in range(3):
                    out[k, e - lowest[0], f - lowest[1], c] = sums[e, f, c]


@kernel
def refine(U: Array, p: int, net: Array, X: Array, a: int, b: int) -> tuple[Array, Array]:
    """Insert the sorted knots X into a net of (n, c): the new knots and net (A5.4; every step a convex combination).

    a is the span of the first new knot, b the one after the span of the last.
    """
    n = net.shape[0]
    c = net.shape[1]
    r = X.shape[0]
    size = U.shape[0]
    Q = np.empty((n + r, c))
    T = np.empty(size + r)
    for k in range(a - p + 1):
        for x in range(c):
            Q[k, x] = net[k, x]
    for k in range(b - 1, n):
        for x in range(c):
            Q[k + r, x] = net[k, x]
    for k in range(a + 1):
        T[k] = U[k]
    for k in range(b + p, size):
        T[k + r] = U[k]
    i = b + p - 1
    k = b + p + r - 1
    for j in range(r - 1, -1, -1):
        while X[j] <= U[i] and i > a:
            for x in range(c):
                Q[k - p - 1, x] = net[i - p - 1, x]
            T[k] = U[i]
            k -= 1
            i -= 1
        for x in range(c):
            Q[k - p - 1, x] = Q[k - p, x]
        for s in range(1, p + 1):
            at = k - p + s
            share = T[k + s] - X[j]
            if share == 0.0:
                for x in range(c):
                    Q[at - 1, x] = Q[at, x]
            else:
                share /= T[k + s] - U[i - p + s]
                for x in range(c):
                    Q[at - 1, x] = share * Q[at - 1, x] + (1.0 - share) * Q[at, x]
        T[k] = X[j]
        k -= 1
    return T, Q
