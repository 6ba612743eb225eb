"""Distributions: increasing numbers from 0 to 1 that say how grid points spread along a side.

distribution("tanh", 41, first=1e-4)                   shares of the side's length
distribution("curvature", 41, curve=side)              denser where the side bends
DISTRIBUTIONS["tanh-both"].options                     what each of them takes

Sources: Vinokur, On one-dimensional stretching functions for finite-difference calculations, J. Comput. Phys. 50 (1983)
215-234 (tanh); Thompson, Warsi and Mastin, Numerical grid generation (1985) ch. VIII. Departure: Vinokur prescribes
the slope at an end, which a finite number of points meets only nearly; here the first and last steps themselves come
out as asked, to round-off. With r = sinh(d x) / sinh(d (1 - x)) his two-sided function is t / (1 - t) = r / A, so that
A and r at the first step follow from the two steps, and d from one monotone equation. Where the steps asked for are
wider than even ones, sinh becomes sin, as his.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from inspect import Parameter, signature
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_curve import NurbsCurve

Clustered = Literal["both", "start", "end"]


@dataclass(frozen=True, slots=True, eq=False)
class Distribution:
    """A named way of spreading points."""

    name: str
    spread: Callable[..., Array]  # (count, **options) -> (count,)

    @property
    def options(self) -> tuple[str, ...]:
        """Names of the options it takes."""
        return tuple(signature(self.spread).parameters)[1:]

    @property
    def required(self) -> tuple[str, ...]:
        """Those without a default."""
        found = signature(self.spread).parameters.values()
        return tuple(p.name for p in found if p.default is Parameter.empty)[1:]

    def __call__(self, count: int, **options: Any) -> Array:
        """(count,) numbers from exactly 0 to exactly 1.

        Raises
        ------
        ParameterError : fewer than two points, an option it does not have or misses, steps that cannot be met.
        """
        if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 2:
            raise ParameterError(f"a distribution needs a whole number of at least 2 points, got {count!r}")
        wrong = [f"has no option {name!r}" for name in options if name not in self.options]
        wrong += [f"needs the option {name!r}" for name in self.required if name not in options]
        if wrong:
            raise ParameterError(f"{self.name} {wrong[0]}; its options: {', '.join(self.options) or 'none'}")
        t = self.spread(int(count), **options)
        t[0], t[-1] = 0.0, 1.0
        if not (t[1:] > t[:-1]).all():
            at = int(np.argmin(t[1:] > t[:-1]))
            raise ParameterError(f"{self.name}: points {at} and {at + 1} fall together in double precision")
        return t


DISTRIBUTIONS: dict[str, Distribution] = {}
"""All distributions by name."""


def distribution(name: str, count: int, **options: Any) -> Array:
    """(count,) numbers from 0 to 1, spread as the named distribution does; see `Distribution.__call__`."""
    if name not in DISTRIBUTIONS:
        raise ParameterError(f"there is no distribution {name!r}; there are: {', '.join(DISTRIBUTIONS)}")
    return DISTRIBUTIONS[name](count, **options)


def _named(name: str) -> Callable[[Callable[..., Array]], Callable[..., Array]]:
    def register(spread: Callable[..., Array]) -> Callable[..., Array]:
        DISTRIBUTIONS[name] = Distribution(name, spread)
        return spread

    return register


@_named("uniform")
def uniform(count: int) -> Array:
    """Even steps."""
    return np.linspace(0.0, 1.0, count)


@_named("geometric")
def geometric(count: int, ratio: float | None = None, first: float | None = None, last: float | None = None) -> Array:
    """Each step `ratio` times the one before; or the ratio that gives the first, or the last, step its size."""
    given = [name for name, value in (("ratio", ratio), ("first", first), ("last", last)) if value is not None]
    if len(given) != 1:
        raise ParameterError(f"geometric takes one of ratio, first and last, got {' and '.join(given) or 'none'}")
    if last is not None:
        return np.asarray(1.0 - geometric(count, first=last)[::-1])
    n = count - 1
    if ratio is not None:
        if not (np.isfinite(ratio) and ratio > 0.0):
            raise ParameterError(f"the ratio of a geometric distribution must be positive and finite, got {ratio}")
        return _powers(float(np.log(ratio)), n)
    size = _step(first, "first", n)
    if n == 1:
        return np.array([0.0, 1.0])
    low, high = np.log1p(-size), -np.log(size) / (n - 1)  # the first step is above 1 - q and below q^(1 - n)
    return _powers(_root(lambda g: np.log(_powers(g, n)[1] / size), low, high), n)


@_named("tanh")
def tanh(count: int, first: float | None = None, last: float | None = None) -> Array:
    """Vinokur's one-sided function, with the first, or the last, step given."""
    if (first is None) == (last is None):
        raise ParameterError("tanh takes one of first and last; tanh-both takes both")
    if last is not None:
        return np.asarray(1.0 - tanh(count, first=last)[::-1])
    n = count - 1
    size = _step(first, "first", n)
    x = np.arange(count) / n
    if n == 1:
        return x
    high = 1.0 + np.log(4.0 / size) / (2.0 * (1.0 - x[1]))  # the first step is below 4 exp(-2 b (1 - x))
    b = _root(lambda b: np.log(_one_sided(x[1:2], b)[0] / size), -0.5 * np.pi, high)
    return _one_sided(x, b)


