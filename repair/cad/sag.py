"""How far the triangles of CAD faces stray from the surfaces they stand for."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly

SHARE = 99.0  # per cent of a face's triangles


def sags(model: Assembly, share: float = SHARE) -> Array:
    """(f,) the height of each face's surface over the middles of its triangles that `share` per cent stay below.

    Measured along the triangles' normals: the surface at the mean of a triangle's parameters lies above its middle to
    second order only, and beside it by much more where the parameters crowd. Zero where a part has no surface.
    """
    out = np.zeros(len(model.parts))
    for i, part in enumerate(model.parts):
        mesh = part.triangulation
        if part.surface is not None and mesh.uv is not None and len(mesh):
            u, v = mesh.uv.mean(axis=1).T
            away = np.asarray(part.surface(u, v)) - mesh.corners.mean(axis=1)
            out[i] = float(np.percentile(np.abs((away * mesh.normals).sum(axis=1)), share))
    return out
