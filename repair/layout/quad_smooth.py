"""Quads made square: vertices move over the surface, on their feature curve or not at all, never spoiling a quad.

A plain mean of the neighbours where that does no harm; where a quad is poor, the best place among some tried ones
(smart Laplacian and pattern search). What is bettered is a sum over all corners round the vertex, not the worst alone:
beside a corner that features hold narrow the others still matter. Short sides count as well as angles.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.layout.pairing import QuadMesh

ROUNDS = 4  # normals at the quads' centres are renewed between rounds
EXTRA = 8  # further rounds, near quads poorer than POOR only
POOR = 0.1
PASSES = 6  # over all vertices in a round
GOAL = 0.6  # corner quality that evening out may go down to, and from which on no better place is searched for


def smooth(quad_mesh: QuadMesh, *, rounds: int = ROUNDS) -> None:
    """Move the vertices of `quad_mesh` in place."""
    from patchwright.repair.layout import _quad_kernel as kernel

    mesh, ground, quads = quad_mesh.mesh, quad_mesh.ground, np.ascontiguousarray(quad_mesh.quads)
    n = len(mesh.X)
    offsets, around = corners_by_vertex(quads, n)
    one, two = quads.reshape(-1), np.roll(quads, -1, axis=1).reshape(-1)
    key = np.unique(np.minimum(one, two) * n + np.maximum(one, two))
    lo, hi = key // n, key % n
    near_offsets, near = _csr(np.concatenate([lo, hi]), np.concatenate([hi, lo]), n)
    low, high = np.full(n, -1, dtype=np.int64), np.full(n, -1, dtype=np.int64)
    high[quad_mesh.sides[:, 0]] = quad_mesh.sides[:, 1]
    low[quad_mesh.sides[:, 1]] = quad_mesh.sides[:, 0]
    busy = np.ones(n, dtype=bool)
    for turn in range(rounds + EXTRA if rounds else 0):
        if turn >= rounds:
            poor: BoolArray = scaled_jacobians(quad_mesh) <= POOR
            if not poor.any():
                break
            beside = np.asarray(_around(quads, poor, n)[quads].any(axis=1))
            busy = _around(quads, beside, n)
        update_outward(mesh, ground, quads, quad_mesh.region, quad_mesh.outward)
        kernel.smooth_quads(
            mesh, ground, quads, quad_mesh.outward, offsets, around, near_offsets, near, low, high, busy, GOAL, PASSES
        )
    update_outward(mesh, ground, quads, quad_mesh.region, quad_mesh.outward)


def _around(quads: IntArray, which: BoolArray, n: int) -> BoolArray:
    """(n,) the vertices of some quads (m,)."""
    out = np.zeros(n, dtype=bool)
    out[quads[which]] = True
    return out


def update_outward(mesh: Any, ground: Any, quads: IntArray, region: IntArray, outward: Array) -> None:
    """Mean surface normals at the quads' centres and smooth corners, in place; the centres are walked to."""
    from patchwright.repair.layout import _quad_kernel as kernel

    centre = np.zeros((len(quads), 1, 3))
    for k in range(4):
        centre[:, 0] += 0.25 * mesh.X[quads[:, k]]
    triangle = np.empty((len(quads), 1), dtype=np.int64)
    kernel.land(mesh, ground, quads, region, centre, outward, np.empty_like(centre), triangle)
    # with the normals at smooth corners: the centre of a quad that bends round an edge may land on either skin
    total = ground.normal[triangle[:, 0]]
    for k in range(4):
        corner = quads[:, k]
        total += np.where((mesh.kind[corner] == 0)[:, None], mesh.N[corner], 0.0)
    size = np.sqrt(total[:, 0] ** 2 + total[:, 1] ** 2 + total[:, 2] ** 2)
    found = (triangle[:, 0] >= 0) & (size > 0.0)
    outward[found] = total[found] / size[found, None]


def scaled_jacobians(quad_mesh: QuadMesh) -> Array:
    """(m,) least sine of each quad's corner angles along the surface normal; -1 for a quad turned against it."""
    from patchwright.repair.layout import _quad_kernel as kernel

    out = np.empty(len(quad_mesh.quads))
    kernel.all_qualities(quad_mesh.mesh, np.ascontiguousarray(quad_mesh.quads), quad_mesh.outward, out)
    return out


def corners_by_vertex(quads: IntArray, count: int) -> tuple[Any, Any]:
    """The quads round each vertex as (offsets, quads)."""
    return _csr(quads.reshape(-1), np.repeat(np.arange(len(quads)), 4), count)


def _csr(owner: IntArray, values: IntArray, count: int) -> tuple[Any, Any]:
    order = np.argsort(owner, kind="stable")
    offsets = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=count))])
    return offsets.astype(np.int64), np.ascontiguousarray(values[order], dtype=np.int64)
