"""Kernels of `regular`: two strips of quads side by side zipped up, so that curves they cross lose two edges.

Discs never change how many edges a feature curve has, and where the counts on two sides of a region differ, irregular
vertices stay. A row of two edges in line (`_rows_kernel`), zipped (`_zip_rows_kernel`), becomes one vertex: the vertex
in front of its middle loses an edge, and the zipped one has one too many. Such pairs are what discs on either side can
then do away with; where they do not, everything is taken back.
"""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import inner, kernel
from patchwright.repair.layout._block_kernel import preceding
from patchwright.repair.layout._disc_kernel import (
    behind_in_sector,
    note_vertex,
    quads_at,
    sector,
    sector_start,
    take_back,
)
from patchwright.repair.layout._quad_kernel import BENT, quad_quality, straightness
from patchwright.repair.layout._regular_kernel import FLOOR, even_out, improve, index_around, longest_edge
from patchwright.repair.layout._rows_kernel import MOST_ROWS, MOST_TURN, gather_rows, in_line, next_round, turn_start
from patchwright.repair.layout._zip_rows_kernel import zip_rows

_PASSES = 4
_TRIES = 2  # discs one after the other from one sector


@inner
def quads_round(net, d, s, v, near):
    """Note the quads round a vertex in `near`, once each."""
    start = turn_start(net, v)
    h = start
    for _ in range(MOST_TURN):
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
def straightest(m, g, net, v, worst):
    """The least of `worst` and the straightness of the sides on curves at a vertex."""
    start = turn_start(net, v)
    h = start
    for _ in range(MOST_TURN):
        back = preceding(h)
        worst = min(worst, min(side_straightness(m, g, net, h), side_straightness(m, g, net, back)))
        h = next_round(net, h, start)
        if h < 0:
            break
    return worst


@inner
def side_straightness(m, g, net, h):
    """Straightness of a half-edge, 1 off the curves."""
    c = net.curve[h]
    if c < 0:
        return 1.0
    a, b = net.quads[h // 4, h % 4], net.quads[h // 4, (h % 4 + 1) % 4]
    if net.along[h] < 0:
        a, b = b, a
    low = m.vs[a] if m.kind[a] == 1 else 0.0
    high = m.vs[b] if m.kind[b] == 1 else g.along[g.off[c + 1] - 1]
    return straightness(m, g, c, a, b, low, high)


@inner
def settle(m, g, net, d, s, touched, left):
    """Even out the free vertices at and round the touched ones."""
    net.used[2] += 1
    stamp = net.used[2]
    moves, near = np.int64(0), np.int64(0)
    for i in range(left):
        start = turn_start(net, touched[i])
        h = start
        for _ in range(MOST_TURN):
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
    rows = np.empty((2 * MOST_ROWS, 2), dtype=np.int64)
    touched, heads = np.empty(2 * MOST_ROWS + 2, dtype=np.int64), np.empty(4 * MOST_TURN, dtype=np.int64)
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
        near, straight = np.int64(0), BENT
        for i in range(count):
            a, b = rows[i, 0], rows[i, 1]
            for v in (net.quads[a // 4, a % 4], net.quads[b // 4, b % 4], net.quads[b // 4, (b % 4 + 1) % 4]):
                straight = straightest(m, g, net, v, straight)
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
                    for _ in range(MOST_TURN):
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
                    good = good and straightest(m, g, net, touched[i], 1.0) >= straight
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
