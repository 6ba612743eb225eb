"""Coarse triangles on a triangulation: edges as long as a size field asks, along the features, topology kept.

First short edges are collapsed onto one of their ends, the shortest first, so that all vertices stay vertices of the
input; then rounds of splits, flips, collapses and smoothing (after Botsch and Kobbelt, SGP 2004, with lengths that
vary) even out the rest. New and moved vertices are put back on the surface by walking over it, never across a feature.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import GeometryError
from patchwright.repair.layout.features import Features

LONG, SHORT = 4.0 / 3.0, 4.0 / 5.0  # of the wanted length: split above, collapse below
LONGEST = 1.6  # of the wanted length: no collapse makes a longer edge
MOST_TRIANGLES = 200_000  # a coarse mesh has thousands: beyond this, splitting runs away
ROUNDS = 6


@dataclass(frozen=True, slots=True, eq=False)
class CoarseMesh:
    """Coarse triangles with what their vertices and sides lie on.

    `ground` and `mesh` are the kernels' records (see `_remesh_kernel`); `mesh` holds no dead vertex or triangle.
    """

    ground: Any
    mesh: Any

    @property
    def vertices(self) -> Array:
        """(n, 3)."""
        return np.asarray(self.mesh.X)

    @property
    def triangles(self) -> IntArray:
        """(m, 3)."""
        return np.asarray(self.mesh.T)

    @property
    def side_curve(self) -> IntArray:
        """(m, 3) feature curve each side lies on, -1 smooth."""
        return np.asarray(self.mesh.F)


def remesh(features: Features, size: Array) -> CoarseMesh:
    """Triangles with edges about as long as `size` (n,), wanted lengths at the vertices of `features.body`."""
    from patchwright.repair.layout import _remesh_kernel as kernel

    ground = ground_of(features, size)
    mesh = _start(features, ground)
    count = len(mesh.T)
    length = np.linalg.norm(
        features.body.vertices[features.body.triangles[:, 0]] - features.body.vertices[features.body.triangles[:, 1]],
        axis=1,
    )
    wanted = size[features.body.triangles[:, 0]]
    finest = float(np.quantile(length / wanted, 0.02))
    scales = SHORT * 0.5 ** np.arange(max(0, int(np.ceil(-np.log2(max(finest, 1e-4))))) + 1)[::-1]
    for scale in scales:
        kernel.collapse_pass(mesh, ground, count, float(scale), LONGEST)
        if scale > 0.1 * SHORT:
            kernel.flip_pass(mesh, ground, count)
    mesh = _compact(mesh)
    for turn in range(ROUNDS):
        mesh = _split(mesh, ground)
        kernel.flip_pass(mesh, ground, len(mesh.T))
        for _ in range(3):
            if kernel.collapse_pass(mesh, ground, len(mesh.T), SHORT, LONGEST) == 0:
                break
        mesh = _compact(mesh)
        for _ in range(3):
            kernel.flip_pass(mesh, ground, len(mesh.T))
            kernel.smooth_pass(mesh, ground, len(mesh.X), 0.6 if turn < ROUNDS - 1 else 0.9)
    kernel.flip_pass(mesh, ground, len(mesh.T))
    return CoarseMesh(ground, mesh)


def ground_of(features: Features, size: Array) -> Any:
    """The kernels' record of a triangulation with its curves and wanted lengths."""
    from patchwright.repair.layout import _remesh_kernel as kernel

    body = features.body
    anchor = np.full(len(body.vertices), -1, dtype=np.int64)
    anchor[features.corners] = np.arange(len(features.corners))
    flat = body.triangles.reshape(-1)
    here = np.flatnonzero(anchor[flat] >= 0)
    owner = anchor[flat[here]]
    order = np.argsort(owner, kind="stable")
    fan_off = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=len(features.corners)))]).astype(np.int64)
    first, last = features.vertices[features.offsets[:-1]], features.vertices[features.offsets[1:] - 1]
    return kernel.Ground(
        np.array(body.vertices),
        np.array(body.triangles),
        features.neighbours,
        features.side_curve,
        features.normals,
        features.region,
        np.ascontiguousarray(size, dtype=np.float64),
        features.offsets.astype(np.int64),
        features.vertices.astype(np.int64),
        features.along,
        features.beside,
        anchor[first],
        anchor[last],
        fan_off,
        (here[order] // 3).astype(np.int64),
    )


def _start(features: Features, ground: Any) -> Any:
    """The input itself as a mesh to be changed."""
    from patchwright.repair.layout import _remesh_kernel as kernel

    body = features.body
    n = len(body.vertices)
    normal = np.zeros((n, 3))
    weighted = features.normals * body.areas[:, None]
    for k in range(3):
        for d in range(3):
            normal[:, d] += np.bincount(body.triangles[:, k], weights=weighted[:, d], minlength=n)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    kind, vc, vs = np.zeros(n, dtype=np.int64), np.full(n, -1, dtype=np.int64), np.zeros(n)
    owner = np.repeat(np.arange(len(features.kind)), np.diff(features.offsets))
    kind[features.vertices], vc[features.vertices], vs[features.vertices] = 1, owner, features.along
    kind[features.corners], vc[features.corners], vs[features.corners] = 2, np.arange(len(features.corners)), 0.0
    any_triangle = np.zeros(n, dtype=np.int64)
    any_triangle[body.triangles.reshape(-1)] = np.repeat(np.arange(len(body)), 3)
    return kernel.Mesh(
        np.array(body.vertices),
        normal,
        np.array(ground.h),
        kind,
        vc,
        vs,
        any_triangle.copy(),
        any_triangle,
        np.array(body.triangles),
        features.neighbours.copy(),
        features.side_curve.copy(),
        features.region.copy(),
        np.zeros(n, dtype=np.int64),
    )


def _compact(mesh: Any, vertices: int | None = None, triangles: int | None = None, room: int = 0) -> Any:
    """Without dead vertices and triangles; with `room` further rows of each."""
    from patchwright.repair.layout import _remesh_kernel as kernel

    n, m = len(mesh.X) if vertices is None else vertices, len(mesh.T) if triangles is None else triangles
    alive_v, alive_t = np.flatnonzero(mesh.v2t[:n] >= 0), np.flatnonzero(mesh.T[:m, 0] >= 0)
    new_v, new_t = np.full(n + 1, -1, dtype=np.int64), np.full(m + 1, -1, dtype=np.int64)
    new_v[alive_v], new_t[alive_t] = np.arange(len(alive_v)), np.arange(len(alive_t))

    def rows(values: Any, which: IntArray) -> Any:
        out = np.zeros((len(which) + room, *values.shape[1:]), dtype=values.dtype)
        out[: len(which)] = values[which]
        return out

    out = [rows(values, alive_v) for values in mesh[:8]] + [rows(values, alive_t) for values in mesh[8:12]]
    if room:
        out[7][len(alive_v) :] = -1
        out[8][len(alive_t) :] = -1
    out[7][: len(alive_v)] = new_t[out[7][: len(alive_v)]]
    out[8][: len(alive_t)] = new_v[out[8][: len(alive_t)]]
    out[9][: len(alive_t)] = new_t[out[9][: len(alive_t)]]
    return kernel.Mesh._make([*out, np.zeros(len(alive_v) + room, dtype=np.int64)])


def _split(mesh: Any, ground: Any) -> Any:
    """All long edges halved, in arrays that grow as needed."""
    from patchwright.repair.layout import _remesh_kernel as kernel

    while True:
        n, m = len(mesh.X), len(mesh.T)
        if m > MOST_TRIANGLES:
            raise GeometryError(f"the remeshing does not settle: {m} triangles and edges still longer than wanted")
        mesh = _compact(mesh, room=2 * m + 64)
        used_v, used_t = kernel.split_pass(mesh, ground, n, m, LONG)
        full = used_v + 1 > len(mesh.X) or used_t + 2 > len(mesh.T)
        mesh = _compact(mesh, used_v, used_t)
        if not full:
            return mesh
