"""`Plane`: origin + u x + v y."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from patchwright.models.analytic.frame import Range, across, bounded, interval, parameters, point, unit
from patchwright.models.arrays import Array
from patchwright.models.nurbs_surface import NurbsSurface

UNBOUNDED = (-math.inf, math.inf)


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Plane:
    """S(u, v) = origin + u x + v (z cross x) with z the unit normal and x the unit xdir; u, v are lengths.

    Parameters
    ----------
    origin : (3,)
    normal : (3,), made unit
    xdir : (3,) the direction of u, made unit and square to the normal; None for a deterministic one
    u, v : ranges (lo, hi); None for unbounded

    Raises
    ------
    ParameterError : a zero normal, an xdir along it, an empty range, numbers that are not finite.
    """

    origin: Array
    normal: Array
    xdir: Array
    u: Range
    v: Range

    def __init__(
        self,
        origin: npt.ArrayLike,
        normal: npt.ArrayLike,
        xdir: npt.ArrayLike | None = None,
        u: Range | None = None,
        v: Range | None = None,
    ) -> None:
        put = object.__setattr__
        put(self, "origin", point(origin, "origin"))
        put(self, "normal", unit(normal, "normal"))
        put(self, "xdir", across(self.normal, xdir))
        put(self, "u", interval(u, UNBOUNDED, "u"))
        put(self, "v", interval(v, UNBOUNDED, "v"))

    @property
    def ydir(self) -> Array:
        """(3,) the direction of v."""
        return np.cross(self.normal, self.xdir)

    @property
    def domain(self) -> tuple[Range, Range]:
        """((u0, u1), (v0, v1)); infinite where unbounded."""
        return self.u, self.v

    def __call__(self, u: npt.ArrayLike, v: npt.ArrayLike, nu: tuple[int, int] = (0, 0)) -> Array:
        """(..., 3) the mixed derivative of order `nu` at broadcast parameters."""
        us, vs = parameters(self.domain, u, v, nu)
        if nu == (0, 0):
            return np.asarray(self.origin + us[..., None] * self.xdir + vs[..., None] * self.ydir)
        value = {(1, 0): self.xdir, (0, 1): self.ydir}.get((int(nu[0]), int(nu[1])), np.zeros(3))
        return np.broadcast_to(value, (*us.shape, 3)).copy()

    def to_nurbs(self) -> NurbsSurface:
        """The bounded piece, bilinear, with the same parameters.

        Raises
        ------
        ParameterError : the piece is unbounded.
        """
        bounded(self.domain, "plane")
        corners = self(np.array(self.u)[:, None], np.array(self.v))
        return NurbsSurface((1, 1), (np.repeat(self.u, 2), np.repeat(self.v, 2)), corners)
