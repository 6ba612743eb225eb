"""The four sides of a surface, or of a trimmed face with four sides, run through by arc length.

A side is a curve in the parameters of the surface. South and north run along the first new parameter s, west and east
along the second, t; a side that is one point in space (a pole) keeps its own parameter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from patchwright.models.arc_length import ArcLength
from patchwright.models.arrays import Array
from patchwright.models.knots import bezier_knots, divided
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.reparam.defect import NO_LENGTH
from patchwright.reparam.monotone_map import MonotoneMap
from patchwright.reparam.parameter_curves import Chain, ParameterCurve

ACCURACY = 1e-10  # of the length of a side
PER_PIECE = 4  # entries of the table in a piece of the arc length's own
FEWEST_PIECES = 512
CROSSING_SAMPLES = 257
BISECTIONS = 52
MOST_CHORD_STEPS = 200
RELAXED = 0.8  # of the power that would do for straight lines: bends answer more strongly


@dataclass(frozen=True, slots=True, eq=False)
class CurveOnSurface:
    """A curve in the parameters of a surface as a curve in space: points and first derivatives."""

    surface: Surface
    pcurve: ParameterCurve

    @property
    def domain(self) -> tuple[float, float]:
        """That of the parameter curve."""
        return self.pcurve.domain

    @property
    def breaks(self) -> Array:
        """Those of the parameter curve, and where it crosses a knot line of the surface."""
        lines = getattr(self.surface, "breaks", None)
        found = [self.pcurve.breaks]
        for axis, line in enumerate(() if lines is None else lines):
            found.append(self._crossings(axis, line[1:-1]))
        return np.unique(np.concatenate(found))

    def _crossings(self, axis: int, line: Array) -> Array:
        """Parameters where a coordinate of the curve passes one of the values (k,), by bisection."""
        ts = np.linspace(*self.domain, CROSSING_SAMPLES)
        above = self.pcurve(ts)[:, axis, None] >= line
        k, which = np.nonzero(above[1:] != above[:-1])
        low, high, rising = ts[k], ts[k + 1], above[k + 1, which]
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            beyond = (self.pcurve(middle)[:, axis] >= line[which]) == rising
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        return np.asarray(high)

    @property
    def control_points(self) -> Array:
        """Points along it, for its size."""
        return self(np.linspace(*self.domain, 33))

    def parameters(self, t: npt.ArrayLike) -> Array:
        """(..., 2) in the domain of the surface, round-off beyond it cut."""
        low, high = np.array(self.surface.domain).T
        return np.asarray(np.clip(self.pcurve(t), low, high))

    def __call__(self, t: npt.ArrayLike, nu: int = 0) -> Array:
        """(..., 3) the point or the first derivative."""
        uv = self.parameters(t)
        u, v = uv[..., 0], uv[..., 1]
        if nu == 0:
            return np.asarray(self.surface(u, v))
        d = self.pcurve(t, 1)
        return np.asarray(d[..., :1] * self.surface(u, v, (1, 0)) + d[..., 1:] * self.surface(u, v, (0, 1)))


@dataclass(frozen=True, slots=True, eq=False)
class ArcSide:
    """One side by its arc share x in [0, 1]."""

    curve: CurveOnSurface
    length: float
    to_parameter: MonotoneMap | None
    """From arc share to the curve's parameter, a table; None at a pole."""
    to_share: MonotoneMap | None
    """Its inverse, to the accuracy of the table."""

    @classmethod
    def of(cls, surface: Surface, pcurve: ParameterCurve, size: float) -> ArcSide:
        """The side of a surface of the given size."""
        curve = CurveOnSurface(surface, pcurve)
        points = curve(np.linspace(*curve.domain, 65))
        if float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) <= NO_LENGTH * size:
            return cls(curve, 0.0, None, None)
        as_curve: Any = curve  # arc length takes whatever has points, derivatives and breaks
        arc = ArcLength.of(as_curve, ACCURACY)
        t = divided(arc.knots, max(PER_PIECE, -(-FEWEST_PIECES // (len(arc.knots) - 1))))
        x = arc(t) / arc.total
        x[0], x[-1] = 0.0, 1.0
        keep = np.append(np.flatnonzero(np.diff(np.maximum.accumulate(x)) > 1e-15), len(x) - 1)
        x, t = x[keep], t[keep]
        x[0] = 0.0
        inset = 1e-9 * np.diff(t)  # the speed may jump at a knot
        speed = [np.linalg.norm(curve(at, 1), axis=1) / arc.total for at in (t[:-1] + inset, t[1:] - inset)]
        with np.errstate(divide="ignore"):
            back = MonotoneMap.hermite(x, t, (1.0 / speed[0], 1.0 / speed[1]))
        return cls(curve, arc.total, back, MonotoneMap.hermite(t, x, (speed[0], speed[1])))

    @property
    def is_pole(self) -> bool:
        """Whether the side is one point."""
        return self.to_parameter is None

    def parameter(self, x: npt.ArrayLike) -> Array:
        """Parameters of the side's own curve at arc shares of any shape."""
        if self.to_parameter is None:
            t0, t1 = self.curve.domain
            return t0 + (t1 - t0) * np.asarray(x, dtype=np.float64)
        return self.to_parameter(x)

    def share(self, t: float) -> float:
        """The arc share of a parameter of the side's own curve."""
        if self.to_share is None:
            t0, t1 = self.curve.domain
            return (t - t0) / (t1 - t0)
        return float(self.to_share(t))

    @property
    def joints(self) -> Array:
        """(k,) arc shares where one edge of the side goes over into the next, perhaps with a corner."""
        links = len(self.curve.pcurve.links) if isinstance(self.curve.pcurve, Chain) else 1
        return np.array([self.share(float(k)) for k in range(1, links)])

    def uv(self, x: npt.ArrayLike) -> Array:
        """(..., 2) parameters of the surface."""
        return self.curve.parameters(self.parameter(x))

    def points(self, x: npt.ArrayLike) -> Array:
        """(..., 3)"""
        return self.curve(self.parameter(x))


def chord_places(side: ArcSide, steps: Array, ends: tuple[float, float] = (0.0, 1.0)) -> Array:
    """Arc shares (k + 1,) of points on the side whose chords are to each other as the parameter steps (k,).

    From one arc share to another. Each arc is scaled by what its chord is short of, again and again, from the equal
    arcs on; where that does not settle these are returned.
    """
    low, width = ends[0], ends[1] - ends[0]
    start = low + width * np.concatenate(([0.0], np.cumsum(steps) / steps.sum()))
    start[-1] = ends[1]
    if side.is_pole:
        return start
    x = start.copy()
    for _ in range(MOST_CHORD_STEPS):
        chords = np.linalg.norm(np.diff(side.points(x), axis=0), axis=1) / steps
        wanted = chords.mean()
        if np.abs(chords - wanted).max() <= 1e-12 * wanted:
            return x
        grown = np.diff(x) * np.clip(wanted / np.maximum(chords, 1e-300), 0.5, 2.0) ** RELAXED
        x[1:-1] = low + width * np.cumsum(grown)[:-1] / grown.sum()
    return x if np.abs(chords - wanted).max() <= 1e-4 * wanted else start


def straight(start: npt.ArrayLike, end: npt.ArrayLike) -> NurbsCurve:
    """The straight line between two places in the parameters, on [0, 1]."""
    return NurbsCurve(1, bezier_knots(1), np.array([start, end], dtype=np.float64))
