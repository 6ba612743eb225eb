"""Tips: points of a triangulation that stand alone, such as the apex of a cone, where no tangent plane is."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from patchwright.models.arrays import Array, BoolArray
from patchwright.models.triangulation import Triangulation

BACK = -0.5  # cosine of the angle to the mean normal at which a triangle turns its back


def find_tips(body: Triangulation, normals: Array, on_curve: BoolArray, angle: float, reach: float = 0.0) -> BoolArray:
    """(n,) vertices off all curves round which no triangle faces the way their mean normal does.

    Parameters
    ----------
    body : a 2-manifold
    normals : (m, 3) unit normals freed from noise
    on_curve : (n,) vertices on feature curves
    angle : degrees; as much does every triangle round a tip lean away from the mean
    reach : and so do all triangles whose middles are no farther from it, and no curve is nearer; where one does not, or
        a triangle turns its back, the tip is a scratch

    The triangles count by their angles at the vertex. On a cone all lean by the complement of its half angle, so a cone
    blunter than the complement of `angle` has no tip.
    """
    flat = body.triangles.reshape(-1)
    ahead = np.roll(body.corners, -1, axis=1) - body.corners
    back = np.roll(body.corners, 1, axis=1) - body.corners
    opening = np.arctan2(np.linalg.norm(np.cross(ahead, back), axis=2), (ahead * back).sum(axis=2)).reshape(-1)
    mean = np.zeros((len(body.vertices), 3))
    np.add.at(mean, flat, np.repeat(normals, 3, axis=0) * opening[:, None])
    size = np.linalg.norm(mean, axis=1, keepdims=True)
    mean = np.divide(mean, size, out=np.zeros_like(mean), where=size > 0)
    most, least = np.full(len(mean), -1.0), np.full(len(mean), 1.0)
    facing = np.einsum("ij,ij->i", np.repeat(normals, 3, axis=0), mean[flat])
    np.maximum.at(most, flat, facing)
    np.minimum.at(least, flat, facing)
    leans = np.cos(np.radians(angle))
    tips = (most < leans) & (least > BACK) & ~on_curve & (size[:, 0] > 0.0)
    some = np.flatnonzero(tips)
    if len(some):
        tips[some] = _most_facing(body, normals, body.vertices[some], mean[some], reach) < leans
    some = np.flatnonzero(tips)
    if len(some) and on_curve.any():
        tips[some] = cKDTree(body.vertices[on_curve]).query(body.vertices[some])[0] > reach
    return np.asarray(tips)


def _most_facing(body: Triangulation, normals: Array, points: Array, directions: Array, reach: float) -> Array:
    """(k,) largest cosine between each direction and the normals of triangles whose middles are near its point."""
    near: Any = cKDTree(body.corners.mean(axis=1)).query_ball_point(points, reach)
    count = np.array([len(own) for own in near])
    triangles = np.concatenate([np.asarray(own, dtype=np.int64) for own in near])
    owner = np.repeat(np.arange(len(points)), count)
    most = np.full(len(points), -1.0)
    np.maximum.at(most, owner, np.einsum("ij,ij->i", normals[triangles], directions[owner]))
    return most
