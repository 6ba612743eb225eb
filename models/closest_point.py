"""Closest points on NURBS curves and surfaces, and their parameters (point inversion), vectorised over points.

The start is the nearest of a sampling of every span; up to two more samples among the nearest, none a neighbour of
another, are tried as well, for shapes that come close more than once. Damped Newton steps inside the domain finish
them and the closest foot wins. The answer is the global minimum wherever the sampling separates the shape's
branches; `samples` makes it denser.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.knots import between, locked
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface

STEPS = 60
CLOSED_SHARE = 1e-12  # of the size: opposite ends nearer than this are one seam
NEAREST = 12  # samples looked at per point


class Status(IntEnum):
    """How the search for one point ended."""

    CONVERGED = 0
    ON_BOUNDARY = 1
    NOT_CONVERGED = 2

    @property
    def sentence(self) -> str:
        """The reason in words."""
        return (
            "the foot is square below the point",
            "stopped on the boundary of the domain: the nearest point of the shape lies there, but not square below",
            f"did not settle in {STEPS} steps",
        )[self.value]


@dataclass(frozen=True, slots=True, eq=False)
class ClosestOnSurface:
    """One row per query point."""

    points: Array
    """(k, 3) feet on the surface."""
    distance: Array
    """(k,)"""
    u: Array
    """(k,)"""
    v: Array
    """(k,)"""
    status: IntArray
    """(k,) values of `Status`."""


@dataclass(frozen=True, slots=True, eq=False)
class ClosestOnCurve:
    """One row per query point."""

    points: Array
    """(k, d) feet on the curve."""
    distance: Array
    """(k,)"""
    t: Array
    """(k,)"""
    status: IntArray
    """(k,) values of `Status`."""


def closest_on_surface(
    surface: NurbsSurface, points: npt.ArrayLike, *, start: npt.ArrayLike | None = None, samples: int = 4
) -> ClosestOnSurface:
    """The closest points of a surface.

    Parameters
    ----------
    points : (k, 3)
    start : (k, 2) parameters to start from: only the minimum they lead to is found, several times faster; None for a
    search
    samples : per span and direction, for the search

    Raises
    ------
    ParameterError : points of another shape or not finite, starts outside the domain, samples below 1.
    """
    from patchwright.models._closest_kernel import polish

    queries = _checked(points, 3)
    box = np.array(surface.domain)
    size = _size(surface.control_points.reshape(-1, 3))
    closed = np.array([_is_closed(surface, axis, size) for axis in (0, 1)], dtype=np.int64)
    (p, q), (U, V) = surface.degree, surface.knots

    def finish(which: Array, uv: Array) -> tuple[Array, IntArray, Array, Array]:
        feet, status = polish(U, p, V, q, surface.homogeneous, locked(which), locked(uv), box, closed, size, STEPS)
        at = surface(feet[:, 0], feet[:, 1])
        return feet, status, at, np.linalg.norm(at - which, axis=1)

    if start is not None:
        uv = np.array(start, dtype=np.float64)
        if uv.shape != (queries.shape[0], 2) or not ((uv >= box[:, 0]) & (uv <= box[:, 1])).all():
            raise ParameterError(f"starts must be ({queries.shape[0]}, 2) parameters inside the domain, got {uv.shape}")
        feet, status, at, distance = finish(queries, uv)
        return ClosestOnSurface(at, distance, feet[:, 0], feet[:, 1], status)
    us, vs = (_samples(ts, samples) for ts in surface.breaks)
    us, vs = us[_kept(surface.grid(us, vs), size)], vs[_kept(surface.grid(us, vs).swapaxes(0, 1), size)]
    cells = surface.grid(us, vs).reshape(-1, 3)
    starts = _starts(cells, queries, (us.shape[0], vs.shape[0]), (bool(closed[0]), bool(closed[1])))
    parameters = np.stack(np.meshgrid(us, vs, indexing="ij"), axis=-1).reshape(-1, 2)
    feet, status, at, distance = finish(queries, parameters[starts[0]])
    for start_at in starts[1:]:
        again = np.flatnonzero(start_at >= 0)
        other = finish(queries[again], parameters[start_at[again]])
        better = _better(other[3], other[1], distance[again], status[again])
        for mine, theirs in zip((feet, status, at, distance), other, strict=True):
            mine[again[better]] = theirs[better]
    return ClosestOnSurface(at, distance, feet[:, 0], feet[:, 1], status)


def closest_on_curve(
    curve: NurbsCurve, points: npt.ArrayLike, *, start: npt.ArrayLike | None = None, samples: int = 8
) -> ClosestOnCurve:
    """The closest points of a curve in R^d.

    Parameters
    ----------
    points : (k, d)
    start : (k,) parameters to start from: only the minimum they lead to is found; None for a search
    samples : per span, for the search

    Raises
    ------
    ParameterError : points of another shape or not finite, starts outside the domain, samples below 1.
    """
    queries = _checked(points, curve.dimension)
    t0, t1 = curve.domain
    if start is not None:
        t = np.array(start, dtype=np.float64)
        if t.shape != queries.shape[:1] or not ((t >= t0) & (t <= t1)).all():
            raise ParameterError(f"starts must be ({queries.shape[0]},) parameters inside the domain, got {t.shape}")
        return _finish_on_curve(curve, queries, t)
    ts = _samples(curve.breaks, samples)
    size = _size(curve.control_points)
    closed = bool(np.linalg.norm(curve(t0) - curve(t1)) <= CLOSED_SHARE * size)
    starts = _starts(curve(ts), queries, (ts.shape[0], 1), (closed, False))
    one = _finish_on_curve(curve, queries, ts[starts[0]])
    for start_at in starts[1:]:
        again = np.flatnonzero(start_at >= 0)
        two = _finish_on_curve(curve, queries[again], ts[start_at[again]])
        better = _better(two.distance, two.status, one.distance[again], one.status[again])
        for name in ("points", "distance", "t", "status"):
            getattr(one, name)[again[better]] = getattr(two, name)[better]
    return one


def _finish_on_curve(curve: NurbsCurve, queries: Array, start: Array) -> ClosestOnCurve:
    t0, t1 = curve.domain
    width, size = t1 - t0, _size(curve.control_points)
    closed = bool(np.linalg.norm(curve(t0) - curve(t1)) <= CLOSED_SHARE * size)
    k = queries.shape[0]
    t, new = start.copy(), start.copy()
    best, slope, bend, speed = (np.full(k, np.inf) for _ in range(4))
    damping, trusted = np.zeros(k), np.zeros(k, dtype=bool)
    status = np.full(k, int(Status.NOT_CONVERGED))
    on = np.arange(k)
    for _ in range(STEPS):
        if not on.size:
            break
        c, d1, d2 = curve.derivatives(new[on], 2)
        r = c - queries[on]
        f = 0.5 * (r * r).sum(axis=1)
        good = (f <= best[on]) | trusted[on]
        won = on[good]
        best[won], t[won] = f[good], new[won]
        slope[won], speed[won] = (r * d1).sum(axis=1)[good], (d1 * d1).sum(axis=1)[good]
        bend[won] = speed[won] + (r * d2).sum(axis=1)[good]
        damping[won] = np.where(damping[won] > 1.0, 0.1 * damping[won], 0.0)
        lost = on[~good]
        damping[lost] = np.maximum(8.0 * damping[lost], 0.1)
        bowl = bend[on] > 0.0
        newton = (damping[on] == 0.0) & bowl
        floor = np.maximum(speed[on], 1e-12 * (size / width) ** 2)
        divisor = np.where(bowl, bend[on], speed[on] + 1e-10 * floor) + damping[on] * floor
        step = np.clip(-slope[on] / divisor, -0.5 * width, 0.5 * width)
        at = t[on] + step
        if closed:
            at = np.where(at < t0, at + width, np.where(at > t1, at - width, at))
        else:
            step = np.clip(at, t0, t1) - t[on]
        at = np.clip(at, t0, t1)
        move = np.sqrt(speed[on]) * np.abs(step)
        noise = 4e-15 * (size + np.sqrt(2.0 * best[on]))  # round-off of C' . (C - P)
        square = np.abs(slope[on]) <= noise * np.sqrt(speed[on])
        settled = ((move <= 1e-14 * size) & newton) | (np.abs(step) <= 1e-15 * width) | square
        at = np.where(square, t[on], at)
        new[on] = at
        trusted[on] = newton & (move <= 1e-6 * size)
        ends = on[settled]
        t[ends] = new[ends]
        edge = ((t[ends] <= t0) | (t[ends] >= t1)) & (not closed)
        oblique = np.abs(slope[ends]) > 1e-9 * np.sqrt(speed[ends]) * (np.sqrt(2.0 * best[ends]) + 1e-9 * size)
        status[ends] = np.where(edge & oblique, int(Status.ON_BOUNDARY), int(Status.CONVERGED))
        on = on[~settled]
    feet = curve(t)
    return ClosestOnCurve(feet, np.linalg.norm(feet - queries, axis=1), t, status)


def _checked(points: npt.ArrayLike, dimension: int) -> Array:
    queries = np.ascontiguousarray(points, dtype=np.float64)
    if queries.ndim != 2 or queries.shape[1] != dimension:
        raise ParameterError(f"points must be (k, {dimension}), got shape {queries.shape}")
    if not np.isfinite(queries).all():
        raise ParameterError(f"point {int(np.argmin(np.isfinite(queries).all(axis=1)))} is not finite")
    return queries


def _size(points: Array) -> float:
    """The diagonal of the box round control points; 1 for a single spot."""
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0


def _is_closed(surface: NurbsSurface, axis: int, size: float) -> bool:
    along = surface.breaks[1 - axis]
    along = np.sort(np.concatenate((along, 0.5 * (along[:-1] + along[1:]))))
    ends = np.array(surface.domain[axis])
    rows = surface.grid(ends, along) if axis == 0 else surface.grid(along, ends).swapaxes(0, 1)
    return bool(np.linalg.norm(rows[0] - rows[1], axis=1).max() <= CLOSED_SHARE * size)


def _samples(ts: Array, count: int) -> Array:
    """Parameters inside every span, `count` each, and both ends of the domain."""
    if count < 1:
        raise ParameterError(f"samples must be at least 1 per span, got {count}")
    return np.concatenate((ts[:1], between(ts, count), ts[-1:]))


def _kept(rows: Array, size: float) -> npt.NDArray[np.bool_]:
    """All rows of samples (k, l, 3) but those at an end that is one point: there the search would not know which way
    to go."""
    keep = np.ones(rows.shape[0], dtype=bool)
    keep[[0, -1]] = np.ptp(rows[[0, -1]], axis=1).max(axis=1) > CLOSED_SHARE * size
    return keep


def _starts(cells: Array, queries: Array, shape: tuple[int, int], closed: tuple[bool, bool]) -> list[IntArray]:
    """For each query the nearest sample, then the next nearest that is no neighbour of those before, or -1, up to
    three."""
    from scipy.spatial import cKDTree

    count = min(NEAREST, cells.shape[0])
    found = np.asarray(cKDTree(cells).query(queries, k=np.arange(1, count + 1))[1], dtype=np.int64)
    starts = [np.asarray(found[:, 0], dtype=np.int64)]
    apart = np.ones(found.shape, dtype=bool)
    for _ in range(2):
        last = starts[-1][:, None]
        near = last >= 0
        for index, at, size, wraps in (
            (found // shape[1], last // shape[1], shape[0], closed[0]),
            (found % shape[1], last % shape[1], shape[1], closed[1]),
        ):
            gap = np.abs(index - at)
            near = near & ((np.minimum(gap, size - gap) if wraps else gap) <= 2)
        apart &= ~near
        chosen = np.take_along_axis(found, np.argmax(apart, axis=1)[:, None], axis=1)[:, 0]
        starts.append(np.where(apart.any(axis=1) & (starts[-1] >= 0), chosen, -1))
    return starts


def _better(distance: Array, status: IntArray, than: Array, than_status: IntArray) -> npt.NDArray[np.bool_]:
    """Whether a second foot replaces the first: closer, or as close and settled where the first was not."""
    return np.asarray((distance < than) | ((distance == than) & (status < than_status)))
