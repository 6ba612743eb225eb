"""Kernels of `remesh`: collapse, split, flip and smooth triangles that lie on another triangulation.

A vertex is smooth (kind 0, anywhere in its region), on a feature curve (kind 1, at an arc length) or fixed (kind 2, an anchor).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from patchwright.repair._surface_walk_kernel import walk

_RING = 512  # most triangles round a vertex; a vertex with more is left alone
_FACING = 0.34  # cosine of 70 degrees: how far a triangle may turn from the surface's normal at its corners
_GOOD = 0.25  # quality (1 is equilateral) that is never asked to be bettered


class Ground(NamedTuple):
    """The triangulation under the mesh, with its curves and anchors."""

    v: Any  # (n, 3) vertices
    t: Any  # (m, 3) triangles
    nb: Any  # (m, 3) neighbours
    block: Any  # (m, 3) curve on each side, -1 smooth
    normal: Any  # (m, 3)
    region: Any  # (m,)
    h: Any  # (n,) wanted edge length
    off: Any  # (c + 1,) rows of curves
    cv: Any  # (k,) vertices along curves
    along: Any  # (k,) arc lengths
    beside: Any  # (k, 2) triangles beside each segment
    begin: Any  # (c,) anchor at each curve's start
    end: Any  # (c,) anchor at its end
    fan_off: Any  # (anchors + 1,)
    fan: Any  # triangles round each anchor


class Mesh(NamedTuple):
    """The mesh being changed; a dead triangle has T[t, 0] = -1, a dead vertex v2t = -1."""

    X: Any  # (n, 3)
    N: Any  # (n, 3) surface normal at smooth vertices
    H: Any  # (n,) wanted edge length
    kind: Any  # (n,)
    vc: Any  # (n,) curve (kind 1) or anchor (kind 2)
    vs: Any  # (n,) arc length (kind 1)
    vt: Any  # (n,) triangle of the ground
    v2t: Any  # (n,) a triangle at the vertex
    T: Any  # (m, 3)
    B: Any  # (m, 3) neighbours
    F: Any  # (m, 3) curve on each side, -1 smooth
    R: Any  # (m,) region
    mark: Any  # (n,) scratch


@njit(cache=True, nogil=True)
def on_curve(g, c, s):
    """(x, y, z, row, share) of the point at arc length s of curve c; the row is its segment's."""
    lo, hi = g.off[c], g.off[c + 1] - 2
    while lo < hi:
        mid = (lo + hi + 1) // 2
        if g.along[mid] <= s:
            lo = mid
        else:
            hi = mid - 1
    step = g.along[lo + 1] - g.along[lo]
    r = (s - g.along[lo]) / step if step > 0.0 else 0.0
    r = min(max(r, 0.0), 1.0)
    a, b = g.cv[lo], g.cv[lo + 1]
    return (
        g.v[a, 0] + r * (g.v[b, 0] - g.v[a, 0]),
        g.v[a, 1] + r * (g.v[b, 1] - g.v[a, 1]),
        g.v[a, 2] + r * (g.v[b, 2] - g.v[a, 2]),
        lo,
        r,
    )


@njit(cache=True, nogil=True)
def facing(m, g, v, region, nx, ny, nz):
    """Cosine between (nx, ny, nz) and the surface normal at vertex v in a region; of several normals the nearest."""
    if m.kind[v] == 0:
        return m.N[v, 0] * nx + m.N[v, 1] * ny + m.N[v, 2] * nz
    best = -2.0
    if m.kind[v] == 1:
        _, _, _, row, _ = on_curve(g, m.vc[v], m.vs[v])
        for side in range(2):
            t = g.beside[row, side]
            if t >= 0 and g.region[t] == region:
                best = max(best, g.normal[t, 0] * nx + g.normal[t, 1] * ny + g.normal[t, 2] * nz)
    else:
        for a in range(g.fan_off[m.vc[v]], g.fan_off[m.vc[v] + 1]):
            t = g.fan[a]
            if g.region[t] == region:
                best = max(best, g.normal[t, 0] * nx + g.normal[t, 1] * ny + g.normal[t, 2] * nz)
    return 1.0 if best < -1.5 else best


