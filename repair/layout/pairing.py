"""Triangles to quads only: good pairs are joined, then split at edge middles and centres.

Where all edges are halved, a joined pair becomes four quads, a triangle left alone three, so the result is pure quad
whatever the pairs (the topology of Catmull-Clark's first step). Where few quads shall come out, only those edges are
halved that must be (`halving`), and more pairs are joined. Pairs are never joined across a feature.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.layout.remesh import CoarseMesh

ACCEPTABLE = 0.25  # score below which two triangles are not joined
BORNE = 0.02  # the same where few quads shall come out: a triangle left alone costs two more
UNPAIRED = 0.55  # score of two triangles left alone: they become six quads as good as those of a pair of this score


@dataclass(frozen=True, slots=True, eq=False)
class QuadMesh:
    """Quads on the ground of a coarse mesh.

    Parameters
    ----------
    ground, mesh : the kernels' records; of `mesh` only the vertex arrays are in use
    quads : (m, 4)
    region : (m,) smooth region each quad lies in
    outward : (m, 3) surface normals at the quads' centres
    sides : (k, 2) vertex pairs that lie on feature curves, along the curve
    side_curve : (k,) their curves
    """

    ground: Any
    mesh: Any
    quads: IntArray
    region: IntArray
    outward: Array
    sides: IntArray
    side_curve: IntArray

    def copy(self) -> QuadMesh:
        """The same quads with vertices and normals of their own, to be moved apart from these."""
        mesh = self.mesh
        columns = {name: values.copy() for name, values in zip(mesh._fields[:8], mesh[:8], strict=True)}
        return replace(self, mesh=mesh._replace(**columns), outward=self.outward.copy())


def pair_score(coarse: CoarseMesh, least: float = ACCEPTABLE) -> Array:
    """(m, 3) how near to a rectangle a triangle and its neighbour across side k are, in [0, 1]; 0 below `least`.

    1 - the largest difference of a corner from 90 degrees over 90, times the cosine between the triangles.
    """
    mesh = coarse.mesh
    t, k = np.nonzero((mesh.B >= 0) & (mesh.F < 0))
    o = mesh.B[t, k]
    a, b, c = mesh.T[t, k], mesh.T[t, (k + 1) % 3], mesh.T[t, (k + 2) % 3]
    d = mesh.T[o].sum(axis=1) - a - b
    corners = np.stack([a, d, b, c], axis=1)
    points = mesh.X[corners]
    ahead, back = np.roll(points, -1, axis=1) - points, np.roll(points, 1, axis=1) - points
    size = np.linalg.norm(ahead, axis=2) * np.linalg.norm(back, axis=2)
    dot = np.einsum("ijk,ijk->ij", ahead, back)
    cosine = np.divide(dot, size, out=np.ones_like(size), where=size > 0)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    # concave at a or b: the two triangles' angles there add up to more than 180
    normals = np.cross(mesh.X[mesh.T[:, 1]] - mesh.X[mesh.T[:, 0]], mesh.X[mesh.T[:, 2]] - mesh.X[mesh.T[:, 0]])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    mean = normals[t] + normals[o]
    left = np.einsum("ijk,ik->ij", np.cross(ahead, back), mean)
    angle = np.where(left < 0, 360.0 - angle, angle)
    flat = np.einsum("ij,ij->i", normals[t], normals[o])
    value = np.clip(1.0 - np.abs(angle - 90.0).max(axis=1) / 90.0, 0.0, 1.0) * np.clip(flat, 0.0, 1.0)
    # flat at a corner that is the only one on its side of a curve which does not end there
    at_a = (mesh.T[o] == a[:, None]).argmax(axis=1)
    bc, ca, ad, db = (
        mesh.F[which, side % 3] >= 0 for which, side in ((t, k + 1), (t, k + 2), (o, at_a), (o, at_a + 1))
    )
    both = np.stack([ca & ad, ad & db, db & bc, bc & ca], axis=1)
    value[(both & (mesh.kind[corners] == 1)).any(axis=1)] = 0.0
    score = np.zeros(mesh.T.shape)
    score[t, k] = np.where(value >= least, value, 0.0)
    return score


def part_doublets(mesh: Any, score: Array, partner: IntArray) -> None:
    """Take pairs apart, in place, until every inner vertex off the curves keeps three edges.

    With two edges its two quads would share both and meet at angles that add up to a full turn: one of them folds.
    """
    triangles, neighbours = mesh.T, mesh.B
    degree = np.bincount(triangles.reshape(-1), minlength=len(mesh.X))
    while True:
        t = np.flatnonzero((partner >= 0) & (neighbours[np.arange(len(partner)), partner] > np.arange(len(partner))))
        k = partner[t]
        ends = np.stack([triangles[t, k], triangles[t, (k + 1) % 3]], axis=1)
        kept = degree - np.bincount(ends.reshape(-1), minlength=len(degree))
        poor = (mesh.kind == 0) & (kept < 3) & (degree >= 3)
        which = np.flatnonzero(poor[ends].any(axis=1))
        if not len(which):
            return
        # the worst pair first; the next round sees what it left
        worst = which[np.argmin(score[t[which], k[which]])]
        partner[neighbours[t[worst], k[worst]]] = -1
        partner[t[worst]] = -1


def pair(coarse: CoarseMesh, *, few: bool = False) -> QuadMesh:
    """Quads only, on the surface and along the features.

    With `few`, only those edges are halved that must be (`halving`); otherwise all.
    """
    from patchwright.repair.layout import _quad_kernel as kernel
    from patchwright.repair.layout import _remesh_kernel as records
    from patchwright.repair.layout.halving import halved

    mesh, ground = coarse.mesh, coarse.ground
    triangles, neighbours = mesh.T, mesh.B
    m, n = len(triangles), len(mesh.X)
    score = pair_score(coarse, BORNE if few else ACCEPTABLE)
    order = np.argsort(-score.reshape(-1), kind="stable")
    partner = kernel.match(neighbours, score, order, BORNE if few else UNPAIRED)
    part_doublets(mesh, score, partner)
    arcs = np.zeros((m, 3, 2))
    kernel.curve_sides_of_edges(mesh, ground, m, arcs)
    # faces: pairs as (a, d, b, c), triangles with -1 at the end
    alone = np.flatnonzero(partner < 0)
    joined = np.flatnonzero(partner >= 0)
    other = neighbours[joined, partner[joined]]
    joined, other = joined[joined < other], other[joined < other]
    k = partner[joined]
    a, b, c = triangles[joined, k], triangles[joined, (k + 1) % 3], triangles[joined, (k + 2) % 3]
    d = triangles[other].sum(axis=1) - a - b
    faces = np.concatenate(
        [np.stack([a, d, b, c], axis=1), np.concatenate([triangles[alone], np.full((len(alone), 1), -1)], axis=1)]
    )
    leader = np.concatenate([joined, alone])
    normals = np.cross(
        mesh.X[triangles[:, 1]] - mesh.X[triangles[:, 0]], mesh.X[triangles[:, 2]] - mesh.X[triangles[:, 0]]
    )
    face_normal = normals[leader].copy()
    face_normal[: len(joined)] += normals[other]
    # edges that stay, from all sides but the joined ones
    lo = np.minimum(triangles, np.roll(triangles, -1, axis=1))
    hi = np.maximum(triangles, np.roll(triangles, -1, axis=1))
    stays = np.arange(3)[None, :] != partner[:, None]
    keys = (lo * n + hi)[stays]
    kept, first = np.unique(keys, return_index=True)
    st, sk = np.nonzero(stays)
    st, sk = st[first], sk[first]
    ends = np.stack([triangles[st, sk], triangles[st, (sk + 1) % 3]], axis=1)
    curve = mesh.F[st, sk]
    edge_normal = normals[st].copy()
    inner = neighbours[st, sk] >= 0
    edge_normal[inner] += normals[neighbours[st, sk][inner]]
    e = len(kept)
    face_edges, edge_faces = _sides(faces, kept, n)
    if few:
        marks = halved(faces, face_edges, edge_faces, ends, mesh.X, face_normal, curve >= 0)
    else:
        marks = np.ones(e, dtype=bool)
    halves = np.flatnonzero(marks)
    middle = np.full(e + 1, -1)
    middle[halves] = n + np.arange(len(halves))
    quads, owner, centred = _split_faces(faces, np.where(face_edges >= 0, middle[face_edges], -1), n + len(halves))
    h, f = len(halves), len(centred)
    parents = np.full((h + f, 4), -1, dtype=np.int64)
    parents[:h, :2] = ends[halves]
    parents[h:] = faces[centred]
    regions = np.concatenate([mesh.R[st[halves]], mesh.R[leader[centred]]])
    columns: Any = [
        *[np.concatenate([v, np.zeros((h + f, *v.shape[1:]), dtype=v.dtype)]) for v in mesh[:8]],
        *mesh[8:12],
        np.zeros(n + h + f, dtype=np.int64),
    ]
    grown = records.Mesh._make(columns)
    spot = np.zeros((h + f, 1, 3))
    for k4 in range(4):
        spot[:, 0] += np.where((parents[:, k4] >= 0)[:, None], grown.X[parents[:, k4]], 0.0)
    spot /= (parents >= 0).sum(axis=1)[:, None, None]
    arc = arcs[st, sk]
    landed, at = np.empty_like(spot), np.empty((h + f, 1), dtype=np.int64)
    towards = np.concatenate([edge_normal[halves], face_normal[centred]])
    kernel.land(grown, ground, parents, regions, spot, towards, landed, at)
    at = np.where(at[:, 0] >= 0, at[:, 0], mesh.vt[parents[:, 0]])
    new_curve, new_arc = (
        np.concatenate([curve[halves], np.full(f, -1)]),
        np.concatenate([arc[halves], np.zeros((f, 2))]),
    )
    kernel.place_new(grown, ground, n, new_curve, new_arc, landed[:, 0], at)
    # feature edges, in the curve's direction, whole or in two halves
    on = np.flatnonzero(curve >= 0)
    forth = arc[on, 0] < arc[on, 1]
    begin, end = np.where(forth, ends[on, 0], ends[on, 1]), np.where(forth, ends[on, 1], ends[on, 0])
    cut, whole = marks[on], ~marks[on]
    between = middle[on[cut]]
    sides = np.concatenate(
        [
            np.stack([begin[cut], between], axis=1),
            np.stack([between, end[cut]], axis=1),
            np.stack([begin[whole], end[whole]], axis=1),
        ]
    )
    return QuadMesh(
        ground,
        grown,
        quads,
        np.ascontiguousarray(mesh.R[leader][owner]),
        np.ascontiguousarray(face_normal[owner]),
        sides,
        np.concatenate([curve[on[cut]], curve[on[cut]], curve[on[whole]]]),
    )


def _sides(faces: IntArray, kept: IntArray, n: int) -> tuple[IntArray, IntArray]:
    """(f, 4) the edge from each corner of a face to the next, -1 behind a triangle's; (e, 2) the faces of each edge."""
    corners = np.where(faces[:, 3] < 0, 3, 4)
    ahead = np.take_along_axis(faces, (np.arange(4)[None, :] + 1) % corners[:, None], axis=1)
    sides = np.searchsorted(kept, np.minimum(faces, ahead) * n + np.maximum(faces, ahead))
    there = np.arange(4)[None, :] < corners[:, None]
    sides = np.where(there, sides, -1)
    flat, owner = sides[there], np.nonzero(there)[0]
    order = np.argsort(flat, kind="stable")
    first = np.searchsorted(flat[order], np.arange(len(kept) + 1))
    both = np.full((len(kept), 2), -1, dtype=np.int64)
    both[:, 0] = owner[order[first[:-1]]]
    twice = np.diff(first) > 1
    both[twice, 1] = owner[order[first[:-1][twice] + 1]]
    return sides, both


