"""Every quad split in four, on the surface and along the features: how a quad looks between its sides."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.layout.pairing import QuadMesh


@dataclass(frozen=True, slots=True, eq=False)
class Finer:
    """Quads split in four.

    Parameters
    ----------
    quad_mesh : quad 4 q + k holds corner k of quad q as its own first corner; the vertices are the old ones, the
        middles of the edges and the centres of the quads, in this order
    keys : (e,) lo * n + hi of the edges, ascending, in the order of their middles
    """

    quad_mesh: QuadMesh
    keys: IntArray

    def middles(self, tail: IntArray, head: IntArray) -> IntArray:
        """The vertices in the middles of edges."""
        n = len(self.quad_mesh.mesh.X) - len(self.keys) - len(self.quad_mesh.quads) // 4
        return n + np.searchsorted(self.keys, np.minimum(tail, head) * n + np.maximum(tail, head))

    def refined(self, lines: IntArray) -> IntArray:
        """(k, 2 j + 1) the vertices along lines of (k, j + 1) old ones."""
        out = np.empty((len(lines), 2 * lines.shape[1] - 1), dtype=np.int64)
        out[:, ::2] = lines
        out[:, 1::2] = self.middles(lines[:, :-1], lines[:, 1:])
        return out


def split_in_four(quad_mesh: QuadMesh, middle: Array | None = None) -> Finer:
    """Split every quad at its centre and the middles of its sides.

    `middle` (e, 3) are points of the surface for the middles of edges, in the order of `Finer.keys`; by default those
    of the chords are put onto it. The middles of edges on curves are those of the arcs.
    """
    from patchwright.repair.layout import _quad_kernel as kernel
    from patchwright.repair.layout.quad_smooth import update_outward

    mesh, ground, quads = quad_mesh.mesh, quad_mesh.ground, quad_mesh.quads
    n, m = len(mesh.X), len(quads)
    tail, head = quads, np.roll(quads, -1, axis=1)
    keys, first, number = np.unique(
        np.minimum(tail, head) * n + np.maximum(tail, head), return_index=True, return_inverse=True
    )
    number = number.reshape(m, 4)
    ends, e = np.stack([keys // n, keys % n], axis=1), len(keys)
    owner = first // 4
    towards = np.zeros((e, 3))
    for k in range(4):
        np.add.at(towards, number[:, k], quad_mesh.outward)
    curve, arc = np.full(e, -1, dtype=np.int64), np.zeros((e, 2))
    sides = quad_mesh.sides
    which = np.searchsorted(keys, np.minimum(sides[:, 0], sides[:, 1]) * n + np.maximum(sides[:, 0], sides[:, 1]))
    curve[which] = quad_mesh.side_curve
    arc[which] = side_arcs(quad_mesh)
    room = e + m
    columns: Any = [
        *[np.concatenate([v, np.zeros((room, *v.shape[1:]), dtype=v.dtype)]) for v in mesh[:8]],
        *mesh[8:12],
        np.zeros(n + room, dtype=np.int64),
    ]
    grown = mesh._make(columns)

    def land(parents: IntArray, region: IntArray, points: Array, normals: Array) -> tuple[Array, IntArray]:
        out, at = np.empty((len(points), 1, 3)), np.empty((len(points), 1), dtype=np.int64)
        kernel.land(grown, ground, parents, region, np.ascontiguousarray(points[:, None]), normals, out, at)
        return out[:, 0], np.where(at[:, 0] >= 0, at[:, 0], grown.vt[parents[:, 0]])

    spot = 0.5 * (mesh.X[ends[:, 0]] + mesh.X[ends[:, 1]]) if middle is None else middle
    spot, at = land(ends, quad_mesh.region[owner], spot, towards)
    kernel.place_new(grown, ground, n, curve, arc, spot, at)
    half = grown.X[n : n + e]
    spot = 0.5 * half[number].sum(axis=1) - 0.25 * mesh.X[quads].sum(axis=1)  # the Coons patch's
    spot, at = land(np.ascontiguousarray(n + number), quad_mesh.region, spot, quad_mesh.outward)
    kernel.place_new(grown, ground, n + e, np.full(m, -1), np.zeros((m, 2)), spot, at)
    ahead, behind = n + number, n + np.roll(number, 1, axis=1)
    centre = np.broadcast_to((n + e + np.arange(m))[:, None], (m, 4))
    new_sides = np.concatenate([np.stack([sides[:, 0], n + which], axis=1), np.stack([n + which, sides[:, 1]], axis=1)])
    fine = QuadMesh(
        ground,
        grown,
        np.ascontiguousarray(np.stack([quads, ahead, centre, behind], axis=2).reshape(-1, 4)),
        np.repeat(quad_mesh.region, 4),
        np.repeat(quad_mesh.outward, 4, axis=0),
        new_sides,
        np.concatenate([quad_mesh.side_curve, quad_mesh.side_curve]),
    )
    update_outward(grown, ground, fine.quads, fine.region, fine.outward)
    return Finer(fine, keys)


def side_arcs(quad_mesh: QuadMesh) -> Array:
    """(k, 2) arc lengths of both ends of each of `sides` on its curve."""
    mesh, ground, sides = quad_mesh.mesh, quad_mesh.ground, quad_mesh.sides
    length = ground.along[ground.off[quad_mesh.side_curve + 1] - 1] if len(sides) else np.zeros(0)
    low = np.where(mesh.kind[sides[:, 0]] == 1, mesh.vs[sides[:, 0]], 0.0)
    high = np.where(mesh.kind[sides[:, 1]] == 1, mesh.vs[sides[:, 1]], length)
    return np.stack([low, high], axis=1)


def part_of(quad_mesh: QuadMesh, which: IntArray) -> QuadMesh:
    """Some of the quads, with vertices of their own in the same places of the arrays."""
    quads = np.ascontiguousarray(quad_mesh.quads[which])
    n = len(quad_mesh.mesh.X)
    tail, head = quads.reshape(-1), np.roll(quads, -1, axis=1).reshape(-1)
    keys = np.minimum(tail, head) * n + np.maximum(tail, head)
    low, high = quad_mesh.sides.min(axis=1), quad_mesh.sides.max(axis=1)
    kept = np.isin(low * n + high, keys)
    return replace(
        quad_mesh.copy(),
        quads=quads,
        region=np.ascontiguousarray(quad_mesh.region[which]),
        outward=np.ascontiguousarray(quad_mesh.outward[which]),
        sides=np.ascontiguousarray(quad_mesh.sides[kept]),
        side_curve=np.ascontiguousarray(quad_mesh.side_curve[kept]),
    )