@njit(cache=True, nogil=True)
def quality(m, g, a, b, c, region, strict):
    """4 sqrt(3) area / sum of squared sides, 1 when equilateral; -1 when `strict` and turned against the surface."""
    ux, uy, uz = m.X[b, 0] - m.X[a, 0], m.X[b, 1] - m.X[a, 1], m.X[b, 2] - m.X[a, 2]
    wx, wy, wz = m.X[c, 0] - m.X[a, 0], m.X[c, 1] - m.X[a, 1], m.X[c, 2] - m.X[a, 2]
    nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
    size = np.sqrt(nx * nx + ny * ny + nz * nz)
    squares = ux * ux + uy * uy + uz * uz + wx * wx + wy * wy + wz * wz
    squares += (wx - ux) ** 2 + (wy - uy) ** 2 + (wz - uz) ** 2
    if size <= 1e-14 * squares:
        return -1.0 if strict else 0.0
    if strict:
        nx, ny, nz = nx / size, ny / size, nz / size
        if facing(m, g, a, region, nx, ny, nz) < _FACING:
            return -1.0
        if facing(m, g, b, region, nx, ny, nz) < _FACING:
            return -1.0
        if facing(m, g, c, region, nx, ny, nz) < _FACING:
            return -1.0
    return 2.0 * np.sqrt(3.0) * size / squares


@njit(cache=True, nogil=True)
def distance(m, a, b):
    return np.sqrt((m.X[a, 0] - m.X[b, 0]) ** 2 + (m.X[a, 1] - m.X[b, 1]) ** 2 + (m.X[a, 2] - m.X[b, 2]) ** 2)


@njit(cache=True, nogil=True)
def corner_of(m, t, v):
    if m.T[t, 0] == v:
        return 0
    if m.T[t, 1] == v:
        return 1
    return 2


@njit(cache=True, nogil=True)
def ring_of(m, v, ring):
    """Triangles round v, counter-clockwise, from the boundary if there is one; their number, 0 when too many."""
    start = m.v2t[v]
    t = start
    for _ in range(_RING):
        back = m.B[t, corner_of(m, t, v)]
        if back < 0 or back == start:
            break
        t = back
    first = t
    count = 0
    while True:
        if count == _RING:
            return 0
        ring[count] = t
        count += 1
        t = m.B[t, (corner_of(m, t, v) + 2) % 3]
        if t < 0 or t == first:
            return count


@njit(cache=True, nogil=True)
def replace_neighbour(m, t, old, new, curve):
    if t >= 0:
        for k in range(3):
            if m.B[t, k] == old:
                m.B[t, k] = new
                m.F[t, k] = curve
                return


