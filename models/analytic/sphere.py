"""`Sphere`: longitude and latitude."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from patchwright.models.analytic.arc import arc_net
from patchwright.models.analytic.frame import (
    TURN,
    Range,
    across,
    cosine,
    interval,
    parameters,
    point,
    positive,
    sine,
    unit,
)
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.knots import ROUND_OFF
from patchwright.models.nurbs_surface import NurbsSurface

LATITUDES = (-0.5 * math.pi, 0.5 * math.pi)


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Sphere:
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
    def ydir(self) -> Array:
        """(3,) where u is a quarter turn."""
        return np.cross(self.axis, self.xdir)

    @property
    def domain(self) -> tuple[Range, Range]:
        """((u0, u1), (v0, v1))."""
        return self.u, self.v

    def __call__(self, u: npt.ArrayLike, v: npt.ArrayLike, nu: tuple[int, int] = (0, 0)) -> Array:
        """(..., 3) the mixed derivative of order `nu` at broadcast parameters."""
        us, vs = parameters(self.domain, u, v, nu)
        a, b = nu
        ring = cosine(us, a) * self.xdir + sine(us, a) * self.ydir
        out = self.radius * cosine(vs, b) * ring
        if a == 0:
            out += self.radius * sine(vs, b) * self.axis
        if (a, b) == (0, 0):
            out += self.center
        return out

    def to_nurbs(self) -> NurbsSurface:
        """The piece, rational biquadratic; the parameters agree at the knots, a pole is one point repeated."""
        (U, round_), (V, up) = arc_net(self.u), arc_net(self.v)
        w = round_[:, 2:] * up[:, 2]
        ring = (round_[:, :1] * self.xdir + round_[:, 1:2] * self.ydir) / round_[:, 2:]
        out, along = up[:, 0] / up[:, 2], up[:, 1] / up[:, 2]
        points = self.center + self.radius * (out[:, None] * ring[:, None] + along[:, None] * self.axis)
        return NurbsSurface((2, 2), (U, V), points, w)
