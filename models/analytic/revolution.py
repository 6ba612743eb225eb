"""What cylinder, cone, sphere and torus share: a profile turned about an axis."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from patchwright.models.analytic.arc import arc_net
from patchwright.models.analytic.frame import Range, bounded, cosine, parameters, sine
from patchwright.models.arrays import Array
from patchwright.models.nurbs_surface import NurbsSurface


class ProfileNet(NamedTuple):
    """The profile as a rational curve in (radius, height): each of the arrays (k,)."""

    degree: int
    knots: Array
    radius: Array
    height: Array
    weights: Array


class Revolution:
    """S(u, v) = middle + r(v) (x cos u + y sin u) + h(v) z with z along the axis, x along xdir, y = z cross x."""

    __slots__ = ()
    axis: Array
    xdir: Array
    u: Range
    v: Range

    @property
    def middle(self) -> Array:
        """(3,) the point of the axis at height 0."""
        raise NotImplementedError

    def profile(self, v: Array, order: int) -> tuple[Array, Array]:
        """(..., 1) the derivatives of the given order of radius and height."""
        raise NotImplementedError

    def profile_net(self) -> ProfileNet:
        """The bounded profile as a rational curve."""
        raise NotImplementedError

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
        radius, height = self.profile(vs, b)
        out = radius * (cosine(us, a) * self.xdir + sine(us, a) * self.ydir)
        if a == 0:
            out += height * self.axis
        if (a, b) == (0, 0):
            out += self.middle
        return np.asarray(out)

    def to_nurbs(self) -> NurbsSurface:
        """The bounded piece, rational quadratic in u; the parameters agree at the knots, a pole is one point repeated.

        Raises
        ------
        ParameterError : the piece is unbounded.
        """
        bounded(self.domain, type(self).__name__.lower())
        knots, net = arc_net(self.u)
        own = self.profile_net()
        ring = (net[:, :1] * self.xdir + net[:, 1:2] * self.ydir) / net[:, 2:]
        line = self.middle + own.height[:, None] * self.axis
        points = line + own.radius[:, None] * ring[:, None]
        return NurbsSurface((2, own.degree), (knots, own.knots), points, net[:, 2:] * own.weights)
