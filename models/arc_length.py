"""Arc length of a curve and its inverse, with error control.

The spans are integrated and halved as `quadrature` does, so that cusps and unequal parametrisations cost only local
refinement. The accepted intervals are a table; lengths and parameters are looked up in it and finished by the same
rule, the inverse by Newton's method kept inside its interval. Kinks are at knots only, and so cost nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.knots import inside
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.quadrature import gauss, inverted, refined

CurveRate: TypeAlias = Callable[[NurbsCurve, Array], Array]


def speed(curve: NurbsCurve, t: Array) -> Array:
    """|C'| at parameters of any shape."""
    return np.asarray(np.linalg.norm(curve(t, 1), axis=-1))


@dataclass(frozen=True, slots=True, eq=False)
class ArcLength:
    """s(t) of a curve on [knots[0], knots[-1]] and its inverse."""

    curve: NurbsCurve
    knots: Array
    """(k + 1,) parameters between which one Gauss rule is accurate."""
    lengths: Array
    """(k + 1,) arc length from the start to each of them."""
    rate: CurveRate = speed
    """ds/dt: the speed, or a weighted speed where lengths are to count for more in some places."""

    @classmethod
    def of(
        cls,
        curve: NurbsCurve,
        accuracy: float = 1e-12,
        interval: tuple[float, float] | None = None,
        rate: CurveRate = speed,
    ) -> ArcLength:
        """The table to a relative accuracy of the total length.

        Raises
        ------
        ParameterError : an accuracy that is not in (0, 1), an empty interval.
        """
        if not 0.0 < accuracy < 1.0:
            raise ParameterError(f"the relative accuracy must lie in (0, 1), got {accuracy}")
        low, high = (float(t) for t in inside(curve.domain, curve.domain if interval is None else interval, "t"))
        if not low < high:
            raise ParameterError(f"an interval must not be empty, got [{low:.17g}, {high:.17g}]")
        ts = curve.breaks
        ts = np.concatenate(([low], ts[(ts > low) & (ts < high)], [high]))
        reach = float(np.abs(curve.control_points).max())  # derivatives are differences of numbers of this size
        found = refined(_clipped(curve, rate), ts, accuracy, noise=reach)
        return cls(curve, found.knots, np.concatenate(([0.0], np.cumsum(found.integrals))), rate)

    @property
    def total(self) -> float:
        """Length of the whole interval."""
        return float(self.lengths[-1])

    def __call__(self, t: npt.ArrayLike) -> Array:
        """Arc length from the start of the interval to parameters of any shape.

        Raises
        ------
        ParameterError : a parameter outside the interval.
        """
        at = inside((float(self.knots[0]), float(self.knots[-1])), t, "t")
        flat = at.ravel()
        k = np.clip(np.searchsorted(self.knots, flat, side="right") - 1, 0, self.knots.shape[0] - 2)
        part = gauss(_clipped(self.curve, self.rate), self.knots[k], flat)
        return np.asarray((self.lengths[k] + part).reshape(at.shape))

    def parameter(self, s: npt.ArrayLike) -> Array:
        """Parameters of any shape where the arc length from the start is s; the first of them where the curve stands
        still.

        Raises
        ------
        ParameterError : a length that is negative or beyond the total by more than round-off.
        """
        wanted = inside((0.0, self.total), s, "s")
        flat = wanted.ravel()
        rate = _clipped(self.curve, self.rate)
        k = np.clip(np.searchsorted(self.lengths, flat, side="left") - 1, 0, self.knots.shape[0] - 2)
        rest = flat - self.lengths[k]
        t = inverted(lambda _, at: rate(at), self.knots[k], self.knots[k + 1], rest)
        t = np.clip(t, self.knots[0], self.knots[-1])
        t[flat == self.total] = self.knots[-1]
        return t.reshape(wanted.shape)


def _clipped(curve: NurbsCurve, rate: CurveRate) -> Callable[[Array], Array]:
    low, high = curve.domain
    return lambda t: rate(curve, np.clip(t, low, high))
