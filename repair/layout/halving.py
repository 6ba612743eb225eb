"""Which edges between coarse faces are halved, so that all faces part into quads and few come out.

A face of three or four sides parts into quads when its sides and halves are even in number: a quad with no, two or four
of its sides halved gives one, two (three where the two are neighbours) or four quads; a triangle with all three sides
halved gives three, with one a quad that is flat at the middle of that side until it is smoothed. Halving all edges
always does; turning over one vertex, which means that all edges that meet in it change between whole and halved, keeps
every face even. So the choice is a search over sets of vertices for the least cost: the number of quads and how poor
their corners are. It is the ground state of a spin glass, searched for by annealing (Kirkpatrick, Gelatt and Vecchi,
Optimization by simulated annealing, Science 220, 1983).
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray

SWEEPS, STILL = 60, 10  # the last ones take turns that gain alone
WARMEST, COOLEST = 1.2, 0.05  # quads
SEED = 1983
QUADS = np.array([1, 0, 0, 3, 0, 2, 3, 0, 0, 3, 2, 0, 3, 0, 0, 4])  # of a quad, by the mask of its halved sides
POOR_FROM, POOR_OVER = 30.0, 30.0  # degrees a corner may differ from 90; a quad that much beyond counts as one more
FLAT = 1.0  # what a quad that is flat at first costs more
TURNED = 0.5  # what three quads in place of two cost more: an irregular vertex inside
NEVER = 1e6


def halved(
    faces: IntArray,
    face_edges: IntArray,
    edge_faces: IntArray,
    edges: IntArray,
    points: Array,
    normals: Array,
    fixed: BoolArray,
) -> BoolArray:
    """(e,) whether each edge is to be halved.

    Parameters
    ----------
    faces : (f, 4) corners, -1 at the end of a triangle
    face_edges : (f, 4) edge from each corner to the next, -1 at the end of a triangle
    edge_faces : (e, 2) faces on either side, -1 at a boundary
    edges : (e, 2) vertices
    points : (n, 3)
    normals : (f, 3) of the faces, of any length
    fixed : (e,) edges on curves, whose middles do not leave them
    """
    from patchwright.repair.layout import _halving_kernel as kernel

    cost = face_costs(faces, points, normals, np.where(face_edges >= 0, fixed[face_edges], False))
    # two quads that share opposite sides, both halved there alone, would make two edges of the same ends
    own = np.arange(len(faces))[:, None]
    other = np.where(face_edges >= 0, edge_faces[face_edges].sum(axis=2) - own, -1)
    for k, mask in ((0, 5), (1, 10)):
        cost[(other[:, k] >= 0) & (other[:, k] == other[:, k + 2]), mask] = NEVER
    n = len(points)
    edge_off, by_edge = _lists(edges, n)
    face_off, by_face = _lists(faces, n)
    rng = np.random.default_rng(SEED)
    used = np.flatnonzero(np.diff(edge_off) > 0)
    order = np.stack([rng.permutation(used) for _ in range(SWEEPS)])
    chance = np.log1p(-rng.random(order.shape))
    cooling = np.concatenate([np.geomspace(WARMEST, COOLEST, SWEEPS - STILL), np.zeros(STILL)])
    least, best = np.inf, np.ones(len(edges), dtype=bool)
    for marks, warmth in ((np.ones(len(edges), dtype=bool), cooling), (_uneven(edges, n), np.zeros(SWEEPS))):
        total = kernel.anneal(
            order, chance, warmth, edge_off, by_edge, face_off, by_face, face_edges, edge_faces, cost, marks
        )
        if total < least:
            least, best = total, marks
    return best


def _uneven(edges: IntArray, count: int) -> BoolArray:
    """(e,) edges both ends of which are an even, or both an odd number of edges away from the first vertex.

    All edges but these are a set that turning over vertices reaches from all edges; none is left of a chequered net.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components, dijkstra

    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count)).tocsr()
    label = connected_components(graph, directed=False)[1]
    first = np.unique(label, return_index=True)[1]
    away = dijkstra(graph, directed=False, indices=first, min_only=True, unweighted=True).astype(np.int64)
    return np.asarray((away[edges[:, 0]] - away[edges[:, 1]]) % 2 == 0)


def face_costs(faces: IntArray, points: Array, normals: Array, fixed: BoolArray) -> Array:
    """(f, 16) cost of each face for every mask of halved sides; `fixed` (f, 4) sides that lie on curves."""
    three = faces[:, 3] < 0
    angle = _corners(faces, points, normals)
    poor = np.clip((np.abs(angle - 90.0).max(axis=1) - POOR_FROM) / POOR_OVER, 0.0, None)
    cost = np.full((len(faces), 16), NEVER)
    for mask in np.flatnonzero(QUADS):
        turned = TURNED if QUADS[mask] == 3 else 0.0
        cost[~three, mask] = QUADS[mask] + turned + poor[~three]
    cost[three, 7] = 3.0
    for k in range(3):
        cost[three, 1 << k] = np.where(fixed[three, k], NEVER, 1.0 + FLAT)
    return cost


def _corners(faces: IntArray, points: Array, normals: Array) -> Array:
    """(f, 4) the angles at corners in degrees, up to 360; of triangles the first three count."""
    count = np.where(faces[:, 3] < 0, 3, 4)[:, None]
    step = np.arange(4)[None, :]
    here = points[np.where(faces >= 0, faces, faces[:, :1])]
    ahead = points[np.take_along_axis(faces, (step + 1) % count, axis=1)] - here
    back = points[np.take_along_axis(faces, (step - 1) % count, axis=1)] - here
    sine = np.einsum("ijk,ik->ij", np.cross(ahead, back), normals)
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    sine = np.divide(sine, size, out=np.zeros_like(sine), where=size > 0.0)
    return np.asarray(np.degrees(np.arctan2(sine, np.einsum("ijk,ijk->ij", ahead, back))) % 360.0)


def _lists(rows: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """For each of `count` numbers the rows it stands in, as (offsets, rows); -1 stands for nothing."""
    flat = rows.reshape(-1)
    owner = np.repeat(np.arange(len(rows)), rows.shape[1])[flat >= 0]
    flat = flat[flat >= 0]
    offsets = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=count))])
    return offsets.astype(np.int64), owner[np.argsort(flat, kind="stable")].astype(np.int64)
