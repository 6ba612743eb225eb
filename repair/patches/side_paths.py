"""The way along the pieces of a curve that gaps have broken: plane sections and intersection curves as patch sides."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from patchwright.models.analytic import Plane
from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import GeometryError
from patchwright.models.triangulation import Triangulation
from patchwright.repair.patches.patch_sides import Side, polyline

if TYPE_CHECKING:
    from patchwright.ssi.operands import Input

CURVE_POINTS = 513  # of a smooth intersection curve
LEAP = 3.0  # a step over a gap counts this many times its length, so that the curve is followed where there is one
NEIGHBOURS = 8  # loose ends a loose end may be joined to


def section_side(
    body: Triangulation,
    point: npt.ArrayLike,
    normal: npt.ArrayLike,
    start: npt.ArrayLike,
    end: npt.ArrayLike,
) -> Side:
    """The plane section of a triangulation between the points of it nearest to two places.

    Where the section is interrupted it is carried over the gap in a straight line.

    Raises
    ------
    GeometryError : the plane does not meet the geometry.
    """
    from patchwright.ssi.mesh_plane import intersect_mesh_plane

    at, direction = np.asarray(point, dtype=np.float64), np.asarray(normal, dtype=np.float64)
    low, high = body.bounds
    reach = float(np.linalg.norm(high - low) + np.linalg.norm(0.5 * (low + high) - at))
    found = intersect_mesh_plane(body, Plane(at, direction, u=(-reach, reach), v=(-reach, reach)))
    lines = [c.points for c in found.curves] + [c.points for o in found.overlaps for c in o.boundary]
    if not lines:
        raise GeometryError(f"the plane at {at.tolist()} does not meet the geometry; move it")
    return Side(polyline(path_along(lines, start, end)), "plane section")


def intersection_side(a: Input, b: Input, start: npt.ArrayLike, end: npt.ArrayLike) -> Side:
    """The intersection curve of two parts, surfaces or triangulations between its points nearest to two places.

    Raises
    ------
    GeometryError : the two do not meet.
    """
    from patchwright.ssi import intersect

    curves = [c.curve for c in intersect(a, b).curves]
    lines = [np.asarray(c.control_points if c.degree == 1 else c(np.linspace(*c.domain, CURVE_POINTS))) for c in curves]
    if not lines:
        raise GeometryError("the two parts named for a side do not meet; give the side by points")
    return Side(polyline(path_along(lines, start, end)), "intersection curve")


def path_along(lines: list[Array], start: npt.ArrayLike, end: npt.ArrayLike) -> Array:
    """(k, 3) the shortest way along polylines from the point nearest to `start` to the one nearest to `end`.

    Steps between loose ends are allowed at `LEAP` times their length. A closed polyline may be walked either way; the
    shorter wins.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra
    from scipy.spatial import cKDTree

    cut = [_cut_at(line, np.array([start, end], dtype=np.float64)) for line in lines]
    points, where = np.unique(np.concatenate(cut), axis=0, return_inverse=True)
    where = where.reshape(-1)
    offsets = np.cumsum([0] + [len(line) for line in cut])
    step = np.ones(len(where), dtype=bool)
    step[offsets[1:] - 1] = False
    first = np.flatnonzero(step)
    a, b = where[first], where[first + 1]
    loose = np.flatnonzero(np.bincount(np.concatenate([a, b]), minlength=len(points)) == 1)
    leaps = _leaps(points, loose)
    ends = np.concatenate([np.stack([a, b], axis=1), leaps])
    length = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    length[len(a) :] *= LEAP
    low, high = ends.min(axis=1), ends.max(axis=1)
    keep = low < high
    order = np.lexsort((length[keep], high[keep], low[keep]))
    low, high, length = low[keep][order], high[keep][order], length[keep][order]
    fresh = np.concatenate([[True], (np.diff(low) != 0) | (np.diff(high) != 0)])  # of equal pairs the shorter
    low, high, length = low[fresh], high[fresh], length[fresh]
    graph = coo_array((length, (low, high)), shape=(len(points), len(points))).tocsr()
    tree = cKDTree(points)
    begin, finish = (int(tree.query(np.asarray(p, dtype=np.float64))[1]) for p in (start, end))
    if begin == finish:
        raise GeometryError(f"both ends of a side are the same place of its curve, {points[begin].round(6).tolist()}")
    found, came = dijkstra(graph, directed=False, indices=np.array([begin]), return_predecessors=True)
    distance, before = found[0], came[0]
    if not np.isfinite(distance[finish]):
        raise GeometryError(f"no way leads along the curve to {points[finish].round(6).tolist()}")
    chain = [finish]
    while chain[-1] != begin:
        chain.append(int(before[chain[-1]]))
    return np.asarray(points[chain[::-1]])


def _cut_at(line: Array, places: Array) -> Array:
    """The polyline with the feet of the places put in as vertices of their own."""
    out = line
    for place in places:
        a, way = out[:-1], np.diff(out, axis=0)
        size = np.einsum("ij,ij->i", way, way)
        t = np.clip(np.einsum("ij,ij->i", place - a, way) / np.where(size > 0.0, size, 1.0), 0.0, 1.0)
        feet = a + t[:, None] * way
        k = int(np.linalg.norm(feet - place, axis=1).argmin())
        if 1e-9 < t[k] < 1.0 - 1e-9:
            out = np.insert(out, k + 1, feet[k], axis=0)
    return out


def _leaps(points: Array, loose: IntArray) -> IntArray:
    """(l, 2) pairs of loose ends near one another."""
    from scipy.spatial import cKDTree

    if len(loose) < 2:
        return np.zeros((0, 2), dtype=np.int64)
    count = min(NEIGHBOURS, len(loose) - 1)
    near = np.asarray(cKDTree(points[loose]).query(points[loose], k=count + 1)[1])
    return np.stack([np.repeat(loose, count), loose[near[:, 1:].reshape(-1)]], axis=1)
