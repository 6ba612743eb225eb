"""Kernels of `regular`: two strips of quads side by side zipped up, so that curves they cross lose two edges.

Discs never change how many edges a feature curve has, and where the counts on two sides of a region differ, irregular
vertices stay. A *row* is two edges in line, a - m - b; zipped, it becomes one vertex. The quads between zipped rows go,
and the two quads before the first row and behind the last become one each: the vertex between them, in front of m,
loses an edge, and the zipped one has one too many. Such pairs are what discs on either side can then do away with. Rows
go on over narrow strips between curves (the blunt trailing edge of a wing), so that both borders lose edges.
"""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import inner, kernel
from patchwright.repair._block_kernel import following, preceding
from patchwright.repair._disc_kernel import (
    ALONG,
    AT,
    CURVE,
    QUADS,
    TWIN,
    behind_in_sector,
    note,
    note_vertex,
    quads_at,
    sector,
    sector_start,
    take_back,
)
from patchwright.repair._quad_kernel import quad_quality
from patchwright.repair._regular_kernel import FLOOR, even_out, improve, index_around, longest_edge

_MOST_TURN = 64
_MOST_ROWS = 24
_REACH = 4  # rows to look ahead for another curve
_PASSES = 4
_TRIES = 2  # discs one after the other from one sector


