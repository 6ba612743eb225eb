"""Paths of a layout kept on the surface: those that cut through the body are led round it on plane sections.

A path is a few points on the triangulation. Round the rim of a thin body two of them may lie on different skins; the
straight line between them then leads through the body, and a curve fitted to it cuts the rim off. Such a path gives way
to the section of the triangulation with the plane through both its ends that stands upright on the surface; where that
does not arrive, the steps that stray are led round in the same way, one by one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, IntArray
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.joins import smooth_edges
from patchwright.repair.patches.patch_fit import Target

LOOKED_AT = np.array([0.0, 0.25, 0.5, 0.75, 1.0])  # places on a step of a path at which the target is asked
BEND = 30.0  # degrees
ROUND = 4.0  # times the distance of both ends: a way round may always be that long; half a circle needs 1.6
TURN = 60.0  # degrees from triangle to triangle: what turns more may be a sharp line, which smooth edges do not cross
PARALLEL = 0.3  # sum of two unit normals, across the line between their points, below which they have no clear mean
MOST_SIDES = 2000  # crossed on the way
INSIDE = 1e-6  # of a triangle: how far an end is moved off its border, where walks would be undecided


def on_surface(layout: QuadLayout, target: Target, most: Array) -> QuadLayout:
    """The layout with the paths of smooth edges led round that stray farther than `most` (e,) where the target bends.

    A way that would cross a turn of more than `TURN` degrees or a boundary, or be longer than the other three sides of
    a quad and `ROUND` times the straight line, is not taken.
    """
    points, offsets = layout.path_points, layout.path_offsets
    step = _straying(layout, target, most)
    if not len(step):
        return layout
    own = np.searchsorted(offsets, step, side="right") - 1
    across, longest = _across(layout), _other_sides(layout)
    edge = np.unique(own)
    first, last = offsets[edge], offsets[edge + 1] - 1
    ways = _sections(target, points[first], points[last], across[edge], longest[edge])
    found = np.array([len(way) > 0 for way in ways])
    instead = [(a, b, way) for a, b, way, good in zip(first, last, ways, found, strict=True) if good]
    step, own = (x[~np.isin(own, edge[found])] for x in (step, own))
    ways = _sections(target, points[step], points[step + 1], across[own], longest[own])
    instead += [(a, a + 1, way) for a, way in zip(step, ways, strict=True)]
    pieces, count, done = [], np.diff(offsets), 0
    for a, b, way in sorted(instead, key=lambda one: int(one[0])):
        pieces += [points[done : a + 1], way]
        count[np.searchsorted(offsets, a, side="right") - 1] += len(way) - (b - a - 1)
        done = b
    new = np.concatenate([[0], np.cumsum(count)])
    return replace(layout, path_points=np.concatenate([*pieces, points[done:]]), path_offsets=new)


def _straying(layout: QuadLayout, target: Target, most: Array) -> IntArray:
    """Rows of the path points from which a step of a smooth edge leads through the body.

    It strays farther than `most` (e,) from the target, which turns by more than `BEND` degrees from its one end to the
    other: where it turns less, all points of the step have the same skin beside them.
    """
    points, offsets = layout.path_points, layout.path_offsets
    step = np.flatnonzero(np.bincount(offsets[1:] - 1, minlength=len(points)) == 0)
    edge = np.searchsorted(offsets, step, side="right") - 1
    smooth = smooth_edges(layout)[edge]
    step, edge = step[smooth], edge[smooth]
    asked = points[step][:, None] + LOOKED_AT[:, None] * (points[step + 1] - points[step])[:, None]
    found = target.tree.closest(asked.reshape(-1, 3))
    away = found.distance.reshape(asked.shape[:2]).max(axis=1)
    normals = np.asarray(target.tree.triangulation.normals)[found.triangle].reshape(asked.shape)
    bent = (normals[:, 0] * normals[:, -1]).sum(axis=1) < np.cos(np.radians(BEND))
    return np.asarray(step[(away > most[edge]) & bent])


def _across(layout: QuadLayout) -> Array:
    """(e, 3) from the middle of the quad on the left of each edge to that on its right; zero on a boundary."""
    middle = layout.vertices[layout.quads].mean(axis=1)
    out = np.zeros((len(layout.edges), 3))
    for k in range(4):
        np.add.at(out, layout.quad_edges[:, k], np.where(layout.edge_reversed[:, k, None], middle, -middle))
    out[layout.boundary] = 0.0
    return out


def _other_sides(layout: QuadLayout) -> Array:
    """(e,) the length of the other sides of a quad at each edge together, the lesser of both quads'."""
    step = np.linalg.norm(np.diff(layout.path_points, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(step)])
    length = along[layout.path_offsets[1:] - 1] - along[layout.path_offsets[:-1]]
    sides = length[layout.quad_edges]
    out = np.full(len(length), np.inf)
    np.minimum.at(out, layout.quad_edges, sides.sum(axis=1, keepdims=True) - sides)
    return out


def _sections(target: Target, begin: Array, finish: Array, across: Array, longest: Array) -> list[Array]:
    """For each pair of points (k, 3) the places where the section between them crosses sides; none where it fails.

    The plane stands upright on the mean of the surface's normals at both; where that is undecided, on skins that are
    parallel, and where the way does not arrive, it is perpendicular to `across` (k, 3).
    """
    from patchwright.repair.patches._section_kernel import walk_sections

    if not len(begin):
        return []
    body = target.tree.triangulation
    normals, neighbours = np.asarray(body.normals), Adjacency.of(body).neighbours
    triangle = np.stack([target.tree.closest(p).triangle for p in (begin, finish)], axis=1)
    middle = body.corners.mean(axis=1)
    ends = [p + INSIDE * (middle[t] - p) for p, t in zip((begin, finish), triangle.T, strict=True)]
    chord = ends[1] - ends[0]
    size = np.linalg.norm(chord, axis=1)
    longest = np.maximum(longest, ROUND * size)
    least = np.cos(np.radians(TURN))
    outside = normals[triangle].sum(axis=1)
    upright = np.cross(chord, outside)
    square = np.maximum(size**2, np.finfo(float).tiny)
    flat = across - ((across * chord).sum(axis=1) / square)[:, None] * chord
    parallel = np.linalg.norm(upright, axis=1) < PARALLEL * size
    ways = [np.zeros((0, 3))] * len(begin)
    for planes in (np.where(parallel[:, None], flat, upright), np.where(parallel[:, None], upright, flat)):
        left = np.flatnonzero([not len(way) for way in ways])
        count, out = np.empty(len(left), dtype=np.int64), np.empty((len(left), MOST_SIDES, 3))
        walk_sections(
            *(np.ascontiguousarray(p[left]) for p in ends), np.ascontiguousarray(triangle[left]), planes[left],
            longest[left], body.vertices, body.triangles, neighbours, normals, least, count, out,
        )  # fmt: skip
        for i, way, number in zip(left.tolist(), out, count.tolist(), strict=True):
            ways[i] = way[: max(number, 0)].copy()
    return ways
