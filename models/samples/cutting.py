"""Injectors that cut along planes: slits with clean plane rims, halves pushed apart or into each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.samples.defects import Damaged, Injected, removed
from patchwright.models.triangulation import Triangulation


class Cut(NamedTuple):
    """A triangulation cut by a plane: no triangle crosses it any more."""

    triangulation: Triangulation
    side: IntArray
    """(m,) 1 in front of the plane, -1 behind it, 0 inside it"""
    origin: IntArray
    """(m,) the input triangle each is a piece of"""


def cut(
    triangulation: Triangulation, point: npt.ArrayLike, normal: npt.ArrayLike, only: BoolArray | None = None
) -> Cut:
    """Split the triangles that cross a plane (of those in the mask `only`); shared edges get one shared new vertex."""
    n = np.asarray(normal, dtype=np.float64)
    n = n / np.linalg.norm(n)
    height = (triangulation.vertices - np.asarray(point, dtype=np.float64)) @ n
    height[np.abs(height) < 1e-12 * triangulation.diagonal] = 0.0
    sign = np.sign(height).astype(np.int64)[triangulation.triangles]
    crossing = (sign.min(axis=1) < 0) & (sign.max(axis=1) > 0)
    if only is not None:
        crossing &= only
    whole, split = np.flatnonzero(~crossing), np.flatnonzero(crossing)
    if not len(split):
        return Cut(triangulation, np.sign(sign.sum(axis=1)), np.arange(len(triangulation)))

    # turn each triangle so that corner 0 is alone on its side, or, with a corner in the plane, is that corner
    own = sign[split]
    touching = (own == 0).any(axis=1)
    lone = np.where(touching, np.argmax(own == 0, axis=1), np.argmax(own == -np.sign(own.sum(axis=1))[:, None], axis=1))
    turn = (lone[:, None] + np.arange(3)) % 3
    corner = np.take_along_axis(triangulation.triangles[split], turn, axis=1)
    first, second = np.where(touching, 1, 0), np.where(touching, 2, 1)  # the edges cut: 1-2, or 0-1 and 0-2
    rows = np.arange(len(split))
    ends = np.concatenate(
        [np.stack([corner[rows, first], corner[rows, second]], axis=1), corner[~touching][:, [0, 2]]], axis=0
    )
    edges, which = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    which = which.reshape(-1) + len(triangulation.vertices)
    low, high = edges.T
    t = height[low] / (height[low] - height[high])
    new = triangulation.vertices[low] + t[:, None] * (triangulation.vertices[high] - triangulation.vertices[low])
    new -= ((new - np.asarray(point)) @ n)[:, None] * n  # onto the plane to the last bit that matters
    a, b, c = corner.T
    x = which[: len(split)]
    y = np.full(len(split), -1)
    y[~touching] = which[len(split) :]
    # touching: x on b-c; otherwise x on a-b and y on a-c
    pieces = [
        (touching, np.stack([a, b, x], axis=1)),
        (touching, np.stack([a, x, c], axis=1)),
        (~touching, np.stack([a, x, y], axis=1)),
        (~touching, np.stack([x, b, c], axis=1)),
        (~touching, np.stack([x, c, y], axis=1)),
    ]
    triangles = np.concatenate([triangulation.triangles[whole]] + [p[m] for m, p in pieces])
    origin = np.concatenate([whole] + [split[m] for m, _ in pieces])
    points = np.concatenate([triangulation.vertices, new])
    heights = np.concatenate([height, np.zeros(len(new))])
    side = np.sign(np.sign(heights)[triangles].sum(axis=1)).astype(np.int64)
    uv = None if triangulation.uv is None else _carried(triangulation, points, triangles, origin, len(whole))
    tags = None if triangulation.tags is None else triangulation.tags[origin]
    return Cut(replace(triangulation, vertices=points, triangles=triangles, uv=uv, tags=tags), side, origin)


def _carried(old: Triangulation, points: Array, triangles: IntArray, origin: IntArray, whole: int) -> Array:
    """uv of the pieces' corners: linear in their input triangle."""
    assert old.uv is not None
    uv = old.uv[origin]
    a, b, c = np.moveaxis(old.corners[origin[whole:]], 1, 0)
    normal = np.cross(b - a, c - a)
    square = np.einsum("ij,ij->i", normal, normal)
    for k in range(3):
        p = points[triangles[whole:, k]]
        at_b = np.einsum("ij,ij->i", np.cross(p - a, c - a), normal) / square
        at_c = np.einsum("ij,ij->i", np.cross(b - a, p - a), normal) / square
        weight = np.stack([1.0 - at_b - at_c, at_b, at_c], axis=1)
        uv[whole:, k] = np.einsum("ij,ijk->ik", weight, old.uv[origin[whole:]])
    return np.asarray(uv)


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
