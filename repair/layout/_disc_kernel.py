"""Kernels of `regular`: discs of quads grown round irregular vertices until all their corners are convex.

The mesh is a `Net`: half-edge 4 q + k is side k of quad q, from its corner k to the next; half-edges on feature curves
and boundaries are *hard* and no disc reaches across them. A *sector* is the fan of quads round a vertex between hard
edges, or the whole turn. How many quads a sector should have is its *target*: four for a whole turn, two at a curve or
boundary, at a corner of features the sector's angle over a right angle.
"""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from patchwright.models._compile_kernel import inner
from patchwright.repair.layout._block_kernel import following, preceding

_MOST_TURN = 64  # quads round a vertex
QUADS, TWIN, CURVE, ALONG, AT = 0, 1, 2, 3, 4  # tables in the log


class Net(NamedTuple):
    """Quads that change; a dead quad has quads[q, 0] = -1, a dead vertex at[v] = -1."""

    quads: Any  # (q, 4)
    twin: Any  # (4 q,) half-edge on the other side, -1 at a boundary
    curve: Any  # (4 q,) feature curve the half-edge lies on, -1 none
    along: Any  # (4 q,) 1 where the half-edge runs along its curve, -1 against, 0 off
    region: Any  # (q,) smooth region
    outward: Any  # (q, 3) surface normals at the centres
    at: Any  # (v,) a half-edge that leaves each vertex
    used: Any  # (5,) rows in use of quads, of vertices, the last stamp, rows in use of `log` and of `log_vertex`
    log: Any  # (l, 3) what was changed: table, row, value before
    log_vertex: Any  # (l, 10) vertices that were moved: number, place, normal, wanted length, arc length, triangle


@inner
def note(net, values, table, row, value):
    """Change an entry of a table and log what it was."""
    n = net.used[3]
    net.log[n, 0], net.log[n, 1], net.log[n, 2] = table, row, values[row]
    net.used[3] += 1
    values[row] = value


@inner
def note_vertex(m, net, v):
    """Log where a vertex is."""
    n = net.used[4]
    net.log_vertex[n, 0] = v
    for c in range(3):
        net.log_vertex[n, 1 + c], net.log_vertex[n, 4 + c] = m.X[v, c], m.N[v, c]
    net.log_vertex[n, 7], net.log_vertex[n, 8], net.log_vertex[n, 9] = m.H[v], m.vs[v], m.vt[v]
    net.used[4] += 1


@inner
def take_back(m, net, changes, moves):
    """Undo all that was logged after the first `changes` and `moves` rows."""
    corners = net.quads.reshape(-1)
    for n in range(net.used[3] - 1, changes - 1, -1):
        table, row, value = net.log[n, 0], net.log[n, 1], net.log[n, 2]
        if table == QUADS:
            corners[row] = value
        elif table == TWIN:
            net.twin[row] = value
        elif table == CURVE:
            net.curve[row] = value
        elif table == ALONG:
            net.along[row] = value
        else:
            net.at[row] = value
    for n in range(net.used[4] - 1, moves - 1, -1):
        v = int(net.log_vertex[n, 0])
        for c in range(3):
            m.X[v, c], m.N[v, c] = net.log_vertex[n, 1 + c], net.log_vertex[n, 4 + c]
        m.H[v], m.vs[v], m.vt[v] = net.log_vertex[n, 7], net.log_vertex[n, 8], int(net.log_vertex[n, 9])
    net.used[3], net.used[4] = changes, moves