@njit(cache=True, nogil=True)
def collapse_score(m, g, v, w, ring, ring_w, limit):
    """Worst quality after moving v onto w, or -1 when that is not allowed."""
    if m.kind[v] == 2:
        return -1.0
    n = ring_of(m, v, ring)
    if n == 0:
        return -1.0
    shared = 0
    along_curve = False
    for i in range(n):
        t = ring[i]
        k = corner_of(m, t, v)
        p, q = m.T[t, (k + 1) % 3], m.T[t, (k + 2) % 3]
        if p == w or q == w:
            shared += 1
            to_w = k if p == w else (k + 2) % 3
            to_x = (k + 2) % 3 if p == w else k
            if m.F[t, to_w] >= 0:
                along_curve = True
            if m.F[t, (k + 1) % 3] >= 0 and m.F[t, to_x] >= 0:
                return -1.0
            if m.B[t, (k + 1) % 3] < 0 and m.B[t, to_x] < 0:
                return -1.0
    if m.kind[v] == 1 and not along_curve:
        return -1.0
    # link condition
    nw = ring_of(m, w, ring_w)
    if nw == 0:
        return -1.0
    for i in range(n):
        for k in range(3):
            m.mark[m.T[ring[i], k]] = 0
    for i in range(nw):
        for k in range(3):
            m.mark[m.T[ring_w[i], k]] = 1
    m.mark[v], m.mark[w] = 0, 0
    common = 0
    for i in range(n):
        for k in range(3):
            x = m.T[ring[i], k]
            if m.mark[x] == 1:
                common += 1
                m.mark[x] = 0
    if common != shared:
        return -1.0
    worst_old, worst_new = 1.0, 1.0
    for i in range(n):
        t = ring[i]
        k = corner_of(m, t, v)
        p, q = m.T[t, (k + 1) % 3], m.T[t, (k + 2) % 3]
        worst_old = min(worst_old, quality(m, g, v, p, q, m.R[t], True))
        if p == w or q == w:
            continue
        new = quality(m, g, w, p, q, m.R[t], True)
        if new <= 0.0:
            return -1.0
        worst_new = min(worst_new, new)
        if limit > 0.0:
            for x in (p, q):
                d = distance(m, w, x)
                if d > limit * 0.5 * (m.H[w] + m.H[x]) and d > distance(m, v, x):
                    return -1.0
    if worst_new < min(_GOOD, worst_old):
        return -1.0
    return worst_new


@njit(cache=True, nogil=True)
def collapse(m, v, w, ring):
    """Move v onto w and drop the triangles between; `collapse_score` has said that it may be done."""
    n = ring_of(m, v, ring)
    keep = -1
    for i in range(n):
        t = ring[i]
        k = corner_of(m, t, v)
        p, q = m.T[t, (k + 1) % 3], m.T[t, (k + 2) % 3]
        if p == w or q == w:
            x = q if p == w else p
            outer = m.B[t, (k + 1) % 3]  # across w-x
            to_x = (k + 2) % 3 if p == w else k
            inner = m.B[t, to_x]  # across v-x
            curve = max(m.F[t, (k + 1) % 3], m.F[t, to_x])
            replace_neighbour(m, outer, t, inner, curve)
            replace_neighbour(m, inner, t, outer, curve)
            alive = outer if outer >= 0 else inner
            m.v2t[x] = alive
            keep = alive
            m.T[t, 0] = -1
    for i in range(n):
        t = ring[i]
        if m.T[t, 0] >= 0:
            m.T[t, corner_of(m, t, v)] = w
    m.v2t[w] = keep
    m.v2t[v] = -1


@njit(cache=True, nogil=True)
def collapse_pass(m, g, count, scale, limit):
    """Collapse edges shorter than `scale` times the wanted length; how many."""
    ring = np.empty(_RING, dtype=np.int64)
    ring_w = np.empty(_RING, dtype=np.int64)
    done = 0
    for t in range(count):
        for k in range(3):
            if m.T[t, 0] < 0:
                break
            a, b = m.T[t, k], m.T[t, (k + 1) % 3]
            if m.B[t, k] >= 0 and a > b:
                continue
            if distance(m, a, b) >= scale * min(m.H[a], m.H[b]):
                continue
            if m.F[t, k] < 0 and m.kind[a] > 0 and m.kind[b] > 0:
                continue
            ab = collapse_score(m, g, a, b, ring, ring_w, limit) if m.kind[a] <= m.kind[b] else -1.0
            ba = collapse_score(m, g, b, a, ring, ring_w, limit) if m.kind[b] <= m.kind[a] else -1.0
            if ab < 0.0 and ba < 0.0:
                continue
            if ab >= ba:
                collapse(m, a, b, ring)
            else:
                collapse(m, b, a, ring)
            done += 1
    return done


