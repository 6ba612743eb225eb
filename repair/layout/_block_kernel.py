"""Kernels of `blocks`: traces through a quad mesh, and the place of every quad in its block.

A half-edge is 4 q + k: side k of quad q, from its corner k to the next. `twin` holds the half-edge on the other side
of the edge, -1 on a boundary.
"""

# mypy: disable-error-code="untyped-decorator"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import inner, kernel
from patchwright.models.arrays import BoolArray, IntArray


@inner
def following(h: int) -> int:
    """The next half-edge round the same quad."""
    return h - 3 if h % 4 == 3 else h + 1


@inner
def preceding(h: int) -> int:
    """The half-edge before, round the same quad."""
    return h + 3 if h % 4 == 0 else h - 1


@inner
def straight_on(twin: IntArray, h: int) -> int:
    """The half-edge opposite the end of `h` at a vertex of four quads, -1 where a boundary is met."""
    across = twin[following(h)]
    return -1 if across < 0 else following(across)


@kernel
def starts(twin: IntArray, first: IntArray, edge: IntArray, wall: BoolArray, every: bool) -> IntArray:
    """Half-edges along which a trace must leave, so that no block has a corner of three quads or more.

    Parameters
    ----------
    first : (n,) an outgoing half-edge of each vertex, the most clockwise one on a boundary; -1 without quads
    edge : (4 m,) the edge of each half-edge
    wall : (e,) edges that are block borders already
    every : also halve the flat sides of vertices at which three borders or more meet (T-junctions)
    """
    out = np.empty(twin.shape[0], dtype=np.int64)
    count = 0
    spoke = np.empty(64, dtype=np.int64)
    for v in range(first.shape[0]):
        h = first[v]
        if h < 0:
            continue
        degree = 0
        walls = 0
        closed = False
        while degree < 64:
            spoke[degree] = h
            walls += wall[edge[h]]
            degree += 1
            last = preceding(h)
            h = twin[last]
            if h == first[v]:
                closed = True
                break
            if h < 0:
                walls += wall[edge[last]]
                break
        if closed and walls == 0 and degree == 4:
            continue
        if closed and walls == 1 and degree == 4:  # a border that ends here goes on
            for k in range(4):
                if wall[edge[spoke[k]]]:
                    out[count] = spoke[(k + 2) % 4]
                    count += 1
            continue
        free = closed and walls < 2
        for k in range(degree):
            if wall[edge[spoke[k]]]:
                continue
            if free:
                out[count] = spoke[k]
                count += 1
                continue
            before = 0  # quads to the border on either side
            while before < degree and not wall[edge[spoke[(k - before) % degree]]]:
                before += 1
            after = 0
            while after < degree:
                after += 1
                if (not closed and k + after == degree) or wall[edge[spoke[(k + after) % degree]]]:
                    break
            if before + after > 2 or (every and closed and walls > 2):
                out[count] = spoke[k]
                count += 1
    return out[:count]


@kernel
def trace(twin: IntArray, edge: IntArray, head: IntArray, wall: BoolArray, visited: BoolArray, start: IntArray) -> None:
    """Run all traces at one speed; each stops where it meets a border or an earlier trace. Fills `wall`, `visited`.

    Parameters
    ----------
    head : (4 m,) the vertex each half-edge leads to
    visited : (n,) vertices at which a trace stops: irregular ones and those on borders
    start : half-edges the traces leave by
    """
    alive = start.copy()
    count = alive.shape[0]
    arrived = np.zeros(visited.shape[0], dtype=np.int64)  # 1 + position in `alive` of the trace that goes on from there
    while count > 0:
        kept = 0
        for i in range(count):
            h = alive[i]
            if wall[edge[h]]:
                continue
            wall[edge[h]] = True
            if not visited[head[h]]:
                alive[kept] = h
                kept += 1
        count = kept
        for i in range(count):
            v = head[alive[i]]
            if arrived[v] == 0:
                arrived[v] = i + 1
            elif arrived[v] > 0 and edge[straight_on(twin, alive[arrived[v] - 1])] == edge[alive[i]]:
                arrived[v] = -1  # head on: both stop; of two that meet at a right angle the first goes on
        kept = 0
        for i in range(count):
            h = alive[i]
            v = head[h]
            visited[v] = True
            if arrived[v] == i + 1:
                ahead = straight_on(twin, h)
                alive[i] = ahead
            else:
                alive[i] = -1
        for i in range(count):
            if alive[i] >= 0:
                alive[kept] = alive[i]
                kept += 1
        count = kept
        arrived[:] = 0


@kernel
def place_quads(
    twin: IntArray, edge: IntArray, wall: BoolArray, block: IntArray, place: IntArray, turn: IntArray
) -> int:
    """Number the blocks and give each quad its place and turn in its own; returns how many blocks there are.

    `block` (m,) must come filled with -1. A quad reached by two ways with different places has its `turn` marked -1:
    its block closes on itself.
    """
    m = block.shape[0]
    queue = np.empty(m, dtype=np.int64)
    count = 0
    for seed in range(m):
        if block[seed] >= 0:
            continue
        block[seed] = count
        place[seed, 0] = place[seed, 1] = turn[seed] = 0
        queue[0] = seed
        size = 1
        at = 0
        while at < size:
            q = queue[at]
            at += 1
            for k in range(4):
                h = 4 * q + k
                if wall[edge[h]] or twin[h] < 0:
                    continue
                other, side = twin[h] // 4, twin[h] % 4
                way = (k + max(turn[q], 0)) % 4
                i = place[q, 0] + (1 if way == 1 else 0) - (1 if way == 3 else 0)
                j = place[q, 1] + (1 if way == 2 else 0) - (1 if way == 0 else 0)
                r = (way + 6 - side) % 4
                if block[other] < 0:
                    block[other] = count
                    place[other, 0], place[other, 1], turn[other] = i, j, r
                    queue[size] = other
                    size += 1
                elif turn[other] >= 0 and (place[other, 0] != i or place[other, 1] != j or turn[other] != r):
                    turn[other] = -1
        count += 1
    return count