class Disc(NamedTuple):
    """A growing disc and the scratch it needs; `stamp`ed rows belong to it."""

    quad_stamp: Any  # (q,)
    vertex_stamp: Any  # (v,)
    row: Any  # (v,) row of a vertex in `vertices`
    quads: Any  # (q,) its quads
    vertices: Any  # (v,) its vertices
    leaves: Any  # (v,) a half-edge of the disc that leaves each of `vertices`
    border: Any  # (v,) the border half-edge that leaves each of `vertices`, -1 inside
    want: Any  # (v,) quads each of `vertices` should have in the disc
    loop: Any  # (v,) rows along the border, counter-clockwise, from a corner on
    corner: Any  # (8,) rows of `loop` that are corners
    size: Any  # (4,) quads, vertices, loop, corners
    seen: Any  # (q,) stamp of the search
    came: Any  # (q,) where the search came from
    queue: Any  # (q,)


@inner
def ahead_in_sector(net, h):
    """The next half-edge counter-clockwise that leaves the same vertex, -1 behind a hard edge."""
    p = preceding(h)
    return np.int64(-1) if net.curve[p] >= 0 or net.twin[p] < 0 else net.twin[p]


@inner
def behind_in_sector(net, h):
    """The next half-edge clockwise that leaves the same vertex, -1 behind a hard edge."""
    return np.int64(-1) if net.curve[h] >= 0 or net.twin[h] < 0 else following(net.twin[h])


@inner
def sector_start(net, h):
    """(half-edge, whether the sector is a whole turn): the most clockwise one, `h` itself for a whole turn."""
    at = h
    for _ in range(_MOST_TURN):
        before = behind_in_sector(net, at)
        if before < 0:
            return at, False
        if before == h:
            return h, True
        at = before
    return h, True


@inner
def corner_angle(m, net, h):
    """Angle between a half-edge and the side before it, radians."""
    X = m.X
    q, k = h // 4, h % 4
    v, a, b = net.quads[q, k], net.quads[q, (k + 1) % 4], net.quads[q, (k + 3) % 4]
    ux, uy, uz = X[a, 0] - X[v, 0], X[a, 1] - X[v, 1], X[a, 2] - X[v, 2]
    wx, wy, wz = X[b, 0] - X[v, 0], X[b, 1] - X[v, 1], X[b, 2] - X[v, 2]
    cx, cy, cz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
    return np.arctan2(np.sqrt(cx * cx + cy * cy + cz * cz), ux * wx + uy * wy + uz * wz)


