"""`Torus`: a circle turned about an axis in its plane."""

from __future__ import annotations

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


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Torus(Revolution):
    """S(u, v) = center + (major_radius + minor_radius cos v) (x cos u + y sin u) + minor_radius sin v z.

    The normal S_u x S_v points out of the tube. A minor radius at or above the major one gives a torus that meets
    itself.

    Parameters
    ----------
    center : (3,)
    axis : (3,), made unit: z
    major_radius, minor_radius : positive
    xdir : (3,) where u = 0, made unit and square to the axis: x; None for a deterministic one; y = z cross x
    u, v : ranges of the angles round the axis and round the tube in radians, at most one turn; None for (0, 2 pi)

    Raises
    ------
    ParameterError : a zero axis, a radius that is not positive, an empty or too long range.
    """

    center: Array
    axis: Array
    major_radius: float
    minor_radius: float
    xdir: Array
    u: Range
    v: Range

    def __init__(
        self,
        center: npt.ArrayLike,
        axis: npt.ArrayLike,
        major_radius: float,
        minor_radius: float,
        xdir: npt.ArrayLike | None = None,
        u: Range | None = None,
        v: Range | None = None,
    ) -> None:
        put = object.__setattr__
        put(self, "center", point(center, "center"))
        put(self, "axis", unit(axis, "axis"))
        put(self, "major_radius", positive(major_radius, "major_radius"))
        put(self, "minor_radius", positive(minor_radius, "minor_radius"))
        put(self, "xdir", across(self.axis, xdir))
        put(self, "u", interval(u, (0.0, TURN), "u", TURN))
        put(self, "v", interval(v, (0.0, TURN), "v", TURN))

    @property
    def middle(self) -> Array:
        """(3,) the center."""
        return self.center

    def profile(self, v: Array, order: int) -> tuple[Array, Array]:
        """(..., 1) the derivatives of the given order of radius and height."""
        away = self.major_radius if order == 0 else 0.0
        return away + self.minor_radius * cosine(v, order), self.minor_radius * sine(v, order)

    def profile_net(self) -> ProfileNet:
        """The profile: an arc round the tube."""
        knots, net = arc_net(self.v)
        along = self.minor_radius * net[:, :2] / net[:, 2:]
        return ProfileNet(2, knots, self.major_radius + along[:, 0], along[:, 1], net[:, 2])
