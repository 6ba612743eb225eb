"""Quads that fold between their sides are opened: vertices and paths near them move, on a finer net of quads.

A quad is judged by its corners, but its patch by its sides: where a feature turns far along one side, or bulges into
the quad, the side beside runs along the feature or through it, and no room is left at a corner whose chords look good.
Each quad is split into 4 x 4. Where one of the small quads is poor, those of all quads around it move down an energy
(`_opening_kernel`) that makes them alike, with the sides they lie on, so that the sides bend away from each other.
What lies on features stays, and so do quads over which the surface bends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.layout.finer_quads import part_of, split_in_four
from patchwright.repair.layout.pairing import QuadMesh

POOR = 0.05  # scaled Jacobian of small quads: near those below, the quads are moved
FLAT = 0.9  # cosine: over quads that bend more, one normal does not tell which way is up, and nothing is moved
RINGS = 1  # of quads around poor ones that move with them
SLENDER = 4.0  # large quads as many times longer than wide may stay so
SWEEPS, PASSES = 12, 12  # the least determinant is renewed between
BIND, LEAST = 2.0, 0.05  # of the least determinant, and at least: what keeps the energy's divisors above zero


@dataclass(frozen=True, slots=True, eq=False)
class Opened:
    """Where vertices and smooth edges of a quad mesh have been moved to.

    Parameters
    ----------
    quad_mesh : the quads, with their vertices moved
    edges : (k, 2) ends of the smooth edges with a path of their own, lower first
    paths : (k, 9, 3) those paths, from the lower end
    quality : (m,) the least scaled Jacobian of the 4 x 4 small quads in each quad, or its own where it is not flat
    """

    quad_mesh: QuadMesh
    edges: IntArray
    paths: Array
    quality: Array


def opened(quad_mesh: QuadMesh, middle: Array) -> Opened:
    """The quads with room between their sides.

    Parameters
    ----------
    middle : (e, 3) points of the paths that the edges take now, halfway, edges in ascending order of their ends
    """
    from patchwright.repair.layout.quad_smooth import scaled_jacobians

    small = split_in_four(split_in_four(quad_mesh, middle).quad_mesh).quad_mesh
    flat = _flat(small)
    quality = np.where(flat, _quality(small), scaled_jacobians(quad_mesh))
    n = len(quad_mesh.mesh.X)
    near = (quality < POOR) & flat
    for _ in range(RINGS):
        on = np.zeros(n, dtype=bool)
        on[quad_mesh.quads[near]] = True
        near = np.asarray(on[quad_mesh.quads].any(axis=1)) & flat
    which = np.flatnonzero(near)
    if not len(which):
        return Opened(quad_mesh, np.zeros((0, 2), dtype=np.int64), np.zeros((0, 9, 3)), quality)
    part = part_of(quad_mesh, which)
    all_keys, all_count = np.unique(_edges(quad_mesh.quads, n), return_counts=True)
    keys, count = np.unique(_edges(part.quads, n), return_counts=True)
    place = np.searchsorted(all_keys, keys)
    held_edge = count < all_count[place]
    held = np.zeros(n, dtype=bool)
    held[quad_mesh.quads[~near]] = True
    ends = np.stack([keys // n, keys % n], axis=1)
    lines, fine, sizes = ends, part, _sizes(part)
    piece = _pieces(part.quads, n)
    for level in range(3):
        finer = split_in_four(fine, middle[place] if level == 0 else None)
        lines, fine, sizes = finer.refined(lines), finer.quad_mesh, _sizes_in_four(sizes)
        free = fine.mesh.kind == 0
        free[:n] &= ~held
        free[lines[held_edge]] = False
        if level == 1:
            _descend(fine, sizes, free, np.repeat(piece, 16))
            after = _quality(fine)
            better = _better(piece, quality[which], after)
    which, after = which[better], after[better]
    quality[which] = after
    used = np.zeros(n, dtype=bool)
    used[part.quads[better]] = True
    moved = quad_mesh.copy()
    for old, new in zip(moved.mesh[:7], fine.mesh[:7], strict=True):
        old[used] = new[:n][used]
    on_curve = np.isin(keys, _edges_of(part.sides, n))
    own = ~held_edge & ~on_curve & used[ends].all(axis=1)
    return Opened(moved, ends[own], np.asarray(fine.mesh.X[lines[own]]), quality)


def _quality(fine: QuadMesh) -> Array:
    """(m,) least scaled Jacobian of every sixteen small quads."""
    from patchwright.repair.layout.quad_smooth import scaled_jacobians

    return np.asarray(scaled_jacobians(fine).reshape(-1, 16).min(axis=1))


def _flat(fine: QuadMesh) -> BoolArray:
    """(m,) whether the normals of every sixteen small quads agree within acos(FLAT) with their mean."""
    normals = fine.outward.reshape(-1, 16, 3)
    mean = normals.sum(axis=1)
    return np.asarray(np.einsum("ijk,ik->ij", normals, mean).min(axis=1) >= FLAT * np.linalg.norm(mean, axis=1))


def _pieces(quads: IntArray, n: int) -> IntArray:
    """(m,) numbers of the pieces that quads with common vertices make."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    m = len(quads)
    graph = coo_matrix((np.ones(4 * m), (np.repeat(np.arange(m), 4), m + quads.reshape(-1))), shape=(m + n, m + n))
    label = connected_components(graph, directed=False)[1][:m]
    return np.asarray(np.unique(label, return_inverse=True)[1].reshape(-1), dtype=np.int64)


