"""Truncated Taylor series, vectorised over points: arrays (k + 1, n) of coefficients of (s - s_i)^j."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array


def product(a: Array, b: Array) -> Array:
    """The product."""
    out = np.zeros_like(a)
    for j in range(a.shape[0]):
        out[j] = np.einsum("in,in->n", a[: j + 1], b[j::-1])
    return out


def quotient(a: Array, b: Array) -> Array:
    """a / b, b[0] not zero."""
    out = np.zeros_like(a)
    for j in range(a.shape[0]):
        out[j] = (a[j] - np.einsum("in,in->n", out[:j], b[j:0:-1])) / b[0]
    return out


def root(a: Array) -> Array:
    """The square root, a[0] positive."""
    out = np.zeros_like(a)
    out[0] = np.sqrt(a[0])
    for j in range(1, a.shape[0]):
        out[j] = (a[j] - np.einsum("in,in->n", out[1:j], out[j - 1 : 0 : -1])) / (2.0 * out[0])
    return out


def angle(y: Array, x: Array) -> Array:
    """atan2(y, x), not both zero: (atan2)' = (x y' - y x') / (x^2 + y^2)."""
    order = np.arange(y.shape[0])[:, None]
    dx, dy = np.zeros_like(x), np.zeros_like(y)
    dx[:-1], dy[:-1] = (order * x)[1:], (order * y)[1:]
    slope = quotient(product(x, dy) - product(y, dx), product(x, x) + product(y, y))
    out = np.zeros_like(x)
    out[0] = np.arctan2(y[0], x[0])
    out[1:] = slope[:-1] / order[1:]
    return out
