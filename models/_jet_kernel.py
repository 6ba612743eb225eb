"""Kernels for all derivatives of a surface up to a total order of one or two at once.

A jet is S, S_u, S_v, S_uu, S_uv, S_vv, numbered 0 to 5. Sums over the net share their rows, and the quotient rule
(4.20 of The NURBS Book) is written out. Nets are homogeneous.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import inlined, kernel
from patchwright.models._nurbs_kernel import cubic_basis, cubic_table
from patchwright.models._span_kernel import near_span, span_table
from patchwright.models.arrays import Array, IntArray

Four = tuple[float, float, float, float]
Three = tuple[float, float, float]


@inlined
def along_row(net: Array, i: int, j: int, b: Four) -> Four:
    """The sum of b[s] net[i, j + s]."""
    k = j + 1
    m = j + 2
    o = j + 3
    return (
        b[0] * net[i, j, 0] + b[1] * net[i, k, 0] + b[2] * net[i, m, 0] + b[3] * net[i, o, 0],
        b[0] * net[i, j, 1] + b[1] * net[i, k, 1] + b[2] * net[i, m, 1] + b[3] * net[i, o, 1],
        b[0] * net[i, j, 2] + b[1] * net[i, k, 2] + b[2] * net[i, m, 2] + b[3] * net[i, o, 2],
        b[0] * net[i, j, 3] + b[1] * net[i, k, 3] + b[2] * net[i, m, 3] + b[3] * net[i, o, 3],
    )


@inlined
def across(a: Four, p: Four, q: Four, r: Four, s: Four) -> Four:
    """a[0] p + a[1] q + a[2] r + a[3] s."""
    return (
        a[0] * p[0] + a[1] * q[0] + a[2] * r[0] + a[3] * s[0],
        a[0] * p[1] + a[1] * q[1] + a[2] * r[1] + a[3] * s[1],
        a[0] * p[2] + a[1] * q[2] + a[2] * r[2] + a[3] * s[2],
        a[0] * p[3] + a[1] * q[3] + a[2] * r[3] + a[3] * s[3],
    )


@inlined
def first_order(jet: Array, S: Four, U: Four, V: Four) -> tuple[Three, Three, Three, float]:
    """jet[0..2] = the quotients of the sums and of their first derivatives, which are returned too, with 1 / w."""
    w = 1.0 / S[3]
    P = (S[0] * w, S[1] * w, S[2] * w)
    A = ((U[0] - U[3] * P[0]) * w, (U[1] - U[3] * P[1]) * w, (U[2] - U[3] * P[2]) * w)
    B = ((V[0] - V[3] * P[0]) * w, (V[1] - V[3] * P[1]) * w, (V[2] - V[3] * P[2]) * w)
    jet[0, 0] = P[0]
    jet[0, 1] = P[1]
    jet[0, 2] = P[2]
    jet[1, 0] = A[0]
    jet[1, 1] = A[1]
    jet[1, 2] = A[2]
    jet[2, 0] = B[0]
    jet[2, 1] = B[1]
    jet[2, 2] = B[2]
    return P, A, B, w


@inlined
def second_order(jet: Array, at: int, T: Four, wa: float, A: Three, wb: float, B: Three, P: Three, w: float) -> None:
    """jet[at] = a second derivative of the quotient, from that of the sums, T, and the lower quotients P, A, B."""
    jet[at, 0] = (T[0] - wa * A[0] - wb * B[0] - T[3] * P[0]) * w
    jet[at, 1] = (T[1] - wa * A[1] - wb * B[1] - T[3] * P[1]) * w
    jet[at, 2] = (T[2] - wa * A[2] - wb * B[2] - T[3] * P[2]) * w


@inlined
def kept(jet: Array, wanted: IntArray, out: Array, k: int) -> None:
    """out[k] = the wanted members of the jet."""
    for c in range(wanted.shape[0]):
        out[k, c, 0] = jet[wanted[c], 0]
        out[k, c, 1] = jet[wanted[c], 1]
        out[k, c, 2] = jet[wanted[c], 2]


@kernel
def bicubic_jets(U: Array, V: Array, net: Array, u: Array, v: Array, order: int, wanted: IntArray, out: Array) -> None:
    """out (k, c, 3) = the wanted members (c,) of the jets of a bicubic net (n, m, 4) at u, v, each (k,); order 1 or
    2."""
    n = net.shape[0]
    m = net.shape[1]
    jet = np.empty((6, 3))
    table_u = cubic_table(U, n, 0, order)
    table_v = cubic_table(V, m, 0, order)
    spans_u, scale_u = span_table(U, 3, n, u.shape[0])
    spans_v, scale_v = span_table(V, 3, m, u.shape[0])
    for k in range(u.shape[0]):
        i = near_span(U, 3, spans_u, scale_u, u[k])
        j = near_span(V, 3, spans_v, scale_v, v[k])
        t_u = (u[k] - U[i]) / (U[i + 1] - U[i])
        t_v = (v[k] - V[j]) / (V[j + 1] - V[j])
        row = 0 if u[k] == U[i + 1] else i
        column = 0 if v[k] == V[j + 1] else j
        i -= 3
        j -= 3
        a0 = cubic_basis(table_u, row, 0, t_u)
        a1 = cubic_basis(table_u, row, 1, t_u)
        b0 = cubic_basis(table_v, column, 0, t_v)
        b1 = cubic_basis(table_v, column, 1, t_v)
        p0 = along_row(net, i, j, b0)
        q0 = along_row(net, i + 1, j, b0)
        r0 = along_row(net, i + 2, j, b0)
        s0 = along_row(net, i + 3, j, b0)
        p1 = along_row(net, i, j, b1)
        q1 = along_row(net, i + 1, j, b1)
        r1 = along_row(net, i + 2, j, b1)
        s1 = along_row(net, i + 3, j, b1)
        H_u = across(a1, p0, q0, r0, s0)
        H_v = across(a0, p1, q1, r1, s1)
        P, A, B, w = first_order(jet, across(a0, p0, q0, r0, s0), H_u, H_v)
        if order == 2:
            a2 = cubic_basis(table_u, row, 2, t_u)
            b2 = cubic_basis(table_v, column, 2, t_v)
            second_order(jet, 3, across(a2, p0, q0, r0, s0), 2.0 * H_u[3], A, 0.0, A, P, w)
            second_order(jet, 4, across(a1, p1, q1, r1, s1), H_u[3], B, H_v[3], A, P, w)
            p2 = along_row(net, i, j, b2)
            q2 = along_row(net, i + 1, j, b2)
            r2 = along_row(net, i + 2, j, b2)
            s2 = along_row(net, i + 3, j, b2)
            second_order(jet, 5, across(a0, p2, q2, r2, s2), 2.0 * H_v[3], B, 0.0, B, P, w)
        kept(jet, wanted, out, k)


@kernel
def grid_jets(
    first_u: IntArray, rows_u: Array, first_v: IntArray, rows_v: Array, net: Array, wanted: IntArray, out: Array
) -> None:
    """out (k l, c, 3) = the wanted members (c,) of the jets on the tensor grid, v fastest, of a net (n, m, 4) cubic
    in v.

    rows_u (order + 1, k, p + 1) and rows_v (order + 1, l, 4) are the basis functions with their derivatives up to the
    order, 1 or 2.
    """
    order = rows_u.shape[0] - 1
    l_count = first_v.shape[0]
    m = net.shape[1]
    jet = np.empty((6, 3))
    line = np.empty((order + 1, m, 4))  # the net's sums along u, and their derivatives
    for k in range(first_u.shape[0]):
        for e in range(order + 1):
            for j in range(m):
                for x in range(4):
                    line[e, j, x] = 0.0
            for r in range(rows_u.shape[2]):
                b = rows_u[e, k, r]
                for j in range(m):
                    for x in range(4):
                        line[e, j, x] += b * net[first_u[k] + r, j, x]
        for j in range(l_count):
            at = first_v[j]
            b0 = (rows_v[0, j, 0], rows_v[0, j, 1], rows_v[0, j, 2], rows_v[0, j, 3])
            b1 = (rows_v[1, j, 0], rows_v[1, j, 1], rows_v[1, j, 2], rows_v[1, j, 3])
            H_u = along_row(line, 1, at, b0)
            H_v = along_row(line, 0, at, b1)
            P, A, B, w = first_order(jet, along_row(line, 0, at, b0), H_u, H_v)
            if order == 2:
                b2 = (rows_v[2, j, 0], rows_v[2, j, 1], rows_v[2, j, 2], rows_v[2, j, 3])
                second_order(jet, 3, along_row(line, 2, at, b0), 2.0 * H_u[3], A, 0.0, A, P, w)
                second_order(jet, 4, along_row(line, 1, at, b1), H_u[3], B, H_v[3], A, P, w)
                second_order(jet, 5, along_row(line, 0, at, b2), 2.0 * H_v[3], B, 0.0, B, P, w)
            kept(jet, wanted, out, k * l_count + j)
