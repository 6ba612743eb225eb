"""Kernels of `pairing` and `quad_smooth`: pairs of triangles, their split into quads, and quads made square.

Quads live in a `Mesh` too, of which only the vertex arrays are used.
"""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.repair.layout._remesh_kernel import (
    arc_at,
    on_curve,
    place_on_curve,
    place_on_ground,
    put_on,
    starts_of,
)
from patchwright.repair.layout._surface_walk_kernel import inner, walk

_SOFT = 0.1  # corners much better than this hardly count beside poor ones
_SLENDER = 4.0  # quads as many times longer than wide are as good as square ones
BENT = 0.93  # straightness of nearly a quarter circle: a side on a curve that bends more leaves its corners no room


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True)
def curve_sides_of_edges(m, g, count, arcs):
    """Into arcs (count, 3, 2) the arc lengths of the first and second end of every side that lies on a curve."""
    T = m.T
    for t in range(count):
        for k in range(3):
            c = m.F[t, k]
            if c >= 0:
                a, b = T[t, k], T[t, (k + 1) % 3]
                arcs[t, k, 0] = arc_at(m, g, a, c, b)
                arcs[t, k, 1] = arc_at(m, g, b, c, a)


@njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
def match(neighbours, score, order, unpaired):
    """(m,) partner side of each triangle or -1: greedily by score, then by swaps that raise the sum.

    `unpaired` is what two triangles left alone count in that sum.
    """
    m = len(neighbours)
    partner = np.full(m, -1, dtype=np.int64)
    for flat in order:
        t, k = flat // 3, flat % 3
        o = neighbours[t, k]
        if score[t, k] > 0.0 and partner[t] < 0 and partner[o] < 0:
            partner[t] = k
            for j in range(3):
                if neighbours[o, j] == t:
                    partner[o] = j
    for _ in range(20):
        changed = False
        for u in range(m):
            if partner[u] >= 0:
                continue
            best, bk, by, bz = 0.0, -1, -1, -1
            for k in range(3):
                x = neighbours[u, k]
                if x < 0 or score[u, k] <= 0.0:
                    continue
                if partner[x] < 0:
                    gain = score[u, k] - unpaired
                    if gain > best:
                        best, bk, by, bz = gain, k, -1, -1
                    continue
                y = neighbours[x, partner[x]]
                loss = score[x, partner[x]]
                # x leaves y: y goes with an unpaired z, or stays alone
                if score[u, k] - loss > best:
                    best, bk, by, bz = score[u, k] - loss, k, y, -1
                for j in range(3):
                    z = neighbours[y, j]
                    if z >= 0 and z != u and z != x and partner[z] < 0 and score[y, j] > 0.0:
                        gain = score[u, k] + score[y, j] - loss - unpaired
                        if gain > best:
                            best, bk, by, bz = gain, k, y, j
            if bk < 0:
                continue
            x = neighbours[u, bk]
            if by >= 0:
                partner[by] = -1
                if bz >= 0:
                    z = neighbours[by, bz]
                    partner[by] = bz
                    for j in range(3):
                        if neighbours[z, j] == by:
                            partner[z] = j
            partner[u] = bk
            for j in range(3):
                if neighbours[x, j] == u:
                    partner[x] = j
            changed = True
        if not changed:
            break
    return partner


@njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
def land(m, g, parents, regions, points, normals, out, triangle):
    """Points (n, k, 3) of each row put on the surface of its region, walked to from its parents (n, j), -1 none.

    Where no walk can start, the point itself and triangle -1.
    """
    starts = np.empty(128, dtype=np.int64)
    for i in range(len(parents)):
        n = np.int64(0)
        for j in range(parents.shape[1]):
            if parents[i, j] >= 0:
                n = starts_of(m, g, parents[i, j], regions[i], starts, n)
        for j in range(points.shape[1]):
            x, y, z = points[i, j, 0], points[i, j, 1], points[i, j, 2]
            x, y, z, at = put_on(x, y, z, normals[i, 0], normals[i, 1], normals[i, 2], starts, n, g)
            out[i, j, 0], out[i, j, 1], out[i, j, 2] = x, y, z
            triangle[i, j] = at


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True)
def place_new(m, g, first, curves, arcs, points, triangles):
    """Record vertices `first`...: at the middle of `arcs` on their curve, or at `points` in ground triangles."""
    for i in range(len(curves)):
        if curves[i] >= 0:
            place_on_curve(m, g, first + i, curves[i], 0.5 * (arcs[i, 0] + arcs[i, 1]))
        else:
            place_on_ground(m, g, first + i, points[i, 0], points[i, 1], points[i, 2], triangles[i])


