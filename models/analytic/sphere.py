"""`Sphere`: longitude and latitude."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy.typing as npt

from patchwright.models.analytic.arc import arc_net
from patchwright.models.analytic.frame import (
    TURN,
    Range,
    across,
    cosine,
    interval,
    point,
    positive,
    sine,
    unit,
)
from patchwright.models.analytic.revolution import ProfileNet, Revolution
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.knots import ROUND_OFF

LATITUDES = (-0.5 * math.pi, 0.5 * math.pi)


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Sphere(Revolution):
    """S(u, v) = center + radius (cos v (x cos u + y sin u) + z sin v); the normal S_u x S_v points outwards.

    Parameters
    ----------
    center : (3,)
    radius : positive
    axis : (3,) towards the pole v = pi/2, made unit: z
    xdir : (3,) where u = 0, made unit and square to the axis: x; None for a deterministic one; y = z cross x
    u : range of the longitude in radians, at most one turn; None for (0, 2 pi)
    v : range of the latitude in radians inside [-pi/2, pi/2]; None for all

    Raises
    ------
    ParameterError : a zero axis, a radius that is not positive, an empty or too long range.
    """

    center: Array
    radius: float
    axis: Array
    xdir: Array
    u: Range
    v: Range

    def __init__(
        self,
        center: npt.ArrayLike,
        radius: float,
        axis: npt.ArrayLike = (0.0, 0.0, 1.0),
        xdir: npt.ArrayLike | None = None,
        u: Range | None = None,
        v: Range | None = None,
    ) -> None:
        put = object.__setattr__
        put(self, "center", point(center, "center"))
        put(self, "radius", positive(radius, "radius"))
        put(self, "axis", unit(axis, "axis"))
        put(self, "xdir", across(self.axis, xdir))
        put(self, "u", interval(u, (0.0, TURN), "u", TURN))
        low, high = interval(v, LATITUDES, "v")
        if low < LATITUDES[0] * (1.0 + ROUND_OFF) or high > LATITUDES[1] * (1.0 + ROUND_OFF):
            raise ParameterError(f"latitudes must lie in [-pi/2, pi/2], got ({low:.17g}, {high:.17g})")
        put(self, "v", (max(low, LATITUDES[0]), min(high, LATITUDES[1])))

    @property
    def middle(self) -> Array:
        """(3,) the center."""
        return self.center

    def profile(self, v: Array, order: int) -> tuple[Array, Array]:
        """(..., 1) the derivatives of the given order of radius and height."""
        return self.radius * cosine(v, order), self.radius * sine(v, order)

    def profile_net(self) -> ProfileNet:
        """The profile: an arc of latitudes."""
        knots, net = arc_net(self.v)
        along = self.radius * net[:, :2] / net[:, 2:]
        return ProfileNet(2, knots, along[:, 0], along[:, 1], net[:, 2])