@njit(cache=True, nogil=True)
def flip_pass(m, g, count):
    """Turn smooth edges where that betters the worse of the two triangles; how many."""
    ring = np.empty(_RING, dtype=np.int64)
    done = 0
    for t in range(count):
        if m.T[t, 0] < 0:
            continue
        for k in range(3):
            o = m.B[t, k]
            if o < 0 or m.F[t, k] >= 0:
                continue
            a, b, c = m.T[t, k], m.T[t, (k + 1) % 3], m.T[t, (k + 2) % 3]
            ka = corner_of(m, o, a)
            d = m.T[o, (ka + 1) % 3]
            region = m.R[t]
            old = min(quality(m, g, a, b, c, region, True), quality(m, g, b, a, d, region, True))
            if old > 0.9:
                continue
            first = quality(m, g, a, d, c, region, True)
            if first <= old + 0.02:
                continue
            if min(first, quality(m, g, d, b, c, region, True)) <= old + 0.02:
                continue
            n = ring_of(m, c, ring)
            met = n == 0
            for i in range(n):
                if m.T[ring[i], 0] == d or m.T[ring[i], 1] == d or m.T[ring[i], 2] == d:
                    met = True
            if met:
                continue
            bc, fbc = m.B[t, (k + 1) % 3], m.F[t, (k + 1) % 3]
            ca, fca = m.B[t, (k + 2) % 3], m.F[t, (k + 2) % 3]
            ad, fad = m.B[o, ka], m.F[o, ka]
            db, fdb = m.B[o, (ka + 1) % 3], m.F[o, (ka + 1) % 3]
            m.T[t, 0], m.T[t, 1], m.T[t, 2] = a, d, c
            m.B[t, 0], m.B[t, 1], m.B[t, 2] = ad, o, ca
            m.F[t, 0], m.F[t, 1], m.F[t, 2] = fad, -1, fca
            m.T[o, 0], m.T[o, 1], m.T[o, 2] = d, b, c
            m.B[o, 0], m.B[o, 1], m.B[o, 2] = db, bc, t
            m.F[o, 0], m.F[o, 1], m.F[o, 2] = fdb, fbc, -1
            replace_neighbour(m, ad, o, t, fad)
            replace_neighbour(m, bc, t, o, fbc)
            m.v2t[a], m.v2t[b], m.v2t[c], m.v2t[d] = t, o, t, t
            done += 1
            break
    return done


@njit(cache=True, nogil=True)
def arc_at(m, g, v, c, other):
    """Arc length of v on curve c, as the end of the mesh edge that goes to `other` on the same curve."""
    if m.kind[v] == 1:
        return m.vs[v]
    length = g.along[g.off[c + 1] - 1]
    if g.begin[c] != g.end[c]:
        return 0.0 if m.vc[v] == g.begin[c] else length
    if m.kind[other] != 1:
        return 0.0
    # a ring: v is its beginning or its end, depending on where the curve goes on behind `other`
    before, after = curve_sides(m, g, other)
    if before == v and after != v:
        return 0.0
    if after == v and before != v:
        return length
    return 0.0 if m.vs[other] < 0.5 * length else length


@njit(cache=True, nogil=True)
def curve_sides(m, g, v):
    """(vertex before, vertex after) v along its curve, -1 unknown; v is of kind 1."""
    c = m.vc[v]
    one, two = -1, -1
    t = m.v2t[v]
    start = t
    way = 0
    for _ in range(2 * _RING):
        k = corner_of(m, t, v)
        for side in (k, (k + 2) % 3):
            if m.F[t, side] == c:
                x = m.T[t, (side + 1) % 3] if side == k else m.T[t, side]
                if one < 0 or one == x:
                    one = x
                else:
                    two = x
        if two >= 0:
            break
        step = m.B[t, (k + 2) % 3] if way == 0 else m.B[t, k]
        if step == start:
            break
        if step < 0:
            if way == 1:
                break
            way = 1
            t = start
            continue
        t = step
    if one < 0 or two < 0:
        return -1, -1
    s = m.vs[v]
    if m.kind[one] == 1:
        return (one, two) if m.vs[one] < s else (two, one)
    if m.kind[two] == 1:
        return (two, one) if m.vs[two] < s else (one, two)
    if g.begin[c] != g.end[c]:
        return (one, two) if m.vc[one] == g.begin[c] else (two, one)
    return one, two


