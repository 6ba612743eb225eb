"""Adaptive triangulation of a surface within a chord tolerance, without cracks.

After Hamann, Jean and Razdan (HJR section 4): recursive subdivision, every vertex stored once, parameters kept per
corner. Departure: whether an edge is halved is asked once per edge, not per cell, so neighbours always agree; a
triangle is then cut through the middles of its halved edges in one of three ways, and no transition is ever needed.

Sides of the domain that meet in space (the seam of a periodic surface) share their vertices, a side that is one point
(a pole) is one vertex.

Limits: what lies between the samples of an edge (3) or face (4) is not seen; the first cells are fine enough that a
polynomial of the surface's degree, or an eighth of a turn, has no room to hide there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface
from patchwright.models.triangulation import Triangulation

CHORD = 0.9  # share of the tolerance for the deviation at samples; for quadratic surfaces they see the largest one
CLOSING = 0.1  # the rest: sides of the domain nearer than that are one
TURNS = 8  # first cells per direction where nothing is known of the surface: a full turn is cut into eighths
EDGE_SAMPLES = (0.5, 0.25, 0.75)
FACE_SAMPLES = np.array([[1, 1, 1], [2, 0.5, 0.5], [0.5, 2, 0.5], [0.5, 0.5, 2]]) / 3.0


@dataclass(slots=True)
class _Mesh:
    """The triangles so far: vertex numbers, corners' parameters, and what has been found within tolerance."""

    points: Array
    pole: IntArray  # 0, or 1 + the parameter that does not matter at this vertex
    rows: IntArray
    uv: Array
    edge_fine: BoolArray
    face_fine: BoolArray


def triangulate(surface: Surface, tolerance: float) -> Triangulation:
    """Triangles over the whole domain of a surface, no farther from it than `tolerance` at the samples taken.

    Returns
    -------
    A triangulation with uv, counter-clockwise in (u, v). At a pole the parameter without meaning is that of the middle
    of the triangle.

    Raises
    ------
    ParameterError : an unbounded domain; a tolerance that is not positive or below round-off of the coordinates.
    """
    (u0, u1), (v0, v1) = surface.domain
    if not np.isfinite([u0, u1, v0, v1]).all():
        raise ParameterError(f"only a bounded surface can be triangulated, its domain is {surface.domain}")
    mesh = _first(surface, tolerance)
    reach = float(np.abs(mesh.points).max())
    if not (np.isfinite(tolerance) and tolerance > 64.0 * np.finfo(np.float64).eps * reach):
        raise ParameterError(
            f"the tolerance {tolerance} is not positive, or below round-off of coordinates of {reach:.3g}"
        )
    while True:
        ends = _ends(mesh)
        mark = _coarse_edges(surface, mesh, ends, tolerance)
        if not mark.any():
            break
        _subdivide(surface, mesh, ends, mark)
    uv = mesh.uv.copy()
    for axis in range(2):
        at = mesh.pole[mesh.rows] == 1 + axis
        weight = np.where(at, 0.0, 1.0)
        middle = (uv[..., axis] * weight).sum(axis=1) / np.maximum(weight.sum(axis=1), 1.0)
        uv[..., axis] = np.where(at, middle[:, None], uv[..., axis])
    return Triangulation(mesh.points, mesh.rows, uv=uv).compact()


def _breaks(surface: Surface, axis: int) -> Array:
    """First cell borders in one direction: every span cut by its degree, or eighths of the domain."""
    low, high = surface.domain[axis]
    if isinstance(surface, NurbsSurface):
        knots = np.unique(surface.knots[axis])
        knots = knots[(knots >= low) & (knots <= high)]
        pieces = max(1, surface.degree[axis])
        if len(knots) == 2 and pieces < 4 and surface.weights is not None:
            pieces = 4
    else:
        knots, pieces = np.array([low, high]), TURNS
    share = np.arange(pieces) / pieces
    return np.append((knots[:-1, None] + np.diff(knots)[:, None] * share).reshape(-1), knots[-1])


