"""`Cylinder`: a line turned about an axis it is parallel to."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from patchwright.models.analytic.frame import (
    TURN,
    Range,
    across,
    interval,
    line,
    point,
    positive,
    unit,
)
from patchwright.models.analytic.revolution import ProfileNet, Revolution
from patchwright.models.arrays import Array


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Cylinder(Revolution):
    """S(u, v) = origin + radius (x cos u + y sin u) + v z; the normal S_u x S_v points outwards.

    Parameters
    ----------
    origin : (3,) a point of the axis
    axis : (3,), made unit: z
    radius : positive
    xdir : (3,) where u = 0, made unit and square to the axis: x; None for a deterministic one; y = z cross x
    u : range of the angle in radians, at most one turn; None for (0, 2 pi)
    v : range of the distance along the axis; None for unbounded

    Raises
    ------
    ParameterError : a zero axis, a radius that is not positive, an empty or too long range.
    """

    origin: Array
    axis: Array
    radius: float
    xdir: Array
    u: Range
    v: Range

    def __init__(
        self,
        origin: npt.ArrayLike,
        axis: npt.ArrayLike,
        radius: float,
        xdir: npt.ArrayLike | None = None,
        u: Range | None = None,
        v: Range | None = None,
    ) -> None:
        put = object.__setattr__
        put(self, "origin", point(origin, "origin"))
        put(self, "axis", unit(axis, "axis"))
        put(self, "radius", positive(radius, "radius"))
        put(self, "xdir", across(self.axis, xdir))
        put(self, "u", interval(u, (0.0, TURN), "u", TURN))
        put(self, "v", interval(v, (-math.inf, math.inf), "v"))

    @property
    def middle(self) -> Array:
        """(3,) the origin."""
        return self.origin

    def profile(self, v: Array, order: int) -> tuple[Array, Array]:
        """(..., 1) the derivatives of the given order of radius and height."""
        return np.full((*v.shape, 1), self.radius if order == 0 else 0.0), line(v, order)

    def profile_net(self) -> ProfileNet:
        """The bounded profile: a line along the axis."""
        return ProfileNet(1, np.repeat(self.v, 2), np.full(2, self.radius), np.array(self.v), np.ones(2))
