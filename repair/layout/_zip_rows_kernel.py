"""Kernels of zipping: the surgery that makes one vertex of each row, and what it does to the vertices' defects.

The quads between zipped rows go, and the two quads before the first row and behind the last become one each. Every
change is noted, so that it can be taken back.
"""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import inner
from patchwright.repair.layout._block_kernel import following, preceding
from patchwright.repair.layout._disc_kernel import (
    ALONG,
    AT,
    CURVE,
    QUADS,
    TWIN,
    behind_in_sector,
    note,
    sector,
    sector_start,
)
from patchwright.repair.layout._rows_kernel import MOST_TURN, across, in_line, kept_of, next_round, turn_start


@inner
def defects_at(m, net, d, v):
    """How far the sectors round a vertex are from their targets, summed; 1000 where a free one has less than three."""
    start = turn_start(net, v)
    h = start
    total = 0
    for _ in range(MOST_TURN):
        behind = behind_in_sector(net, h)
        if behind < 0 or h == start:
            count, _, target = sector(m, net, h, d.quad_stamp, np.int64(-1))
            if behind < 0 or sector_start(net, h)[1]:
                total += abs(count - target)
                if target == 4 and count < 3 and behind >= 0:
                    total += 1
        h = next_round(net, h, start)
        if h < 0:
            break
    return total


@inner
def simple_at(net, v, heads):
    """Whether the edges at a vertex lead to different ones."""
    start = turn_start(net, v)
    h = start
    count = 0
    for _ in range(MOST_TURN):
        back = preceding(h)
        for side in range(2):
            if side == 1 and net.twin[back] >= 0:
                break
            w = net.quads[h // 4, (h % 4 + 1) % 4] if side == 0 else net.quads[back // 4, back % 4]
            if w == v:
                return False
            for i in range(count):
                if heads[i] == w:
                    return False
            heads[count] = w
            count += 1
        h = next_round(net, h, start)
        if h < 0:
            return True
    return False


@inner
def rename(net, old, new):
    """Give all corners at a vertex to another one."""
    corners = net.quads.reshape(-1)
    start = turn_start(net, old)
    h = start
    for _ in range(MOST_TURN):
        note(net, corners, QUADS, h, new)
        h = next_round(net, h, start)
        if h < 0:
            break
    note(net, net.at, AT, old, np.int64(-1))


@inner
def take_over(net, new, old):
    """Let half-edge `new` stand in the place of `old`."""
    over = net.twin[old]
    note(net, net.twin, TWIN, new, over)
    note(net, net.curve, CURVE, new, net.curve[old])
    note(net, net.along, ALONG, new, net.along[old])
    if over >= 0:
        note(net, net.twin, TWIN, over, new)


@inner
def merge_pair(net, one, two, v):
    """Make one quad (v, y, x, w) of two that share the edge between `one` and `two`, (a, m, x, w) and (m, b, y, x)."""
    corners = net.quads.reshape(-1)
    q = net.used[0]
    net.used[0] += 1
    net.region[q] = net.region[one // 4]
    for c in range(3):
        net.outward[q, c] = net.outward[one // 4, c]
    corners[4 * q] = v
    corners[4 * q + 1] = corners[across(two)]
    corners[4 * q + 2] = corners[across(one)]
    corners[4 * q + 3] = corners[preceding(one)]
    take_over(net, 4 * q, following(two))
    take_over(net, 4 * q + 1, across(two))
    take_over(net, 4 * q + 2, across(one))
    take_over(net, 4 * q + 3, preceding(one))
    for k in range(4):
        note(net, net.at, AT, corners[4 * q + k], 4 * q + k)
    note(net, corners, QUADS, 4 * (one // 4), np.int64(-1))
    note(net, corners, QUADS, 4 * (two // 4), np.int64(-1))


@inner
def drop_pair(net, one, two):
    """Take the two quads above a zipped row out and join those beside them; whether that can be."""
    corners = net.quads.reshape(-1)
    left, right = preceding(one), following(two)
    to_left, to_right = net.twin[left], net.twin[right]
    if (to_left < 0 and to_right < 0) or (net.curve[left] >= 0 and net.curve[right] >= 0):
        return False
    for way in range(2):
        h, over = (to_left, to_right) if way == 0 else (to_right, to_left)
        own, other = (left, right) if way == 0 else (right, left)
        if h < 0:
            continue
        if net.curve[own] < 0:
            note(net, net.curve, CURVE, h, net.curve[other])
            note(net, net.along, ALONG, h, net.along[other])
        note(net, net.twin, TWIN, h, over)
        note(net, net.at, AT, corners[h], h)
    note(net, corners, QUADS, 4 * (one // 4), np.int64(-1))
    note(net, corners, QUADS, 4 * (two // 4), np.int64(-1))
    return True


@inner
def zip_rows(m, net, d, rows, count, touched, heads):
    """Zip rows up: (number of `touched` vertices left, change of their defects), no vertices where it cannot be.

    The zipped vertices come first, then the ones in front of and behind them.
    """
    corners = net.quads.reshape(-1)
    net.used[2] += 1
    stamp = net.used[2]
    kept = np.int64(0)
    before = 0
    for i in range(count):
        one, two = rows[i, 0], rows[i, 1]
        touched[i] = kept_of(m, net, one, two)
        if touched[i] < 0:
            return kept, 0
        for c in range(3):
            v = corners[one] if c == 0 else corners[two if c == 1 else following(two)]
            if d.vertex_stamp[v] == stamp:
                return kept, 0
            d.vertex_stamp[v] = stamp
            before += defects_at(m, net, d, v)
    low_one, low_two = net.twin[rows[0, 1]], net.twin[rows[0, 0]]
    if (low_one < 0) != (low_two < 0) or (low_one >= 0 and not in_line(net, low_one, low_two)):
        return kept, 0
    if not in_line(net, rows[count - 1, 0], rows[count - 1, 1]):
        return kept, 0
    left = count
    touched[left] = corners[across(rows[count - 1, 0])]
    left += 1
    if low_one >= 0:
        touched[left] = corners[across(low_one)]
        left += 1
    for i in range(count, left):
        if d.vertex_stamp[touched[i]] == stamp:
            return kept, 0
        d.vertex_stamp[touched[i]] = stamp
        before += defects_at(m, net, d, touched[i])
    for i in range(count):
        one, two = rows[i, 0], rows[i, 1]
        for c in range(3):
            heads[c] = corners[one] if c == 0 else corners[two if c == 1 else following(two)]
        for c in range(3):
            if heads[c] != touched[i]:
                rename(net, heads[c], touched[i])
    for i in range(count - 1):
        if not drop_pair(net, rows[i, 0], rows[i, 1]):
            return kept, 0
    merge_pair(net, rows[count - 1, 0], rows[count - 1, 1], touched[count - 1])
    if low_one >= 0:
        merge_pair(net, low_one, low_two, touched[0])
    after = 0
    for i in range(left):
        if not simple_at(net, touched[i], heads):
            return kept, 0
        after += defects_at(m, net, d, touched[i])
    return np.int64(left), after - before
