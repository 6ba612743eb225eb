"""Injectors that cut along planes: slits with clean plane rims, halves pushed apart or into each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import BoolArray, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.level_cut import Cut, level_cut
from patchwright.models.samples.defects import Damaged, Injected, removed
from patchwright.models.triangulation import Triangulation


def cut(
    triangulation: Triangulation, point: npt.ArrayLike, normal: npt.ArrayLike, only: BoolArray | None = None
) -> Cut:
    """Split the triangles that cross a plane (of those in the mask `only`); new vertices lie in it to round-off."""
    n = np.asarray(normal, dtype=np.float64)
    n = n / np.linalg.norm(n)
    at = np.asarray(point, dtype=np.float64)
    height = (triangulation.vertices - at) @ n
    height[np.abs(height) < 1e-12 * triangulation.diagonal] = 0.0
    step = level_cut(triangulation, height, only)
    old = len(triangulation.vertices)
    points = step.triangulation.vertices.copy()
    points[old:] -= ((points[old:] - at) @ n)[:, None] * n  # onto the plane to the last bit that matters
    return step._replace(triangulation=replace(step.triangulation, vertices=points))


def slit(
    triangulation: Triangulation,
    point: npt.ArrayLike,
    normal: npt.ArrayLike,
    width: float,
    *,
    only: Sequence[str] | None = None,
    facing: npt.ArrayLike | None = None,
    seed: int = 0,
) -> Damaged:
    """Remove the band between two planes, cut exactly at both; a "gap" of that width per connected piece.

    Parameters
    ----------
    point, normal, width : the band's middle plane and its thickness
    only : names of the tags it cuts; None for all
    facing : remove only triangles whose normal has a positive component along this vector ("the upper skin")
    seed : not used
    """
    if not width > 0.0:
        raise ParameterError(f"a slit needs a positive width, got {width:g}")
    n = np.asarray(normal, dtype=np.float64) / np.linalg.norm(normal)
    middle = np.asarray(point, dtype=np.float64)
    current, origin = triangulation, np.arange(len(triangulation))
    for offset in (-0.5 * width, 0.5 * width):
        step = cut(current, middle + offset * n, n, _tagged(current, only))
        current, origin = step.triangulation, origin[step.origin]
    height = (current.corners.mean(axis=1) - middle) @ n
    gone = (np.abs(height) < 0.5 * width) & _tagged(current, only)
    if facing is not None:
        gone &= current.area_vectors @ np.asarray(facing, dtype=np.float64) > 0.0
    result = removed(current, np.flatnonzero(gone), size=width)
    return replace(result, origin=origin[result.origin])


def push_apart(
    triangulation: Triangulation, point: npt.ArrayLike, normal: npt.ArrayLike, distance: float, *, seed: int = 0
) -> Damaged:
    """Cut at a plane and move both sides by half the distance along its normal: a "gap", negative an "overlap".

    The label's points are the two rims, its area what the tube between the rims has (`seed` is not used).
    """
    n = np.asarray(normal, dtype=np.float64) / np.linalg.norm(normal)
    step = cut(triangulation, point, n)
    mesh, front = step.triangulation, step.side >= 0
    count = len(mesh.vertices)
    triangles = mesh.triangles + np.where(front, 0, count)[:, None]
    vertices = np.concatenate([mesh.vertices + 0.5 * distance * n, mesh.vertices - 0.5 * distance * n])
    moved = replace(mesh, vertices=vertices, triangles=triangles).compact()
    rim = _rim(mesh, front)
    points = np.concatenate([mesh.vertices[rim].reshape(-1, 3) + s * 0.5 * distance * n for s in (1, -1)])
    length = np.linalg.norm(mesh.vertices[rim[:, 1]] - mesh.vertices[rim[:, 0]], axis=1).sum()
    kind = "gap" if distance > 0.0 else "overlap"
    label = Injected.of(kind, points, size=abs(distance), area=float(length * abs(distance)))
    return Damaged(moved, (label,), step.origin)


def _rim(mesh: Triangulation, front: BoolArray) -> IntArray:
    """(k, 2) edges with a triangle on either side of the cut."""

    def edges(which: BoolArray) -> IntArray:
        t = mesh.triangles[which]
        pairs = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
        return np.unique(pairs[:, 0] * len(mesh.vertices) + pairs[:, 1])

    code = np.intersect1d(edges(front), edges(~front))
    return np.stack([code // len(mesh.vertices), code % len(mesh.vertices)], axis=1)


def _tagged(triangulation: Triangulation, only: Sequence[str] | None) -> BoolArray:
    if only is None:
        return np.ones(len(triangulation), dtype=np.bool_)
    unknown = [name for name in only if name not in triangulation.tag_names]
    if triangulation.tags is None or unknown:
        raise ParameterError(f"no triangle is tagged {', '.join(unknown or only)}; tags: {triangulation.tag_names}")
    return np.isin(triangulation.tags, [triangulation.tag_names.index(name) for name in only])