@njit(cache=True, nogil=True)
def starts_of(m, g, v, region, out, n):
    """Append ground triangles at v in a region to `out`, from which a walk may start."""
    if m.kind[v] == 0:
        if g.region[m.vt[v]] == region:
            out[n] = m.vt[v]
            return n + 1
        return n
    if m.kind[v] == 1:
        _, _, _, row, _ = on_curve(g, m.vc[v], m.vs[v])
        for side in range(2):
            t = g.beside[row, side]
            if t >= 0 and g.region[t] == region and n < len(out):
                out[n] = t
                n += 1
        return n
    for a in range(g.fan_off[m.vc[v]], g.fan_off[m.vc[v] + 1]):
        if g.region[g.fan[a]] == region and n < len(out):
            out[n] = g.fan[a]
            n += 1
    return n


@njit(cache=True, nogil=True)
def put_on(px, py, pz, nx, ny, nz, starts, n, g):
    """Best of the walks from several triangles: (x, y, z, triangle); a sheet turned from (nx, ny, nz) counts as far."""
    bx, by, bz, bt, best = px, py, pz, -1, np.inf
    for i in range(n):
        seen = False
        for j in range(i):
            seen |= starts[j] == starts[i]
        if seen:
            continue
        x, y, z, t, d = walk(px, py, pz, starts[i], g.v, g.t, g.nb, g.block)
        if nx * g.normal[t, 0] + ny * g.normal[t, 1] + nz * g.normal[t, 2] < 0.1:
            d = 100.0 * d + 1e-300
        if d < best:
            bx, by, bz, bt, best = x, y, z, t, d
    return bx, by, bz, bt


@njit(cache=True, nogil=True)
def wanted_at(g, t, x, y, z):
    """Wanted edge length at a point of ground triangle t, linear between its corners."""
    total, value = 0.0, 0.0
    for k in range(3):
        a, b, c = g.t[t, k], g.t[t, (k + 1) % 3], g.t[t, (k + 2) % 3]
        ux, uy, uz = g.v[b, 0] - x, g.v[b, 1] - y, g.v[b, 2] - z
        wx, wy, wz = g.v[c, 0] - x, g.v[c, 1] - y, g.v[c, 2] - z
        area = np.sqrt((uy * wz - uz * wy) ** 2 + (uz * wx - ux * wz) ** 2 + (ux * wy - uy * wx) ** 2)
        total += area
        value += area * g.h[a]
    return value / total if total > 0.0 else g.h[g.t[t, 0]]


@njit(cache=True, nogil=True)
def place_on_curve(m, g, v, c, s):
    x, y, z, row, r = on_curve(g, c, s)
    m.X[v, 0], m.X[v, 1], m.X[v, 2] = x, y, z
    m.kind[v], m.vc[v], m.vs[v] = 1, c, s
    m.vt[v] = g.beside[row, 0]
    m.H[v] = (1.0 - r) * g.h[g.cv[row]] + r * g.h[g.cv[row + 1]]


@njit(cache=True, nogil=True)
def place_on_ground(m, g, v, x, y, z, t):
    m.X[v, 0], m.X[v, 1], m.X[v, 2] = x, y, z
    m.N[v, 0], m.N[v, 1], m.N[v, 2] = g.normal[t, 0], g.normal[t, 1], g.normal[t, 2]
    m.kind[v], m.vc[v], m.vs[v], m.vt[v] = 0, -1, 0.0, t
    m.H[v] = wanted_at(g, t, x, y, z)


