"""Closest points found by walking over a triangulation from a known triangle, never across a blocked side.

The walk stays on the sheet it starts on, so a point of one skin of a thin wing never lands on the other, and it stays
within the features round its region. It stops at a local minimum of the distance.
"""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

from numba import njit

# for functions that only kernels call: no wrappers for Python, no counting of references to arrays (they allocate
# nothing), no test of every divisor; less to compile, and faster
inner = njit(cache=True, nogil=True, error_model="numpy", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)

_MOST_STEPS = 2000


@inner
def closest_on_triangle(px, py, pz, v, t, k):
    """Closest point of triangle `t[k]`: (x, y, z, place), place 0-2 corner, 3-5 edge, 6 inside (Ericson, 5.1.5)."""
    ax, ay, az = v[t[k, 0], 0], v[t[k, 0], 1], v[t[k, 0], 2]
    bx, by, bz = v[t[k, 1], 0], v[t[k, 1], 1], v[t[k, 1], 2]
    cx, cy, cz = v[t[k, 2], 0], v[t[k, 2], 1], v[t[k, 2], 2]
    ux, uy, uz = bx - ax, by - ay, bz - az
    wx, wy, wz = cx - ax, cy - ay, cz - az
    qx, qy, qz = px - ax, py - ay, pz - az
    d1 = ux * qx + uy * qy + uz * qz
    d2 = wx * qx + wy * qy + wz * qz
    if d1 <= 0.0 and d2 <= 0.0:
        return ax, ay, az, 0
    qx, qy, qz = px - bx, py - by, pz - bz
    d3 = ux * qx + uy * qy + uz * qz
    d4 = wx * qx + wy * qy + wz * qz
    if d3 >= 0.0 and d4 <= d3:
        return bx, by, bz, 1
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0 and d1 - d3 > 0.0:
        s = d1 / (d1 - d3)
        return ax + s * ux, ay + s * uy, az + s * uz, 3
    qx, qy, qz = px - cx, py - cy, pz - cz
    d5 = ux * qx + uy * qy + uz * qz
    d6 = wx * qx + wy * qy + wz * qz
    if d6 >= 0.0 and d5 <= d6:
        return cx, cy, cz, 2
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0 and d2 - d6 > 0.0:
        s = d2 / (d2 - d6)
        return ax + s * wx, ay + s * wy, az + s * wz, 5
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0 and (d4 - d3) + (d5 - d6) > 0.0:
        s = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return bx + s * (cx - bx), by + s * (cy - by), bz + s * (cz - bz), 4
    total = va + vb + vc
    if total <= 0.0:
        return ax, ay, az, 0
    s, r = vb / total, vc / total
    return ax + s * ux + r * wx, ay + s * uy + r * wy, az + s * uz + r * wz, 6


@inner
def walk(px, py, pz, start, v, t, neighbours, blocked):
    """(x, y, z, triangle, squared distance) of the closest point reached from triangle `start`."""
    k = start
    x, y, z, place = closest_on_triangle(px, py, pz, v, t, k)
    best = (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2
    came = -1
    for _ in range(_MOST_STEPS):
        moved = False
        for side in range(3):
            other = neighbours[k, side]
            if other < 0 or other == came or blocked[k, side] >= 0:
                continue
            ox, oy, oz, o_place = closest_on_triangle(px, py, pz, v, t, other)
            d = (px - ox) ** 2 + (py - oy) ** 2 + (pz - oz) ** 2
            if d < best:
                best, x, y, z, place = d, ox, oy, oz, o_place
                came, k = k, other
                moved = True
                break
        if moved:
            continue
        if place > 2:
            break
        # stuck at a corner: look all round it, both ways, up to blocked sides
        corner = t[k, place]
        for way in range(2):
            at = k
            for _ in range(256):
                local = 0
                while t[at, local] != corner:
                    local += 1
                side = local if way == 0 else (local + 2) % 3
                if neighbours[at, side] < 0 or blocked[at, side] >= 0:
                    break
                at = neighbours[at, side]
                if at == k:
                    break
                ox, oy, oz, o_place = closest_on_triangle(px, py, pz, v, t, at)
                d = (px - ox) ** 2 + (py - oy) ** 2 + (pz - oz) ** 2
                if d < best:
                    best, x, y, z, place = d, ox, oy, oz, o_place
                    came, k = -1, at
                    moved = True
                    break
            if moved:
                break
        if not moved:
            break
    return x, y, z, k, best


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True)
def walk_many(points, starts, v, t, neighbours, blocked, out, triangle):
    """`walk` for each point; closest points into `out`, their triangles into `triangle`."""
    for i in range(len(points)):
        x, y, z, k, _ = walk(points[i, 0], points[i, 1], points[i, 2], starts[i], v, t, neighbours, blocked)
        out[i, 0], out[i, 1], out[i, 2] = x, y, z
        triangle[i] = k


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True)
def walk_chain(points, starts, v, t, neighbours, blocked, out, triangle):
    """Rows of points (n, k, 3), each row walked on from the point before; `starts` (n,)."""
    for i in range(points.shape[0]):
        at = starts[i]
        for j in range(points.shape[1]):
            x, y, z, at, _ = walk(points[i, j, 0], points[i, j, 1], points[i, j, 2], at, v, t, neighbours, blocked)
            out[i, j, 0], out[i, j, 1], out[i, j, 2] = x, y, z
            triangle[i, j] = at
