"""Kernel of self-intersection: which pairs of triangles cross."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import filling, inner
from patchwright.models.arrays import Array, BoolArray, IntArray


@inner
def _volume(points: Array, a: int, b: int, c: int, d: int) -> float:
    ax = points[a, 0]
    ay = points[a, 1]
    az = points[a, 2]
    ux = points[b, 0] - ax
    uy = points[b, 1] - ay
    uz = points[b, 2] - az
    vx = points[c, 0] - ax
    vy = points[c, 1] - ay
    vz = points[c, 2] - az
    wx = points[d, 0] - ax
    wy = points[d, 1] - ay
    wz = points[d, 2] - az
    return wx * (uy * vz - uz * vy) + wy * (uz * vx - ux * vz) + wz * (ux * vy - uy * vx)


@inner
def _height(points: Array, p: int, a: int, nx: float, ny: float, nz: float) -> float:
    return (points[p, 0] - points[a, 0]) * nx + (points[p, 1] - points[a, 1]) * ny + (points[p, 2] - points[a, 2]) * nz


@inner
def _pierces(points: Array, p: int, q: int, a: int, b: int, c: int, depth: float) -> bool:
    """Whether the segment p q passes through the inside of a b c, both ends farther than `depth` from its plane.

    A triangle no higher than `depth` has no inside to pass through; the direction of its plane is chance.
    """
    ux = points[b, 0] - points[a, 0]
    uy = points[b, 1] - points[a, 1]
    uz = points[b, 2] - points[a, 2]
    vx = points[c, 0] - points[a, 0]
    vy = points[c, 1] - points[a, 1]
    vz = points[c, 2] - points[a, 2]
    nx = uy * vz - uz * vy
    ny = uz * vx - ux * vz
    nz = ux * vy - uy * vx
    size = np.sqrt(nx * nx + ny * ny + nz * nz)
    wx = vx - ux
    wy = vy - uy
    wz = vz - uz
    longest = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz)
    if size <= depth * np.sqrt(longest):
        return False
    sp = _height(points, p, a, nx, ny, nz) / size
    sq = _height(points, q, a, nx, ny, nz) / size
    if not ((sp > depth and sq < -depth) or (sp < -depth and sq > depth)):
        return False
    x = _volume(points, p, q, a, b)
    y = _volume(points, p, q, b, c)
    z = _volume(points, p, q, c, a)
    ux = points[p, 0] - points[q, 0]
    uy = points[p, 1] - points[q, 1]
    uz = points[p, 2] - points[q, 2]
    tiny = depth * np.sqrt(ux * ux + uy * uy + uz * uz) * np.sqrt(size)
    return (x > tiny and y > tiny and z > tiny) or (x < -tiny and y < -tiny and z < -tiny)


def crossing(pairs: IntArray, points: Array, triangles: IntArray, depth: float) -> BoolArray:
    """(k,) whether an edge of one triangle passes through the inside of the other.

    Triangles that share an edge do not count; of those that share a vertex the opposite edges are tested. Triangles no
    higher than `depth` may pass through others, nothing passes through them.
    """
    found = np.zeros(len(pairs), dtype=np.bool_)
    _crossing(pairs, points, triangles, depth, found)
    return found


@filling
def _crossing(pairs: IntArray, points: Array, triangles: IntArray, depth: float, found: BoolArray) -> None:
    for at in range(len(pairs)):
        shared = 0
        mine = -1
        yours = -1
        s = pairs[at, 0]
        t = pairs[at, 1]
        for i in range(3):
            for j in range(3):
                if triangles[s, i] == triangles[t, j]:
                    shared += 1
                    mine = i
                    yours = j
        if shared > 1:
            continue
        for _ in range(2):  # edges of the first against the second, then the other way
            a = triangles[t, 0]
            b = triangles[t, 1]
            c = triangles[t, 2]
            for k in range(3):
                after = 0 if k == 2 else k + 1
                if not found[at] and (shared == 0 or (k != mine and after != mine)):
                    found[at] = _pierces(points, triangles[s, k], triangles[s, after], a, b, c, depth)
            swap = s
            s = t
            t = swap
            mine = yours


def same_boxes(old: Array, old_triangles: IntArray, new: Array, new_triangles: IntArray, of: IntArray) -> IntArray:
    """`of` (m,), the old triangle each new one is, with -1 where their boxes differ to the last bit."""
    same = of.copy()
    _same_boxes(old, old_triangles, new, new_triangles, same)
    return same


@filling
def _same_boxes(old: Array, old_triangles: IntArray, new: Array, new_triangles: IntArray, same: IntArray) -> None:
    for t in range(len(same)):
        s = same[t]
        if s < 0:
            continue
        for d in range(3):
            x, y, z = old[old_triangles[s, 0], d], old[old_triangles[s, 1], d], old[old_triangles[s, 2], d]
            u, v, w = new[new_triangles[t, 0], d], new[new_triangles[t, 1], d], new[new_triangles[t, 2], d]
            if min(min(x, y), z) != min(min(u, v), w) or max(max(x, y), z) != max(max(u, v), w):
                same[t] = -1
