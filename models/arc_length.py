"""Arc length of a curve and its inverse, with error control.

Every span is integrated by the 15-point Gauss-Legendre rule and halved until the halves agree with the whole, so
that cusps and unequal parametrisations cost only local refinement. The accepted intervals are a table; lengths and
parameters are looked up in it and finished by the same rule, the inverse by Newton's method kept inside its interval.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.knots import inside
from patchwright.models.nurbs_curve import NurbsCurve

NODES = 15
DEEPEST = 60  # halvings: below it an interval has no inner float64 parameter


@dataclass(frozen=True, slots=True, eq=False)
class ArcLength:
    """s(t) of a curve on [knots[0], knots[-1]] and its inverse."""

    curve: NurbsCurve
    knots: Array
    """(k + 1,) parameters between which one Gauss rule is accurate."""
    lengths: Array
    """(k + 1,) arc length from the start to each of them."""

    @classmethod
    def of(cls, curve: NurbsCurve, accuracy: float = 1e-12, interval: tuple[float, float] | None = None) -> ArcLength:
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
        a, b = ts[:-1], ts[1:]
        whole = _rule(curve, a, b)
        total = float(whole.sum())
        reach = float(np.abs(curve.control_points).max())
        done_at: list[Array] = []
        done: list[Array] = []
        for _ in range(DEEPEST):
            middle = 0.5 * (a + b)
            left, right = _rule(curve, a, middle), _rule(curve, middle, b)
            total += float((left + right - whole).sum())
            floor = 4.0 * float(np.finfo(np.float64).eps) * (total + reach)  # what round-off leaves of any interval
            share = np.maximum(
                (b - a) / (high - low), 2.0**-10
            )  # cusps need no less than a thousandth of the error each
            good = (
                (np.abs(left + right - whole) <= np.maximum(0.1 * accuracy * total * share, floor))
                | (middle <= a)
                | (middle >= b)
            )
            done_at += [a[good], middle[good]]
            done += [left[good], right[good]]
            a, middle, b = a[~good], middle[~good], b[~good]
            if not a.size:
                break
            a, b = np.concatenate((a, middle)), np.concatenate((middle, b))
            whole = np.concatenate((left[~good], right[~good]))
        else:
            done_at.append(a)
            done.append(whole)
        starts = np.concatenate(done_at)
        order = np.argsort(starts, kind="stable")
        steps = np.concatenate(done)[order]
        return cls(curve, np.append(starts[order], high), np.concatenate(([0.0], np.cumsum(steps))))

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
        return np.asarray((self.lengths[k] + _rule(self.curve, self.knots[k], flat)).reshape(at.shape))

    def parameter(self, s: npt.ArrayLike) -> Array:
        """Parameters of any shape where the arc length from the start is s; the first of them where the curve stands
        still.

        Raises
        ------
        ParameterError : a length that is negative or beyond the total by more than round-off.
        """
        wanted = inside((0.0, self.total), s, "s")
        flat = wanted.ravel()
        k = np.clip(np.searchsorted(self.lengths, flat, side="left") - 1, 0, self.knots.shape[0] - 2)
        start, low, high = self.knots[k], self.knots[k].copy(), self.knots[k + 1].copy()
        rest, step = flat - self.lengths[k], self.lengths[k + 1] - self.lengths[k]
        t = low + (high - low) * np.divide(rest, step, out=np.zeros_like(rest), where=step > 0.0)
        active = np.arange(flat.shape[0])
        for _ in range(2 * DEEPEST):
            if not active.size:
                break
            x = t[active]
            error = _rule(self.curve, start[active], x) - rest[active]
            speed = np.linalg.norm(self.curve(x, 1), axis=-1)
            low[active] = np.where(error < 0.0, x, low[active])
            high[active] = np.where(error > 0.0, x, high[active])
            move = np.divide(error, speed, out=np.full_like(error, np.inf), where=speed > 0.0)
            newton = x - move
            outside = ~((newton > low[active]) & (newton < high[active]))
            new = np.where(outside, 0.5 * (low[active] + high[active]), newton)
            new = np.where(error == 0.0, x, new)
            t[active] = new
            settled = (np.abs(new - x) <= 2.0 * np.spacing(np.abs(x))) | (error == 0.0)
            active = active[~settled]
        t = np.clip(t, self.knots[0], self.knots[-1])
        t[flat == self.total] = self.knots[-1]
        return t.reshape(wanted.shape)


@cache
def _gauss() -> tuple[Array, Array]:
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    return nodes, weights


def _rule(curve: NurbsCurve, a: Array, b: Array) -> Array:
    """Lengths between a and b, each (k,), by one Gauss rule; the knots between them must be none."""
    nodes, weights = _gauss()
    half = 0.5 * (b - a)
    at = np.clip(0.5 * (a + b)[:, None] + half[:, None] * nodes, *curve.domain)
    return np.asarray(half * (np.linalg.norm(curve(at, 1), axis=-1) @ weights))
