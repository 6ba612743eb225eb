"""Integrals along a parameter by Gauss-Legendre rules of 15 points, halved where they are not accurate enough."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from patchwright.models.arrays import Array, IntArray

NODES = 15
DEEPEST = 60  # halvings: below it an interval has no inner float64 parameter
LEAST_SHARE = 2.0**-10  # of the error: no interval, however small, must do better than this

Rate = Callable[[Array], Array]
"""The integrand at parameters of any shape."""


class Refined(NamedTuple):
    """Intervals between `knots` (k + 1,), on each of which one rule is accurate, and their integrals."""

    knots: Array
    integrals: Array
    settled: bool
    """False where the rule was still moving when there was nothing left to halve, or was not finite."""


def gauss(rate: Rate, a: Array, b: Array) -> Array:
    """(..., k) integrals from a to b, each (k,), by one rule; the integrand must be smooth between them."""
    nodes, weights = _legendre()
    half = 0.5 * (b - a)
    return np.asarray(half * (rate(0.5 * (a + b)[:, None] + half[:, None] * nodes) @ weights))


def refined(rate: Rate, breaks: Array, accuracy: float, *, noise: float = 0.0, deepest: int = DEEPEST) -> Refined:
    """Integrals between the breaks (n + 1,) to an accuracy of their sum.

    Parameters
    ----------
    rate : not negative, smooth between the breaks but for isolated cusps
    accuracy : relative to the sum
    noise : what round-off leaves of the integral over any interval, over one unit of the integral
    """
    a, b = breaks[:-1], breaks[1:]
    width = float(breaks[-1] - breaks[0])
    whole = gauss(rate, a, b)
    total = float(whole.sum())
    starts: list[Array] = []
    done: list[Array] = []
    settled = True
    for _ in range(deepest):
        if not np.isfinite(whole).all():
            settled = False
            break
        middle = 0.5 * (a + b)
        left, right = gauss(rate, a, middle), gauss(rate, middle, b)
        error = np.abs(left + right - whole)
        total += float((left + right - whole).sum())
        floor = 4.0 * float(np.finfo(np.float64).eps) * (total + noise)
        share = np.maximum((b - a) / width, LEAST_SHARE)
        good = (error <= np.maximum(0.1 * accuracy * total * share, floor)) | (middle <= a) | (middle >= b)
        starts += [a[good], middle[good]]
        done += [left[good], right[good]]
        a, middle, b = a[~good], middle[~good], b[~good]
        if not a.size:
            break
        a, b = np.concatenate((a, middle)), np.concatenate((middle, b))
        whole = np.concatenate((left[~good], right[~good]))
    else:
        settled = False
    starts.append(a)
    done.append(whole if a.size else a)
    first = np.concatenate(starts)
    order = np.argsort(first, kind="stable")
    return Refined(np.append(first[order], breaks[-1]), np.concatenate(done)[order], settled)


def inverted(rate: Callable[[IntArray, Array], Array], a: Array, b: Array, wanted: Array) -> Array:
    """(k,) parameters t with the integral from a to t as wanted, each (k,), by Newton's method kept between a and b.

    Parameters
    ----------
    rate : the integrands numbered (j,) at parameters (j,) or (j, nodes); not negative, smooth from a to b, and their
        integral over the whole at least what is wanted
    """
    low, high = a.copy(), b.copy()
    t = np.where(wanted <= 0.0, a, 0.5 * (a + b))
    active = np.arange(a.shape[0])
    for _ in range(2 * DEEPEST):
        if not active.size:
            break
        x, live = t[active], active
        error = gauss(lambda at, live=live: rate(live, at), a[active], x) - wanted[active]  # type: ignore[misc]
        here = rate(active, x)
        low[active] = np.where(error < 0.0, x, low[active])
        high[active] = np.where(error > 0.0, x, high[active])
        move = np.divide(error, here, out=np.full_like(error, np.inf), where=here > 0.0)
        newton = x - move
        outside = ~((newton > low[active]) & (newton < high[active]))
        new = np.where(outside, 0.5 * (low[active] + high[active]), newton)
        new = np.where(error == 0.0, x, new)
        t[active] = new
        active = active[~((np.abs(new - x) <= 2.0 * np.spacing(np.abs(x))) | (error == 0.0))]
    return t


@cache
def _legendre() -> tuple[Array, Array]:
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    return nodes, weights
