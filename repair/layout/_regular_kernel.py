"""Kernels of `regular`: discs filled anew, vertices put onto the surface, kept where no quad gets too poor."""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from patchwright.models._compile_kernel import inner, kernel
from patchwright.repair.layout._disc_kernel import (
    AT,
    QUADS,
    TWIN,
    add_sector,
    ahead_in_sector,
    find_loop,
    make_convex,
    note,
    note_vertex,
    reach_out,
    sector,
    sector_start,
    take_back,
)
from patchwright.repair.layout._pattern_kernel import defect, fill, patterns
from patchwright.repair.layout._quad_kernel import quad_quality, try_place
from patchwright.repair.layout._remesh_kernel import place_on_ground, put_on, starts_of

_SETTLING = 30  # sweeps of the first, harmonic placing
_OVER = 1.6  # over-relaxation in them
_FREE_PASSES = 3  # over the new vertices alone, whatever becomes of the quads
_PASSES = 6  # over new vertices and border, never spoiling a quad
_GOAL = 0.6  # scaled Jacobian that evening out may go down to
FLOOR = 0.05  # scaled Jacobian below which no new quad is taken, however poor the ones before were


class Scratch(NamedTuple):
    """Room for one disc's new quads and their vertices."""

    local: Any  # (q, 4) quads of a pattern
    vertex: Any  # (v,) vertices in the pattern's numbers
    near: Any  # (q,) quads that may change: new ones, then the ones round the border
    move: Any  # (v,) vertices that may move: new ones, then the border's
    number: Any  # (v,) row in `move`; only where `stamp` says so
    stamp: Any  # (v,)
    offsets: Any  # (v,) rows of `around` for each of `move`
    around: Any  # (4 q,) quads round each, as 4 q + corner
    first: Any  # (v,) and
    following: Any  # (4 q,) half-edges that leave each vertex, as lists
    starts: Any  # (128,)


@inner
def index_around(net, s, near, count):
    """Fill `offsets` and `around` for the vertices `move[:count]` and the quads `near[:near]`."""
    stamp = net.used[2]
    for i in range(count + 1):
        s.offsets[i] = 0
    for i in range(near):
        for k in range(4):
            v = net.quads[s.near[i], k]
            if s.stamp[v] == stamp:
                s.offsets[s.number[v] + 1] += 1
    for i in range(count):
        s.offsets[i + 1] += s.offsets[i]
    for i in range(near):
        for k in range(4):
            v = net.quads[s.near[i], k]
            if s.stamp[v] == stamp:
                n = s.number[v]
                s.around[s.offsets[n]] = 4 * s.near[i] + k
                s.offsets[n] += 1
    for i in range(count, 0, -1):
        s.offsets[i] = s.offsets[i - 1]
    s.offsets[0] = 0


@inner
def lay_out(m, net, d, s, rows, new_q, new_v):
    """Lists of the quads and vertices that a disc's change touches: (near, new vertices, all that move)."""
    stamp = net.used[2]
    count = 0
    for i in range(rows):
        s.near[i] = new_q + i
    near = rows
    for i in range(d.size[2], new_v):
        v = s.vertex[i]
        s.stamp[v] = stamp
        s.number[v] = count
        s.move[count] = v
        count += 1
    fresh = count
    for i in range(d.size[2]):
        v = s.vertex[i]
        if m.kind[v] != 0:
            continue
        start, whole = sector_start(net, d.leaves[d.loop[i]])
        if not whole:
            continue
        s.stamp[v] = stamp
        s.number[v] = count
        s.move[count] = v
        count += 1
        at = start
        for _ in range(64):
            q = at // 4
            if d.quad_stamp[q] != stamp and d.quad_stamp[q] != -stamp:
                d.quad_stamp[q] = -stamp
                s.near[near] = q
                near += 1
            at = ahead_in_sector(net, at)
            if at < 0 or at == start:
                break
    index_around(net, s, near, count)
    return near, fresh, count


