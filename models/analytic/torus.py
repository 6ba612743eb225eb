"""`Torus`: a circle turned about an axis in its plane."""

from __future__ import annotations

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
from patchwright.models.nurbs_surface import NurbsSurface


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Torus:
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
        out = (self.minor_radius * cosine(vs, b) + (self.major_radius if b == 0 else 0.0)) * ring
        if a == 0:
            out += self.minor_radius * sine(vs, b) * self.axis
        if (a, b) == (0, 0):
            out += self.center
        return out

    def to_nurbs(self) -> NurbsSurface:
        """The piece, rational biquadratic; the parameters agree at the knots."""
        (U, round_), (V, tube) = arc_net(self.u), arc_net(self.v)
        w = round_[:, 2:] * tube[:, 2]
        ring = (round_[:, :1] * self.xdir + round_[:, 1:2] * self.ydir) / round_[:, 2:]
        out = self.major_radius + self.minor_radius * tube[:, 0] / tube[:, 2]
        along = self.minor_radius * tube[:, 1] / tube[:, 2]
        points = self.center + out[:, None] * ring[:, None] + along[:, None] * self.axis
        return NurbsSurface((2, 2), (U, V), points, w)
