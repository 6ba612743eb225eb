"""Layouts a person gives: four boundary curves, or four corner points, for every patch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import GeometryError, ParameterError
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.tolerance import Tolerance
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.coons import check_corners

CURVE_SAMPLES = 65


def layout_of(
    patches: QuadLayout | Sequence[Any], tolerance: Tolerance, *, sharp: Sequence[tuple[int, int]] = ()
) -> QuadLayout:
    """A quad layout from a list of patches.

    Parameters
    ----------
    patches : each either four curves (NurbsCurve, or (k, 3) points along the curve) in the order south (u, v = 0),
        east (v, u = 1), north (u, v = 1), west (v, u = 0), or a (4, 3) array of corner points counter-clockwise from
        outside, whose sides are then straight and find the surface by projection
    tolerance : corners and curves nearer than `.fit` are one
    sharp : pairs of patch numbers whose common edge is a crease

    Raises
    ------
    GeometryError : curves that do not meet in their corners (names patch, corner and gap), an edge with three patches.
    """
    if isinstance(patches, QuadLayout):
        return patches
    if not len(patches):
        raise ParameterError("a layout needs at least one patch")
    sides = [_sides(p, i, tolerance) for i, p in enumerate(patches)]
    corners = np.array([[s[0][0], s[0][-1], s[2][-1], s[2][0]] for s in sides])
    numbers, vertices = _merge(corners.reshape(-1, 3), tolerance.fit)
    quads = numbers.reshape(-1, 4)
    # the sides in the quad's own way round: south, east, north backward, west backward
    around = [(s[0], s[1], s[2][::-1], s[3][::-1]) for s in sides]
    edges: list[tuple[int, int]] = []
    paths: list[Array] = []
    uses: list[list[int]] = []
    quad_edges = np.empty_like(quads)
    turned = np.zeros(quads.shape, dtype=bool)
    for q, quad in enumerate(quads):
        for k in range(4):
            a, b = int(quad[k]), int(quad[(k + 1) % 4])
            if a == b:
                raise GeometryError(f"side {k + 1} of patch {q + 1} has no length")
            path = around[q][k].copy()
            path[0], path[-1] = vertices[a], vertices[b]
            turned[q, k] = a > b
            if a > b:
                path = path[::-1]
            edge = _find(edges, paths, (min(a, b), max(a, b)), path, tolerance.fit)
            if edge == len(edges):
                edges.append((min(a, b), max(a, b)))
                paths.append(path)
                uses.append([])
            uses[edge].append(q)
            quad_edges[q, k] = edge
    for edge, use in enumerate(uses):
        if len(use) > 2:
            where = paths[edge][len(paths[edge]) // 2]
            raise GeometryError(
                f"{len(use)} patches ({', '.join(str(q + 1) for q in use)}) share the edge at {where.round(6).tolist()}"
            )
    creases = {frozenset(pair) for pair in sharp}
    return QuadLayout(
        vertices=vertices,
        quads=quads,
        edges=np.array(edges),
        quad_edges=quad_edges,
        edge_reversed=turned,
        edge_quads=np.array([(u[0], u[1] if len(u) == 2 else -1) for u in uses]),
        sharp=np.array([frozenset(u) in creases for u in uses]),
        boundary=np.array([len(u) == 1 for u in uses]),
        path_offsets=np.concatenate([[0], np.cumsum([len(p) for p in paths])]),
        path_points=np.concatenate(paths),
        triangle=np.full(len(vertices), -1),
        tags=np.zeros(len(quads), dtype=np.int64),
    )


def _sides(patch: Any, number: int, tolerance: Tolerance) -> tuple[Array, Array, Array, Array]:
    """(south, east, north, west) polylines, all along +u or +v."""
    if isinstance(patch, np.ndarray) and patch.shape == (4, 3):
        a, b, c, d = np.asarray(patch, dtype=np.float64)
        t = np.linspace(0.0, 1.0, CURVE_SAMPLES)[:, None]
        return (1 - t) * a + t * b, (1 - t) * b + t * c, (1 - t) * d + t * c, (1 - t) * a + t * d
    if len(patch) != 4:
        raise ParameterError(
            f"patch {number + 1} needs four boundary curves or a (4, 3) array of corners, got {len(patch)} items"
        )
    lines = []
    for curve in patch:
        if isinstance(curve, NurbsCurve):
            lines.append(curve(np.linspace(*curve.domain, CURVE_SAMPLES)))
        else:
            lines.append(np.asarray(curve, dtype=np.float64))
    south, east, north, west = lines
    try:
        check_corners(south, north, west, east, tolerance.fit)
    except GeometryError as error:
        raise GeometryError(f"patch {number + 1}: {error}") from None
    return south, east, north, west


def _merge(points: Array, distance: float) -> tuple[IntArray, Array]:
    """Numbers of the merged points and the points; clusters within `distance` are one, at their mean."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(distance, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    count, label = connected_components(graph, directed=False)
    mean = np.zeros((count, 3))
    np.add.at(mean, label, points)
    return label.astype(np.int64), mean / np.bincount(label, minlength=count)[:, None]


def _find(edges: list[tuple[int, int]], paths: list[Array], ends: tuple[int, int], path: Array, distance: float) -> int:
    """The edge with these ends whose middle is the same, or the number of a new one."""
    for number, (known, line) in enumerate(zip(edges, paths, strict=True)):
        if known == ends and np.linalg.norm(line[len(line) // 2] - path[len(path) // 2]) <= 10.0 * distance:
            return number
    return len(edges)
