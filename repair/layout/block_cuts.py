"""Blocks cut into smaller ones: along edges that must be borders, and where a block meets itself."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import BoolArray, IntArray
from patchwright.repair.layout.blocks import Blocks
from patchwright.repair.layout.quad_layout import QuadLayout


def cut_along(layout: QuadLayout, blocks: Blocks, border: BoolArray) -> Blocks:
    """The blocks cut from side to side along every line with an edge that must be a border, `border` (e,)."""
    quad, side = np.nonzero(border[layout.quad_edges])
    side = (side + blocks.turn[quad]) % 4
    own, place = blocks.block[quad], blocks.place[quad]
    segments = []
    for axis, ahead, behind in ((0, 1, 3), (1, 2, 0)):
        after = np.concatenate([place[side == ahead, axis], place[side == behind, axis] - 1])
        of = np.concatenate([own[side == ahead], own[side == behind]])
        segments.append(_segments(blocks, axis, of, after))
    return _parted(layout, blocks, np.stack([blocks.block, *segments], axis=1))


def cut_apart(layout: QuadLayout, blocks: Blocks) -> Blocks:
    """The blocks, those that meet themselves along an edge halved until none does."""
    one, two = layout.edge_quads.T
    while True:
        itself = blocks.wall & (two >= 0) & (blocks.block[one] == blocks.block[two])
        quad, side = np.nonzero(itself[layout.quad_edges])
        axis = (
            side + blocks.turn[quad] + 1
        ) % 2  # a block that meets itself at both ends of its columns is cut in them
        axis = np.where(blocks.shape[blocks.block[quad], axis] > 1, axis, 1 - axis)
        segments = []
        for k in (0, 1):
            of = np.unique(blocks.block[quad[axis == k]])
            segments.append(_segments(blocks, k, of, blocks.shape[of, k] // 2 - 1))
        if not any(segment.any() for segment in segments):
            return blocks
        blocks = _parted(layout, blocks, np.stack([blocks.block, *segments], axis=1))


def _segments(blocks: Blocks, axis: int, of: IntArray, after: IntArray) -> IntArray:
    """(m,) how many cuts lie before each quad along an axis; the blocks `of` are cut after those columns or rows."""
    start = np.concatenate([[0], np.cumsum(blocks.shape[:, axis])])
    inside = (after >= 0) & (after < blocks.shape[of, axis] - 1)
    ends = np.zeros(start[-1], dtype=np.int64)
    ends[start[of[inside]] + after[inside]] = 1
    before = np.concatenate([[0], np.cumsum(ends)])
    return np.asarray(before[start[blocks.block] + blocks.place[:, axis]] - before[start[blocks.block]])


def _parted(layout: QuadLayout, blocks: Blocks, label: IntArray) -> Blocks:
    """Rectangles within blocks: the quads with equal rows of `label` (m, k) make one."""
    _, block = np.unique(label, axis=0, return_inverse=True)
    block = np.asarray(block, dtype=np.int64).reshape(-1)
    low = np.full((int(block.max()) + 1, 2), np.iinfo(np.int64).max)
    high = np.zeros_like(low)
    np.minimum.at(low, block, blocks.place)
    np.maximum.at(high, block, blocks.place)
    one, two = layout.edge_quads.T
    wall = blocks.wall | ((two >= 0) & (block[one] != block[two]))
    return Blocks(wall, block, blocks.place - low[block], blocks.turn, high - low + 1)
