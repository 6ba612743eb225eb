"""Triangles within a given chord of every patch: each patch and each shared edge cut as finely as it asks for.

Patches have their own numbers of intervals along u and along v, at least two, an edge the most that one of its patches
has along it. To keep the different counts few they are powers of two and one and a half times these. The nodes inside
a patch are a grid; between its outer ring and the four edges runs a strip that takes up the difference, so that the
whole is watertight whatever the counts.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.triangulation import Triangulation
from patchwright.repair.patches.joins import edge_uses
from patchwright.repair.patches.network import PatchNetwork
from patchwright.repair.patches.patch_nets import evaluate
from patchwright.repair.patches.spline_space import uniform_collocation

MOST_TRIANGLES = 2_000_000
COUNTS = np.array([2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256])  # intervals along a side
LOOKED_AT = 4  # intervals, at least, at which the sag is measured; never fewer than a patch has pieces


def tessellation_within(network: PatchNetwork, chord: float, most: int = MOST_TRIANGLES) -> Triangulation:
    """Watertight triangles within about `chord` of the patches.

    Parameters
    ----------
    chord : a length; the sum of the sags along u, along v and of the twist of a cell, measured between nodes
    most : triangles, about; a chord that asks for more is widened

    Returns
    -------
    Triangulation with tag i for patch i and its parameters as uv. Vertices on shared edges are stored once.
    """
    own = intervals_within(network, chord, most)
    along = own[:, [0, 1, 0, 1]].reshape(-1)
    on_edge = along[edge_uses(network.layout)].max(axis=1)
    return _triangulated(network, own, on_edge)


def intervals_within(network: PatchNetwork, chord: float, most: int = MOST_TRIANGLES) -> IntArray:
    """(m, 2) intervals of each patch along u and v."""
    wanted = np.empty((len(network), 2))
    for cells, which, nets in network.nets.groups():
        base = np.maximum(LOOKED_AT, cells)
        points = evaluate(nets, *(uniform_collocation(c, 2 * int(b) + 1) for c, b in zip(cells, base, strict=True)))
        sag = np.stack([_sag(points), _sag(np.swapaxes(points, 1, 2))], axis=1)
        cell = points[:, ::2, ::2]
        twist = np.linalg.norm(cell[:, 1:, 1:] - cell[:, 1:, :-1] - cell[:, :-1, 1:] + cell[:, :-1, :-1], axis=-1)
        # half the chord for each direction, or for the twist; a twist is split evenly
        share = np.maximum(sag, 0.25 * twist.max(axis=(1, 2))[:, None]) / (0.5 * chord)
        wanted[which] = base * np.sqrt(share)
    wanted = np.clip(wanted, COUNTS[0], COUNTS[-1])
    for _ in range(len(COUNTS)):
        own = COUNTS[np.searchsorted(COUNTS, wanted)]
        if 2 * int(own.prod(axis=1).sum()) <= most:
            break
        wanted = np.maximum(wanted / np.sqrt(2.0), COUNTS[0])
    return np.asarray(own)


def _sag(points: Array) -> Array:
    """(k,) how far odd nodes along the second axis of (k, a, b, 3) are from the chords between their neighbours."""
    off = points[:, 1::2] - 0.5 * (points[:, :-1:2] + points[:, 2::2])
    return np.asarray(np.linalg.norm(off, axis=-1).max(axis=(1, 2)))


def _triangulated(network: PatchNetwork, own: IntArray, on_edge: IntArray) -> Triangulation:
    layout = network.layout
    edge_first = len(layout.vertices) + np.concatenate([[0], np.cumsum(on_edge - 1)])
    inner_first = edge_first[-1] + np.concatenate([[0], np.cumsum((own - 1).prod(axis=1))])
    vertices = np.empty((int(inner_first[-1]), 3))
    vertices[: len(layout.vertices)] = layout.vertices
    _place_edges(network, on_edge, edge_first, vertices)
    _place_inner(network, own, inner_first, vertices)
    pieces = [
        *_inner_cells(own, inner_first, vertices),
        *_strips(network, own, on_edge, edge_first, inner_first),
    ]
    triangles, uv, tags = (np.concatenate([piece[k] for piece in pieces]) for k in range(3))
    order = np.argsort(tags, kind="stable")
    names = tuple(f"patch-{i + 1}" for i in range(len(network)))
    return Triangulation(vertices, triangles[order], uv=uv[order], tags=tags[order], tag_names=names)


def _place_edges(network: PatchNetwork, on_edge: IntArray, first: IntArray, vertices: Array) -> None:
    """Nodes inside the shared curves, from each edge's first vertex to its second."""
    for cells, which, points in network.edges.groups():
        for count in np.unique(on_edge[which]).tolist():
            some = on_edge[which] == count
            rows = first[which[some]][:, None] + np.arange(count - 1)
            basis = uniform_collocation(cells, count + 1)[1:-1]
            vertices[rows] = np.einsum("ij,kjd->kid", basis, points[some])


def _place_inner(network: PatchNetwork, own: IntArray, first: IntArray, vertices: Array) -> None:
    """The grid inside each patch, u slowest."""
    for cells, which, nets in network.nets.groups():
        for m, n in np.unique(own[which], axis=0).tolist():
            some = (own[which] == (m, n)).all(axis=1)
            basis = (uniform_collocation(c, k + 1)[1:-1] for c, k in zip(cells, (m, n), strict=True))
            rows = first[which[some]][:, None] + np.arange((m - 1) * (n - 1))
            vertices[rows] = evaluate(nets[some], *basis).reshape(len(rows), -1, 3)