@inner
def sector(m, net, h, quad_stamp, stamp):
    """(quads, of these in the disc, target) of the sector a half-edge leaves into."""
    start, whole = sector_start(net, h)
    v = net.quads[h // 4, h % 4]
    total, inside, angle = 0, 0, 0.0
    at = start
    for _ in range(_MOST_TURN):
        total += 1
        inside += quad_stamp[at // 4] == stamp
        if not whole and m.kind[v] == 2:
            angle += corner_angle(m, net, at)
        at = ahead_in_sector(net, at)
        if at < 0 or at == start:
            break
    if whole:
        return total, inside, 4
    return total, inside, max(1, int(angle / (0.5 * np.pi) + 0.5)) if m.kind[v] == 2 else 2


@inner
def add(net, d, q, stamp):
    """Put a quad into the disc."""
    if d.quad_stamp[q] == stamp:
        return
    d.quad_stamp[q] = stamp
    d.quads[d.size[0]] = q
    d.size[0] += 1
    for k in range(4):
        v = net.quads[q, k]
        if d.vertex_stamp[v] != stamp:
            d.vertex_stamp[v] = stamp
            d.row[v] = d.size[1]
            d.vertices[d.size[1]] = v
            d.leaves[d.size[1]] = 4 * q + k
            d.size[1] += 1


@inner
def add_sector(net, d, h, stamp):
    """Put all quads of a sector into the disc."""
    start, _ = sector_start(net, h)
    at = start
    for _ in range(_MOST_TURN):
        add(net, d, at // 4, stamp)
        at = ahead_in_sector(net, at)
        if at < 0 or at == start:
            break


@inner
def make_convex(m, net, d, stamp, limit):
    """Add sectors until every vertex of the border has room for one or two quads; whether `limit` quads were enough."""
    changed = True
    while changed:
        changed = False
        i = 0
        while i < d.size[1]:
            total, inside, target = sector(m, net, d.leaves[i], d.quad_stamp, stamp)
            outside = total - inside
            if outside > 0 and (target - outside < 1 or target - outside > 2):
                add_sector(net, d, d.leaves[i], stamp)
                changed = True
                if d.size[0] > limit:
                    return False
            i += 1
    return True


@inner
def quads_at(net, v):
    """How many quads there are all round a vertex, three at least for one on the boundary, which may have any."""
    start = net.at[v]
    h = start
    count = 0
    for _ in range(_MOST_TURN):
        count += 1
        h = net.twin[preceding(h)]
        if h < 0:
            return max(count, 3)
        if h == start:
            break
    return count


@inner
def find_loop(m, net, d, stamp):
    """(is a disc, defect now, defect of its border with the wanted quads): fills `border`, `want`, `loop`, `corner`."""
    quads, vertices = d.size[0], d.size[1]
    for i in range(vertices):
        d.border[i] = -1
    edges = 0
    for n in range(quads):
        q = d.quads[n]
        for k in range(4):
            h = 4 * q + k
            if net.twin[h] < 0 or net.curve[h] >= 0 or d.quad_stamp[net.twin[h] // 4] != stamp:
                i = d.row[net.quads[q, k]]
                if d.border[i] >= 0:
                    return False, 0, 0
                d.border[i] = h
                edges += 1
    if edges < 4 or vertices - (4 * quads + edges) // 2 + quads != 1:
        return False, 0, 0
    before, after = 0, 0
    first, corners = -1, 0
    for i in range(vertices):
        total, inside, target = sector(m, net, d.leaves[i], d.quad_stamp, stamp)
        want = target - total + inside
        before += abs(inside - want)
        if d.border[i] >= 0:
            d.want[i] = min(max(want, 1), 2)
            if m.kind[d.vertices[i]] == 2 and quads_at(net, d.vertices[i]) - inside + d.want[i] < 3:
                d.want[i] = 2  # a corner of ridges alone keeps three edges: two quads would share two of theirs
            after += abs(d.want[i] - want)
            if d.want[i] == 1:
                corners += 1
                first = i
    if corners < 2 or corners > 6:
        return False, 0, 0
    at, n, corners = first, 0, 0
    while n < edges:
        d.loop[n] = at
        if d.want[at] == 1:
            d.corner[corners] = n
            corners += 1
        n += 1
        h = d.border[at]
        at = d.row[net.quads[h // 4, (h % 4 + 1) % 4]]
        if at == first:
            break
    d.size[2], d.size[3] = n, corners
    return n == edges, before, after


@inner
def reach_out(m, net, d, stamp, limit):
    """Add the nearest irregular vertex outside with all quads on the way; whether there was one near enough."""
    head, tail = 0, 0
    for n in range(d.size[0]):
        d.queue[tail] = d.quads[n]
        d.seen[d.quads[n]] = stamp
        d.came[d.quads[n]] = -1
        tail += 1
    inside = tail
    while head < tail and tail < inside + 4 * limit:
        q = d.queue[head]
        head += 1
        for k in range(4):
            h = 4 * q + k
            if net.curve[h] >= 0 or net.twin[h] < 0:
                continue
            o = net.twin[h] // 4
            if d.seen[o] == stamp:
                continue
            d.seen[o] = stamp
            d.came[o] = q
            d.queue[tail] = o
            tail += 1
            for c in range(4):
                v = net.quads[o, c]
                if d.vertex_stamp[v] == stamp:
                    continue
                total, _, target = sector(m, net, 4 * o + c, d.quad_stamp, stamp)
                if total != target:
                    way = o
                    while way >= 0 and d.quad_stamp[way] != stamp:
                        add(net, d, way, stamp)
                        way = d.came[way]
                    add_sector(net, d, 4 * o + c, stamp)
                    return d.size[0] <= limit
    return False
