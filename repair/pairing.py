"""Triangles to quads only: good pairs are joined, then everything is split once at edge middles and centres.

A joined pair becomes four quads, a triangle left alone three, so the result is pure quad whatever the pairs (the
topology of Catmull-Clark's first step). Pairs are never joined across a feature.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.remesh import CoarseMesh

ACCEPTABLE = 0.25  # score below which two triangles are not joined


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


def pair_score(coarse: CoarseMesh) -> Array:
    """(m, 3) how near to a rectangle a triangle and its neighbour across side k are, in [0, 1]; 0 when not allowed.

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
    score = np.zeros(mesh.T.shape)
    score[t, k] = np.where(value >= ACCEPTABLE, value, 0.0)
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


def pair(coarse: CoarseMesh) -> QuadMesh:
    """Quads only, on the surface and along the features."""
    from patchwright.repair import _quad_kernel as kernel
    from patchwright.repair import _remesh_kernel as records

    mesh, ground = coarse.mesh, coarse.ground
    triangles, neighbours = mesh.T, mesh.B
    m, n = len(triangles), len(mesh.X)
    score = pair_score(coarse)
    partner = kernel.match(neighbours, score, np.argsort(-score.reshape(-1), kind="stable"))
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
    e, f = len(kept), len(faces)
    parents = np.full((e + f, 4), -1, dtype=np.int64)
    parents[:e, :2] = ends
    parents[e:] = faces
    regions = np.concatenate([mesh.R[st], mesh.R[leader]])
    columns: Any = [
        *[np.concatenate([v, np.zeros((e + f, *v.shape[1:]), dtype=v.dtype)]) for v in mesh[:8]],
        *mesh[8:12],
        np.zeros(n + e + f, dtype=np.int64),
    ]
    grown = records.Mesh._make(columns)
    spot = np.zeros((e + f, 1, 3))
    for k4 in range(4):
        spot[:, 0] += np.where((parents[:, k4] >= 0)[:, None], grown.X[parents[:, k4]], 0.0)
    spot /= (parents >= 0).sum(axis=1)[:, None, None]
    new_curve = np.concatenate([curve, np.full(f, -1)])
    landed, at = np.empty_like(spot), np.empty((e + f, 1), dtype=np.int64)
    kernel.land(grown, ground, parents, regions, spot, np.concatenate([edge_normal, face_normal]), landed, at)
    at = np.where(at[:, 0] >= 0, at[:, 0], mesh.vt[parents[:, 0]])
    kernel.place_new(grown, ground, n, new_curve, np.concatenate([arcs[st, sk], np.zeros((f, 2))]), landed[:, 0], at)
    quads, owner = _split_faces(faces, kept, n, e)
    # feature edges, each in two halves, in the curve's direction
    on = np.flatnonzero(curve >= 0)
    arc = arcs[st[on], sk[on]]
    forth = arc[:, 0] < arc[:, 1]
    begin, end = np.where(forth, ends[on, 0], ends[on, 1]), np.where(forth, ends[on, 1], ends[on, 0])
    sides = np.concatenate([np.stack([begin, n + on], axis=1), np.stack([n + on, end], axis=1)])
    return QuadMesh(
        ground,
        grown,
        quads,
        np.ascontiguousarray(mesh.R[leader][owner]),
        np.ascontiguousarray(face_normal[owner]),
        sides,
        np.concatenate([curve[on], curve[on]]),
    )


def _split_faces(faces: IntArray, kept: IntArray, n: int, e: int) -> tuple[IntArray, IntArray]:
    """One quad per face corner (corner, middle ahead, centre, middle behind), and the face of each."""
    corners = np.where(faces[:, 3] < 0, 3, 4)
    owner = np.repeat(np.arange(len(faces)), corners)
    local = np.arange(len(owner)) - np.repeat(np.cumsum(corners) - corners, corners)
    here = faces[owner, local]
    ahead = faces[owner, (local + 1) % corners[owner]]
    behind = faces[owner, (local - 1) % corners[owner]]

    def middle(p: IntArray, q: IntArray) -> IntArray:
        return np.asarray(n + np.searchsorted(kept, np.minimum(p, q) * n + np.maximum(p, q)))

    return np.stack([here, middle(here, ahead), n + e + owner, middle(behind, here)], axis=1), owner
