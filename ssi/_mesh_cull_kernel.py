"""Kernels of `mesh_cull`: which triangles of two meshes can meet at all, in a few passes over each.

Space is cut into cells of a grid over the box common to both meshes; one bit per cell says whether a triangle's box
touches it. A triangle that covers many cells sets bits of a coarser grid instead, so that no triangle costs more than
the number of coarse cells.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call,return-value"

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from patchwright.models.arrays import Array, BoolArray, IntArray

Bytes = npt.NDArray[np.uint8]

COARSE = 16  # coarse cells along each axis; a fine grid has a multiple of it


@njit(cache=True, nogil=True)
def spread(points: Array, box: Array) -> None:
    """Make `box` (2, 3) that of the points."""
    x0, y0, z0 = points[0, 0], points[0, 1], points[0, 2]
    x1, y1, z1 = x0, y0, z0
    for v in range(points.shape[0]):
        x, y, z = points[v, 0], points[v, 1], points[v, 2]
        x0, x1 = x if x < x0 else x0, x if x > x1 else x1
        y0, y1 = y if y < y0 else y0, y if y > y1 else y1
        z0, z1 = z if z < z0 else z0, z if z > z1 else z1
    box[0, 0], box[0, 1], box[0, 2], box[1, 0], box[1, 1], box[1, 2] = x0, y0, z0, x1, y1, z1


@njit(cache=True, nogil=True)
def large(cell: Bytes, t: int) -> bool:
    """Whether a triangle covers so many fine cells that it goes into the coarse grid."""
    covered = np.int64(1)
    for k in range(3):
        covered *= np.int64(cell[t, k + 3]) - np.int64(cell[t, k]) + 1
    return covered > COARSE * COARSE


@njit(cache=True, nogil=True)
def mark(vertices: Array, triangles: IntArray, keep: BoolArray, box: Array, scale: Array, shift: int,
         cell: Bytes, fine: Bytes, coarse: Bytes) -> None:  # fmt: skip
    """Mark the cells of the triangles and drop from `keep` those off the box.

    The fine cells are COARSE << shift along each axis; `cell` (m, 6) becomes the lowest and highest of each triangle.
    `coarse` has bit 1 where anything lies, bit 2 where something too large for the fine grid does.
    """
    last = (COARSE << shift) - 1
    row = shift + 4  # a row of fine cells is 2^row
    for t in range(triangles.shape[0]):
        i, j, m = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        off = False
        for k in range(3):
            x, y, z = vertices[i, k], vertices[j, k], vertices[m, k]
            low = x if x < y else y
            low = z if z < low else low
            high = x if x > y else y
            high = z if z > high else high
            if low > box[1, k] or high < box[0, k]:
                off = True
                break
            # the same monotonic map for every coordinate: boxes that touch share a cell
            low = box[0, k] if low < box[0, k] else low
            high = box[1, k] if high > box[1, k] else high
            first, final = np.int64((low - box[0, k]) * scale[k]), np.int64((high - box[0, k]) * scale[k])
            cell[t, k] = first if first < last else last
            cell[t, k + 3] = final if final < last else last
        if off:
            keep[t] = False
            continue
        big = large(cell, t)
        x0, y0, z0 = np.int64(cell[t, 0]), np.int64(cell[t, 1]), np.int64(cell[t, 2])
        x1, y1, z1 = np.int64(cell[t, 3]), np.int64(cell[t, 4]), np.int64(cell[t, 5])
        if not big:
            for x in range(x0, x1 + 1):
                for y in range(y0, y1 + 1):
                    for z in range(z0, z1 + 1):
                        bit = (((x << row) + y) << row) + z
                        fine[bit >> 3] |= np.uint8(1 << (bit & 7))
        for x in range(x0 >> shift, (x1 >> shift) + 1):
            for y in range(y0 >> shift, (y1 >> shift) + 1):
                for z in range(z0 >> shift, (z1 >> shift) + 1):
                    coarse[(x * COARSE + y) * COARSE + z] |= np.uint8(3 if big else 1)


@njit(cache=True, nogil=True)
def sift(keep: BoolArray, shift: int, cell: Bytes, fine: Bytes, coarse: Bytes) -> None:
    """Drop from `keep` the triangles whose cells are not marked."""
    row = shift + 4
    for t in range(keep.shape[0]):
        if not keep[t]:
            continue
        big = large(cell, t)
        wanted = 1 if big else 2
        hit = False
        x0, y0, z0 = np.int64(cell[t, 0]), np.int64(cell[t, 1]), np.int64(cell[t, 2])
        x1, y1, z1 = np.int64(cell[t, 3]), np.int64(cell[t, 4]), np.int64(cell[t, 5])
        for x in range(x0 >> shift, (x1 >> shift) + 1):
            for y in range(y0 >> shift, (y1 >> shift) + 1):
                for z in range(z0 >> shift, (z1 >> shift) + 1):
                    hit |= coarse[(x * COARSE + y) * COARSE + z] & wanted != 0
        if not big and not hit:
            for x in range(x0, x1 + 1):
                for y in range(y0, y1 + 1):
                    for z in range(z0, z1 + 1):
                        bit = (((x << row) + y) << row) + z
                        hit |= (fine[bit >> 3] >> (bit & 7)) & 1 != 0
        keep[t] = hit
