"""Kernels of `tree`: watertight rays and segments against the tree (layout: `_tree_kernel`)."""

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.models._exact_kernel import determinant, difference_tail
from patchwright.models._tree_kernel import STACK, Boxes, Index
from patchwright.models.arrays import Array, IntArray

HUGE = 1e300  # stands for 1 / 0: its product with zero is zero
SLACK = 4e-15  # on the parameters of box planes: more than their rounding
ROUNDING = 3e-15  # of an edge function against the lengths in it: 24 units in the last place


@njit(cache=True, nogil=True)
def ray_frame(direction: Array) -> tuple[int, int, int, float, float, float]:
    """Axes permuted so that the longest comes last, and the shear that turns the direction into it (Woop 2013)."""
    kz = 0
    for k in range(1, 3):
        if abs(direction[k]) > abs(direction[kz]):
            kz = k
    kx, ky = (kz + 1) % 3, (kz + 2) % 3
    return kx, ky, kz, direction[kx] / direction[kz], direction[ky] / direction[kz], 1.0 / direction[kz]


@njit(cache=True, nogil=True)
def exact_edge(corners: Array, i: int, p: int, q: int, origins: Array, r: int, frame: Array) -> float:
    """The edge function of corners p and q of row i against ray r, with the sign it has in exact arithmetic."""
    rows = np.empty((3, 3))
    tails = np.empty((3, 3))
    largest = 0.0
    for k in range(3):
        rows[0, k] = corners[i, 3 * p + k] - origins[r, k]
        tails[0, k] = difference_tail(corners[i, 3 * p + k], origins[r, k], rows[0, k])
        rows[1, k] = corners[i, 3 * q + k] - origins[r, k]
        tails[1, k] = difference_tail(corners[i, 3 * q + k], origins[r, k], rows[1, k])
        rows[2, k], tails[2, k] = frame[0, k], frame[1, k]
        if abs(frame[0, k]) > abs(largest):
            largest = frame[0, k]
    return determinant(rows, tails) / largest


@njit(cache=True, nogil=True)
def ray_triangle(
    corners: Array, i: int, origins: Array, r: int, frame: Array, kx: int, ky: int, kz: int, sx: float, sy: float
) -> tuple[float, float, float, float]:
    """Depth along axis kz and barycentric coordinates where ray r's line meets row i of `corners`; NaN if nowhere.

    The edge functions of the sheared corners decide; those too small for their rounding are evaluated exactly from
    the origin and the direction, `frame[0]` plus its rounding `frame[1]`. No line slips through between triangles.
    """
    ox, oy, oz = origins[r, kx], origins[r, ky], origins[r, kz]
    az, bz, cz = corners[i, kz] - oz, corners[i, 3 + kz] - oz, corners[i, 6 + kz] - oz
    ax, ay = (corners[i, kx] - ox) - sx * az, (corners[i, ky] - oy) - sy * az
    bx, by = (corners[i, 3 + kx] - ox) - sx * bz, (corners[i, 3 + ky] - oy) - sy * bz
    cx, cy = (corners[i, 6 + kx] - ox) - sx * cz, (corners[i, 6 + ky] - oy) - sy * cz
    u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    wide = max(max(max(abs(ax), abs(ay)), max(abs(bx), abs(by))), max(abs(cx), abs(cy)))
    far = wide + max(max(abs(az), abs(bz)), abs(cz))
    error = (ROUNDING * wide + ROUNDING * ROUNDING * far) * far
    if min(min(u, v), w) < -error and max(max(u, v), w) > error:
        return np.nan, 0.0, 0.0, 0.0
    if min(min(abs(u), abs(v)), abs(w)) <= error:
        u = u if abs(u) > error else exact_edge(corners, i, 2, 1, origins, r, frame)
        v = v if abs(v) > error else exact_edge(corners, i, 0, 2, origins, r, frame)
        w = w if abs(w) > error else exact_edge(corners, i, 1, 0, origins, r, frame)
        if min(min(u, v), w) < 0.0 and max(max(u, v), w) > 0.0:
            return np.nan, 0.0, 0.0, 0.0
    total = u + v + w
    if total == 0.0:
        return np.nan, 0.0, 0.0, 0.0
    u, v, w = u / total, v / total, w / total
    return u * az + v * bz + w * cz, u, v, w


@njit(cache=True, nogil=True)
def inverse(x: float) -> float:
    """1 / x, finite."""
    return 1.0 / x if abs(x) > 1.0 / HUGE else HUGE


@njit(cache=True, nogil=True)
def entry(
    boxes: Boxes, node: int, at: int, px: float, py: float, pz: float, ix: float, iy: float, iz: float, best: float
) -> float:
    """Parameter at which a ray enters a box, from below; inf if it misses it or comes later than `best`."""
    x0, x1 = (boxes[node, at] - px) * ix, (boxes[node, at + 3] - px) * ix
    y0, y1 = (boxes[node, at + 1] - py) * iy, (boxes[node, at + 4] - py) * iy
    z0, z1 = (boxes[node, at + 2] - pz) * iz, (boxes[node, at + 5] - pz) * iz
    near = max(max(min(x0, x1), min(y0, y1)), max(min(z0, z1), 0.0)) * (1.0 - SLACK)
    far = min(min(max(x0, x1), max(y0, y1)), min(max(z0, z1), best))
    return near if near <= far else np.inf