def _first(surface: Surface, tolerance: float) -> _Mesh:
    """Two triangles per cell of the first grid, seams and poles closed."""
    u, v = _breaks(surface, 0), _breaks(surface, 1)
    n, m = len(u), len(v)
    points = np.asarray(surface(u[:, None], v[None, :]), dtype=np.float64)
    number = np.arange(n * m).reshape(n, m)
    pole = np.zeros((n, m), dtype=np.int64)
    near = CLOSING * tolerance

    def apart(x: Array, y: Array) -> float:
        return float(np.linalg.norm(x - y, axis=-1).max())

    # halfway between the grid's lines too, so that a slit is not taken for a seam
    mid_u, mid_v = 0.5 * (u[1:] + u[:-1]), 0.5 * (v[1:] + v[:-1])
    all_u, all_v = np.sort(np.concatenate([u, mid_u])), np.sort(np.concatenate([v, mid_v]))
    sides = [surface(np.full(len(all_v), w), all_v) for w in (u[0], u[-1])]
    floors = [surface(all_u, np.full(len(all_u), w)) for w in (v[0], v[-1])]
    if n > 3 and apart(sides[0], sides[1]) <= near < apart(points[0], points[n // 2]):
        number[-1] = number[0]
    if m > 3 and apart(floors[0], floors[1]) <= near < apart(points[:, 0], points[:, m // 2]):
        number[:, -1] = number[:, 0]
    for row, side in ((0, sides[0]), (-1, sides[1])):
        if n > 2 and apart(side, side[:1]) <= near:
            number[row], pole[row] = number[row, 0], 2
    for row, side in ((0, floors[0]), (-1, floors[1])):
        if m > 2 and apart(side, side[:1]) <= near:
            number[:, row], pole[:, row] = number[0, row], 1
    grid = np.stack(np.broadcast_arrays(u[:, None], v[None, :]), axis=-1)
    corners = [(slice(None, -1), slice(None, -1)), (slice(1, None), slice(None, -1)),
               (slice(1, None), slice(1, None)), (slice(None, -1), slice(1, None))]  # fmt: skip
    rows, uv = [], []
    for triple in ((0, 1, 2), (0, 2, 3)):
        rows.append(np.stack([number[corners[k]].reshape(-1) for k in triple], axis=1))
        uv.append(np.stack([grid[corners[k]].reshape(-1, 2) for k in triple], axis=1))
    triangles, parameters = np.concatenate(rows), np.concatenate(uv)
    flat = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    triangles, parameters = triangles[~flat], parameters[~flat]
    fine = np.zeros((len(triangles), 3), dtype=np.bool_)
    return _Mesh(points.reshape(-1, 3), pole.reshape(-1), triangles, parameters, fine, fine[:, 0].copy())


def _ends(mesh: _Mesh) -> Array:
    """(m, 3, 2, 2) parameters of both ends of each edge, corner k to k + 1; a pole takes over what does not matter."""
    ends = np.stack([mesh.uv, np.roll(mesh.uv, -1, axis=1)], axis=2)
    pole = np.stack([mesh.pole[mesh.rows], np.roll(mesh.pole[mesh.rows], -1, axis=1)], axis=2)
    for axis in range(2):
        for end in range(2):
            free = (pole[:, :, end] == 1 + axis) & (pole[:, :, 1 - end] != 1 + axis)
            ends[:, :, end, axis] = np.where(free, ends[:, :, 1 - end, axis], ends[:, :, end, axis])
    return ends


def _edge_keys(mesh: _Mesh) -> IntArray:
    """(m, 3) one number per edge, the same on both sides of it."""
    following = np.roll(mesh.rows, -1, axis=1)
    return np.minimum(mesh.rows, following) * len(mesh.points) + np.maximum(mesh.rows, following)


def _coarse_edges(surface: Surface, mesh: _Mesh, ends: Array, tolerance: float) -> BoolArray:
    """(m, 3) edges to be halved: the surface is too far from the edge, or from a face beside it."""
    allowed = CHORD * tolerance
    mark = np.zeros(mesh.rows.shape, dtype=np.bool_)
    keys = _edge_keys(mesh)
    open_edges = np.flatnonzero(~mesh.edge_fine.reshape(-1))
    if len(open_edges):
        # once per edge; the quarters only where the middle is near enough
        _, lead, edge = np.unique(keys.reshape(-1)[open_edges], return_index=True, return_inverse=True)
        t, k = np.divmod(open_edges[lead], 3)
        a, b = mesh.points[mesh.rows[t, k]], mesh.points[mesh.rows[t, (k + 1) % 3]]
        far = np.zeros(len(lead), dtype=np.bool_)
        for share in EDGE_SAMPLES:
            rest = np.flatnonzero(~far)
            first, last = ends[t[rest], k[rest], 0], ends[t[rest], k[rest], 1]
            at = first + share * (last - first)
            far[rest] = _from_chord(np.asarray(surface(at[:, 0], at[:, 1])), a[rest], b[rest]) > allowed
        mark.reshape(-1)[open_edges] = far[edge.reshape(-1)]
        mesh.edge_fine = ~mark
    ask = np.flatnonzero(~mesh.face_fine & ~mark.any(axis=1))
    if len(ask):
        uv = mesh.uv[ask]
        pole = mesh.pole[mesh.rows[ask]]
        at = np.einsum("sk,nkd->nsd", FACE_SAMPLES, uv)
        for axis in range(2):
            # at a pole the parameter without meaning is no corner: samples lie between the other two
            free = pole == 1 + axis
            weight = FACE_SAMPLES[None] * ~free[:, None, :]
            between = np.einsum("nsk,nk->ns", weight, uv[..., axis]) / np.maximum(weight.sum(axis=2), 1e-300)
            at[..., axis] = np.where(free.any(axis=1)[:, None], between, at[..., axis])
        corners = mesh.points[mesh.rows[ask]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
        away = np.einsum("nsk,nk->ns", np.asarray(surface(at[..., 0], at[..., 1])) - corners[:, :1], normal)
        far = np.abs(away).max(axis=1) > allowed
        mark[ask[far]] = True
        mesh.face_fine[ask[~far]] = True
    return _agreed(mesh, keys, mark) if mark.any() else mark


def _agreed(mesh: _Mesh, keys: IntArray, mark: BoolArray) -> BoolArray:
    """`mark` on both sides of each edge, and on the longest edge of every triangle that has a marked one.

    So only longest edges are halved alone, which keeps the angles from degenerating (Rivara, IJNME 20, 1984); without
    it long edges can follow one another for ever.
    """
    _, edge = np.unique(keys.reshape(-1), return_inverse=True)
    edge = edge.reshape(-1, 3)
    corners = mesh.points[mesh.rows]
    way = np.roll(corners, -1, axis=1) - corners
    size = np.zeros(int(edge.max()) + 1)
    size[edge] = np.einsum("nkj,nkj->nk", way, way)
    longest = np.take_along_axis(edge, size[edge].argmax(axis=1)[:, None], axis=1)[:, 0]
    marked = np.zeros(len(size), dtype=np.bool_)
    marked[edge[mark]] = True
    while True:
        more = np.unique(longest[marked[edge].any(axis=1) & ~marked[longest]])
        if not len(more):
            return marked[edge]
        marked[more] = True


def _from_chord(points: Array, a: Array, b: Array) -> Array:
    """(n,) distances of points (n, 3) from the segments a to b."""
    way, away = b - a, points - a
    square = np.maximum(np.einsum("ij,ij->i", way, way), np.finfo(np.float64).tiny)
    share = np.clip(np.einsum("ij,ij->i", away, way) / square, 0.0, 1.0)
    away -= share[:, None] * way
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", away, away)))


def _subdivide(surface: Surface, mesh: _Mesh, ends: Array, mark: BoolArray) -> None:
    """Halve the marked edges and cut the triangles through the new vertices."""
    t, k = np.nonzero(mark)
    keys = _edge_keys(mesh)[t, k]
    _, first, new = np.unique(keys, return_index=True, return_inverse=True)
    half = ends[t, k].mean(axis=1)
    count = len(mesh.points)
    middle = np.full(mark.shape, -1, dtype=np.int64)
    middle[t, k] = count + new.reshape(-1)
    middle_uv = np.zeros((*mark.shape, 2))
    middle_uv[t, k] = half
    mesh.points = np.concatenate([mesh.points, np.asarray(surface(half[first, 0], half[first, 1]))])
    mesh.pole = np.concatenate([mesh.pole, np.zeros(len(first), dtype=np.int64)])
    cuts = mark.sum(axis=1)
    rows, uv = [mesh.rows[cuts == 0]], [mesh.uv[cuts == 0]]
    edge_fine, face_fine = [mesh.edge_fine[cuts == 0]], [mesh.face_fine[cuts == 0]]
    for number, lead in ((1, mark.argmax(axis=1)), (2, (~mark).argmax(axis=1)), (3, np.zeros(len(mark), np.int64))):
        some = np.flatnonzero(cuts == number)
        if not len(some):
            continue
        # corners 0, 1, 2 and middles 3, 4, 5 of the edges after them, turned so that the odd edge is the first
        turn = (lead[some, None] + np.arange(3)) % 3
        six = np.concatenate([np.take_along_axis(mesh.rows[some], turn, 1),
                              np.take_along_axis(middle[some], turn, 1)], axis=1)  # fmt: skip
        six_uv = np.concatenate([np.take_along_axis(mesh.uv[some], turn[..., None], 1),
                                 np.take_along_axis(middle_uv[some], turn[..., None], 1)], axis=1)  # fmt: skip
        patterns: list[tuple[BoolArray, tuple[tuple[int, int, int], ...]]]
        if number == 1:
            patterns = [(np.ones(len(some), dtype=np.bool_), ((0, 3, 2), (3, 1, 2)))]
        elif number == 2:  # the quadrilateral 0, 1, 4, 5 is cut by its shorter diagonal
            short = np.linalg.norm(mesh.points[six[:, 0]] - mesh.points[six[:, 4]], axis=1) <= np.linalg.norm(
                mesh.points[six[:, 1]] - mesh.points[six[:, 5]], axis=1
            )
            patterns = [(short, ((0, 1, 4), (0, 4, 5), (5, 4, 2))), (~short, ((0, 1, 5), (1, 4, 5), (5, 4, 2)))]
        else:
            patterns = [(np.ones(len(some), dtype=np.bool_), ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)))]
        for which, triples in patterns:
            for triple in triples:
                rows.append(six[which][:, triple])
                uv.append(six_uv[which][:, triple])
                edge_fine.append(np.zeros((int(which.sum()), 3), dtype=np.bool_))
                face_fine.append(np.zeros(int(which.sum()), dtype=np.bool_))
    mesh.rows, mesh.uv = np.concatenate(rows), np.concatenate(uv)
    mesh.edge_fine, mesh.face_fine = np.concatenate(edge_fine), np.concatenate(face_fine)
