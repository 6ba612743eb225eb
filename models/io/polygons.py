"""Polygons of OBJ, PLY and OFF files as triangles."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import UnsupportedEntity

MOST_CORNERS = 20_000  # cutting ears takes time that grows with the square of the corners: some seconds at this number


def triangulated(path: Path, points: Array, corners: IntArray, offsets: IntArray) -> tuple[IntArray, IntArray]:
    """Triangles of polygons given one after the other.

    Planar polygons, concave too, give no inverted triangle; a quad is cut along the diagonal that leaves the better
    of the worse triangles. Polygons of fewer than three corners (points and lines) give none.

    Parameters
    ----------
    path : for the error's text
    points : (n, 3) float64
    corners : (c,) indices into `points`, in range, of all polygons
    offsets : (f + 1,) where each polygon's corners begin

    Returns
    -------
    triangles : (m, 3) indices into `points`, m the sum of corners − 2, in the polygons' order and direction
    owners : (m,) the polygon each triangle was cut from

    Raises
    ------
    UnsupportedEntity : a polygon of more than `MOST_CORNERS` corners.
    """
    from patchwright.models.io._polygon_kernel import triangulate

    sizes = np.diff(offsets)
    if sizes.size == 0:
        return np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64)
    if sizes.min() == sizes.max() == 3:
        return corners[offsets[0] : offsets[-1]].reshape(-1, 3), np.arange(len(sizes))
    if sizes.max() > MOST_CORNERS:
        raise UnsupportedEntity(
            f"{path}: polygon {int(np.argmax(sizes)) + 1} has {sizes.max()} corners, more than "
            f"{MOST_CORNERS}; export triangles"
        )
    count = int(np.maximum(sizes - 2, 0).sum())
    triangles = np.empty((count, 3), dtype=np.int64)
    owners = np.empty(count, dtype=np.int64)
    with np.errstate(all="ignore"):
        triangulate(points, corners, offsets, triangles, owners)
    return triangles, owners
