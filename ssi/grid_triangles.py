"""Structured surface grids as triangulations: every cell two triangles, block seams merged.

Limits: seams merge node by node, so blocks whose nodes do not match along a common edge stay apart there.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.structured_grid import StructuredGrid
from patchwright.models.triangulation import Triangulation


def grid_triangulation(grid: StructuredGrid, tolerance: float = 0.0) -> Triangulation:
    """The surface blocks of a grid as one triangulation, tagged by block, with node indices (i, j) as uv.

    A cell is cut along its shorter diagonal; of a cell collapsed to a triangle one triangle remains.

    Parameters
    ----------
    tolerance : border nodes of blocks nearer than this (model length unit) are one; 0 merges equal coordinates only

    Raises
    ------
    ParameterError : a block that is a volume or a line, a tolerance that is negative or NaN.
    """
    if not tolerance >= 0.0:
        raise ParameterError(f"the merging tolerance must be zero or a positive length, got {tolerance}")
    points: list[Array] = []
    rows: list[IntArray] = []
    uv: list[Array] = []
    tags: list[IntArray] = []
    rim: list[IntArray] = []
    base = 0
    for number, block in enumerate(grid.blocks):
        if sum(size > 1 for size in block.shape[:3]) != 2:
            raise ParameterError(f"block {number} of {block.shape[:3]} nodes is not a surface")
        nodes = block.reshape(*(size for size in block.shape[:3] if size > 1), 3)
        n, m = nodes.shape[:2]
        index = base + np.arange(n * m).reshape(n, m)
        triangles, where = _cells(nodes, index)
        points.append(nodes.reshape(-1, 3))
        rows.append(triangles)
        uv.append(where)
        tags.append(np.full(len(triangles), number))
        rim.append(np.unique(np.concatenate([index[0], index[-1], index[:, 0], index[:, -1]])))
        base += n * m
    if not points:
        return Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    vertices, parameters, tag = np.concatenate(points), np.concatenate(uv), np.concatenate(tags)
    triangles = _merged(vertices, np.concatenate(rim), tolerance)[np.concatenate(rows)]
    good = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    names = grid.names if len(grid.names) == len(grid.blocks) else tuple(f"block {k}" for k in range(len(grid.blocks)))
    return Triangulation(vertices, triangles[good], uv=parameters[good], tags=tag[good], tag_names=names).compact()


def _cells(nodes: Array, index: IntArray) -> tuple[IntArray, Array]:
    """Two triangles per cell of a block (n, m, 3), and the (i, j) of their corners."""
    m = index.shape[1]
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    first = np.linalg.norm(nodes[:-1, :-1] - nodes[1:, 1:], axis=2)
    second = np.linalg.norm(nodes[1:, :-1] - nodes[:-1, 1:], axis=2)
    pick = (first <= second)[..., None]
    one = np.where(pick, np.stack([a, b, c], axis=-1), np.stack([a, b, d], axis=-1))
    two = np.where(pick, np.stack([a, c, d], axis=-1), np.stack([b, c, d], axis=-1))
    rows = np.stack([one, two], axis=2).reshape(-1, 3)
    local = rows - index[0, 0]
    return rows, np.stack([local // m, local % m], axis=-1).astype(np.float64)


def _merged(points: Array, rim: IntArray, tolerance: float) -> IntArray:
    """(n,) the lowest node each node is one with."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    number = np.arange(len(points))
    if tolerance == 0.0:
        _, first, inverse = np.unique(points[rim], axis=0, return_index=True, return_inverse=True)
        number[rim] = rim[first][inverse.reshape(-1)]
        return number
    from scipy.spatial import cKDTree

    pairs = cKDTree(points[rim]).query_pairs(tolerance, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(rim), len(rim)))
    _, label = connected_components(graph, directed=False)
    _, first = np.unique(label, return_index=True)
    number[rim] = rim[first][label]
    return number
