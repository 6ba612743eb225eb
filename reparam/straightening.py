"""Parameters by mean arc length: each direction on its own, the bulk of a poor parametrisation taken out at once.

Where the speed of a surface is uneven the same way on all its lines (knots that do not fit the points, weights, control
points crowded at one end), two monotone maps of one variable even it out, however abrupt it is. What is left for the
points inside (see `placement`) is smooth, so that a coarse grid carries it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.knots import divided
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.reparam.defect import NO_LENGTH
from patchwright.reparam.monotone_map import MonotoneMap

LINES = 17  # lines of the mean
PER_SPAN = 8  # intervals of the table in a span to begin with
LARGEST_SHARE = 1 / 128  # of the length in one interval
ROUNDS = 40  # of halving
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True, slots=True, eq=False)
class Straightened:
    """The surface S(a(x), b(y)) on the unit square: points and first derivatives."""

    surface: NurbsSurface
    maps: tuple[MonotoneMap, MonotoneMap]
    """a and b, from arc share to parameter."""
    shares: tuple[MonotoneMap, MonotoneMap]
    """Their inverses, to the accuracy of the tables."""

    @classmethod
    def of(cls, surface: NurbsSurface, box: npt.ArrayLike | None = None) -> Straightened:
        """The part of the surface on a box ((u0, u1), (v0, v1)) of its domain, by default all of it.

        Raises
        ------
        ParameterError : the surface has no length in one direction: it is a curve or a point.
        """
        limits = np.asarray(surface.domain if box is None else box, dtype=np.float64)
        pairs = [_mean_share(surface, axis, limits) for axis in (0, 1)]
        return cls(surface, (pairs[0][0], pairs[1][0]), (pairs[0][1], pairs[1][1]))

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The unit square."""
        return (0.0, 1.0), (0.0, 1.0)

    def __call__(self, u: npt.ArrayLike, v: npt.ArrayLike, nu: tuple[int, int] = (0, 0)) -> Array:
        """(..., 3) the point, or the first derivative nu = (1, 0) or (0, 1)."""
        (a, b), out = self.maps, None
        out = self.surface(a(u), b(v), nu)
        if nu == (0, 0):
            return out
        return np.asarray(out * np.asarray(a(u, 1) if nu == (1, 0) else b(v, 1))[..., None])

    def parameters(self, at: Array) -> Array:
        """(..., 2) of the surface itself at (..., 2) of the unit square."""
        return np.stack([a(at[..., k]) for k, a in enumerate(self.maps)], axis=-1)

    def places(self, uv: Array) -> Array:
        """(..., 2) of the unit square at parameters (..., 2) of the surface."""
        return np.stack([s(uv[..., k]) for k, s in enumerate(self.shares)], axis=-1)

    def to_nurbs(self) -> Any:
        """Not to be had: the maps are no spline maps."""
        raise ParameterError("a straightened surface has no NURBS form")


def _mean_share(surface: NurbsSurface, axis: int, limits: Array) -> tuple[MonotoneMap, MonotoneMap]:
    """From mean arc share to the parameter of one direction, and back."""
    low, high = limits[axis]
    across = np.linspace(limits[1 - axis, 0], limits[1 - axis, 1], LINES)
    inner = surface.breaks[axis]
    ts = divided(np.concatenate(([low], inner[(inner > low) & (inner < high)], [high])), PER_SPAN)

    def speed(t: Array) -> Array:
        order = (1, 0) if axis == 0 else (0, 1)
        d = surface.grid(t, across, order) if axis == 0 else surface.grid(across, t, order).swapaxes(0, 1)
        return np.asarray(np.linalg.norm(d, axis=2))

    def lengths(a: Array, b: Array) -> Array:
        half = 0.5 * (b - a)
        at = 0.5 * (a + b)[:, None] + half[:, None] * NODES
        return np.asarray(half[:, None] * np.einsum("kgl,g->kl", speed(at.ravel()).reshape(*at.shape, LINES), WEIGHTS))

    steps = lengths(ts[:-1], ts[1:])
    for _ in range(ROUNDS):
        total = steps.sum(axis=0)
        lines = total > NO_LENGTH * total.max()
        if not lines.any():
            raise ParameterError(f"the surface has no extent along {'uv'[axis]}: it is a curve or a point")
        share = (steps[:, lines] / total[lines]).mean(axis=1)
        middle = 0.5 * (ts[:-1] + ts[1:])
        wide = (share > LARGEST_SHARE) & (middle > ts[:-1]) & (middle < ts[1:])
        if not wide.any():
            break
        at = np.flatnonzero(wide)
        steps = np.insert(steps, at + 1, 0.0, axis=0)
        rows = at + np.arange(len(at))
        steps[rows], steps[rows + 1] = lengths(ts[at], middle[at]), lengths(middle[at], ts[at + 1])
        ts = np.insert(ts, at + 1, middle[at])
    x = np.concatenate(([0.0], np.cumsum(share)))
    x /= x[-1]
    inset = 1e-9 * np.diff(ts)  # the slopes of an interval are those inside it: speed may jump at a knot
    slope = [(speed(t)[:, lines] / total[lines]).mean(axis=1) for t in (ts[:-1] + inset, ts[1:] - inset)]
    keep = np.flatnonzero(np.concatenate(([True], np.diff(x) > 1e-15)))  # where it stands still, the first counts
    first, last = slope[0][keep[:-1]], slope[1][keep[1:] - 1]
    x, ts = x[keep], np.append(ts[keep[:-1]], ts[-1])
    x[-1] = 1.0
    with np.errstate(divide="ignore"):
        return (
            MonotoneMap.hermite(x, ts, (1.0 / first, 1.0 / last)),
            MonotoneMap.hermite(ts, x, (first, last)),
        )
