"""`Cone`: a line turned about an axis it meets."""

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
    unit,
)
from patchwright.models.analytic.revolution import ProfileNet, Revolution
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Cone(Revolution):
    """S(u, v) = origin + r(v) (x cos u + y sin u) + v z with r(v) = ref_radius + v tan(half_angle); both nappes belong.

    Where r(v) is negative the point lies on the second nappe, half a turn round.

    Parameters
    ----------
    origin : (3,) the point of the axis where v = 0
    axis : (3,), made unit: z
    half_angle : between axis and line, in radians, in (-pi/2, pi/2), not 0
    ref_radius : radius at the origin, at least 0
    xdir : (3,) where u = 0, made unit and square to the axis: x; None for a deterministic one; y = z cross x
    u : range of the angle in radians, at most one turn; None for (0, 2 pi)
    v : range of the distance along the axis; None for unbounded

    Raises
    ------
    ParameterError : a zero axis, a half angle or radius out of range, an empty or too long range.
    """

    origin: Array
    axis: Array
    half_angle: float
    ref_radius: float
    xdir: Array
    u: Range
    v: Range

    def __init__(
        self,
        origin: npt.ArrayLike,
        axis: npt.ArrayLike,
        half_angle: float,
        ref_radius: float = 0.0,
        xdir: npt.ArrayLike | None = None,
        u: Range | None = None,
        v: Range | None = None,
    ) -> None:
        put = object.__setattr__
        if not 0.0 < abs(half_angle) < 0.5 * math.pi:
            raise ParameterError(f"the half angle must lie between 0 and pi/2 in size, got {half_angle}")
        if not (math.isfinite(ref_radius) and ref_radius >= 0.0):
            raise ParameterError(f"the reference radius must be at least 0 and finite, got {ref_radius}")
        put(self, "origin", point(origin, "origin"))
        put(self, "axis", unit(axis, "axis"))
        put(self, "half_angle", float(half_angle))
        put(self, "ref_radius", float(ref_radius))
        put(self, "xdir", across(self.axis, xdir))
        put(self, "u", interval(u, (0.0, TURN), "u", TURN))
        put(self, "v", interval(v, (-math.inf, math.inf), "v"))

    @property
    def middle(self) -> Array:
        """(3,) the origin."""
        return self.origin

    @property
    def apex(self) -> Array:
        """(3,) where the radius is zero."""
        return np.asarray(self.origin - self.ref_radius / math.tan(self.half_angle) * self.axis)

    def radius(self, v: npt.ArrayLike) -> Array:
        """The signed radius at distances v along the axis."""
        return np.asarray(self.ref_radius + math.tan(self.half_angle) * np.asarray(v, dtype=np.float64))

    def profile(self, v: Array, order: int) -> tuple[Array, Array]:
        """(..., 1) the derivatives of the given order of radius and height."""
        along = line(v, order)
        return self.radius(along) if order == 0 else math.tan(self.half_angle) * along, along

    def profile_net(self) -> ProfileNet:
        """The bounded profile: a line that slopes."""
        return ProfileNet(1, np.repeat(self.v, 2), self.radius(self.v), np.array(self.v), np.ones(2))
