"""Untangling: a body that passes through itself loses what lies inside it, so that a union can finish the work.

Take away the crossing triangles, and a body falls into patches; the winding number just outside a patch tells whether
it lies inside. Without the inner patches a blade that ran through its hub is a body of its own, open inside the hub:
closed there by a cap, which the union then drops.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.triangulation import Triangulation

SAMPLES = 5  # triangles asked per patch, the largest ones


def inner_patches(triangulation: Triangulation, body: IntArray, pairs: IntArray, step: float) -> BoolArray:
    """(m,) triangles of patches that lie inside their own body.

    `body` (m,) labels closed, outward bodies, `pairs` (k, 2) are triangles of one body that cross; `step` is how far
    outside a triangle the winding number is asked for.
    """
    inner = np.zeros(len(triangulation), dtype=np.bool_)
    bad = np.zeros(len(triangulation), dtype=np.bool_)
    bad[pairs] = True
    areas, normals, corners = triangulation.areas, triangulation.normals, triangulation.corners
    for tangled in np.unique(body[pairs]):
        own = np.flatnonzero(body == tangled)
        rest = own[~bad[own]]
        if not len(rest):
            continue
        label = np.asarray(Adjacency.of(triangulation.take(rest)).components())
        for patch in range(int(label.max()) + 1):
            some = rest[label == patch]
            asked = some[np.argsort(-areas[some], kind="stable")[:SAMPLES]]
            points = corners[asked].mean(axis=1) + step * normals[asked]
            around = np.array([winding(corners[own], point) for point in points])
            if np.median(around) > 0.5:
                inner[some] = True
    return inner


def winding(corners: Array, point: Array) -> float:
    """Generalised winding number of triangles (m, 3, 3) around one point, after A. Van Oosterom, J. Strackee, 1983."""
    local = corners - point
    length = np.linalg.norm(local, axis=2)
    p, q, r = local[:, 0], local[:, 1], local[:, 2]
    six = np.einsum("ij,ij->i", p, np.cross(q, r))
    under = (
        length.prod(axis=1)
        + np.einsum("ij,ij->i", p, q) * length[:, 2]
        + np.einsum("ij,ij->i", q, r) * length[:, 0]
        + np.einsum("ij,ij->i", r, p) * length[:, 1]
    )
    return float(np.arctan2(six, under).sum() / (2.0 * np.pi))