@inner
def quad_cost(m, q, quads, outward, slender):
    """(worst, cost) of quad q: its least corner quality and the sum of `_cost` over its corners.

    The quality of a corner is the sine of its angle, seen along the surface normal, times the root of `slender` times
    the ratio of its two sides where that is below one; an infinite `slender` leaves the angle alone (scaled Jacobian).
    """
    X, N = m.X, m.N
    a, b, c, d = quads[q, 0], quads[q, 1], quads[q, 2], quads[q, 3]
    ux, uy, uz = X[c, 0] - X[a, 0], X[c, 1] - X[a, 1], X[c, 2] - X[a, 2]
    wx, wy, wz = X[d, 0] - X[b, 0], X[d, 1] - X[b, 1], X[d, 2] - X[b, 2]
    nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
    size = np.sqrt(nx * nx + ny * ny + nz * nz)
    if size == 0.0:
        return -1.0, 4.0 * _cost(-1.0)
    nx, ny, nz = nx / size, ny / size, nz / size
    # a turned quad is judged along the surface normal at its centre, so that it can be seen to better
    turned = nx * outward[q, 0] + ny * outward[q, 1] + nz * outward[q, 2] <= 0.0
    if turned:
        nx, ny, nz = outward[q, 0], outward[q, 1], outward[q, 2]
    worst, cost = 1.0, 0.0
    for k in range(4):
        p, after, before = quads[q, k], quads[q, (k + 1) % 4], quads[q, (k + 3) % 4]
        ux, uy, uz = X[after, 0] - X[p, 0], X[after, 1] - X[p, 1], X[after, 2] - X[p, 2]
        wx, wy, wz = X[before, 0] - X[p, 0], X[before, 1] - X[p, 1], X[before, 2] - X[p, 2]
        px, py, pz = nx, ny, nz
        if m.kind[p] == 0:
            # half way to the quad's own plane, for quads that bend round an edge
            px, py, pz = px + N[p, 0], py + N[p, 1], pz + N[p, 2]
            length = np.sqrt(px * px + py * py + pz * pz)
            if length > 0.0:
                px, py, pz = px / length, py / length, pz / length
        u, w = ux * ux + uy * uy + uz * uz, wx * wx + wy * wy + wz * wz
        size = np.sqrt(u * w)
        if size == 0.0:
            return -1.0, 4.0 * _cost(-1.0)
        j = (px * (uy * wz - uz * wy) + py * (uz * wx - ux * wz) + pz * (ux * wy - uy * wx)) / size
        if turned:
            j = min(j, 0.0)
        if j > 0.0:
            j *= min(1.0, np.sqrt(slender * min(u, w) / size))
        worst = min(worst, j)
        cost += _cost(j)
    return worst, cost


@inner
def quad_quality(m, q, quads, outward):
    """Scaled Jacobian of quad q: the least sine of its corners' angles, seen along the surface normal."""
    return quad_cost(m, q, quads, outward, np.inf)[0]


@inner
def _cost(quality):
    """1 / (quality + c)^2, led on straight below zero."""
    if quality > 0.0:
        return 1.0 / (quality + _SOFT) ** 2
    return (1.0 - 2.0 * quality / _SOFT) / _SOFT**2


@inner
def straightness(m, g, c, a, b, low, high):
    """How straight curve c is between vertices a and b at arc lengths: the chord over those to its middle and on."""
    X = m.X
    x, y, z, _, _ = on_curve(g, c, 0.5 * (low + high))
    chord = np.sqrt((X[a, 0] - X[b, 0]) ** 2 + (X[a, 1] - X[b, 1]) ** 2 + (X[a, 2] - X[b, 2]) ** 2)
    one = np.sqrt((X[a, 0] - x) ** 2 + (X[a, 1] - y) ** 2 + (X[a, 2] - z) ** 2)
    two = np.sqrt((X[b, 0] - x) ** 2 + (X[b, 1] - y) ** 2 + (X[b, 2] - z) ** 2)
    return chord / (one + two) if one + two > 0.0 else 1.0


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True)
def all_qualities(m, quads, outward, out):
    for q in range(len(quads)):
        out[q] = quad_quality(m, q, quads, outward)


@inner
def quality_at(m, v, offsets, around, quads, outward):
    """(worst, cost) of the quads round v."""
    worst, cost = 1.0, 0.0
    for a in range(offsets[v], offsets[v + 1]):
        one, own = quad_cost(m, around[a], quads, outward, _SLENDER)
        worst = min(worst, one)
        cost += own
    return worst, cost


