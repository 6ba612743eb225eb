"""Kernels of `remesh`: collapse, split, flip and smooth triangles that lie on another triangulation.

A vertex is smooth (kind 0, anywhere in its region), on a feature curve (kind 1, at an arc length) or fixed (kind 2, an
anchor).
"""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from patchwright.repair.layout._surface_walk_kernel import inner, walk

_RING = 512  # most triangles round a vertex; a vertex with more is left alone
_FACING = 0.34  # cosine of 70 degrees: how far a triangle may turn from the surface's normal at its corners
_GOOD = 0.25  # quality (1 is equilateral) that is never asked to be bettered
_SLIM = 0.1  # the same across a strip between curves, where triangles may be long
_BLUNT = -0.5  # cosine of the largest angle; beyond, a flat triangle lies along its curve
_ACROSS = 0.5  # of the way along a curve to the next vertex: across narrower strips vertices face each other
_LENGTHENED = 1.05  # how much a collapse may lengthen an edge that is too long already
_HALF = 0.8  # longest half of a split edge against the edge
_APART = 0.02  # of a split edge: where its middle is nearer to a corner opposite, the edge is one to flip
_REFUSED = -9.0  # score of a collapse that is not allowed; below any quality


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


@inner
def on_curve(g, c, s):
    """(x, y, z, row, share) of the point at arc length s of curve c; the row is its segment's."""
    g_off, g_along, g_cv, g_v = g.off, g.along, g.cv, g.v
    lo, hi = g_off[c], g_off[c + 1] - 2
    while lo < hi:
        mid = (lo + hi + 1) // 2
        if g_along[mid] <= s:
            lo = mid
        else:
            hi = mid - 1
    step = g_along[lo + 1] - g_along[lo]
    r = (s - g_along[lo]) / step if step > 0.0 else 0.0
    r = min(max(r, 0.0), 1.0)
    a, b = g_cv[lo], g_cv[lo + 1]
    return (
        g_v[a, 0] + r * (g_v[b, 0] - g_v[a, 0]),
        g_v[a, 1] + r * (g_v[b, 1] - g_v[a, 1]),
        g_v[a, 2] + r * (g_v[b, 2] - g_v[a, 2]),
        lo,
        r,
    )


@inner
def facing(m, g, v, region, nx, ny, nz):
    """Cosine between (nx, ny, nz) and the surface normal at vertex v in a region; of several normals the nearest."""
    kind, N, vc = m.kind, m.N, m.vc
    g_region, g_normal, g_fan_off = g.region, g.normal, g.fan_off
    if kind[v] == 0:
        return N[v, 0] * nx + N[v, 1] * ny + N[v, 2] * nz
    best = -2.0
    if kind[v] == 1:
        _, _, _, row, _ = on_curve(g, vc[v], m.vs[v])
        for side in range(2):
            t = g.beside[row, side]
            if t >= 0 and g_region[t] == region:
                best = max(best, g_normal[t, 0] * nx + g_normal[t, 1] * ny + g_normal[t, 2] * nz)
    else:
        for a in range(g_fan_off[vc[v]], g_fan_off[vc[v] + 1]):
            t = g.fan[a]
            if g_region[t] == region:
                best = max(best, g_normal[t, 0] * nx + g_normal[t, 1] * ny + g_normal[t, 2] * nz)
    return 1.0 if best < -1.5 else best


@inner
def quality(m, g, a, b, c, region, strict):
    """4 sqrt(3) area / sum of squared sides, 1 when equilateral.

    When `strict`, a triangle turned against the surface gets its least cosine to the normals at its corners less 1, so
    that of two turned ones the better is seen.
    """
    X, N, kind = m.X, m.N, m.kind
    ux, uy, uz = X[b, 0] - X[a, 0], X[b, 1] - X[a, 1], X[b, 2] - X[a, 2]
    wx, wy, wz = X[c, 0] - X[a, 0], X[c, 1] - X[a, 1], X[c, 2] - X[a, 2]
    nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
    size = np.sqrt(nx * nx + ny * ny + nz * nz)
    squares = ux * ux + uy * uy + uz * uz + wx * wx + wy * wy + wz * wz
    squares += (wx - ux) ** 2 + (wy - uy) ** 2 + (wz - uz) ** 2
    if size <= 1e-14 * squares:
        return -1.0 if strict else 0.0
    if strict:
        nx, ny, nz = nx / size, ny / size, nz / size
        least = 1.0
        for i in range(3):
            p = a if i == 0 else (b if i == 1 else c)
            if kind[p] == 0:
                least = min(least, N[p, 0] * nx + N[p, 1] * ny + N[p, 2] * nz)
            else:
                least = min(least, facing(m, g, p, region, nx, ny, nz))
        if least < _FACING:
            return least - 1.0
    return 2.0 * np.sqrt(3.0) * size / squares


