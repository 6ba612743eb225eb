"""The surface of a block of grid points as triangles."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.io.polygons import triangulated

AXES = "ijk"


def block_faces(path: Path, block: Array, visible: BoolArray) -> list[tuple[str, IntArray]]:
    """The faces of a block with their label.

    Parameters
    ----------
    path : for an error's text
    block : (ni, nj, nk, 3) points
    visible : (ni, nj, nk) False at blanked nodes; a cell that has one is left out

    Returns
    -------
    (label, triangles (m, 3)) for each face, indices into block.reshape(-1, 3): one face labelled "" of a block with one
    plane of nodes, facing along the first remaining direction × the second; "-imin" … "-kmax", facing outwards, of a
    volume block; none of a line or a point.
    """
    index: IntArray = np.arange(block[..., 0].size).reshape(block.shape[:3])
    thin = [axis for axis in range(3) if block.shape[axis] == 1]
    if len(thin) > 1:
        return []
    if thin:
        return [("", _cells(path, block, visible, np.take(index, [0], axis=thin[0]).squeeze(thin[0])))]
    faces = []
    for axis in range(3):
        for end, label in ((0, "min"), (-1, "max")):
            plane: IntArray = np.take(index, end, axis=axis)
            # i × j = k, j × k = i, but the plane of axis j has i before k, against k × i = j
            inwards = (end == 0) != (axis == 1)
            faces.append((f"-{AXES[axis]}{label}", _cells(path, block, visible, plane.T if inwards else plane)))
    unit = block.reshape(-1, 3) / max(float(np.abs(block).max()), np.finfo(np.float64).tiny)  # squares stay finite
    points = unit - unit.mean(axis=0)
    a, b, c = np.moveaxis(points[np.concatenate([triangles for _, triangles in faces])], 1, 0)
    if np.einsum("ij,ij->", a, np.cross(b, c)) < 0.0:  # a left-handed block: inside out
        faces = [(label, np.ascontiguousarray(triangles[:, ::-1])) for label, triangles in faces]
    return faces


def _cells(path: Path, block: Array, visible: BoolArray, plane: IntArray) -> IntArray:
    """(m, 3) two triangles for each cell of a plane of nodes (p, q), without those that have two equal corners."""
    quads = np.stack([plane[:-1, :-1], plane[1:, :-1], plane[1:, 1:], plane[:-1, 1:]], axis=-1).reshape(-1, 4)
    quads = quads[visible.reshape(-1)[quads].all(axis=1)]
    points = block.reshape(-1, 3)
    triangles, _ = triangulated(path, points, np.ascontiguousarray(quads).ravel(), np.arange(0, quads.size + 1, 4))
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    collapsed = (a == b).all(axis=1) | (b == c).all(axis=1) | (c == a).all(axis=1)
    kept: IntArray = triangles[~collapsed]
    return kept