@inner
def across(h):
    """The half-edge on the opposite side of the same quad."""
    return 4 * (h // 4) + (h % 4 + 2) % 4


@inner
def turn_start(net, v):
    """The most clockwise half-edge that leaves a vertex; any where quads go all round it."""
    h = net.at[v]
    for _ in range(_MOST_TURN):
        if net.twin[h] < 0 or following(net.twin[h]) == net.at[v]:
            break
        h = following(net.twin[h])
    return h


@inner
def next_round(net, h, start):
    """The next half-edge counter-clockwise round the same vertex, -1 at the end."""
    h = net.twin[preceding(h)]
    return np.int64(-1) if h == start else h


@inner
def in_line(net, one, two):
    """Whether two half-edges a-m and m-b have one edge between them on their side, and nothing hard there."""
    middle = following(one)
    return net.curve[middle] < 0 and net.twin[middle] >= 0 and following(net.twin[middle]) == two


@inner
def row_up(net, one, two):
    """The next row beyond the quads of a row, (-1, -1) at a boundary or an irregular vertex."""
    one, two = net.twin[across(one)], net.twin[across(two)]
    if one < 0 or two < 0 or not in_line(net, one, two):
        return np.int64(-1), np.int64(-1)
    return one, two


@inner
def row_down(net, one, two):
    """The row before, whose quads end at this one."""
    below_one, below_two = net.twin[one], net.twin[two]
    if below_one < 0 or below_two < 0:
        return np.int64(-1), np.int64(-1)
    one, two = across(below_one), across(below_two)
    if not in_line(net, one, two):
        return np.int64(-1), np.int64(-1)
    return one, two


@inner
def gather_rows(net, one, two, rows):
    """Rows (n, 2) from the lowest to the highest, with those over narrow strips; how many, 0 where there are none.

    A row is its half-edges a-m and m-b in the quads above it.
    """
    count = 0
    for way in range(2):
        rows[count, 0], rows[count, 1] = one, two
        at_one, at_two = one, two
        last = count
        n = count
        while n + 1 < _MOST_ROWS // 2 + count and n - last < _REACH:
            at_one, at_two = row_down(net, at_one, at_two) if way == 0 else row_up(net, at_one, at_two)
            if at_one < 0:
                break
            n += 1
            rows[n, 0], rows[n, 1] = at_one, at_two
            if net.curve[at_one] >= 0 and net.curve[at_two] >= 0:
                last = n
        if way == 0:
            for i in range((last + 1) // 2):
                for c in range(2):
                    rows[i, c], rows[last - i, c] = rows[last - i, c], rows[i, c]
        count = last
    return count + 1


@inner
def kept_of(m, net, one, two):
    """The vertex a row becomes, -1 where its vertices may not become one."""
    a, v, b = net.quads[one // 4, one % 4], net.quads[two // 4, two % 4], net.quads[two // 4, (two % 4 + 1) % 4]
    if a in (v, b) or v == b:
        return np.int64(-1)
    hard = (net.curve[one] >= 0) + (net.curve[two] >= 0)
    fixed = (m.kind[a] > 0) + (m.kind[v] > 0) + (m.kind[b] > 0)
    if hard == 2:
        if net.curve[one] != net.curve[two] or m.kind[v] != 1 or (m.kind[a] == 2 and m.kind[b] == 2):
            return np.int64(-1)
        return a if m.kind[a] == 2 else (b if m.kind[b] == 2 else v)
    if hard == 1 or fixed > 1 or net.twin[one] < 0 or net.twin[two] < 0:
        return np.int64(-1)
    return a if m.kind[a] > 0 else (b if m.kind[b] > 0 else v)


@inner
def defects_at(m, net, d, v):
    """How far the sectors round a vertex are from their targets, summed; 1000 where a free one has less than three."""
    start = turn_start(net, v)
    h = start
    total = 0
    for _ in range(_MOST_TURN):
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
    for _ in range(_MOST_TURN):
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
    for _ in range(_MOST_TURN):
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


@inner
def quads_round(net, d, s, v, near):
    """Note the quads round a vertex in `near`, once each."""
    start = turn_start(net, v)
    h = start
    for _ in range(_MOST_TURN):
        if d.quad_stamp[h // 4] != net.used[2]:
            d.quad_stamp[h // 4] = net.used[2]
            s.near[near] = h // 4
            near += 1
        h = next_round(net, h, start)
        if h < 0:
            break
    return near


@inner
def poorest(m, net, s, near):
    """Least quality and longest edge of the quads `near[:near]`."""
    worst, longest = 1.0, 0.0
    for i in range(near):
        worst = min(worst, quad_quality(m, s.near[i], net.quads, net.outward))
        longest = max(longest, longest_edge(m, net, s.near[i]))
    return worst, longest


@inner
def settle(m, g, net, d, s, touched, left):
    """Even out the free vertices at and round the touched ones."""
    net.used[2] += 1
    stamp = net.used[2]
    moves, near = np.int64(0), np.int64(0)
    for i in range(left):
        start = turn_start(net, touched[i])
        h = start
        for _ in range(_MOST_TURN):
            for c in range(4):
                v = net.quads[h // 4, c]
                if m.kind[v] == 0 and s.stamp[v] != stamp and sector_start(net, net.at[v])[1]:
                    s.stamp[v] = stamp
                    s.number[v] = moves
                    s.move[moves] = v
                    moves += 1
                    note_vertex(m, net, v)
            h = next_round(net, h, start)
            if h < 0:
                break
    for i in range(moves):
        near = quads_round(net, d, s, s.move[i], near)
    index_around(net, s, near, moves)
    for _ in range(_PASSES):
        even_out(m, g, net, s, np.int64(0), moves, True)


@kernel
def zip_up(m, g, net, d, s, limit, least, stretch, most):
    """Zip strips at curves where discs then gain more than was lost; how many were.

    Parameters
    ----------
    limit, least, stretch : as `regularize`
    most : how much the defects may rise for the time being
    """
    rows = np.empty((2 * _MOST_ROWS, 2), dtype=np.int64)
    touched, heads = np.empty(2 * _MOST_ROWS + 2, dtype=np.int64), np.empty(4 * _MOST_TURN, dtype=np.int64)
    done = 0
    for two in range(4 * net.used[0]):
        if net.quads[two // 4, 0] < 0 or net.curve[two] < 0 or (net.twin[two] >= 0 and net.twin[two] < two):
            continue
        if m.kind[net.quads[two // 4, two % 4]] != 1 or net.twin[preceding(two)] < 0:
            continue
        one = preceding(net.twin[preceding(two)])
        if net.curve[one] != net.curve[two] or not in_line(net, one, two):
            continue
        if net.used[0] + 8 * limit > len(net.quads) or net.used[1] + 8 * limit > len(net.at):
            break
        net.used[3] = net.used[4] = 0
        quads, vertices = net.used[0], net.used[1]
        count = gather_rows(net, np.int64(one), np.int64(two), rows)
        # how poor the quads are now
        net.used[2] += 1
        near = np.int64(0)
        for i in range(count):
            a, b = rows[i, 0], rows[i, 1]
            near = quads_round(net, d, s, net.quads[a // 4, a % 4], near)
            near = quads_round(net, d, s, net.quads[b // 4, b % 4], near)
            near = quads_round(net, d, s, net.quads[b // 4, (b % 4 + 1) % 4], near)
        worst, longest = poorest(m, net, s, near)
        bound, far = min(least, max(worst, FLOOR)), max(stretch, longest)
        left, rise = zip_rows(m, net, d, rows, count, touched, heads)
        good = left > 0 and rise <= most
        if good:
            settle(m, g, net, d, s, touched, left)
            for i in range(left):
                for _ in range(_TRIES):
                    if rise < 0 or net.at[touched[i]] < 0:
                        break
                    start = turn_start(net, touched[i])
                    h = start
                    gain = 0
                    for _ in range(_MOST_TURN):
                        if behind_in_sector(net, h) < 0 or h == start:
                            total, _, target = sector(m, net, h, d.quad_stamp, np.int64(-1))
                            if total != target:
                                gain = improve(m, g, net, d, s, h, limit, bound, far, False)
                                if gain > 0:
                                    break
                        h = next_round(net, h, start)
                        if h < 0:
                            break
                    if gain == 0:
                        break
                    rise -= gain
            good = rise <= 0
        if good:
            net.used[2] += 1
            near = np.int64(0)
            for i in range(left):
                if net.at[touched[i]] >= 0:
                    good = good and quads_at(net, touched[i]) >= 3
                    near = quads_round(net, d, s, touched[i], near)
            worst, longest = poorest(m, net, s, near)
            good = good and worst >= bound and longest <= far
        if good:
            done += 1
        else:
            take_back(m, net, np.int64(0), np.int64(0))
            for q in range(quads, net.used[0]):
                net.quads[q, 0] = -1
            net.used[0], net.used[1] = quads, vertices
    return done