@inner
def distance(m, a, b):
    X = m.X
    return np.sqrt((X[a, 0] - X[b, 0]) ** 2 + (X[a, 1] - X[b, 1]) ** 2 + (X[a, 2] - X[b, 2]) ** 2)


@inner
def spans_strip(m, a, b, c):
    """Whether a triangle has its corners on different curves, or all on curves and no blunt angle."""
    kind, vc = m.kind, m.vc
    if kind[a] == 0 or kind[b] == 0 or kind[c] == 0:
        return False
    if kind[a] == 1 and kind[b] == 1 and vc[a] != vc[b]:
        return True
    if kind[b] == 1 and kind[c] == 1 and vc[b] != vc[c]:
        return True
    if kind[c] == 1 and kind[a] == 1 and vc[c] != vc[a]:
        return True
    p, q, r = distance(m, a, b), distance(m, b, c), distance(m, c, a)
    longest = max(p, max(q, r))
    one = min(p, q) if longest == r else (min(q, r) if longest == p else min(p, r))
    two = p + q + r - longest - one
    return one * one + two * two - longest * longest >= 2.0 * _BLUNT * one * two


@inner
def corner_of(m, t, v):
    T = m.T
    if T[t, 0] == v:
        return 0
    if T[t, 1] == v:
        return 1
    return 2


@inner
def ring_of(m, v, ring):
    """Triangles round v, counter-clockwise, from the boundary if there is one; their number, 0 when too many."""
    B = m.B
    start = m.v2t[v]
    t = start
    for _ in range(_RING):
        back = B[t, corner_of(m, t, v)]
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
        t = B[t, (corner_of(m, t, v) + 2) % 3]
        if t < 0 or t == first:
            return count


@inner
def replace_neighbour(m, t, old, new, curve):
    B = m.B
    if t >= 0:
        for k in range(3):
            if B[t, k] == old:
                B[t, k] = new
                m.F[t, k] = curve
                return


@inner
def collapse_score(m, g, v, w, ring, ring_w, limit):
    """Worst quality after moving v onto w, or `_REFUSED` when that is not allowed."""
    kind, T, F, B, mark, R, H = m.kind, m.T, m.F, m.B, m.mark, m.R, m.H
    if kind[v] == 2:
        return _REFUSED
    n = ring_of(m, v, ring)
    if n == 0:
        return _REFUSED
    shared = 0
    along_curve = False
    for i in range(n):
        t = ring[i]
        k = corner_of(m, t, v)
        p, q = T[t, (k + 1) % 3], T[t, (k + 2) % 3]
        if p == w or q == w:
            shared += 1
            to_w = k if p == w else (k + 2) % 3
            to_x = (k + 2) % 3 if p == w else k
            if F[t, to_w] >= 0:
                along_curve = True
            if F[t, (k + 1) % 3] >= 0 and F[t, to_x] >= 0:
                return _REFUSED
            if B[t, (k + 1) % 3] < 0 and B[t, to_x] < 0:
                return _REFUSED
    if kind[v] == 1 and not along_curve:
        return _REFUSED
    # link condition
    nw = ring_of(m, w, ring_w)
    if nw == 0:
        return _REFUSED
    for i in range(n):
        for k in range(3):
            mark[T[ring[i], k]] = 0
    for i in range(nw):
        for k in range(3):
            mark[T[ring_w[i], k]] = 1
    mark[v], mark[w] = 0, 0
    common = 0
    for i in range(n):
        for k in range(3):
            x = T[ring[i], k]
            if mark[x] == 1:
                common += 1
                mark[x] = 0
    if common != shared:
        return _REFUSED
    if limit > 0.0:
        for i in range(n):
            for k in range(3):
                x = T[ring[i], k]
                if x != v and x != w:
                    d = distance(m, w, x)
                    if d > limit * 0.5 * (H[w] + H[x]) and d > _LENGTHENED * distance(m, v, x):
                        return _REFUSED
    worst_old, worst_new, turned = 1.0, 1.0, 1.0
    for state in range(3):
        if state == 2 and worst_new > 0.0:
            break
        for i in range(n):
            t = ring[i]
            k = corner_of(m, t, v)
            p, q = T[t, (k + 1) % 3], T[t, (k + 2) % 3]
            if state == 1 and (p == w or q == w):
                continue
            value = quality(m, g, w if state == 1 else v, p, q, R[t], state)
            if state == 0:
                worst_old = min(worst_old, value)
            elif state == 1:
                if value == 0.0:
                    return _REFUSED
                good = _SLIM if spans_strip(m, w, p, q) else _GOOD
                if 0.0 < value < min(good, worst_old):
                    return _REFUSED
                worst_new = min(worst_new, value)
            else:
                turned = min(turned, value)
    # turned triangles may stay where the collapse turns them less
    if worst_new <= 0.0 and worst_new <= turned:
        return _REFUSED
    return worst_new


