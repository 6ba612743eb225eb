"""Curves in the parameters of a surface: NURBS curves, chains of them, and what lies on an analytic surface carried
over to its NURBS form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface
from patchwright.reparam.monotone_map import MonotoneMap

TABLE = 1025  # entries of a map between two parameters of the same circle


class ParameterCurve(Protocol):
    """A curve in the (u, v) plane."""

    @property
    def domain(self) -> tuple[float, float]:
        """(t0, t1)"""
        ...

    @property
    def breaks(self) -> Array:
        """Parameters between which it is smooth, both ends included."""
        ...

    def __call__(self, u: npt.ArrayLike, nu: int = 0) -> Array:
        """(..., 2) the point or the first derivative."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Curves head to tail as one, each on an interval of length 1."""

    links: tuple[ParameterCurve, ...]

    @property
    def domain(self) -> tuple[float, float]:
        """(0, number of links)"""
        return 0.0, float(len(self.links))

    @property
    def breaks(self) -> Array:
        """Those of all links, moved."""
        found = [k + (link.breaks - link.domain[0]) / np.ptp(link.domain) for k, link in enumerate(self.links)]
        return np.unique(np.concatenate(found))

    def __call__(self, u: npt.ArrayLike, nu: int = 0) -> Array:
        """(..., 2) the point or the first derivative, that of the later link at a joint."""
        t = np.asarray(u, dtype=np.float64)
        which = np.clip(np.floor(t), 0, len(self.links) - 1).astype(np.int64)
        out = np.empty((*t.shape, 2))
        for k, link in enumerate(self.links):
            own, (low, high) = which == k, link.domain
            at = np.clip(low + (high - low) * (t[own] - k), low, high)
            out[own] = link(at, nu) * (high - low) ** nu
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Backwards:
    """A curve run the other way over the same domain."""

    curve: ParameterCurve

    @property
    def domain(self) -> tuple[float, float]:
        """That of the curve."""
        return self.curve.domain

    @property
    def breaks(self) -> Array:
        """Mirrored."""
        return np.asarray(sum(self.domain) - self.curve.breaks[::-1])

    def __call__(self, u: npt.ArrayLike, nu: int = 0) -> Array:
        """(..., 2) the point or the first derivative."""
        t = np.clip(sum(self.domain) - np.asarray(u, dtype=np.float64), *self.domain)
        return self.curve(t, nu) * (-1.0) ** nu


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """A curve in the parameters of an analytic surface, in those of its NURBS form."""

    curve: ParameterCurve
    maps: tuple[MonotoneMap, MonotoneMap]

    @property
    def domain(self) -> tuple[float, float]:
        """That of the curve."""
        return self.curve.domain

    @property
    def breaks(self) -> Array:
        """Those of the curve."""
        return self.curve.breaks

    def __call__(self, u: npt.ArrayLike, nu: int = 0) -> Array:
        """(..., 2) the point or the first derivative."""
        at = self.curve(u)
        if nu == 0:
            return np.stack([m(at[..., k]) for k, m in enumerate(self.maps)], axis=-1)
        slope = self.curve(u, 1)
        return np.stack([slope[..., k] * m(at[..., k], 1) for k, m in enumerate(self.maps)], axis=-1)


def carrying(surface: Surface, form: NurbsSurface) -> tuple[MonotoneMap, MonotoneMap]:
    """From u and v of a bounded analytic surface to those of its NURBS form on the same domain.

    Both run through the same lines, so that each parameter maps on its own: by arc length along the longest of the
    lines.
    """
    maps = []
    for axis in (0, 1):
        (low, high), other = surface.domain[axis], surface.domain[1 - axis]
        across = np.linspace(*other, 9)
        t = np.linspace(low, high, TABLE)
        order = (1, 0) if axis == 0 else (0, 1)
        speeds = []
        for thing in (surface, form):
            d = thing(t[:, None], across[None], order) if axis == 0 else thing(across[None], t[:, None], order)
            speeds.append(np.linalg.norm(d, axis=2))
        line = int(np.argmax(speeds[0].sum(axis=0)))
        own, its = (s[:, line] for s in speeds)
        # the analytic lines run at constant speed; the form's arc length is integrated by its own derivative
        arc = _integral(form, axis, across[line], t)
        arc *= (high - low) / arc[-1]
        x = low + arc
        x[-1] = high
        slope = its * (high - low) / float(np.trapezoid(own, t))
        maps.append(MonotoneMap.hermite(x, t, (1.0 / slope[:-1], 1.0 / slope[1:])))
    return maps[0], maps[1]


def _integral(form: NurbsSurface, axis: int, value: float, t: Array) -> Array:
    """Arc length of a line of the form from its start to each of t."""
    line = form.iso_curve("u" if axis == 0 else "v", value)
    nodes, weights = np.polynomial.legendre.leggauss(5)
    half = 0.5 * np.diff(t)
    at = 0.5 * (t[1:] + t[:-1])[:, None] + half[:, None] * nodes
    return np.concatenate(([0.0], np.cumsum(half * (np.linalg.norm(line(at, 1), axis=2) @ weights))))