# what becomes of a quad (4 sides) or triangle (3) with its first sides halved so, as corners 0 to 3, middles 4 to 7 of
# the sides from there on, and 8, the centre
PIECES = {
    (4, (0, 0, 0, 0)): ((0, 1, 2, 3),),
    (4, (1, 0, 1, 0)): ((0, 4, 6, 3), (4, 1, 2, 6)),
    (4, (1, 1, 0, 0)): ((4, 1, 5, 8), (8, 5, 2, 3), (4, 8, 3, 0)),
    (4, (1, 1, 1, 1)): ((0, 4, 8, 7), (1, 5, 8, 4), (2, 6, 8, 5), (3, 7, 8, 6)),
    (3, (1, 0, 0)): ((0, 4, 1, 2),),
    (3, (1, 1, 1)): ((0, 4, 8, 6), (1, 5, 8, 4), (2, 6, 8, 5)),
}


def _split_faces(faces: IntArray, middles: IntArray, n: int) -> tuple[IntArray, IntArray, IntArray]:
    """Quads, the face each is a piece of, and the faces that got a centre, numbered from `n` on.

    `middles` (f, 4) are the vertices halfway along the sides, -1 where a side stays whole.
    """
    corners = np.where(faces[:, 3] < 0, 3, 4)
    mark = middles >= 0
    quads: list[IntArray] = []
    owner: list[IntArray] = []
    centred: list[IntArray] = []
    for (count, pattern), pieces in PIECES.items():
        turns = {tuple(np.roll(pattern, turn).tolist()): turn for turn in reversed(range(count))}
        for turned, turn in turns.items():
            some = np.flatnonzero((corners == count) & (mark[:, :count] == np.array(turned, dtype=bool)).all(axis=1))
            if not len(some):
                continue
            way = (np.arange(count) + turn) % count
            spots = np.full((len(some), 9), -1, dtype=np.int64)
            spots[:, :count] = faces[some][:, way]
            spots[:, 4 : 4 + count] = middles[some][:, way]
            if 8 in np.array(pieces):
                spots[:, 8] = n + sum(len(c) for c in centred) + np.arange(len(some))
                centred.append(some)
            for piece in pieces:
                quads.append(spots[:, piece])
                owner.append(some)
    face = np.concatenate(owner)
    order = np.argsort(face, kind="stable")
    centres = np.concatenate([*centred, np.zeros(0, dtype=np.int64)])
    return np.concatenate(quads)[order], face[order], centres
