"""Four-sided regions: what is given a new parametrisation, a whole surface or a trimmed face with four sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.reparam.defect import NO_LENGTH
from patchwright.reparam.parameter_curves import ParameterCurve
from patchwright.reparam.sides import ArcSide, straight

Curves = tuple[ParameterCurve, ParameterCurve, ParameterCurve, ParameterCurve]
"""South, north, west, east."""


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """A piece of a surface between four sides: south and north along s, west and east along t.

    `whole` says that the sides are the borders of the `box` of parameters, so that lines of the domain may be kept.
    """

    surface: NurbsSurface
    sides: tuple[ArcSide, ArcSide, ArcSide, ArcSide]
    box: Array
    """(2, 2) [[u0, u1], [v0, v1]] round the sides."""
    whole: bool
    size: float
    name: str = ""

    @classmethod
    def of_surface(cls, surface: NurbsSurface, box: Array | None = None, name: str = "") -> Region:
        """The whole surface, or its part on a box of parameters.

        Raises
        ------
        ParameterError : two opposite sides are poles, or two that meet: there is no direction to run through.
        """
        limits = np.array(surface.domain if box is None else box, dtype=np.float64)
        (u0, u1), (v0, v1) = limits
        curves = (
            straight((u0, v0), (u1, v0)),
            straight((u0, v1), (u1, v1)),
            straight((u0, v0), (u0, v1)),
            straight((u1, v0), (u1, v1)),
        )
        return cls._of(surface, curves, limits, whole=True, name=name)

    @classmethod
    def of_sides(
        cls,
        surface: NurbsSurface,
        curves: Curves,
        name: str = "",
    ) -> Region:
        """The region between south, north, west and east, which meet in four corners.

        Raises
        ------
        ParameterError : as above.
        """
        at = np.concatenate([c(np.linspace(*c.domain, 129)) for c in curves])
        low, high = np.array(surface.domain).T
        at = np.clip(at, low, high)
        box = np.stack((at.min(axis=0), at.max(axis=0)), axis=1)
        on_box = all(
            float(np.ptp(np.clip(c(np.linspace(*c.domain, 33)), low, high)[:, axis])) <= 1e-9 * np.ptp(box[axis])
            for c, axis in zip(curves, (1, 1, 0, 0), strict=True)
        )
        if on_box and _upright(curves):
            return cls.of_surface(surface, box, name)
        return cls._of(surface, curves, box, whole=False, name=name)

    @classmethod
    def _of(cls, surface: NurbsSurface, curves: Curves, box: Array, *, whole: bool, name: str) -> Region:
        inner = surface.grid(*np.linspace(box[:, 0], box[:, 1], 17).T)
        size = float(np.linalg.norm(np.ptp(inner.reshape(-1, 3), axis=0)))
        where = f"{name}: " if name else ""
        if not size > 0.0:
            raise ParameterError(f"{where}the surface is a single point: there is nothing to give parameters to")
        for axis in (0, 1):
            if float(np.linalg.norm(np.diff(inner, axis=axis), axis=2).sum(axis=axis).max()) <= NO_LENGTH * size:
                raise ParameterError(f"{where}no extent along {'uv'[axis]}: this is a curve, not a surface")
        south, north, west, east = (ArcSide.of(surface, c, size) for c in curves)
        if (south.is_pole or north.is_pole) and (west.is_pole or east.is_pole):
            raise ParameterError(
                f"{where}two sides that meet have no length; leave out the one that is no side, or split the surface"
            )
        return cls(surface, (south, north, west, east), box, whole, size, name)

    @property
    def label(self) -> str:
        """The name with a colon, for sentences."""
        return f"{self.name}: " if self.name else ""


def _upright(curves: Curves) -> bool:
    """Whether s runs along u and t along v, both forwards."""
    south, north, west, east = (c(np.array(c.domain)) for c in curves)
    forward = all(c[1, 0] > c[0, 0] for c in (south, north)) and all(c[1, 1] > c[0, 1] for c in (west, east))
    return bool(forward)
