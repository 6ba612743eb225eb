"""Degree elevation of B-spline nets by blossoms.

The new control point of degree p + 1 is the blossom of the raised polynomial at the new knots that follow it,
F(t_1, ..., t_{p+1}) = mean over i of f(t_1, ..., without t_i, ..., t_{p+1}), with f the blossom of the old one
(Ramshaw, Blossoms are polar forms, CAGD 6 (1989), 323-358; doi:10.1016/0167-8396(89)90032-0). The
polynomial is the one of the longest span under the new basis function, and the arguments furthest from it go first,
so that extrapolation stays small.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.knots import breaks, distinct, restrict


def elevated(degree: int, knots: Array, net: Array, times: int = 1) -> tuple[Array, Array]:
    """Knots and net (n, ...) of degree + times, clamped; each knot of the domain gains `times` copies."""
    knots, net = restrict(degree, knots, net, knots[degree], knots[-degree - 1])
    for step in range(times):
        knots, net = _elevated_once(degree + step, knots, net)
    return knots, net


def _elevated_once(p: int, U: Array, net: Array) -> tuple[Array, Array]:
    values, multiplicities = distinct(U)
    T = np.repeat(values, multiplicities + 1)
    count = T.shape[0] - p - 2
    span = _longest_span(p, U, T, count)
    after = np.arange(count)[:, None] + 1 + np.arange(p + 1)
    keep = np.array(
        [[k for k in range(p + 1) if k != i] for i in range(p + 1)]
    )  # the p arguments left without the i-th
    arguments = T[after][:, keep].reshape(-1, p)  # (count (p + 1), p)
    points = blossom(p, U, net.reshape(net.shape[0], -1), np.repeat(span, p + 1), arguments)
    return T, points.reshape(count, p + 1, *net.shape[1:]).mean(axis=1)


def _longest_span(p: int, U: Array, T: Array, count: int) -> IntArray:
    """(count,) the old knot index of the longest span under each new basis function."""
    ts = breaks(p, U)
    lengths = np.concatenate((np.diff(ts), np.zeros(p + 2)))
    first = np.searchsorted(ts, T[:count], side="left")
    last = np.searchsorted(ts, T[p + 2 :], side="left")
    windows = first[:, None] + np.arange(p + 2)
    windows = np.where(windows < last[:, None], windows, ts.shape[0] - 1)
    best = np.take_along_axis(windows, np.argmax(lengths[windows], axis=1)[:, None], axis=1)[:, 0]
    return np.asarray(np.searchsorted(U, ts[best], side="right") - 1, dtype=np.int64)


def blossom(p: int, U: Array, net: Array, span: IntArray, arguments: Array) -> Array:
    """(k, c) the blossoms of the polynomials on the non-empty spans (k,) at arguments (k, p), for a net of (n, c)."""
    middle = 0.5 * (U[span] + U[span + 1])
    order = np.argsort(-np.abs(arguments - middle[:, None]), axis=1, kind="stable")
    t = np.take_along_axis(arguments, order, axis=1)
    d = net[span[:, None] - p + np.arange(p + 1)]
    for r in range(1, p + 1):
        i = span[:, None] - p + r + np.arange(p + 1 - r)
        share = (t[:, r - 1, None] - U[i]) / (U[i + p + 1 - r] - U[i])
        d = (1.0 - share[..., None]) * d[:, :-1] + share[..., None] * d[:, 1:]
    return np.asarray(d[:, 0])
