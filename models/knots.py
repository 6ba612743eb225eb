"""Knot vectors: their checks, distinct knots and multiplicities, and the knots other representations need.

The domain of degree p on n control points is [U[p], U[n]]; knots need not be clamped. Inserting knots never changes
the shape. Letters follow Piegl and Tiller, The NURBS Book (2nd ed. 1997).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, IntArray, frozen
from patchwright.models.errors import KnotError, ParameterError

ROUND_OFF = 64.0 * float(np.finfo(np.float64).eps)  # of the largest knot: parameters this far outside are clamped


def checked_knots(degree: int, knots: npt.ArrayLike, count: int, name: str = "knots") -> Array:
    """A read-only copy of `knots` for `count` control points of `degree`.

    Raises
    ------
    KnotError : wrong length, NaN, decreasing, a multiplicity above degree + 1, or an empty domain.
    """
    U = frozen(knots, np.float64)
    p = int(degree)
    if p < 1:
        raise KnotError(f"the degree must be at least 1, got {degree}")
    if count < p + 1:
        raise KnotError(f"degree {p} needs at least {p + 1} control points, got {count}")
    if U.ndim != 1 or U.shape[0] != count + p + 1:
        raise KnotError(f"{name}: {count} control points of degree {p} need {count + p + 1} knots, got shape {U.shape}")
    if not np.isfinite(U).all():
        raise KnotError(f"{name}: a knot is not a finite number")
    if (U[1:] < U[:-1]).any():
        at = int(np.argmax(U[1:] < U[:-1]))
        raise KnotError(f"{name} decrease from {U[at]:.17g} to {U[at + 1]:.17g} at index {at + 1}")
    if (U[p + 1 :] == U[: -p - 1]).any():
        at = int(np.argmax(U[p + 1 :] == U[: -p - 1]))
        raise KnotError(f"{name}: knot {U[at]:.17g} has a multiplicity above degree + 1 = {p + 1}")
    if not U[p] < U[count]:
        raise KnotError(f"{name}: the domain [{U[p]:.17g}, {U[count]:.17g}] is empty")
    return U


def inside(domain: tuple[float, float], t: npt.ArrayLike, name: str = "u") -> Array:
    """`t` as float64, with round-off beyond the domain clamped.

    Raises
    ------
    ParameterError : a parameter is NaN or further outside; nothing is extrapolated.
    """
    values = np.asarray(t, dtype=np.float64)
    if not values.size:
        return values
    low, high = domain
    least, most = values.min(), values.max()
    if low <= least and most <= high:
        return values
    slack = ROUND_OFF * max(abs(low), abs(high))
    if not (low - slack <= least and most <= high + slack):
        worst = most if most > high else least
        raise ParameterError(f"parameter {name} = {worst:.17g} lies outside the domain [{low:.17g}, {high:.17g}]")
    return np.clip(values, low, high)


def between(breaks: Array, count: int) -> Array:
    """`count` parameters inside every span, in the middles of its equal parts."""
    steps = (np.arange(count) + 0.5) / count
    return np.asarray((breaks[:-1, None] + np.diff(breaks)[:, None] * steps).ravel())


def divided(breaks: Array, count: int) -> Array:
    """Every span cut into `count` equal parts: all their ends, the breaks among them."""
    steps = np.arange(count) / count
    return np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * steps).ravel(), breaks[-1])


def locked(values: Array) -> Array:
    """A read-only, contiguous, float64 view or copy: the one kind of array the kernels are compiled for."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.flags.writeable:
        array = array.view()
        array.flags.writeable = False
    return array


def distinct(knots: Array) -> tuple[Array, IntArray]:
    """Distinct knots and their multiplicities."""
    starts = np.concatenate(([0], np.flatnonzero(knots[1:] != knots[:-1]) + 1))
    return knots[starts], np.diff(np.append(starts, knots.shape[0]))


def breaks(degree: int, knots: Array) -> Array:
    """Distinct knots of the domain, its ends included."""
    inner = knots[degree : knots.shape[0] - degree]
    return inner[np.concatenate(([True], inner[1:] != inner[:-1]))]


def uniform_knots(degree: int, count: int) -> Array:
    """Clamped knots on [0, 1] with equal spans for `count` control points."""
    inner = np.linspace(0.0, 1.0, count - degree + 1)
    return np.concatenate((np.zeros(degree), inner, np.ones(degree)))


def bezier_knots(degree: int) -> Array:
    """The knots of one Bezier piece on [0, 1]."""
    return np.repeat([0.0, 1.0], degree + 1)


def greville(degree: int, knots: Array) -> Array:
    """(n,) Greville abscissae: means of `degree` consecutive inner knots."""
    windows = np.lib.stride_tricks.sliding_window_view(knots[1:-1], degree)
    return np.asarray(windows.mean(axis=1))


def missing(degree: int, knots: Array, values: npt.ArrayLike, multiplicity: int | None = None) -> Array:
    """Sorted knots to insert so that each of `values` has the multiplicity (None: the degree)."""
    wanted = np.unique(np.asarray(values, dtype=np.float64))
    have = np.searchsorted(knots, wanted, side="right") - np.searchsorted(knots, wanted, side="left")
    need = (degree if multiplicity is None else multiplicity) - have
    return np.repeat(wanted, np.maximum(need, 0))


