"""The structured surface grid of a patch network: one block of nodes per block of quads."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import IntArray
from patchwright.models.structured_grid import StructuredGrid
from patchwright.repair.layout.blocks import Blocks
from patchwright.repair.patches.network import PatchNetwork


def block_grid(network: PatchNetwork, blocks: Blocks, intervals: int) -> StructuredGrid:
    """A multi-block grid whose nodes agree across every border bit for bit, T-junctions included.

    Parameters
    ----------
    network : the patches, one per quad
    blocks : of the network's layout
    intervals : per side of a quad; a block of M x N quads has M * intervals + 1 by N * intervals + 1 nodes
    """
    size = blocks.shape * intervals + 1
    offsets = np.concatenate([[0], np.cumsum(size.prod(axis=1))])
    at = _addresses(blocks, size, offsets[:-1], intervals)
    points, invented = np.empty((int(offsets[-1]), 3)), np.zeros(int(offsets[-1]), dtype=np.int64)
    points[at] = network.points(intervals)
    mark = network.invented_nodes(intervals)
    invented[at[mark]] = 1
    cut = offsets[1:-1]
    return StructuredGrid(
        tuple(p.reshape(i, j, 1, 3) for p, (i, j) in zip(np.split(points, cut), size, strict=True)),
        tuple(f"block-{i + 1}" for i in range(len(blocks))),
        tuple(p.reshape(i, j, 1) for p, (i, j) in zip(np.split(invented, cut), size, strict=True)),
    )


def _addresses(blocks: Blocks, size: IntArray, start: IntArray, intervals: int) -> IntArray:
    """(m, intervals + 1, intervals + 1) where each node of each quad stands in the list of all blocks' nodes."""
    t = np.arange(intervals + 1)
    a, b = np.broadcast_to(t[:, None], (len(t), len(t))), np.broadcast_to(t[None, :], (len(t), len(t)))
    far = intervals - t
    c, d = np.broadcast_to(far[:, None], a.shape), np.broadcast_to(far[None, :], a.shape)
    column = np.stack([a, d, c, b])[blocks.turn] + intervals * blocks.place[:, 0, None, None]
    row = np.stack([b, a, d, c])[blocks.turn] + intervals * blocks.place[:, 1, None, None]
    own = blocks.block
    return np.asarray(start[own][:, None, None] + column * size[own, 1][:, None, None] + row)