@inner
def collapse(m, v, w, ring):
    """Move v onto w and drop the triangles between; `collapse_score` has said that it may be done."""
    T, B, F, v2t = m.T, m.B, m.F, m.v2t
    n = ring_of(m, v, ring)
    keep = -1
    for i in range(n):
        t = ring[i]
        k = corner_of(m, t, v)
        p, q = T[t, (k + 1) % 3], T[t, (k + 2) % 3]
        if p == w or q == w:
            x = q if p == w else p
            outer = B[t, (k + 1) % 3]  # across w-x
            to_x = (k + 2) % 3 if p == w else k
            inner = B[t, to_x]  # across v-x
            curve = max(F[t, (k + 1) % 3], F[t, to_x])
            replace_neighbour(m, outer, t, inner, curve)
            replace_neighbour(m, inner, t, outer, curve)
            alive = outer if outer >= 0 else inner
            v2t[x] = alive
            keep = alive
            T[t, 0] = -1
    for i in range(n):
        t = ring[i]
        if T[t, 0] >= 0:
            T[t, corner_of(m, t, v)] = w
    v2t[w] = keep
    v2t[v] = -1


@njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
def collapse_pass(m, g, count, scale, limit):
    """Collapse edges shorter than `scale` times the wanted length; how many."""
    T, H, kind = m.T, m.H, m.kind
    ring = np.empty(_RING, dtype=np.int64)
    ring_w = np.empty(_RING, dtype=np.int64)
    done = 0
    for t in range(count):
        for k in range(3):
            if T[t, 0] < 0:
                break
            a, b = T[t, k], T[t, (k + 1) % 3]
            if m.B[t, k] >= 0 and a > b:
                continue
            if distance(m, a, b) >= scale * min(H[a], H[b]):
                continue
            if m.F[t, k] < 0 and kind[a] > 0 and kind[b] > 0:
                continue
            best, gone, stays = _REFUSED, np.int64(-1), np.int64(-1)
            for way in range(2):
                p, q = (a, b) if way == 0 else (b, a)
                if kind[p] <= kind[q]:
                    score = collapse_score(m, g, p, q, ring, ring_w, limit)
                    if score > best:
                        best, gone, stays = score, p, q
            if gone < 0:
                continue
            collapse(m, gone, stays, ring)
            done += 1
    return done


@njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
def flip_pass(m, g, count):
    """Turn smooth edges where that betters the worse of the two triangles; how many."""
    T, B, F, v2t = m.T, m.B, m.F, m.v2t
    ring = np.empty(_RING, dtype=np.int64)
    done = 0
    for t in range(count):
        if T[t, 0] < 0:
            continue
        for k in range(3):
            o = B[t, k]
            if o < 0 or F[t, k] >= 0:
                continue
            a, b, c = T[t, k], T[t, (k + 1) % 3], T[t, (k + 2) % 3]
            ka = corner_of(m, o, a)
            d = T[o, (ka + 1) % 3]
            region = m.R[t]
            old, new = 1.0, 1.0
            for piece in range(4):
                if piece == 0:
                    i, j, k3 = a, b, c
                elif piece == 1:
                    i, j, k3 = b, a, d
                elif piece == 2:
                    i, j, k3 = a, d, c
                else:
                    i, j, k3 = d, b, c
                value = quality(m, g, i, j, k3, region, np.int64(1))
                if piece < 2:
                    old = min(old, value)
                else:
                    new = min(new, value)
                if piece == 1 and old > 0.9:
                    break
            if old > 0.9 or new <= old + 0.02:
                continue
            n = ring_of(m, c, ring)
            met = n == 0
            for i in range(n):
                if T[ring[i], 0] == d or T[ring[i], 1] == d or T[ring[i], 2] == d:
                    met = True
            if met:
                continue
            bc, fbc = B[t, (k + 1) % 3], F[t, (k + 1) % 3]
            ca, fca = B[t, (k + 2) % 3], F[t, (k + 2) % 3]
            ad, fad = B[o, ka], F[o, ka]
            db, fdb = B[o, (ka + 1) % 3], F[o, (ka + 1) % 3]
            T[t, 0], T[t, 1], T[t, 2] = a, d, c
            B[t, 0], B[t, 1], B[t, 2] = ad, o, ca
            F[t, 0], F[t, 1], F[t, 2] = fad, -1, fca
            T[o, 0], T[o, 1], T[o, 2] = d, b, c
            B[o, 0], B[o, 1], B[o, 2] = db, bc, t
            F[o, 0], F[o, 1], F[o, 2] = fdb, fbc, -1
            replace_neighbour(m, ad, o, t, fad)
            replace_neighbour(m, bc, t, o, fbc)
            v2t[a], v2t[b], v2t[c], v2t[d] = t, o, t, t
            done += 1
            break
    return done


@inner
def arc_at(m, g, v, c, other):
    """Arc length of v on curve c, as the end of the mesh edge that goes to `other` on the same curve."""
    kind, vs = m.kind, m.vs
    g_begin = g.begin
    if kind[v] == 1:
        return vs[v]
    length = g.along[g.off[c + 1] - 1]
    if g_begin[c] != g.end[c]:
        return 0.0 if m.vc[v] == g_begin[c] else length
    if kind[other] != 1:
        return 0.0
    # a ring: v is its beginning or its end, depending on where the curve goes on behind `other`
    before, after = curve_sides(m, g, other)
    if before == v and after != v:
        return 0.0
    if after == v and before != v:
        return length
    return 0.0 if vs[other] < 0.5 * length else length


@inner
def curve_sides(m, g, v):
    """(vertex before, vertex after) v along its curve, -1 unknown; v is of kind 1."""
    vc, T, B, vs, kind = m.vc, m.T, m.B, m.vs, m.kind
    g_begin = g.begin
    c = vc[v]
    one, two = -1, -1
    t = m.v2t[v]
    start = t
    way = 0
    for _ in range(2 * _RING):
        k = corner_of(m, t, v)
        for side in (k, (k + 2) % 3):
            if m.F[t, side] == c:
                x = T[t, (side + 1) % 3] if side == k else T[t, side]
                if one < 0 or one == x:
                    one = x
                else:
                    two = x
        if two >= 0:
            break
        step = B[t, (k + 2) % 3] if way == 0 else B[t, k]
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
    s = vs[v]
    if kind[one] == 1:
        return (one, two) if vs[one] < s else (two, one)
    if kind[two] == 1:
        return (two, one) if vs[two] < s else (one, two)
    if g_begin[c] != g.end[c]:
        return (one, two) if vc[one] == g_begin[c] else (two, one)
    return one, two


@inner
def starts_of(m, g, v, region, out, n):
    """Append ground triangles at v in a region to `out`, from which a walk may start."""
    kind, vt, vc = m.kind, m.vt, m.vc
    g_region, g_fan_off, g_fan = g.region, g.fan_off, g.fan
    if kind[v] == 0:
        if g_region[vt[v]] == region:
            out[n] = vt[v]
            return n + 1
        return n
    if kind[v] == 1:
        _, _, _, row, _ = on_curve(g, vc[v], m.vs[v])
        for side in range(2):
            t = g.beside[row, side]
            if t >= 0 and g_region[t] == region and n < len(out):
                out[n] = t
                n += 1
        return n
    for a in range(g_fan_off[vc[v]], g_fan_off[vc[v] + 1]):
        if g_region[g_fan[a]] == region and n < len(out):
            out[n] = g_fan[a]
            n += 1
    return n


