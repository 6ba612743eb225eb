"""Which triangles of two meshes can meet: a linear sieve before the trees, which need n log n."""

from __future__ import annotations

from functools import partial

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.tree import side_by_side
from patchwright.models.triangulation import Triangulation

FINEST = 4  # doublings of the coarse grid: 256 cells along an axis are 2 MB of bits, what a core's cache holds
SPARSE = 4096  # fewer triangles than this go to the tree as they are


def near(a: Triangulation, b: Triangulation) -> tuple[IntArray, IntArray]:
    """Triangles of `a` and of `b` that may touch one of the other; a superset, rising. Linear in time."""
    from patchwright.ssi import _mesh_cull_kernel as kernel

    if not len(a) or not len(b):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    meshes = (a, b)
    boxes = np.empty((2, 2, 3))
    side_by_side([partial(kernel.spread, m.vertices, box) for m, box in zip(meshes, boxes, strict=True)])
    box = np.stack([boxes[:, 0].max(axis=0), boxes[:, 1].min(axis=0)])
    if (box[0] > box[1]).any():
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    keep = [np.ones(len(m), dtype=np.bool_) for m in meshes]
    if max(len(a), len(b)) > SPARSE:
        # a surface of n triangles of one size has about sqrt(n / 2) squares along a side: about four of them to a cell
        wanted = np.sqrt(max(len(a), len(b)) / 2.0) / 4.0
        _sieve(meshes, keep, box, int(np.clip(np.round(np.log2(wanted / kernel.COARSE)), 0, FINEST)))
    return np.flatnonzero(keep[0]), np.flatnonzero(keep[1])


def _sieve(meshes: tuple[Triangulation, Triangulation], keep: list[BoolArray], box: Array, shift: int) -> None:
    """Mark the cells of each mesh and drop from `keep` the triangles in cells the other does not touch."""
    from patchwright.ssi import _mesh_cull_kernel as kernel

    cells = kernel.COARSE << shift
    size = box[1] - box[0]
    scale = np.divide(cells, size, out=np.zeros(3), where=size > 0.0)
    scale[~np.isfinite(scale)] = 0.0
    fine = np.zeros((2, cells**3 // 8), dtype=np.uint8)
    coarse = np.zeros((2, kernel.COARSE**3), dtype=np.uint8)
    cell = [np.empty((len(m), 6), dtype=np.uint8) for m in meshes]
    side_by_side(
        [
            partial(kernel.mark, m.vertices, m.triangles, keep[n], box, scale, shift, cell[n], fine[n], coarse[n])
            for n, m in enumerate(meshes)
        ]
    )
    side_by_side(
        [partial(kernel.sift, keep[n], shift, cell[n], fine[1 - n], coarse[1 - n]) for n in range(len(meshes))]
    )