def _better(piece: IntArray, before: Array, after: Array) -> BoolArray:
    """(m,) quads of pieces in which fewer are folded or poor, or less so."""

    def cost(quality: Array) -> Array:
        return np.bincount(piece, weights=(quality <= 0.0) + np.clip(POOR - quality, 0.0, 0.5)).astype(np.float64)

    return np.asarray((cost(after) < cost(before))[piece])


def _edges(quads: IntArray, n: int) -> IntArray:
    """(4 m,) lo * n + hi of all sides."""
    return _edges_of(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2), n)


def _edges_of(ends: IntArray, n: int) -> IntArray:
    """(k,) lo * n + hi."""
    return np.asarray(ends.min(axis=1) * n + ends.max(axis=1)) if len(ends) else np.zeros(0, dtype=np.int64)


def _sizes(quad_mesh: QuadMesh) -> Array:
    """(m, 2) length of sides 0 and 2 and of sides 1 and 3; neither below 1 / SLENDER of the other."""
    points = quad_mesh.mesh.X[quad_mesh.quads]
    side = np.linalg.norm(np.roll(points, -1, axis=1) - points, axis=2)
    size = 0.5 * (side[:, :2] + side[:, 2:])
    return np.asarray(np.maximum(size, size[:, ::-1] / SLENDER))


def _sizes_in_four(sizes: Array) -> Array:
    """(4 m, 2) those of the quarters; the first side of every second one runs along the second of the whole."""
    out = 0.5 * np.repeat(sizes, 4, axis=0).reshape(-1, 4, 2)
    out[:, 1::2] = out[:, 1::2, ::-1]
    return out.reshape(-1, 2)


def _descend(quad_mesh: QuadMesh, sizes: Array, free: BoolArray, piece: IntArray) -> None:
    """Move the free vertices down the energy, in place; `piece` (m,) as in `_pieces`."""
    from patchwright.repair.layout import _opening_kernel as kernel
    from patchwright.repair.layout.quad_smooth import corners_by_vertex, update_outward

    mesh, ground, quads = quad_mesh.mesh, quad_mesh.ground, quad_mesh.quads
    offsets, around = corners_by_vertex(quads, len(mesh.X))
    free = free & (np.diff(offsets) > 0)
    own, least = np.empty(len(quads)), np.zeros(int(piece.max()) + 1)
    for _ in range(SWEEPS):
        kernel.least_determinant(mesh, quads, quad_mesh.outward, sizes, own)
        least[:] = 0.0
        np.minimum.at(least, piece, own)
        eps = np.sqrt(LEAST**2 + (BIND * least[piece]) ** 2)
        kernel.descend(mesh, ground, quads, quad_mesh.outward, sizes, offsets, around, free, eps, PASSES)
        update_outward(mesh, ground, quads, quad_mesh.region, quad_mesh.outward)