@inner
def mean_around(m, net, s, i):
    """Mean of the edge neighbours of vertex `move[i]`."""
    X = m.X
    x, y, z = 0.0, 0.0, 0.0
    count = s.offsets[i + 1] - s.offsets[i]
    for a in range(s.offsets[i], s.offsets[i + 1]):
        q, k = s.around[a] // 4, s.around[a] % 4
        p, r = net.quads[q, (k + 1) % 4], net.quads[q, (k + 3) % 4]
        x += X[p, 0] + X[r, 0]
        y += X[p, 1] + X[r, 1]
        z += X[p, 2] + X[r, 2]
    share = 0.5 / count
    return x * share, y * share, z * share


@inner
def worst_near(m, net, s, i):
    """Least quality of the quads round vertex `move[i]`."""
    worst = 1.0
    for a in range(s.offsets[i], s.offsets[i + 1]):
        worst = min(worst, quad_quality(m, s.around[a] // 4, net.quads, net.outward))
    return worst


@inner
def put_new(m, g, net, d, s, fresh, region):
    """Place the new vertices: harmonic between the border, then onto the surface; whether all could be put there."""
    X = m.X
    x, y, z = 0.0, 0.0, 0.0
    for i in range(d.size[2]):
        v = s.vertex[i]
        x, y, z = x + X[v, 0], y + X[v, 1], z + X[v, 2]
    for i in range(fresh):
        v = s.move[i]
        X[v, 0], X[v, 1], X[v, 2] = x / d.size[2], y / d.size[2], z / d.size[2]
    for sweep in range(_SETTLING):
        over = 1.0 if sweep < 2 else _OVER
        for i in range(fresh):
            v = s.move[i]
            x, y, z = mean_around(m, net, s, i)
            X[v, 0] += over * (x - X[v, 0])
            X[v, 1] += over * (y - X[v, 1])
            X[v, 2] += over * (z - X[v, 2])
    for i in range(fresh):
        v = s.move[i]
        nearest, best = 0, np.inf
        for n in range(d.size[1]):
            w = d.vertices[n]
            away = (X[w, 0] - X[v, 0]) ** 2 + (X[w, 1] - X[v, 1]) ** 2 + (X[w, 2] - X[v, 2]) ** 2
            if away < best:
                nearest, best = n, away
        count = starts_of(m, g, d.vertices[nearest], region, s.starts, np.int64(0))
        if count == 0:
            return False
        q = d.leaves[nearest] // 4
        x, y, z, t = put_on(
            X[v, 0], X[v, 1], X[v, 2], net.outward[q, 0], net.outward[q, 1], net.outward[q, 2], s.starts, count, g
        )
        if t < 0:
            return False
        place_on_ground(m, g, v, x, y, z, t)
    return True


@inner
def face_out(m, g, net, s, q, region):
    """Set the outward normal of quad q: the surface's at its centre with those at its smooth corners."""
    X, N = m.X, m.N
    g_normal = g.normal
    a, b, c, e = net.quads[q, 0], net.quads[q, 1], net.quads[q, 2], net.quads[q, 3]
    sx, sy, sz = 0.0, 0.0, 0.0
    count = np.int64(0)
    for k in range(4):
        v = net.quads[q, k]
        if m.kind[v] == 0:
            sx, sy, sz = sx + N[v, 0], sy + N[v, 1], sz + N[v, 2]
        if count < 64:
            count = starts_of(m, g, v, region, s.starts, count)
    x, y, z = (
        0.25 * (X[a, 0] + X[b, 0] + X[c, 0] + X[e, 0]),
        0.25 * (X[a, 1] + X[b, 1] + X[c, 1] + X[e, 1]),
        0.25 * (X[a, 2] + X[b, 2] + X[c, 2] + X[e, 2]),
    )
    _, _, _, t = put_on(x, y, z, sx, sy, sz, s.starts, min(count, 4) if sx != 0.0 or sy != 0.0 else count, g)
    if t >= 0:
        sx, sy, sz = sx + g_normal[t, 0], sy + g_normal[t, 1], sz + g_normal[t, 2]
    size = np.sqrt(sx * sx + sy * sy + sz * sz)
    if size > 0.0:
        net.outward[q, 0], net.outward[q, 1], net.outward[q, 2] = sx / size, sy / size, sz / size


@inner
def even_out(m, g, net, s, first, count, careful):
    """One pass over the vertices `move[first:count]`; a `careful` one never spoils a quad below the goal."""
    X, N, H, vt, vs = m.X, m.N, m.H, m.vt, m.vs
    for i in range(first, count):
        v = s.move[i]
        old = worst_near(m, net, s, i) if careful else 0.0
        ox, oy, oz, ot, oh = X[v, 0], X[v, 1], X[v, 2], vt[v], H[v]
        onx, ony, onz = N[v, 0], N[v, 1], N[v, 2]
        x, y, z = mean_around(m, net, s, i)
        dx, dy, dz = 0.8 * (x - ox), 0.8 * (y - oy), 0.8 * (z - oz)
        up = dx * onx + dy * ony + dz * onz
        for _ in range(3):
            try_place(m, g, v, ox + dx - up * onx, oy + dy - up * ony, oz + dz - up * onz)
            if not careful or worst_near(m, net, s, i) >= min(old, _GOAL):
                break
            X[v, 0], X[v, 1], X[v, 2] = ox, oy, oz
            N[v, 0], N[v, 1], N[v, 2] = onx, ony, onz
            vs[v], vt[v], H[v] = 0.0, ot, oh
            dx, dy, dz, up = 0.4 * dx, 0.4 * dy, 0.4 * dz, 0.4 * up


@inner
def longest_edge(m, net, q):
    """Longest edge of a quad over the length wanted there."""
    X, H = m.X, m.H
    longest = 0.0
    for k in range(4):
        a, b = net.quads[q, k], net.quads[q, (k + 1) % 4]
        length = np.sqrt((X[a, 0] - X[b, 0]) ** 2 + (X[a, 1] - X[b, 1]) ** 2 + (X[a, 2] - X[b, 2]) ** 2)
        longest = max(longest, 2.0 * length / (H[a] + H[b]))
    return longest


@inner
def link(net, d, s, rows, new_q, new_v):
    """Join the new quads to each other and to those outside, and drop the old ones."""
    for i in range(new_v):
        s.first[i] = -1
    for i in range(rows):
        for k in range(4):
            h = 4 * i + k
            v = s.local[i, k]
            s.following[h] = s.first[v]
            s.first[v] = h
    border = d.size[2]
    for i in range(rows):
        for k in range(4):
            h = 4 * (new_q + i) + k
            a, b = s.local[i, k], s.local[i, (k + 1) % 4]
            v = net.quads[new_q + i, k]
            note(net, net.at, AT, v, h)
            if a < border and b == (a + 1) % border:
                old = d.border[d.loop[a]]
                net.twin[h], net.curve[h], net.along[h] = net.twin[old], net.curve[old], net.along[old]
                if net.twin[old] >= 0:
                    note(net, net.twin, TWIN, net.twin[old], h)
                continue
            net.curve[h], net.along[h], net.twin[h] = -1, 0, -1
            o = s.first[b]
            while o >= 0:
                if s.local[o // 4, (o % 4 + 1) % 4] == a:
                    net.twin[h] = 4 * new_q + o
                o = s.following[o]
    for i in range(d.size[1]):
        if d.border[i] < 0:
            note(net, net.at, AT, d.vertices[i], np.int64(-1))
    corners = net.quads.reshape(-1)
    for i in range(d.size[0]):
        note(net, corners, QUADS, 4 * d.quads[i], np.int64(-1))


@kernel
def renew(m, g, net, d, s, row, k, least, stretch, relative):
    """Fill the disc by a pattern; whether the quads came out good enough. If not, nothing has changed."""
    new_q, next_v, border = net.used[0], net.used[1], d.size[2]
    rows, new_v = fill(border, d.corner, k, row, s.local)
    if new_q + rows > len(net.quads) or next_v + new_v - border > len(net.at) or 2 * rows > 3 * d.size[0] + 16:
        return False
    for i in range(d.size[1]):
        if d.border[i] < 0 and m.kind[d.vertices[i]] == 2:  # a tip stays a vertex
            return False
    region = net.region[d.quads[0]]
    for i in range(border):
        s.vertex[i] = d.vertices[d.loop[i]]
    for i in range(border, new_v):
        s.vertex[i] = next_v + i - border
        m.kind[s.vertex[i]] = 0
    for i in range(rows):
        net.region[new_q + i] = region
        for c in range(4):
            net.quads[new_q + i, c] = s.vertex[s.local[i, c]]
    changes, moves = net.used[3], net.used[4]
    near, fresh, count = lay_out(m, net, d, s, rows, new_q, new_v)
    # the ring of quads outside shares its stamp with this disc only
    worst_before, longest_before = 1.0, 0.0
    for i in range(d.size[0]):
        worst_before = min(worst_before, quad_quality(m, d.quads[i], net.quads, net.outward))
        longest_before = max(longest_before, longest_edge(m, net, d.quads[i]))
    for i in range(rows, near):
        worst_before = min(worst_before, quad_quality(m, s.near[i], net.quads, net.outward))
        longest_before = max(longest_before, longest_edge(m, net, s.near[i]))
    for i in range(fresh, count):
        note_vertex(m, net, s.move[i])
    good = put_new(m, g, net, d, s, fresh, region)
    if good:
        for _ in range(_FREE_PASSES):
            even_out(m, g, net, s, 0, fresh, False)
        for i in range(rows):
            face_out(m, g, net, s, new_q + i, region)
        for _ in range(_PASSES):
            even_out(m, g, net, s, 0, count, True)
        for i in range(rows):
            face_out(m, g, net, s, new_q + i, region)
        bound, far = least, stretch
        if relative:
            bound, far = min(least, max(worst_before, FLOOR)), max(stretch, longest_before)
        for i in range(near):
            if quad_quality(m, s.near[i], net.quads, net.outward) < bound or longest_edge(m, net, s.near[i]) > far:
                good = False
                break
    for i in range(rows, near):
        d.quad_stamp[s.near[i]] = 0
    if not good:
        take_back(m, net, changes, moves)
        for i in range(rows):
            net.quads[new_q + i, 0] = -1
        return False
    link(net, d, s, rows, new_q, new_v)
    net.used[0], net.used[1] = new_q + rows, next_v + new_v - border
    return True


@kernel
def improve(m, g, net, d, s, seed, limit, least, stretch, relative):
    """Grow a disc from the sector of half-edge `seed` until it can be filled anew; by how much the defects got less."""
    side = np.empty(8, dtype=np.int64)
    found = np.empty((8, 6), dtype=np.int64)
    net.used[2] += 1
    stamp = net.used[2]
    d.size[0] = d.size[1] = 0
    add_sector(net, d, seed, stamp)
    while make_convex(m, net, d, stamp, limit):
        good, before, after = find_loop(m, net, d, stamp)
        if good and before > after:
            k, border = d.size[3], d.size[2]
            for i in range(k):
                side[i] = (d.corner[i + 1] if i + 1 < k else border) - d.corner[i]
            for n in range(patterns(side, k, found)):
                gain = before - after - defect(found[n, 0], k)
                if gain > 0 and renew(m, g, net, d, s, found[n], k, least, stretch, relative):
                    return gain
        if not reach_out(m, net, d, stamp, limit):
            break
    return 0


@inner
def leads_sector(net, h):
    """Whether a live half-edge is the one that stands for the sector it leaves into."""
    if net.quads[h // 4, 0] < 0:
        return False
    start, whole = sector_start(net, h)
    return start == h and (not whole or net.at[net.quads[h // 4, h % 4]] == h)


@kernel
def regularize(m, g, net, d, s, limit, least, stretch):
    """One pass over all irregular vertices with discs of up to `limit` quads; how many discs were filled anew.

    Parameters
    ----------
    least : scaled Jacobian no new quad may fall below, unless one was as poor before
    stretch : edges no longer than this over the wanted length, unless one was as long before
    """
    done = 0
    for seed in range(4 * net.used[0]):
        if not leads_sector(net, seed):
            continue
        total, _, target = sector(m, net, seed, d.quad_stamp, np.int64(0))
        if total != target:
            net.used[3] = net.used[4] = 0
            done += improve(m, g, net, d, s, seed, limit, least, stretch, True) > 0
        if net.used[0] + 2 * limit > len(net.quads) or net.used[1] + 2 * limit > len(net.at):
            break
    return done
