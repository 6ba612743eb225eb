"""What an intersection is made of: curves, isolated contacts, overlaps, and whether there is provably nothing else."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from patchwright.models.arrays import Array

if TYPE_CHECKING:
    from patchwright.models.nurbs_curve import NurbsCurve

CurveKind = Literal["transversal", "tangential", "overlap-boundary"]
ContactKind = Literal["touch", "branch", "near-miss", "crossing"]
Box = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, slots=True, eq=False)
class IntersectionCurve:
    """One branch: it runs from boundary to boundary, between branch points, or round a loop.

    Parameters
    ----------
    curve : in space
    uv_a, uv_b : in the parameters of the two surfaces, on the same parameter as `curve`; None on a mesh
    points : (n, 3) the refined points the curve was fitted to, or the polyline of a mesh
    kind : "transversal", "tangential" or "overlap-boundary"
    closed : whether it ends where it begins
    residual : largest distance between `curve`, `uv_a` on a and `uv_b` on b, on ten times more samples than the fit
        used; 0 for a mesh's polyline, whose points are exact to round-off
    surfaces : which two of the inputs meet
    """

    curve: NurbsCurve
    uv_a: NurbsCurve | None
    uv_b: NurbsCurve | None
    points: Array
    kind: CurveKind
    closed: bool
    residual: float
    surfaces: tuple[int, int] = (0, 1)


@dataclass(frozen=True, slots=True, eq=False)
class Contact:
    """A single point.

    Parameters
    ----------
    point : (3,) midway between the surfaces
    uv_a, uv_b : its parameters, None on a mesh
    kind : "touch" (isolated contact), "branch" (branches meet there), "near-miss" (the surfaces come this near and do
        not meet), "crossing" (three surfaces meet)
    gap : distance between the surfaces there
    surfaces : which of the inputs meet
    """

    point: Array
    uv_a: tuple[float, float] | None
    uv_b: tuple[float, float] | None
    kind: ContactKind
    gap: float
    surfaces: tuple[int, ...] = (0, 1)


@dataclass(frozen=True, slots=True, eq=False)
class Overlap:
    """A region in which two surfaces coincide, bounded by curves; `area` is that of the region on the first."""

    boundary: tuple[IntersectionCurve, ...]
    area: float
    surfaces: tuple[int, int] = (0, 1)


@dataclass(frozen=True, slots=True)
class Unresolved:
    """A pair of parameter boxes that could be neither excluded nor explained, and why."""

    box_a: Box
    box_b: Box
    reason: str
    surfaces: tuple[int, int] = (0, 1)


@dataclass(frozen=True, slots=True, eq=False)
class Intersection:
    """Everything two or more surfaces share.

    `complete` is True when it is proved that there is nothing else; otherwise `unresolved` says where doubt remains.
    """

    curves: tuple[IntersectionCurve, ...] = ()
    points: tuple[Contact, ...] = ()
    overlaps: tuple[Overlap, ...] = ()
    unresolved: tuple[Unresolved, ...] = field(default=())

    @property
    def complete(self) -> bool:
        """Whether nothing is left unresolved."""
        return not self.unresolved

    @property
    def length(self) -> float:
        """Total arc length of the curves."""
        return float(sum(c.curve.length() for c in self.curves))

    @property
    def residual(self) -> float:
        """The largest residual of the curves, 0 without curves."""
        return float(np.max([c.residual for c in self.curves])) if self.curves else 0.0
