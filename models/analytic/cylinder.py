"""`Cylinder`: a line turned about an axis it is parallel to."""

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
    bounded,
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
class Cylinder:
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
    def ydir(self) -> Array:
        """(3,) where u is a quarter turn."""
        return np.cross(self.axis, self.xdir)

    @property
    def domain(self) -> tuple[Range, Range]:
        """((u0, u1), (v0, v1)); infinite where unbounded."""
        return self.u, self.v

    def __call__(self, u: npt.ArrayLike, v: npt.ArrayLike, nu: tuple[int, int] = (0, 0)) -> Array:
        """(..., 3) the mixed derivative of order `nu` at broadcast parameters."""
        us, vs = parameters(self.domain, u, v, nu)
        a, b = nu
        out = np.zeros((*us.shape, 3))
        if b == 0:
            out += self.radius * (cosine(us, a) * self.xdir + sine(us, a) * self.ydir)
        if a == 0 and b <= 1:
            out += self.origin + vs[..., None] * self.axis if b == 0 else self.axis
        return out

    def to_nurbs(self) -> NurbsSurface:
        """The bounded piece: rational quadratic in u, linear in v; the parameters agree at the knots.

        Raises
        ------
        ParameterError : the piece is unbounded.
        """
        bounded(self.domain, "cylinder")
        knots, net = arc_net(self.u)
        w = np.repeat(net[:, 2:], 2, axis=1)
        ring = (net[:, :1] * self.xdir + net[:, 1:2] * self.ydir) / net[:, 2:]
        line = self.origin + np.array(self.v)[:, None] * self.axis
        return NurbsSurface((2, 1), (knots, np.repeat(self.v, 2)), line + self.radius * ring[:, None], w)