@njit(cache=True, nogil=True)
def split_edge(m, g, t, k, vertices, triangles, starts):
    """Put a vertex into side k of t (the new vertex is `vertices`, new triangles from `triangles` on); whether it could be."""
    o = m.B[t, k]
    a, b, c = m.T[t, k], m.T[t, (k + 1) % 3], m.T[t, (k + 2) % 3]
    d, kk = -1, 0
    if o >= 0:
        kk = corner_of(m, o, b)
        d = m.T[o, (kk + 2) % 3]
    p = vertices
    if m.F[t, k] >= 0:
        curve = m.F[t, k]
        place_on_curve(m, g, p, curve, 0.5 * (arc_at(m, g, a, curve, b) + arc_at(m, g, b, curve, a)))
    else:
        n = 0
        for x in (a, b, c, d):
            n = starts_of(m, g, x, m.R[t], starts, n)
        nx, ny, nz = 0.0, 0.0, 0.0
        for tri in (t, o):
            i, j, l = m.T[tri, 0], m.T[tri, 1], m.T[tri, 2]
            ux, uy, uz = m.X[j, 0] - m.X[i, 0], m.X[j, 1] - m.X[i, 1], m.X[j, 2] - m.X[i, 2]
            wx, wy, wz = m.X[l, 0] - m.X[i, 0], m.X[l, 1] - m.X[i, 1], m.X[l, 2] - m.X[i, 2]
            nx, ny, nz = nx + uy * wz - uz * wy, ny + uz * wx - ux * wz, nz + ux * wy - uy * wx
        x, y, z = 0.5 * (m.X[a, 0] + m.X[b, 0]), 0.5 * (m.X[a, 1] + m.X[b, 1]), 0.5 * (m.X[a, 2] + m.X[b, 2])
        x, y, z, at = put_on(x, y, z, nx, ny, nz, starts, n, g)
        if at < 0:
            return False
        place_on_ground(m, g, p, x, y, z, at)
    strict = quality(m, g, a, b, c, m.R[t], True) > 0.0
    if strict and (quality(m, g, a, p, c, m.R[t], True) <= 0.0 or quality(m, g, p, b, c, m.R[t], True) <= 0.0):
        return False
    if o >= 0 and quality(m, g, b, a, d, m.R[o], True) > 0.0:
        if quality(m, g, p, a, d, m.R[o], True) <= 0.0 or quality(m, g, b, p, d, m.R[o], True) <= 0.0:
            return False
    curve = m.F[t, k]
    n1, n2 = triangles, triangles + 1
    bc, fbc = m.B[t, (k + 1) % 3], m.F[t, (k + 1) % 3]
    m.T[t, (k + 1) % 3] = p
    m.B[t, (k + 1) % 3], m.F[t, (k + 1) % 3] = n1, -1
    m.T[n1, 0], m.T[n1, 1], m.T[n1, 2] = p, b, c
    m.B[n1, 0], m.B[n1, 1], m.B[n1, 2] = (n2 if o >= 0 else -1), bc, t
    m.F[n1, 0], m.F[n1, 1], m.F[n1, 2] = curve, fbc, -1
    m.R[n1] = m.R[t]
    replace_neighbour(m, bc, t, n1, fbc)
    m.v2t[p], m.v2t[a], m.v2t[b], m.v2t[c] = t, t, n1, t
    if o >= 0:
        db, fdb = m.B[o, (kk + 2) % 3], m.F[o, (kk + 2) % 3]
        m.T[o, kk] = p
        m.B[o, (kk + 2) % 3], m.F[o, (kk + 2) % 3] = n2, -1
        m.T[n2, 0], m.T[n2, 1], m.T[n2, 2] = b, p, d
        m.B[n2, 0], m.B[n2, 1], m.B[n2, 2] = n1, o, db
        m.F[n2, 0], m.F[n2, 1], m.F[n2, 2] = curve, -1, fdb
        m.R[n2] = m.R[o]
        replace_neighbour(m, db, o, n2, fdb)
        m.v2t[d] = o
    return True


@njit(cache=True, nogil=True)
def split_pass(m, g, vertices, triangles, limit):
    """Halve edges longer than `limit` times the wanted length, the longest first; (vertices, triangles) in use now.

    Stops early when the arrays are full.
    """
    starts = np.empty(64, dtype=np.int64)
    scale = 16.0
    while scale >= 1.0:
        t = 0
        while t < triangles:
            if m.T[t, 0] >= 0:
                for k in range(3):
                    a, b = m.T[t, k], m.T[t, (k + 1) % 3]
                    if distance(m, a, b) > scale * limit * 0.5 * (m.H[a] + m.H[b]):
                        if vertices + 1 > len(m.X) or triangles + 2 > len(m.T):
                            return vertices, triangles
                        inner = m.B[t, k] >= 0
                        if split_edge(m, g, t, k, vertices, triangles, starts):
                            vertices += 1
                            triangles += 2 if inner else 1
                            break
            t += 1
        scale *= 0.5
    return vertices, triangles