def insert(degree: int, knots: Array, net: Array, values: npt.ArrayLike) -> tuple[Array, Array]:
    """Insert `values` into a net (n, ...) along its first axis: the new knots and net.

    Raises
    ------
    KnotError : a value outside the domain, or a multiplicity that would pass degree + 1 (degree for inner knots).
    """
    X = np.sort(np.asarray(values, dtype=np.float64).ravel())
    if not X.size:
        return knots, net
    p, n = degree, net.shape[0]
    low, high = knots[p], knots[n]
    if not (low <= X[0] and X[-1] <= high):
        raise KnotError(f"cannot insert knots [{X[0]:.17g}, {X[-1]:.17g}] outside the domain [{low:.17g}, {high:.17g}]")
    after = np.sort(np.concatenate((knots, X)))
    if (after[p:] == after[: after.shape[0] - p])[1:-1].any():
        at = 1 + int(np.argmax((after[p:] == after[: after.shape[0] - p])[1:-1]))
        if low < after[at] < high or (after[p + 1 :] == after[: -p - 1]).any():
            raise KnotError(f"inserting knot {after[at]:.17g} would raise its multiplicity above the degree {p}")
    from patchwright.models._nurbs_kernel import refine

    first, last = np.searchsorted(knots, X[[0, -1]], side="right")
    a, b = min(int(first) - 1, n - 1), min(int(last), n)
    new_knots, new_net = refine(locked(knots), p, locked(np.reshape(net, (n, -1))), locked(X), a, b)
    return new_knots, new_net.reshape((-1, *net.shape[1:]))


def restrict(degree: int, knots: Array, net: Array, low: float, high: float) -> tuple[Array, Array]:
    """The clamped piece on [low, high] of the domain, the shape kept: knots and net (n, ...)."""
    p = degree
    if not low < high:
        raise ParameterError(f"an interval must not be empty, got [{low:.17g}, {high:.17g}]")
    U, Q = insert(p, knots, net, missing(p, knots, (low, high)))
    first = int(np.searchsorted(U, low, side="right"))  # just after the last copy of low
    last = int(np.searchsorted(U, high, side="left"))  # the first copy of high
    Q = Q[first - p - 1 : last]
    return np.concatenate((np.full(p + 1, low), U[first:last], np.full(p + 1, high))), Q


def bezier_nets(degree: int, knots: Array, net: Array) -> tuple[Array, Array]:
    """Breaks (s + 1,) and the Bezier nets (s, degree + 1, ...) of the s spans."""
    p = degree
    ts = breaks(p, knots)
    U, Q = restrict(p, knots, net, ts[0], ts[-1])
    inner = missing(p, U, ts[1:-1]) if ts.shape[0] > 2 else ts[:0]
    U, Q = insert(p, U, Q, inner)
    first = np.searchsorted(U, ts[:-1], side="right") - p - 1
    return ts, Q[first[:, None] + np.arange(p + 1)]


def mirrored(knots: Array, low: float, high: float) -> Array:
    """The knots of the reversed parameter on the same domain; knots at an end of the domain stay exactly there."""
    back = (low + high) - knots[::-1]
    back[knots[::-1] == low] = high
    back[knots[::-1] == high] = low
    return np.maximum.accumulate(back)


def unrolled(degree: int, values: npt.ArrayLike, multiplicities: npt.ArrayLike, count: int) -> tuple[Array, IntArray]:
    """Full knots, and the indices of the `count` periodic control points to use with them.

    The convention is that of STEP, IGES readers and CAD kernels: distinct knots over one period, both ends included
    and of the same multiplicity k <= degree, count = the sum of all multiplicities but the last; the first control
    point belongs to the first basis function that is not zero on the first span.

    Raises
    ------
    KnotError : knots that do not increase, or multiplicities that do not fit.
    """
    t, k = np.asarray(values, dtype=np.float64), np.asarray(multiplicities, dtype=np.int64)
    p = int(degree)
    if t.ndim != 1 or t.shape[0] < 2 or k.shape != t.shape or not np.isfinite(t).all() or not (t[1:] > t[:-1]).all():
        raise KnotError("periodic knots must be distinct, finite and increasing, with one multiplicity each")
    if k[0] != k[-1] or k.min() < 1 or k.max() > p:
        raise KnotError(f"periodic multiplicities must lie in 1..{p} and agree at both ends, got {k.tolist()}")
    if int(k[:-1].sum()) != count:
        raise KnotError(
            f"{count} periodic control points need multiplicities that sum to {count}, got {int(k[:-1].sum())}"
        )
    period = t[-1] - t[0]
    one = np.repeat(t[:-1], k[:-1])  # the knots of one period
    need = p + 1 - int(k[0])
    turns = -(-need // count)
    before = np.concatenate([one - period * turn for turn in range(turns, 0, -1)])[-need:]
    start = np.repeat(t[1:], k[1:])  # the knots after the first, the last included
    beyond = np.concatenate([start + period * turn for turn in range(1, turns + 1)])[:need]
    full = np.concatenate((before, one, np.repeat(t[-1], k[-1]), beyond))
    return full, np.arange(full.shape[0] - p - 1) % count