@_named("tanh-both")
def tanh_both(count: int, first: float, last: float | None = None) -> Array:
    """Vinokur's two-sided function, with the first and the last step given (last None: as the first)."""
    n = count - 1
    start = _step(first, "first", n)
    end = start if last is None else _step(last, "last", n)
    if n == 1:
        return np.array([0.0, 1.0])
    if n == 2 and abs(start + end - 1.0) > 1e-12:
        raise ParameterError(f"three points have two steps, whose sum is 1, got {start:g} and {end:g}")
    if n == 2:
        return np.array([0.0, start, 1.0])
    if start + end >= 1.0:
        raise ParameterError(f"the first and last steps must leave room for the others, got {start:g} and {end:g}")
    before, after = start / (1.0 - start), end / (1.0 - end)
    r, A = np.sqrt(before * after), np.sqrt(after / before)
    x = np.arange(count) / n
    high = -np.log(r) / (1.0 - 2.0 * x[1])  # r is below exp(-d (1 - 2 x))
    d = _root(lambda d: np.log(_sinh_ratio(x[1:2], d)[0] / r), -np.pi, high)
    odds = _sinh_ratio(x[1:-1], d)
    return np.concatenate(([0.0], odds / (A + odds), [1.0]))


@_named("cosine")
def cosine(count: int, clustered: Clustered = "both") -> Array:
    """The feet of even steps round a half circle (both ends) or a quarter (one end)."""
    x = np.linspace(0.0, 1.0, count)
    if clustered == "both":
        return np.asarray(np.sin(0.5 * np.pi * x) ** 2)
    if clustered == "start":
        return np.asarray(2.0 * np.sin(0.25 * np.pi * x) ** 2)
    if clustered == "end":
        return np.asarray(np.sin(0.5 * np.pi * x))
    raise ParameterError(f'clustered must be "both", "start" or "end", got {clustered!r}')


@_named("curvature")
def curvature(count: int, curve: NurbsCurve, share: float = 0.5) -> Array:
    """Shares of the arc length between which arc length and turning angle, mixed, grow evenly.

    Parameters
    ----------
    share : in [0, 1): of the points, how many follow the turning angle; the others follow the arc length. A curve
        that hardly turns gets even steps. Corners turn at one point, which no spacing resolves: they are not seen,
        split the curve there.
    """
    from patchwright.models.arc_length import ArcLength, speed
    from patchwright.models.strain_energy import turning

    if not 0.0 <= share < 1.0:
        raise ParameterError(f"the share of points that follow the curvature must lie in [0, 1), got {share}")
    arc = ArcLength.of(curve)
    if not arc.total > 0.0:
        raise ParameterError("a curve of no length has no shares of it")
    radius = arc.total / (2.0 * np.pi)
    angle = ArcLength.of(curve, 1e-9, rate=lambda c, t: radius * turning(c, t)).total
    weight = 0.0 if angle <= 1e-9 * arc.total else share / (1.0 - share) * arc.total / angle * radius
    mixed = ArcLength.of(curve, 1e-9, rate=lambda c, t: speed(c, t) + weight * turning(c, t))
    return np.asarray(arc(mixed.parameter(np.linspace(0.0, mixed.total, count))) / arc.total)


@_named("given")
def given(count: int, values: npt.ArrayLike) -> Array:
    """Increasing numbers of any range, brought to [0, 1]."""
    t = np.array(values, dtype=np.float64)
    if t.shape != (count,) or not np.isfinite(t).all() or not (t[1:] > t[:-1]).all():
        raise ParameterError(f"a given distribution must be {count} finite, increasing numbers, got shape {t.shape}")
    return np.asarray((t - t[0]) / (t[-1] - t[0]))


def _step(size: float | None, name: str, n: int) -> float:
    if size is None or not (0.0 < size < 1.0 or (n == 1 and size == 1.0)):
        raise ParameterError(f"the {name} step is a share of the whole length, between 0 and 1, got {size}")
    if n == 1 and size != 1.0:
        raise ParameterError(f"two points have one step, 1, so that the {name} one cannot be {size:g}")
    return float(size)


def _powers(growth: float, n: int) -> Array:
    """(n + 1,) sums of n steps that grow by exp(growth), over their whole."""
    i = np.arange(n + 1.0)
    if growth == 0.0:
        return i / n
    if growth < 0.0:
        return np.asarray(np.expm1(growth * i) / np.expm1(growth * n))
    return np.asarray(np.exp(growth * (i - n)) * np.expm1(-growth * i) / np.expm1(-growth * n))


def _one_sided(x: Array, b: float) -> Array:
    """1 + tanh(b (x - 1)) / tanh(b), without cancellation; b < 0 stands for tan and -b."""
    if b == 0.0:
        return x
    if b < 0.0:
        return np.asarray(np.sin(b * x) / (np.sin(b) * np.cos(b * (1.0 - x))))
    fall = np.exp(-2.0 * b * (1.0 - x))
    return np.asarray(2.0 * fall / (1.0 + fall) * np.expm1(-2.0 * b * x) / np.expm1(-2.0 * b))


def _sinh_ratio(x: Array, d: float) -> Array:
    """sinh(d x) / sinh(d (1 - x)) for 0 < x < 1; d < 0 stands for sin and -d."""
    if d == 0.0:
        return x / (1.0 - x)
    if d < 0.0:
        return np.asarray(np.sin(d * x) / np.sin(d * (1.0 - x)))
    return np.asarray(np.exp(d * (2.0 * x - 1.0)) * np.expm1(-2.0 * d * x) / np.expm1(-2.0 * d * (1.0 - x)))


def _root(f: Callable[[float], float], low: float, high: float) -> float:
    """The root of a falling function between two numbers that bracket it but for round-off."""
    from scipy.optimize import brentq

    if f(low) <= 0.0:
        return low
    if f(high) >= 0.0:
        return high
    return float(brentq(f, low, high, xtol=1e-300, rtol=4.0 * float(np.finfo(np.float64).eps)))
