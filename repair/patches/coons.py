"""Discrete bilinear Coons patches, many at a time.

Source: Hamann, Jean, Razdan, section 3 (HJR 4); opposite sides have the same parameters u_I0 = u_IN and v_0J = v_MJ,
so that u_IJ and v_IJ are these: I/M and J/N where none are given.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import GeometryError


def coons_grid(
    south: Array, north: Array, west: Array, east: Array, *, u: Array | None = None, v: Array | None = None
) -> Array:
    """The points of the Coons patches of four boundary polylines each.

    Parameters
    ----------
    south, north : (..., M + 1, 3) boundary points at v = 0 and v = 1, along u
    west, east : (..., N + 1, 3) boundary points at u = 0 and u = 1, along v
    u, v : (M + 1,), (N + 1,) parameters of the boundary points, from 0 to 1; default equidistant

    Returns
    -------
    (..., M + 1, N + 1, 3), axis -3 along u.
    """
    m, n = south.shape[-2] - 1, west.shape[-2] - 1
    u = (np.arange(m + 1) / m if u is None else u)[:, None, None]
    v = (np.arange(n + 1) / n if v is None else v)[None, :, None]
    ruled_u = (1 - u) * west[..., None, :, :] + u * east[..., None, :, :]
    ruled_v = (1 - v) * south[..., :, None, :] + v * north[..., :, None, :]
    x00, xm0 = south[..., 0, :], south[..., -1, :]
    x0n, xmn = north[..., 0, :], north[..., -1, :]
    corners = (
        (1 - u) * (1 - v) * x00[..., None, None, :]
        + u * (1 - v) * xm0[..., None, None, :]
        + (1 - u) * v * x0n[..., None, None, :]
        + u * v * xmn[..., None, None, :]
    )
    return np.asarray(ruled_u + ruled_v - corners)  # HJR 4


def check_corners(south: Array, north: Array, west: Array, east: Array, tolerance: float) -> None:
    """The four boundary polylines of one patch must meet in its corners.

    Raises
    ------
    GeometryError : names the worst corner, the gap and the tolerance.
    """
    gaps = {
        "south-west": np.linalg.norm(south[0] - west[0]),
        "south-east": np.linalg.norm(south[-1] - east[0]),
        "north-west": np.linalg.norm(north[0] - west[-1]),
        "north-east": np.linalg.norm(north[-1] - east[-1]),
    }
    corner, gap = max(gaps.items(), key=lambda item: item[1])
    if gap > tolerance:
        raise GeometryError(
            f"the boundary curves miss each other at the {corner} corner by {gap:.3g}, "
            f"more than the tolerance {tolerance:.3g}"
        )


def offset_normals(grid: Array) -> Array:
    """Unit normals of point grids by central differences, one-sided on the boundary (HJR 5).

    Parameters
    ----------
    grid : (..., M + 1, N + 1, 3)

    Returns
    -------
    The same shape; a point where the differences are parallel takes the mean normal of its patch.
    """
    du, dv = np.gradient(grid, axis=-3), np.gradient(grid, axis=-2)
    normal = np.cross(du, dv)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    mean = normal.sum(axis=(-3, -2), keepdims=True)
    mean_length = np.linalg.norm(mean, axis=-1, keepdims=True)
    mean = np.divide(mean, mean_length, out=np.zeros_like(mean), where=mean_length > 0)
    scale = np.linalg.norm(du, axis=-1, keepdims=True) * np.linalg.norm(dv, axis=-1, keepdims=True)
    sound = length > 1e-6 * scale
    return np.asarray(np.where(sound, np.divide(normal, length, out=np.zeros_like(normal), where=length > 0), mean))


def offset_distance(grid: Array) -> Array:
    """(...,) an eighth of the perimeter of each patch, its sides measured by their chords (HJR 7)."""
    corner = [grid[..., 0, 0, :], grid[..., -1, 0, :], grid[..., -1, -1, :], grid[..., 0, -1, :]]
    chords = [np.linalg.norm(corner[(k + 1) % 4] - corner[k], axis=-1) for k in range(4)]
    return np.asarray(sum(chords)) / 8.0
