"""Kernels of bridging: the cheapest triangulation of one loop and the cheapest strip between two."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from patchwright.models._compile_kernel import kernel, making
from patchwright.models.arrays import Array, BoolArray, IntArray

Bytes = npt.NDArray[np.uint8]

SPREAD = 0.05  # weight of the squared length of inner edges: between equal areas the compact triangles win


@making
def _normal(p: Array, q: Array, r: Array, out: Array) -> float:
    """Unit normal of a triangle into `out`, returns its area."""
    ax, ay, az = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    bx, by, bz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    nx = ay * bz - az * by
    ny = az * bx - ax * bz
    nz = ax * by - ay * bx
    size = np.sqrt(nx * nx + ny * ny + nz * nz)
    scale = size if size > 0.0 else 1.0
    out[0] = nx / scale
    out[1] = ny / scale
    out[2] = nz / scale
    return 0.5 * size


@making
def _square(p: Array, q: Array) -> float:
    return (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2


@making
def _turn(n: Array, k: Array) -> float:
    """1 - cos of the angle between two normals; 0 where one of them is missing."""
    if (n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0) or (k[0] == 0.0 and k[1] == 0.0 and k[2] == 0.0):
        return 0.0
    return 1.0 - (n[0] * k[0] + n[1] * k[1] + n[2] * k[2])


def fill_loop(points: Array, normals: Array, forbidden: BoolArray) -> IntArray:
    """Triangulate a loop at least cost by dynamic programming over its sub-loops; empty when there is no way.

    `points` (n, 3) run along the rim as its triangles do, `normals` (n, 3) belong to the triangle at edge i -> i + 1,
    `forbidden` (n, n) chords that the surface already uses. The cost is the area plus, for every edge, its squared
    length times the turn of the normals across it. Returns (n - 2, 3) indices, running against the rim.
    """
    n = len(points)
    cost, split = np.full((n, n), np.inf), np.full((n, n), -1, dtype=np.int64)
    facing = np.zeros((n, n, 3))
    at = np.arange(n - 1)
    cost[at, at + 1] = 0.0
    facing[at, at + 1] = normals[:-1]
    triangles = np.empty((n - 2, 3), dtype=np.int64)
    _fill_loop(
        points, normals, forbidden, cost, split, facing, np.zeros(3), np.empty((n, 2), dtype=np.int64), triangles
    )
    return triangles if np.isfinite(cost[0, n - 1]) else np.empty((0, 3), dtype=np.int64)


@kernel
def _fill_loop(
    points: Array,
    normals: Array,
    forbidden: BoolArray,
    cost: Array,
    split: IntArray,
    facing: Array,
    mine: Array,
    stack: IntArray,
    triangles: IntArray,
) -> None:
    n = len(points)
    for span in range(2, n):
        for i in range(n - span):
            j = i + span
            if forbidden[i, j] and span < n - 1:
                continue
            best = np.inf
            chord = _square(points[i], points[j])
            for k in range(i + 1, j):
                below = cost[i, k] + cost[k, j]
                if below >= best:
                    continue
                total = below + _normal(points[i], points[j], points[k], mine)
                total += 0.5 * _square(points[i], points[k]) * _turn(mine, facing[i, k])
                total += 0.5 * _square(points[k], points[j]) * _turn(mine, facing[k, j])
                if span == n - 1:
                    total += 0.5 * chord * _turn(mine, normals[n - 1])
                else:
                    total += SPREAD * chord
                if total < best:
                    best = total
                    split[i, j] = k
            cost[i, j] = best
            if split[i, j] >= 0:
                _normal(points[i], points[j], points[split[i, j]], facing[i, j])
    if not cost[0, n - 1] < np.inf:
        return
    stack[0, 0] = 0
    stack[0, 1] = n - 1
    top = 1
    count = 0
    while top:
        top -= 1
        i = stack[top, 0]
        j = stack[top, 1]
        if j - i < 2:
            continue
        k = split[i, j]
        triangles[count, 0] = i
        triangles[count, 1] = j
        triangles[count, 2] = k
        count += 1
        stack[top, 1] = k
        stack[top + 1, 0] = k
        stack[top + 1, 1] = j
        top += 2


def narrowest(points: Array, forbidden: BoolArray) -> tuple[int, int]:
    """The chord (i, j) of a loop that is shortest for the length of rim it cuts off; (-1, -1) when there is none."""
    x, y, z = (np.roll(points, -1, axis=0) - points).T
    along = np.concatenate([[0.0], np.cumsum(np.sqrt(x**2 + y**2 + z**2))])
    found: tuple[int, int] = _narrowest(points, along, forbidden)
    return found


@kernel
def _narrowest(points: Array, along: Array, forbidden: BoolArray) -> tuple[int, int]:
    n = len(points)
    best = np.inf
    bi = -1
    bj = -1
    for i in range(n):
        for j in range(i + n // 8 + 2, n):
            if n - (j - i) < n // 8 + 2 or forbidden[i, j]:
                continue
            arc = along[j] - along[i]
            arc = min(arc, along[n] - arc)
            if arc <= 0.0:
                continue
            score = np.sqrt(_square(points[i], points[j])) / arc
            if score < best:
                best = score
                bi = i
                bj = j
    return bi, bj


def strip(p: Array, q: Array, p_normals: Array, q_normals: Array) -> tuple[float, IntArray]:
    """The cheapest strip between an open polyline `p` (n + 1, 3) and `q` (m + 1, 3), both running the same way.

    `p_normals` (n, 3), `q_normals` (m, 3) belong to the triangles at their edges. Returns the cost and the moves
    (n + m,): 0 advances on p, 1 on q.
    """
    n, m = len(p) - 1, len(q) - 1
    row, moves = np.full(m + 1, np.inf), np.empty(n + m, dtype=np.int64)
    _strip(p, q, p_normals, q_normals, np.zeros((n + 1, m + 1), dtype=np.uint8), row, np.zeros(3), moves)
    return float(row[m]), moves


@kernel
def _strip(
    p: Array, q: Array, p_normals: Array, q_normals: Array, came: Bytes, row: Array, mine: Array, moves: IntArray
) -> None:
    n = len(p) - 1
    m = len(q) - 1
    for i in range(n + 1):
        left = np.inf
        for j in range(m + 1):
            best = np.inf
            if i == 0 and j == 0:
                best = 0.0
            if i > 0 and row[j] < np.inf:
                area = _normal(p[i], p[i - 1], q[j], mine)
                best = row[j] + area * (1.0 + 2.0 * _turn(mine, p_normals[i - 1]))
                came[i, j] = 0
            if j > 0:
                area = _normal(q[j - 1], q[j], p[i], mine)
                other = left + area * (1.0 + 2.0 * _turn(mine, q_normals[j - 1]))
                if other < best:
                    best = other
                    came[i, j] = 1
            best += SPREAD * _square(p[i], q[j])
            row[j] = best
            left = best
    i = n
    j = m
    for at in range(n + m - 1, -1, -1):
        moves[at] = came[i, j]
        if came[i, j] == 0:
            i -= 1
        else:
            j -= 1
