"""Kernel of self-intersection: which pairs of triangles cross."""

from __future__ import annotations

import numpy as np
from numba import njit
from patchwright.models.arrays import Array, BoolArray, IntArray


@njit(cache=True)
def _volume(a: Array, b: Array, c: Array, d: Array) -> float:
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    return wx * (uy * vz - uz * vy) + wy * (uz * vx - ux * vz) + wz * (ux * vy - uy * vx)


@njit(cache=True)
def _pierces(p: Array, q: Array, a: Array, b: Array, c: Array, depth: float) -> bool:
    """Whether the segment p q passes through the inside of a b c, both ends farther than `depth` from its plane."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = np.sqrt(nx * nx + ny * ny + nz * nz)
    if size == 0.0:
        return False
    sp = ((p[0] - a[0]) * nx + (p[1] - a[1]) * ny + (p[2] - a[2]) * nz) / size
    sq = ((q[0] - a[0]) * nx + (q[1] - a[1]) * ny + (q[2] - a[2]) * nz) / size
    if not ((sp > depth and sq < -depth) or (sp < -depth and sq > depth)):
        return False
    x, y, z = _volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)
    tiny = depth * np.sqrt((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2) * np.sqrt(size)
    return (x > tiny and y > tiny and z > tiny) or (x < -tiny and y < -tiny and z < -tiny)


@njit(cache=True)
def crossing(pairs: IntArray, points: Array, triangles: IntArray, depth: float) -> BoolArray:
    """(k,) whether an edge of one triangle passes through the inside of the other.

    Triangles that share an edge do not count; of those that share a vertex the opposite edges are tested.
    """
    found = np.zeros(len(pairs), dtype=np.bool_)
    for at in range(len(pairs)):
        shared = 0
        mine = -1
        yours = -1
        s, t = triangles[pairs[at, 0]], triangles[pairs[at, 1]]
        for i in range(3):
            for j in range(3):
                if s[i] == t[j]:
                    shared += 1
                    mine = i
                    yours = j
        if shared > 1:
            continue
        for k in range(3):
            if shared == 0 or k == (mine + 1) % 3:
                found[at] |= _pierces(
                    points[s[k]], points[s[(k + 1) % 3]], points[t[0]], points[t[1]], points[t[2]], depth
                )
            if shared == 0 or k == (yours + 1) % 3:
                found[at] |= _pierces(
                    points[t[k]], points[t[(k + 1) % 3]], points[s[0]], points[s[1]], points[s[2]], depth
                )
    return found
