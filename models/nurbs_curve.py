"""`NurbsCurve`: a rational or plain B-spline curve of any degree in any dimension (2-D curves in a (u, v) plane
included).

Reference: Piegl and Tiller, The NURBS Book, 2nd ed. 1997. Periodic curves are held unrolled, see `from_periodic`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import comb
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from patchwright.models import knots as knot_tools
from patchwright.models.arrays import Array, frozen
from patchwright.models.errors import ParameterError

if TYPE_CHECKING:
    from patchwright.models.closest_point import ClosestOnCurve


@dataclass(frozen=True, slots=True, eq=False)
class NurbsCurve:
    """A NURBS curve in R^d; its arrays are own, read-only copies.

    Parameters
    ----------
    degree : at least 1
    knots : (n + degree + 1,) non-decreasing, multiplicity at most degree + 1
    control_points : (n, d) in the model's unit
    weights : (n,) positive, or None for 1

    Raises
    ------
    KnotError : knots that do not fit; ParameterError : NaN or infinite points, weights that are not positive.
    """

    degree: int
    knots: Array
    control_points: Array
    weights: Array | None = None
    homogeneous: Array = field(init=False, repr=False)
    """(n, d) the control points, or (n, d + 1) their products with the weights and the weights."""

    def __post_init__(self) -> None:
        put = object.__setattr__
        points = frozen(self.control_points, np.float64)
        if points.ndim != 2 or points.shape[1] < 1:
            raise ParameterError(f"control points must be (n, d), got shape {points.shape}")
        if not np.isfinite(points).all():
            raise ParameterError(f"control point {int(np.argmin(np.isfinite(points).all(axis=1)))} is not finite")
        put(self, "degree", int(self.degree))
        put(self, "control_points", points)
        put(self, "knots", knot_tools.checked_knots(self.degree, self.knots, points.shape[0]))
        put(self, "homogeneous", points)
        if self.weights is not None:
            weights = checked_weights(self.weights, points.shape[:-1])
            put(self, "weights", weights)
            net = np.concatenate((points * weights[:, None], weights[:, None]), axis=1)
            net.flags.writeable = False
            put(self, "homogeneous", net)

    @classmethod
    def from_homogeneous(cls, degree: int, knots: Array, net: Array, *, rational: bool) -> NurbsCurve:
        """The curve of a net (n, d), or (n, d + 1) with w x, w y, ..., w when `rational`."""
        if not rational:
            return cls(degree, knots, net)
        return cls(degree, knots, net[:, :-1] / net[:, -1:], net[:, -1])

    @classmethod
    def from_periodic(
        cls,
        degree: int,
        values: npt.ArrayLike,
        multiplicities: npt.ArrayLike,
        control_points: npt.ArrayLike,
        weights: npt.ArrayLike | None = None,
    ) -> NurbsCurve:
        """The clamped, unrolled form of a periodic curve, over the period [values[0], values[-1]].

        Parameters
        ----------
        values, multiplicities : distinct knots of one period, both ends included, see `knots.unrolled`
        control_points, weights : (n, d) and (n,) or None, n = the sum of all multiplicities but the last

        Raises
        ------
        KnotError, ParameterError : as for a curve.
        """
        points = np.asarray(control_points, dtype=np.float64)
        knots, index = knot_tools.unrolled(degree, values, multiplicities, points.shape[0])
        w = None if weights is None else checked_weights(weights, points.shape[:1])[index]
        return cls(degree, knots, points[index], w).clamped()

    @property
    def rational(self) -> bool:
        """Whether the curve carries weights."""
        return self.weights is not None

    @property
    def dimension(self) -> int:
        """d of R^d."""
        return int(self.control_points.shape[1])

    @property
    def domain(self) -> tuple[float, float]:
        """(t0, t1)."""
        return float(self.knots[self.degree]), float(self.knots[-self.degree - 1])

    @property
    def breaks(self) -> Array:
        """Distinct knots of the domain, its ends included."""
        return knot_tools.breaks(self.degree, self.knots)

    def __call__(self, u: npt.ArrayLike, nu: int = 0) -> Array:
        """(..., d) the derivative of order `nu` at parameters of any shape.

        Raises
        ------
        ParameterError : a parameter outside the domain by more than round-off, or a negative order.
        """
        t = knot_tools.inside(self.domain, u)
        return np.asarray(self._jet(t.ravel(), nu)[-1].reshape(*t.shape, self.dimension))

    def derivatives(self, u: npt.ArrayLike, order: int) -> Array:
        """(order + 1, ..., d) the derivatives of orders 0..order at parameters of any shape."""
        t = knot_tools.inside(self.domain, u)
        return self._jet(t.ravel(), order).reshape(order + 1, *t.shape, self.dimension)

    def _jet(self, t: Array, order: int) -> Array:
        if order < 0:
            raise ParameterError(f"the order of a derivative must not be negative, got {order}")
        from patchwright.models._nurbs_kernel import banded_product, basis_table

        net = self.homogeneous
        first, rows = basis_table(self.knots, self.degree, knot_tools.locked(t), order)
        sums = [banded_product(first, row, net) for row in rows]
        if self.weights is None:
            return np.stack(sums)
        out: list[Array] = []
        w = sums[0][:, -1:]
        for k, total in enumerate(sums):
            value = total[:, :-1]
            for i in range(1, k + 1):
                value = value - comb(k, i) * sums[i][:, -1:] * out[k - i]  # 4.8
            out.append(value / w)
        return np.stack(out)

    def _of(self, knots: Array, net: Array, degree: int | None = None) -> NurbsCurve:
        return NurbsCurve.from_homogeneous(
            self.degree if degree is None else degree, knots, net, rational=self.rational
        )

    def insert_knots(self, ts: npt.ArrayLike) -> NurbsCurve:
        """The same curve with the knots `ts` (repeats allowed) inserted."""
        return self._of(*knot_tools.insert(self.degree, self.knots, self.homogeneous, ts))

    def restricted(self, t0: float, t1: float) -> NurbsCurve:
        """The clamped piece on [t0, t1]."""
        ends = knot_tools.inside(self.domain, (t0, t1), "t")
        return self._of(*knot_tools.restrict(self.degree, self.knots, self.homogeneous, ends[0], ends[1]))

    def clamped(self) -> NurbsCurve:
        """The same curve with full end multiplicities: it starts and ends at its first and last control points."""
        return self.restricted(*self.domain)

    def split(self, t: float) -> tuple[NurbsCurve, NurbsCurve]:
        """The pieces before and after t, clamped, on their parts of the domain."""
        t0, t1 = self.domain
        return self.restricted(t0, t), self.restricted(t, t1)

    def bezier_pieces(self) -> tuple[NurbsCurve, ...]:
        """One single-span curve per span, each on its part of the domain."""
        ts, nets = knot_tools.bezier_nets(self.degree, self.knots, self.homogeneous)
        ends = np.repeat(np.stack((ts[:-1], ts[1:]), axis=1), self.degree + 1, axis=1)
        return tuple(self._of(k, net) for k, net in zip(ends, nets, strict=True))

    def elevated(self, times: int = 1) -> NurbsCurve:
        """The same curve, clamped, with its degree raised."""
        from patchwright.models.degree_elevation import elevated

        knots, net = elevated(self.degree, self.knots, self.homogeneous, times)
        return self._of(knots, net, self.degree + times)

    def length(self, t0: float | None = None, t1: float | None = None, *, accuracy: float = 1e-12) -> float:
        """Arc length between two parameters (None: the domain's end), to the relative accuracy; negative where t1 <
        t0."""
        from patchwright.models.arc_length import ArcLength

        low, high = self.domain
        a, b = knot_tools.inside(self.domain, (low if t0 is None else t0, high if t1 is None else t1), "t")
        if a == b:
            return 0.0
        total = ArcLength.of(self, accuracy, (min(a, b), max(a, b))).total
        return total if a < b else -total

    def closest(self, points: npt.ArrayLike) -> ClosestOnCurve:
        """The closest points of the curve to (k, d) points, with a status each."""
        from patchwright.models.closest_point import closest_on_curve

        return closest_on_curve(self, points)

    def reversed(self) -> NurbsCurve:
        """The curve run backwards over the same domain."""
        t0, t1 = self.domain
        weights = None if self.weights is None else self.weights[::-1]
        return NurbsCurve(self.degree, knot_tools.mirrored(self.knots, t0, t1), self.control_points[::-1], weights)


def checked_weights(weights: npt.ArrayLike, shape: tuple[int, ...]) -> Array:
    """A read-only copy of positive, finite weights of the shape.

    Raises
    ------
    ParameterError : otherwise.
    """
    w = frozen(weights, np.float64)
    if w.shape != shape:
        raise ParameterError(f"weights must have the shape {shape}, got {w.shape}")
    if not (np.isfinite(w) & (w > 0.0)).all():
        bad = w.ravel()[int(np.argmin((np.isfinite(w) & (w > 0.0)).ravel()))]
        raise ParameterError(f"weights must be positive and finite, got {bad:.17g}")
    return w