@inner
def put_on(px, py, pz, nx, ny, nz, starts, n, g):
    """Best of the walks from several triangles: (x, y, z, triangle); a sheet turned from (nx, ny, nz) counts as far."""
    g_normal = g.normal
    bx, by, bz, bt, best = px, py, pz, -1, np.inf
    for i in range(n):
        seen = False
        for j in range(i):
            seen |= starts[j] == starts[i]
        if seen:
            continue
        x, y, z, t, d = walk(px, py, pz, starts[i], g.v, g.t, g.nb, g.block)
        if nx * g_normal[t, 0] + ny * g_normal[t, 1] + nz * g_normal[t, 2] < 0.1:
            d = 100.0 * d + 1e-300
        if d < best:
            bx, by, bz, bt, best = x, y, z, t, d
    return bx, by, bz, bt


@inner
def wanted_at(g, t, x, y, z):
    """Wanted edge length at a point of ground triangle t, linear between its corners."""
    g_t, g_v, g_h = g.t, g.v, g.h
    total, value = 0.0, 0.0
    for k in range(3):
        a, b, c = g_t[t, k], g_t[t, (k + 1) % 3], g_t[t, (k + 2) % 3]
        ux, uy, uz = g_v[b, 0] - x, g_v[b, 1] - y, g_v[b, 2] - z
        wx, wy, wz = g_v[c, 0] - x, g_v[c, 1] - y, g_v[c, 2] - z
        area = np.sqrt((uy * wz - uz * wy) ** 2 + (uz * wx - ux * wz) ** 2 + (ux * wy - uy * wx) ** 2)
        total += area
        value += area * g_h[a]
    return value / total if total > 0.0 else g_h[g_t[t, 0]]


@inner
def place_on_curve(m, g, v, c, s):
    X = m.X
    g_h, g_cv = g.h, g.cv
    x, y, z, row, r = on_curve(g, c, s)
    X[v, 0], X[v, 1], X[v, 2] = x, y, z
    m.kind[v], m.vc[v], m.vs[v] = 1, c, s
    m.vt[v] = g.beside[row, 0]
    m.H[v] = (1.0 - r) * g_h[g_cv[row]] + r * g_h[g_cv[row + 1]]


@inner
def place_on_ground(m, g, v, x, y, z, t):
    X, N = m.X, m.N
    g_normal = g.normal
    X[v, 0], X[v, 1], X[v, 2] = x, y, z
    N[v, 0], N[v, 1], N[v, 2] = g_normal[t, 0], g_normal[t, 1], g_normal[t, 2]
    m.kind[v], m.vc[v], m.vs[v], m.vt[v] = 0, -1, 0.0, t
    m.H[v] = wanted_at(g, t, x, y, z)


