"""What every surface can do, whether analytic, NURBS or read from a file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy.typing as npt

from patchwright.models.arrays import Array

if TYPE_CHECKING:
    from patchwright.models.nurbs_surface import NurbsSurface


@runtime_checkable
class Surface(Protocol):
    """A parametric surface in R^3."""

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """((u0, u1), (v0, v1)); infinite where the surface is unbounded."""
        ...

    def __call__(self, u: npt.ArrayLike, v: npt.ArrayLike, nu: tuple[int, int] = (0, 0)) -> Array:
        """(..., 3) the mixed derivative of order `nu` at broadcast parameters."""
        ...

    def to_nurbs(self) -> NurbsSurface:
        """The same bounded piece as an exact NURBS surface."""
        ...