@njit(cache=True, nogil=True)
def first_hits(
    boxes: Boxes,
    child: Index,
    corners: Array,
    index: Index,
    center: Array,
    origins: Array,
    directions: Array,
    reach: Array,
    order: IntArray,
    distance: Array,
    triangle: IntArray,
    barycentric: Array,
) -> None:
    """Nearest hit of the rays `order`; `reach` and `distance` are lengths, whatever the length of the directions."""
    frame = np.zeros((2, 3))
    direction = frame[0]
    stack = np.empty(STACK, np.int32)
    enter = np.empty(STACK)
    for r in order:
        dx, dy, dz = directions[r, 0], directions[r, 1], directions[r, 2]
        longest = max(max(abs(dx), abs(dy)), abs(dz))
        if not 1e-100 < longest < 1e100:
            dx, dy, dz = dx / longest, dy / longest, dz / longest
        direction[0], direction[1], direction[2] = dx, dy, dz
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        kx, ky, kz, sx, sy, sz = ray_frame(direction)
        px, py, pz = origins[r, 0] - center[0], origins[r, 1] - center[1], origins[r, 2] - center[2]
        ix, iy, iz = inverse(direction[0]), inverse(direction[1]), inverse(direction[2])
        best = reach[r % reach.shape[0]] / length
        found = -1
        wa, wb, wc = 0.0, 0.0, 0.0
        stack[0] = 0
        enter[0] = 0.0
        top = 1
        while top:
            top -= 1
            if enter[top] > best:
                continue
            node = stack[top]
            while node >= 0:
                left = entry(boxes, node, 0, px, py, pz, ix, iy, iz, best)
                right = entry(boxes, node, 6, px, py, pz, ix, iy, iz, best)
                if min(left, right) == np.inf:
                    break
                if left <= right:
                    stack[top] = child[node, 1]
                    enter[top] = right
                    node = child[node, 0]
                else:
                    stack[top] = child[node, 0]
                    enter[top] = left
                    node = child[node, 1]
                top += max(left, right) < np.inf
            if node < 0:
                code = -(np.int64(node) + 1)
                for i in range(code >> 3, (code >> 3) + (code & 7)):
                    t, u, v, w = ray_triangle(corners, i, origins, r, frame, kx, ky, kz, sx, sy)
                    t *= sz
                    if t >= 0.0 and (t < best or (t == best and (found < 0 or index[i] < found))):
                        best, found, wa, wb, wc = t, np.int64(index[i]), u, v, w
        triangle[r] = found
        distance[r] = best * length if found >= 0 else np.inf
        barycentric[r, 0], barycentric[r, 1], barycentric[r, 2] = wa, wb, wc


@njit(cache=True, nogil=True)
def all_hits(
    boxes: Boxes, child: Index, corners: Array, index: Index, center: Array, start: Array, end: Array
) -> tuple[IntArray, Array]:
    """Every crossing of each segment, by (t, triangle): counts (n,) and rows t, triangle, three barycentric."""
    n = start.shape[0]
    count = np.zeros(n, np.int64)
    hits = np.empty((max(16, 2 * n), 5))
    stack = np.empty(STACK, np.int32)
    frame = np.zeros((2, 3))
    direction = frame[0]
    filled = 0
    for r in range(n):
        length = 0.0
        for k in range(3):
            direction[k] = end[r, k] - start[r, k]
            frame[1, k] = difference_tail(end[r, k], start[r, k], direction[k])
            length = max(length, abs(direction[k]))
        if length == 0.0:
            continue
        kx, ky, kz, sx, sy, sz = ray_frame(direction)
        px, py, pz = start[r, 0] - center[0], start[r, 1] - center[1], start[r, 2] - center[2]
        ix, iy, iz = inverse(direction[0]), inverse(direction[1]), inverse(direction[2])
        stack[0] = 0
        top = 1
        while top:
            top -= 1
            node = stack[top]
            if node >= 0:
                for half in range(2):
                    if entry(boxes, node, 6 * half, px, py, pz, ix, iy, iz, 1.0) < np.inf:
                        stack[top] = child[node, half]
                        top += 1
                continue
            code = -(np.int64(node) + 1)
            for i in range(code >> 3, (code >> 3) + (code & 7)):
                t, u, v, w = ray_triangle(corners, i, start, r, frame, kx, ky, kz, sx, sy)
                t *= sz
                if not 0.0 <= t <= 1.0:
                    continue
                if filled == hits.shape[0]:
                    more = np.empty((2 * filled, 5))
                    for j in range(filled):
                        for k in range(5):
                            more[j, k] = hits[j, k]
                    hits = more
                j = filled
                while j > filled - count[r] and (
                    t < hits[j - 1, 0] or (t == hits[j - 1, 0] and index[i] < hits[j - 1, 1])
                ):
                    for k in range(5):
                        hits[j, k] = hits[j - 1, k]
                    j -= 1
                hits[j, 0], hits[j, 1], hits[j, 2], hits[j, 3], hits[j, 4] = t, index[i], u, v, w
                filled += 1
                count[r] += 1
    return count, hits[:filled]