_Piece = tuple[IntArray, Array, IntArray]  # triangles (k, 3), their uv (k, 3, 2), their patches (k,)


def _inner_cells(own: IntArray, first: IntArray, vertices: Array) -> list[_Piece]:
    """The cells of the inner grids, cut along their shorter diagonals."""
    out = []
    for m, n in np.unique(own, axis=0).tolist():
        if m < 3 or n < 3:
            continue
        which = np.flatnonzero((own == (m, n)).all(axis=1))
        grid = first[which][:, None, None] + np.arange((m - 1) * (n - 1)).reshape(m - 1, n - 1)
        node = np.stack(np.meshgrid(np.arange(1, m) / m, np.arange(1, n) / n, indexing="ij"), axis=-1)
        a, b, c, d = (grid[:, i, j].reshape(-1) for i, j in _CORNERS)
        at = np.stack([np.broadcast_to(node[i, j], (len(which), m - 2, n - 2, 2)).reshape(-1, 2) for i, j in _CORNERS])
        short = np.linalg.norm(vertices[c] - vertices[a], axis=-1) <= np.linalg.norm(vertices[d] - vertices[b], axis=-1)
        number = np.stack([a, b, c, d])
        tags = np.repeat(which, (m - 2) * (n - 2))
        for corners in (
            np.where(short, [[0], [1], [2]], [[0], [1], [3]]),
            np.where(short, [[0], [2], [3]], [[1], [2], [3]]),
        ):
            cell = np.arange(len(a))
            out.append((number[corners, cell].T, at[corners, cell].swapaxes(0, 1), tags))
    return out


_LOW, _HIGH = slice(None, -1), slice(1, None)
_CORNERS = ((_LOW, _LOW), (_HIGH, _LOW), (_HIGH, _HIGH), (_LOW, _HIGH))


def _strips(
    network: PatchNetwork, own: IntArray, on_edge: IntArray, edge_first: IntArray, inner_first: IntArray
) -> list[_Piece]:
    """Triangles between the outer ring of each inner grid and the patch's edges."""
    layout, out = network.layout, []
    for k in range(4):
        edge = layout.quad_edges[:, k]
        sizes = np.column_stack([on_edge[edge], own])
        for outer, m, n in np.unique(sizes, axis=0).tolist():
            which = np.flatnonzero((sizes == (outer, m, n)).all(axis=1))
            step = np.arange(outer - 1)
            within = np.where(layout.edge_reversed[which, k][:, None], step[::-1], step)
            ring, at = _ring(k, m, n)
            nodes = np.column_stack([
                layout.quads[which, k],
                edge_first[edge[which]][:, None] + within,
                layout.quads[which, (k + 1) % 4],
                inner_first[which][:, None] + ring,
            ])  # fmt: skip
            uv = np.concatenate([_along_side(k, np.arange(outer + 1) / outer), at])
            pattern = _strip(outer, len(ring))
            triangles = nodes[:, pattern].reshape(-1, 3)
            out.append((triangles, np.tile(uv[pattern], (len(which), 1, 1)), np.repeat(which, len(pattern))))
    return out


def _ring(k: int, m: int, n: int) -> tuple[IntArray, Array]:
    """The inner nodes next to side k, in the sense in which the side runs round the patch, and their uv."""
    number = np.arange((m - 1) * (n - 1)).reshape(m - 1, n - 1)
    node = np.stack(np.meshgrid(np.arange(1, m) / m, np.arange(1, n) / n, indexing="ij"), axis=-1)
    i, j = ((slice(None), 0), (-1, slice(None)), (slice(None, None, -1), -1), (0, slice(None, None, -1)))[k]
    return np.asarray(number[i, j]), np.asarray(node[i, j])


def _along_side(k: int, share: Array) -> Array:
    """(s, 2) parameters at shares of side k, which runs round the patch."""
    zero = np.zeros_like(share)
    u, v = ((share, zero), (1 + zero, share), (1 - share, 1 + zero), (zero, 1 - share))[k]
    return np.stack([u, v], axis=1)


@lru_cache(maxsize=256)
def _strip(outer: int, inner: int) -> IntArray:
    """(outer + inner - 1, 3) triangles between nodes 0 … outer of an edge and the `inner` nodes beside it.

    The edge's nodes stand at i / outer, those beside it at j / (inner + 1), j from 1.
    """
    i = np.arange(outer)
    j = np.arange(inner - 1)
    # a step is taken when its middle is passed: first come those of the edge before both rows' common ends
    at = np.concatenate([(i + 0.5) / outer, (j + 1.5) / (inner + 1)])
    order = np.argsort(at, kind="stable")
    edge_step = order < outer
    done_outer: IntArray = np.cumsum(edge_step) - edge_step
    done_inner: IntArray = np.arange(len(order)) - done_outer
    low, high = done_outer, outer + 1 + done_inner
    third = np.where(edge_step, done_outer + 1, outer + 2 + done_inner)
    return np.asarray(np.stack([low, third, high], axis=1))
