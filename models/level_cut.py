"""Cutting a triangulation along a level of a function that is linear on every triangle."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.triangulation import Triangulation


class Cut(NamedTuple):
    """A triangulation no triangle of which crosses the level any more."""

    triangulation: Triangulation
    side: IntArray
    """(m,) 1 above the level, -1 below it, 0 on it"""
    origin: IntArray
    """(m,) the input triangle each is a piece of"""


def level_cut(triangulation: Triangulation, height: Array, only: BoolArray | None = None) -> Cut:
    """Split the triangles in which a function crosses zero; shared edges get one shared new vertex.

    Parameters
    ----------
    triangulation : its triangles stay in front, pieces of the split ones follow; uv and tags are carried
    height : (n,) the function at the vertices; exactly 0 where the level runs through the vertex
    only : (m,) the triangles that may be split, None for all
    """
    sign = np.sign(height).astype(np.int64)[triangulation.triangles]
    crossing = (sign.min(axis=1) < 0) & (sign.max(axis=1) > 0)
    if only is not None:
        crossing &= only
    whole, split = np.flatnonzero(~crossing), np.flatnonzero(crossing)
    if not len(split):
        return Cut(triangulation, np.sign(sign.sum(axis=1)), np.arange(len(triangulation)))

    # turn each triangle so that corner 0 is alone on its side, or, with a corner on the level, is that corner
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
