"""Quads made regular: discs round irregular vertices are filled anew with fewer of them.

A disc of quads grows round an irregular vertex until its border is convex, and on to the next irregular vertex; where
its border can be filled with a pattern of fewer irregular vertices (`_pattern_kernel`), it is, unless a quad came out
poor or too long (after Bunin, Non-local topological clean-up, IMR 2006, and Verma and Suresh, A robust combinatorial
approach to reduce singularities in quadrilateral meshes, CAD 85, 2017). Discs do not reach across features; where the
numbers of edges on two sides of a region differ, curves lose edges, two at a time, if discs then gain by it
(`_zip_kernel`). Curves, their corners and the boundary stay where they are.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from patchwright.models.arrays import BoolArray, IntArray
from patchwright.repair.layout.pairing import QuadMesh

LIMITS = (24, 60, 150)  # quads of the discs, pass by pass
PASSES = 2  # with each limit, as long as something changes
TURNS = 3  # zipping and then filling, as long as something is zipped
ZIP_LIMIT = 50  # quads of the discs that shall make a zip worth while
MOST_RISE = 8  # defects more for the time being
LEAST = 0.3  # scaled Jacobian of new quads, before they are smoothed with all the others
STRETCH = 2.0  # longest new edge over the wanted length of coarse triangles, which is twice that of quads
FOLD_RINGS = 2  # of quads round folded ones that start smoothed
ROOM = 4  # times the quads and vertices there are: room for those of one pass


def regularize(quad_mesh: QuadMesh) -> QuadMesh:
    """Quads on the same ground along the same features, with fewer irregular vertices.

    The given quads need not be smooth, and the new ones are not; vertices on curves keep their places.
    """
    from patchwright.repair.layout import _zip_kernel as zipper

    for limit in LIMITS:
        quad_mesh = _filled(quad_mesh, limit)
    for _ in range(TURNS):
        mesh, net = opened(quad_mesh, ROOM, 8 * LIMITS[-1] + 64)
        disc, scratch = _room(len(net.quads), len(net.at), LIMITS[-1])
        done = zipper.zip_up(mesh, quad_mesh.ground, net, disc, scratch, ZIP_LIMIT, LEAST, STRETCH, MOST_RISE)
        zipped = closed(quad_mesh, mesh, net) if done else quad_mesh
        if not done or not simple(zipped):
            break
        quad_mesh = _filled(zipped, LIMITS[-1])
    return quad_mesh


def _filled(quad_mesh: QuadMesh, limit: int) -> QuadMesh:
    """Discs of up to `limit` quads filled anew as long as that changes anything."""
    from patchwright.repair.layout import _regular_kernel as kernel

    for _ in range(PASSES):
        mesh, net = opened(quad_mesh, ROOM, 8 * limit + 64)
        disc, scratch = _room(len(net.quads), len(net.at), limit)
        if not kernel.regularize(mesh, quad_mesh.ground, net, disc, scratch, limit, LEAST, STRETCH):
            break
        filled = closed(quad_mesh, mesh, net)
        if not simple(filled):
            break
        quad_mesh = filled
    return quad_mesh


def simple(quad_mesh: QuadMesh) -> bool:
    """Whether no two edges of quads have the same two ends, which are all that a layout tells edges by."""
    tail, head = quad_mesh.quads.reshape(-1), np.roll(quad_mesh.quads, -1, axis=1).reshape(-1)
    return len(np.unique(tail * len(quad_mesh.mesh.X) + head)) == len(tail)


def opened(quad_mesh: QuadMesh, times: int, more: int) -> tuple[Any, Any]:
    """The quads as half-edges (`_disc_kernel.Net`) with room for others, and their vertices with as much room."""
    from patchwright.repair.layout import _disc_kernel as kernel

    quads = quad_mesh.quads
    m, n = len(quads), len(quad_mesh.mesh.X)
    room_q, room_v = times * m + more, times * n + more
    tail, head = quads.reshape(-1), np.roll(quads, -1, axis=1).reshape(-1)
    forth, back = tail * n + head, head * n + tail
    order = np.argsort(forth)
    place = np.minimum(np.searchsorted(forth[order], back), len(order) - 1)
    twin = np.where(forth[order[place]] == back, order[place], -1)
    begin, end = quad_mesh.sides[:, 0], quad_mesh.sides[:, 1]
    curve, along = np.full(4 * m, -1), np.zeros(4 * m, dtype=np.int64)
    for key, way in ((begin * n + end, 1), (end * n + begin, -1)):
        place = np.minimum(np.searchsorted(forth[order], key), len(order) - 1)
        there = forth[order[place]] == key
        curve[order[place[there]]], along[order[place[there]]] = quad_mesh.side_curve[there], way
    at = np.full(n, -1)
    at[tail] = np.arange(4 * m)
    net = kernel.Net(
        _grown(quads, room_q),
        _grown(twin, 4 * room_q, -1),
        _grown(curve, 4 * room_q, -1),
        _grown(along, 4 * room_q),
        _grown(quad_mesh.region, room_q),
        _grown(quad_mesh.outward, room_q),
        _grown(at, room_v, -1),
        np.array([m, n, 0, 0, 0]),
        np.zeros((16 * room_q, 3), dtype=np.int64),
        np.zeros((4 * room_v, 10)),
    )
    net.quads[m:, 0] = -1
    mesh = quad_mesh.mesh
    columns = [_grown(v, room_v) for v in mesh[:8]]
    return mesh._replace(**dict(zip(mesh._fields[:8], columns, strict=True)), mark=np.zeros(room_v, np.int64)), net


def closed(quad_mesh: QuadMesh, mesh: Any, net: Any) -> QuadMesh:
    """The live quads and vertices of a net."""
    alive = np.flatnonzero(net.quads[: net.used[0], 0] >= 0)
    quads = net.quads[alive]
    kept = np.unique(quads)
    number = np.full(len(net.at), -1)
    number[kept] = np.arange(len(kept))
    half = (4 * alive[:, None] + np.arange(4)).reshape(-1)
    tail, head = number[quads.reshape(-1)], number[np.roll(quads, -1, axis=1).reshape(-1)]
    once = (net.curve[half] >= 0) & ((net.twin[half] < 0) | (half < net.twin[half]))
    forth = net.along[half[once]] > 0
    begin, end = np.where(forth, tail[once], head[once]), np.where(forth, head[once], tail[once])
    columns: Any = [np.ascontiguousarray(v[kept]) for v in mesh[:8]]
    return QuadMesh(
        quad_mesh.ground,
        mesh._replace(**dict(zip(mesh._fields[:8], columns, strict=True)), mark=np.zeros(len(kept), np.int64)),
        np.ascontiguousarray(number[quads]),
        np.ascontiguousarray(net.region[alive]),
        np.ascontiguousarray(net.outward[alive]),
        np.stack([begin, end], axis=1),
        net.curve[half[once]],
    )


def _grown(values: Any, rows: int, rest: int = 0) -> Any:
    out = np.full((rows, *np.shape(values)[1:]), rest, dtype=np.asarray(values).dtype)
    out[: len(values)] = values
    return out


def _room(quads: int, vertices: int, limit: int) -> tuple[Any, Any]:
    """Scratch for discs of up to `limit` quads and the patterns that fill their borders."""
    from patchwright.repair.layout import _disc_kernel, _regular_kernel

    def integers(*shape: int) -> IntArray:
        return np.zeros(shape, dtype=np.int64)

    rows: Any = [quads, vertices, vertices, quads, *[vertices] * 5, 8, 4, quads, quads, quads]
    disc = _disc_kernel.Disc._make([integers(n) for n in rows])
    most = max(min((limit + 8) ** 2 // 2 + 64, 20000), quads + 8, vertices + 8)
    scratch = _regular_kernel.Scratch(
        integers(most, 4),
        integers(most),
        integers(2 * most),
        integers(most),
        integers(vertices),
        integers(vertices),
        integers(most),
        integers(8 * most),
        integers(most),
        integers(4 * most),
        integers(128),
    )
    return disc, scratch


def unfolded(quad_mesh: QuadMesh) -> tuple[QuadMesh, QuadMesh | None]:
    """The quads where those near folded ones are smoothed, and the quads where all are.

    The first are a copy, or the quads themselves where none is folded; then nothing has been smoothed: None.
    """
    from patchwright.repair.layout.quad_smooth import scaled_jacobians, smooth, update_outward

    near: BoolArray = scaled_jacobians(quad_mesh) <= 0.0
    if not near.any():
        return quad_mesh, None
    own, smoothed = quad_mesh.copy(), quad_mesh.copy()
    smooth(smoothed)
    for _ in range(FOLD_RINGS):
        vertices = np.zeros(len(own.mesh.X), dtype=bool)
        vertices[own.quads[near]] = True
        near = np.asarray(vertices[own.quads].any(axis=1))
    which = np.unique(own.quads[near])
    for mine, other in zip(own.mesh[:8], smoothed.mesh[:8], strict=True):
        mine[which] = other[which]
    update_outward(own.mesh, own.ground, own.quads, own.region, own.outward)
    return own, smoothed