@njit(cache=True, nogil=True)
def smooth_pass(m, g, vertices, relax):
    """Move smooth vertices to the mean of their triangles' centres and curve vertices to even spacing; how many moved."""
    ring = np.empty(_RING, dtype=np.int64)
    starts = np.empty(64, dtype=np.int64)
    moved = 0
    for v in range(vertices):
        if m.v2t[v] < 0 or m.kind[v] == 2:
            continue
        n = ring_of(m, v, ring)
        if n == 0:
            continue
        old = 1.0
        for i in range(n):
            t = ring[i]
            old = min(old, quality(m, g, m.T[t, 0], m.T[t, 1], m.T[t, 2], m.R[t], True))
        ox, oy, oz, oh, ot, os = m.X[v, 0], m.X[v, 1], m.X[v, 2], m.H[v], m.vt[v], m.vs[v]
        onx, ony, onz = m.N[v, 0], m.N[v, 1], m.N[v, 2]
        if m.kind[v] == 1:
            before, after = curve_sides(m, g, v)
            if before < 0:
                continue
            c = m.vc[v]
            low, high = arc_at(m, g, before, c, v), arc_at(m, g, after, c, v)
            if low >= high:
                continue
            left, right = 0.5 * (m.H[before] + oh), 0.5 * (m.H[after] + oh)
            place_on_curve(m, g, v, c, os + relax * (low + (high - low) * left / (left + right) - os))
        else:
            total, x, y, z = 0.0, 0.0, 0.0, 0.0
            for i in range(n):
                a, b, c = m.T[ring[i], 0], m.T[ring[i], 1], m.T[ring[i], 2]
                ux, uy, uz = m.X[b, 0] - m.X[a, 0], m.X[b, 1] - m.X[a, 1], m.X[b, 2] - m.X[a, 2]
                wx, wy, wz = m.X[c, 0] - m.X[a, 0], m.X[c, 1] - m.X[a, 1], m.X[c, 2] - m.X[a, 2]
                area = np.sqrt((uy * wz - uz * wy) ** 2 + (uz * wx - ux * wz) ** 2 + (ux * wy - uy * wx) ** 2)
                weight = area / (m.H[a] + m.H[b] + m.H[c]) ** 2
                total += weight
                x += weight * (m.X[a, 0] + m.X[b, 0] + m.X[c, 0]) / 3.0
                y += weight * (m.X[a, 1] + m.X[b, 1] + m.X[c, 1]) / 3.0
                z += weight * (m.X[a, 2] + m.X[b, 2] + m.X[c, 2]) / 3.0
            if total <= 0.0:
                continue
            dx, dy, dz = relax * (x / total - ox), relax * (y / total - oy), relax * (z / total - oz)
            up = dx * onx + dy * ony + dz * onz
            starts[0] = ot
            x, y, z, at = put_on(
                ox + dx - up * onx, oy + dy - up * ony, oz + dz - up * onz, onx, ony, onz, starts, 1, g
            )
            place_on_ground(m, g, v, x, y, z, at)
        new = 1.0
        for i in range(n):
            t = ring[i]
            new = min(new, quality(m, g, m.T[t, 0], m.T[t, 1], m.T[t, 2], m.R[t], True))
        if new < min(old, _GOOD):
            m.X[v, 0], m.X[v, 1], m.X[v, 2] = ox, oy, oz
            m.N[v, 0], m.N[v, 1], m.N[v, 2] = onx, ony, onz
            m.H[v], m.vt[v], m.vs[v] = oh, ot, os
        else:
            moved += 1
    return moved