@inner
def split_edge(m, g, t, k, vertices, triangles, starts, long):
    """Put vertex `vertices` into side k of t, with new triangles from `triangles` on; whether that could be done.

    A `long` edge, the longest of its triangles, is split even where a half is turned against the surface: slivers along
    a bent surface can be mended only once they are short.
    """
    B, T, F, R, X, v2t = m.B, m.T, m.F, m.R, m.X, m.v2t
    o = B[t, k]
    a, b, c = T[t, k], T[t, (k + 1) % 3], T[t, (k + 2) % 3]
    d, kk = -1, 0
    if o >= 0:
        kk = corner_of(m, o, b)
        d = T[o, (kk + 2) % 3]
    p = vertices
    if F[t, k] >= 0:
        curve = F[t, k]
        one, two = arc_at(m, g, a, curve, b), arc_at(m, g, b, curve, a)
        if one == two:
            return False
        place_on_curve(m, g, p, curve, 0.5 * (one + two))
    else:
        n = np.int64(0)
        for x in (a, b, c, d):
            n = starts_of(m, g, x, R[t], starts, n)
        nx, ny, nz = 0.0, 0.0, 0.0
        for tri in (t, o):
            i, j, k3 = T[tri, 0], T[tri, 1], T[tri, 2]
            ux, uy, uz = X[j, 0] - X[i, 0], X[j, 1] - X[i, 1], X[j, 2] - X[i, 2]
            wx, wy, wz = X[k3, 0] - X[i, 0], X[k3, 1] - X[i, 1], X[k3, 2] - X[i, 2]
            nx, ny, nz = nx + uy * wz - uz * wy, ny + uz * wx - ux * wz, nz + ux * wy - uy * wx
        x, y, z = 0.5 * (X[a, 0] + X[b, 0]), 0.5 * (X[a, 1] + X[b, 1]), 0.5 * (X[a, 2] + X[b, 2])
        x, y, z, at = put_on(x, y, z, nx, ny, nz, starts, n, g)
        if at < 0:
            return False
        place_on_ground(m, g, p, x, y, z, at)
        # halves hardly shorter than the whole would be split without end
        if max(distance(m, a, p), distance(m, p, b)) > _HALF * distance(m, a, b):
            return False
    # turned or flat halves are borne only by the longest side, of which all new edges are short: slivers cut elsewhere
    # would be cut without end
    longest, whole = True, distance(m, a, b)
    for x in (c, d):
        if x >= 0 and (max(distance(m, a, x), distance(m, b, x)) > whole or distance(m, p, x) < _APART * whole):
            longest = False
    for half in range(2):
        tri = t if half == 0 else o
        if tri < 0:
            continue
        # (first, second, third) of the triangle, then of its two halves
        sound = True
        for piece in range(3):
            i = (a if half == 0 else b) if piece != 2 else p
            j = (b if half == 0 else a) if piece != 1 else p
            good = quality(m, g, i, j, c if half == 0 else d, R[tri], np.int64(1)) > 0.0
            if piece == 0:
                sound = good
            elif not good and not (longest and (long or not sound)):
                return False
    curve = F[t, k]
    n1, n2 = triangles, triangles + 1
    bc, fbc = B[t, (k + 1) % 3], F[t, (k + 1) % 3]
    T[t, (k + 1) % 3] = p
    B[t, (k + 1) % 3], F[t, (k + 1) % 3] = n1, -1
    T[n1, 0], T[n1, 1], T[n1, 2] = p, b, c
    B[n1, 0], B[n1, 1], B[n1, 2] = (n2 if o >= 0 else -1), bc, t
    F[n1, 0], F[n1, 1], F[n1, 2] = curve, fbc, -1
    R[n1] = R[t]
    replace_neighbour(m, bc, t, n1, fbc)
    v2t[p], v2t[a], v2t[b], v2t[c] = t, t, n1, t
    if o >= 0:
        db, fdb = B[o, (kk + 2) % 3], F[o, (kk + 2) % 3]
        T[o, kk] = p
        B[o, (kk + 2) % 3], F[o, (kk + 2) % 3] = n2, -1
        T[n2, 0], T[n2, 1], T[n2, 2] = b, p, d
        B[n2, 0], B[n2, 1], B[n2, 2] = n1, o, db
        F[n2, 0], F[n2, 1], F[n2, 2] = curve, -1, fdb
        R[n2] = R[o]
        replace_neighbour(m, db, o, n2, fdb)
        v2t[d] = o
    return True


@njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
def split_pass(m, g, vertices, triangles, limit):
    """Halve edges longer than `limit` times the wanted length, the longest first; (vertices, triangles) in use now.

    Stops early when the arrays are full.
    """
    T, H = m.T, m.H
    starts = np.empty(64, dtype=np.int64)
    scale = 16.0
    while scale >= 1.0:
        t = np.int64(0)
        while t < triangles:
            if T[t, 0] >= 0:
                for k in range(3):
                    a, b = T[t, k], T[t, (k + 1) % 3]
                    if distance(m, a, b) > scale * limit * 0.5 * (H[a] + H[b]):
                        if vertices + 1 > len(m.X) or triangles + 2 > len(m.T):
                            return vertices, triangles
                        inner = m.B[t, k] >= 0
                        if split_edge(m, g, t, k, vertices, triangles, starts, scale > 1.0):
                            vertices += 1
                            triangles += 2 if inner else 1
                            break
            t += 1
        scale *= 0.5
    return vertices, triangles


