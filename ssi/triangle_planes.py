"""Planes of triangles and planes upright on their sides; how far points are from triangles."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array


def planes(corners: Array) -> Array:
    """(m, 4, 4) normals and offsets of the triangles' planes and of those upright on their sides, positive inside."""
    way = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(way[:, 0], way[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inward = np.cross(normal[:, None], way)
    inward /= np.linalg.norm(inward, axis=2, keepdims=True)
    normals = np.concatenate([normal[:, None], inward], axis=1)
    through = np.concatenate([corners[:, :1], corners], axis=1)
    return np.concatenate([normals, -np.einsum("mki,mki->mk", normals, through)[..., None]], axis=2)


def from_triangles(points: Array, corners: Array) -> Array:
    """(n,) distance of each point from its own triangle (n, 3, 3)."""
    upright = planes(corners)
    heights = np.einsum("mki,mi->mk", upright[..., :3], points) + upright[..., 3]
    way = np.roll(corners, -1, axis=1) - corners
    away = points[:, None] - corners
    share = np.clip(np.einsum("mki,mki->mk", away, way) / np.einsum("mki,mki->mk", way, way), 0.0, 1.0)
    sides = np.linalg.norm(away - share[..., None] * way, axis=2).min(axis=1, initial=np.inf)
    inside = (heights[:, 1:] >= 0.0).all(axis=1)
    return np.asarray(np.where(inside, np.abs(heights[:, 0]), sides))