@inner
def try_place(m, g, v, x, y, z):
    """Put a smooth vertex at the walk's end from where it is towards (x, y, z)."""
    x, y, z, at, _ = walk(x, y, z, m.vt[v], g.v, g.t, g.nb, g.block)
    place_on_ground(m, g, v, x, y, z, at)


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True)
def smooth_quads(m, g, quads, outward, offsets, around, near_offsets, near, low, high, busy, goal, rounds):
    """Even out the quads; a vertex moves only to where the quads round it stay good (`goal`) or cost less.

    Where they are poor, better places are searched for.

    `low`, `high` (n,): the vertices before and after on the curve; `near`: edge neighbours; `busy` (n,): those to move.
    """
    kind, X, vs, vt, H, N, vc = m.kind, m.X, m.vs, m.vt, m.H, m.N, m.vc
    for _ in range(rounds):
        for v in range(len(offsets) - 1):
            if kind[v] == 2 or not busy[v]:
                continue
            old, least = quality_at(m, v, offsets, around, quads, outward)
            ox, oy, oz, os, ot, oh = X[v, 0], X[v, 1], X[v, 2], vs[v], vt[v], H[v]
            onx, ony, onz = N[v, 0], N[v, 1], N[v, 2]
            lo, hi = 0.0, 0.0
            if kind[v] == 1:
                c = vc[v]
                lo = vs[low[v]] if kind[low[v]] == 1 else 0.0
                hi = vs[high[v]] if kind[high[v]] == 1 else g.along[g.off[c + 1] - 1]
                place_on_curve(m, g, v, c, 0.5 * os + 0.25 * (lo + hi))
            else:
                x, y, z = 0.0, 0.0, 0.0
                count = near_offsets[v + 1] - near_offsets[v]
                for a in range(near_offsets[v], near_offsets[v + 1]):
                    p = near[a]
                    x, y, z = x + X[p, 0] / count, y + X[p, 1] / count, z + X[p, 2] / count
                dx, dy, dz = 0.7 * (x - ox), 0.7 * (y - oy), 0.7 * (z - oz)
                up = dx * onx + dy * ony + dz * onz
                try_place(m, g, v, ox + dx - up * onx, oy + dy - up * ony, oz + dz - up * onz)
            new, cost = quality_at(m, v, offsets, around, quads, outward)
            if new >= goal or (cost <= least and new >= min(old, 0.0)):
                continue
            # back, and search for a better place
            X[v, 0], X[v, 1], X[v, 2] = ox, oy, oz
            N[v, 0], N[v, 1], N[v, 2] = onx, ony, onz
            vs[v], vt[v], H[v] = os, ot, oh
            if old >= goal:
                continue
            if kind[v] == 1:
                step = 0.25 * (hi - lo)
                for _level in range(5):
                    for sign in (-1.0, 1.0):
                        s = vs[v] + sign * step
                        if s <= lo + 0.05 * (hi - lo) or s >= hi - 0.05 * (hi - lo):
                            continue
                        before = vs[v]
                        place_on_curve(m, g, v, vc[v], s)
                        new, cost = quality_at(m, v, offsets, around, quads, outward)
                        if cost < least and new >= min(old, 0.0):
                            old, least = new, cost
                        else:
                            place_on_curve(m, g, v, vc[v], before)
                    step *= 0.5
                continue
            # two directions in the tangent plane
            ax, ay, az = 1.0, 0.0, 0.0
            if abs(onx) > 0.6:
                ax, ay = 0.0, 1.0
            up = ax * onx + ay * ony + az * onz
            ax, ay, az = ax - up * onx, ay - up * ony, az - up * onz
            size = np.sqrt(ax * ax + ay * ay + az * az)
            ax, ay, az = ax / size, ay / size, az / size
            bx, by, bz = ony * az - onz * ay, onz * ax - onx * az, onx * ay - ony * ax
            step = 0.0
            for a in range(near_offsets[v], near_offsets[v + 1]):
                p = near[a]
                step += np.sqrt((X[p, 0] - ox) ** 2 + (X[p, 1] - oy) ** 2 + (X[p, 2] - oz) ** 2)
            step *= 0.3 / (near_offsets[v + 1] - near_offsets[v])
            for _level in range(5):
                for turn in range(8):
                    r, s = step * np.cos(0.25 * np.pi * turn), step * np.sin(0.25 * np.pi * turn)
                    cx, cy, cz, ct, ch = X[v, 0], X[v, 1], X[v, 2], vt[v], H[v]
                    cnx, cny, cnz = N[v, 0], N[v, 1], N[v, 2]
                    try_place(m, g, v, cx + r * ax + s * bx, cy + r * ay + s * by, cz + r * az + s * bz)
                    new, cost = quality_at(m, v, offsets, around, quads, outward)
                    if cost < least and new >= min(old, 0.0):
                        old, least = new, cost
                    else:
                        X[v, 0], X[v, 1], X[v, 2] = cx, cy, cz
                        N[v, 0], N[v, 1], N[v, 2] = cnx, cny, cnz
                        vt[v], H[v] = ct, ch
                step *= 0.5


@inner
def curve_stretch(g, c, low, high, out, n):
    """Append the polyline of curve c from arc length low to high to `out`; an empty `out` only counts."""
    g_along = g.along
    x, y, z, first, _ = on_curve(g, c, low)
    ex, ey, ez, last, _ = on_curve(g, c, high)
    write = len(out) > 0
    if write:
        out[n, 0], out[n, 1], out[n, 2] = x, y, z
    n += 1
    for row in range(first + 1, last + 1):
        if g_along[row] > low and g_along[row] < high:
            if write:
                for d in range(3):
                    out[n, d] = g.v[g.cv[row], d]
            n += 1
    if write:
        out[n, 0], out[n, 1], out[n, 2] = ex, ey, ez
    return n + 1


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True)
def curve_paths(g, curves, low, high, offsets, out):
    """Stretches of curves one after the other; with an empty `out` only `offsets` is filled."""
    for e in range(len(curves)):
        n = curve_stretch(g, curves[e], low[e], high[e], out, offsets[e])
        if len(out) == 0:
            offsets[e + 1] = n