@inner
def step_to_face(m, v, before, after, ring, n):
    """(step, width): how far curve vertex v is from facing the nearest vertex of another curve, and what is between.

    `before`, `after` are v's neighbours on its curve, `ring` the n triangles round it; the width is inf without any.
    """
    T, X, kind = m.T, m.X, m.kind
    near, step = np.inf, 0.0
    tx, ty, tz = X[after, 0] - X[before, 0], X[after, 1] - X[before, 1], X[after, 2] - X[before, 2]
    size = np.sqrt(tx * tx + ty * ty + tz * tz)
    for i in range(n):
        for k in range(3):
            x = T[ring[i], k]
            if x != v and x != before and x != after and kind[x] > 0:
                d = distance(m, v, x)
                if d < near and size > 0.0:
                    near = d
                    step = (X[x, 0] - X[v, 0]) * tx + (X[x, 1] - X[v, 1]) * ty + (X[x, 2] - X[v, 2]) * tz
                    step /= size
    return step, np.sqrt(max(near * near - step * step, 0.0)) if near < np.inf else near


@njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
def smooth_pass(m, g, vertices, relax):
    """Move smooth vertices to the mean of their triangles' centres, curve vertices to even spacing; how many."""
    kind, T, R, X, H, vt, vs, N = m.kind, m.T, m.R, m.X, m.H, m.vt, m.vs, m.N
    ring = np.empty(_RING, dtype=np.int64)
    starts = np.empty(64, dtype=np.int64)
    moved = 0
    for v in range(vertices):
        if m.v2t[v] < 0 or kind[v] == 2:
            continue
        n = ring_of(m, v, ring)
        if n == 0:
            continue
        old = 1.0
        for i in range(n):
            t = ring[i]
            old = min(old, quality(m, g, T[t, 0], T[t, 1], T[t, 2], R[t], np.int64(1)))
        ox, oy, oz, oh, ot, os = X[v, 0], X[v, 1], X[v, 2], H[v], vt[v], vs[v]
        onx, ony, onz = N[v, 0], N[v, 1], N[v, 2]
        good = _GOOD
        if kind[v] == 1:
            before, after = curve_sides(m, g, v)
            if before < 0:
                continue
            c = m.vc[v]
            low, high = arc_at(m, g, before, c, v), arc_at(m, g, after, c, v)
            if low >= high:
                continue
            left, right = 0.5 * (H[before] + oh), 0.5 * (H[after] + oh)
            s = low + (high - low) * left / (left + right)
            step, width = step_to_face(m, v, before, after, ring, n)
            if width < _ACROSS * min(os - low, high - os):
                s = 0.3 * s + 0.7 * min(max(os + step, 0.8 * low + 0.2 * high), 0.2 * low + 0.8 * high)
                good = 0.6 * old  # right angles make longer triangles than even spacing
            place_on_curve(m, g, v, c, os + relax * (s - os))
        else:
            total, x, y, z = 0.0, 0.0, 0.0, 0.0
            for i in range(n):
                a, b, c = T[ring[i], 0], T[ring[i], 1], T[ring[i], 2]
                ux, uy, uz = X[b, 0] - X[a, 0], X[b, 1] - X[a, 1], X[b, 2] - X[a, 2]
                wx, wy, wz = X[c, 0] - X[a, 0], X[c, 1] - X[a, 1], X[c, 2] - X[a, 2]
                area = np.sqrt((uy * wz - uz * wy) ** 2 + (uz * wx - ux * wz) ** 2 + (ux * wy - uy * wx) ** 2)
                weight = area / (H[a] + H[b] + H[c]) ** 2
                total += weight
                x += weight * (X[a, 0] + X[b, 0] + X[c, 0]) / 3.0
                y += weight * (X[a, 1] + X[b, 1] + X[c, 1]) / 3.0
                z += weight * (X[a, 2] + X[b, 2] + X[c, 2]) / 3.0
            if total <= 0.0:
                continue
            dx, dy, dz = relax * (x / total - ox), relax * (y / total - oy), relax * (z / total - oz)
            up = dx * onx + dy * ony + dz * onz
            starts[0] = ot
            x, y, z, at = put_on(
                ox + dx - up * onx, oy + dy - up * ony, oz + dz - up * onz, onx, ony, onz, starts, np.int64(1), g
            )
            place_on_ground(m, g, v, x, y, z, at)
        new = 1.0
        for i in range(n):
            t = ring[i]
            new = min(new, quality(m, g, T[t, 0], T[t, 1], T[t, 2], R[t], np.int64(1)))
        if new < min(old, good):
            X[v, 0], X[v, 1], X[v, 2] = ox, oy, oz
            N[v, 0], N[v, 1], N[v, 2] = onx, ony, onz
            H[v], vt[v], vs[v] = oh, ot, os
        else:
            moved += 1
    return moved
