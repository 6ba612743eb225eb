"""Kernels of zipping: rows of two edges in line, found from one to the next over a strip of quads.

A *row* is two edges in line, a - m - b, given by its half-edges a-m and m-b in the quads above it. Rows go on over
narrow strips between curves (the blunt trailing edge of a wing), so that both borders lose edges.
"""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import inner
from patchwright.repair.layout._block_kernel import following, preceding

MOST_TURN = 64  # half-edges round a vertex
MOST_ROWS = 24
_REACH = 4  # rows to look ahead for another curve


@inner
def across(h):
    """The half-edge on the opposite side of the same quad."""
    return 4 * (h // 4) + (h % 4 + 2) % 4


@inner
def turn_start(net, v):
    """The most clockwise half-edge that leaves a vertex; any where quads go all round it."""
    h = net.at[v]
    for _ in range(MOST_TURN):
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
        while n + 1 < MOST_ROWS // 2 + count and n - last < _REACH:
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
