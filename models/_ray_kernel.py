"""Kernels of `tree`: watertight rays and segments against the tree (layout: `_tree_kernel`)."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

from typing import Any

import numpy as np

from patchwright.models._compile_kernel import filling, inlined, inner, kernel, making
from patchwright.models._exact_kernel import determinant, difference_tail
from patchwright.models._tree_kernel import STACK, Boxes, Index
from patchwright.models.arrays import Array, IntArray

BLOCK = 64  # rays copied at a time: scattered reads overlap
HUGE = 1e37  # stands for 1 / 0: its product with zero is zero, also in single precision
NONE = np.float32(np.inf)
ZERO = np.float32(0.0)
SHRINK = np.float32(1.0 - 5e-7)  # of a box's entry: more than eight single-precision roundings
WIDEN = 1.0 + 1e-6  # of the best distance, likewise
ROUNDING = 3e-15  # of an edge function against the lengths in it: 24 units in the last place


@inner
def radius_of(boxes: Boxes) -> float:
    """The radius about the centre that holds the tree."""
    size = 0.0
    for k in range(12):
        if abs(boxes[0, k]) < NONE:
            size = max(size, abs(boxes[0, k]))
    return np.sqrt(3.0) * size


@inner
def ray_frame(direction: Array) -> tuple[int, int, int, float, float]:
    """Axes permuted so that the longest comes last, and the shear that turns the direction into it (Woop 2013)."""
    kz = 0
    for k in range(1, 3):
        if abs(direction[k]) > abs(direction[kz]):
            kz = k
    kx, ky = (kz + 1) % 3, (kz + 2) % 3
    return kx, ky, kz, direction[kx] / direction[kz], direction[ky] / direction[kz]


@making
def exact(corners: Array, i: int, what: int, points: Array, r: int, frame: Array) -> float:
    """An edge function of row i against ray r (`what` 0, 1, 2: opposite that corner) or the side r lies on (`what` 3).

    A number with the sign of exact arithmetic. The direction is `frame[0]` plus its rounding `frame[1]`.
    """
    rows = np.empty((3, 3))
    tails = np.empty((3, 3))
    largest = 0.0
    for j in range(rows.shape[0]):
        corner = j if what == 3 else (what + 2 - j) % 3
        for k in range(3):
            if j == 2 and what < 3:
                rows[j, k], tails[j, k] = frame[0, k], frame[1, k]
                if abs(frame[0, k]) > abs(largest):
                    largest = frame[0, k]
            else:
                rows[j, k] = corners[i, 3 * corner + k] - points[r, k]
                tails[j, k] = difference_tail(corners[i, 3 * corner + k], points[r, k], rows[j, k])
    return determinant(rows, tails) / (largest if what < 3 else 1.0)


@making
def settle(
    corners: Array, i: int, origins: Array, r: int, frame: Array, u: float, v: float, w: float, error: float
) -> tuple[float, float, float, float]:
    """`ray_triangle` in exact arithmetic: edge functions within their rounding `error` of zero, and the depth."""
    value = np.empty(4)
    value[0], value[1], value[2], value[3] = u, v, w, 0.0
    for what in range(value.shape[0]):
        if abs(value[what]) <= error:
            value[what] = exact(corners, i, what, origins, r, frame)
    u, v, w = value[0], value[1], value[2]
    total = u + v + w
    if total == 0.0 or (min(min(u, v), w) < 0.0 and max(max(u, v), w) > 0.0):
        return np.nan, 0.0, 0.0, 0.0
    return -value[3] / total, u / total, v / total, w / total


@inlined
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
        return settle(corners, i, origins, r, frame, u, v, w, error)
    total = u + v + w
    depth = (u * az + v * bz + w * cz) / total
    if abs(depth) <= ROUNDING * far:
        return settle(corners, i, origins, r, frame, u, v, w, error)
    return depth, u / total, v / total, w / total


@inner
def inverse(x: float) -> np.float32:
    """1 / x in single precision, finite."""
    return np.float32(1.0 / x if abs(x) * HUGE > 1.0 else HUGE)


@inner
def approach(px: float, py: float, pz: float, dx: float, dy: float, dz: float, radius: float) -> float:
    """How far to go along a ray that starts far off before single precision will do; inf if it misses `radius`."""
    square = px * px + py * py + pz * pz
    if square <= 16.0 * radius * radius:
        return 0.0
    ahead = (np.sqrt(square) - 2.0 * radius) / np.sqrt(dx * dx + dy * dy + dz * dz)
    x, y, z = px + ahead * dx, py + ahead * dy, pz + ahead * dz
    return ahead if x * x + y * y + z * z <= 16.1 * radius * radius else np.inf


@inlined
def entry(
    boxes: Boxes,
    node: int,
    at: int,
    px: np.float32,
    py: np.float32,
    pz: np.float32,
    ix: np.float32,
    iy: np.float32,
    iz: np.float32,
    best: np.float32,
) -> np.float32:
    """Where a ray enters a box, from below, in single precision; inf if it misses it or comes later than `best`."""
    x0, x1 = (boxes[node, at] - px) * ix, (boxes[node, at + 3] - px) * ix
    y0, y1 = (boxes[node, at + 1] - py) * iy, (boxes[node, at + 4] - py) * iy
    z0, z1 = (boxes[node, at + 2] - pz) * iz, (boxes[node, at + 5] - pz) * iz
    near = max(max(min(x0, x1), min(y0, y1)), max(min(z0, z1), ZERO)) * SHRINK
    far = min(min(max(x0, x1), max(y0, y1)), min(max(z0, z1), best))
    return near if near <= far else NONE


def first_hits(*arguments: Any) -> None:
    """`_first_hits` with room of its own, so that threads may call it side by side."""
    _first_hits(
        *arguments, np.zeros((2, 3)), np.empty(STACK, np.int32), np.empty(STACK, np.float32), np.empty((BLOCK, 3)),
        np.empty((BLOCK, 3)),
    )  # fmt: skip


@filling
def _first_hits(
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
    frame: Array,
    stack: Index,
    enter: Boxes,
    starts: Array,
    ways: Array,
) -> None:
    """Nearest hit of the rays `order`; `reach` and `distance` are lengths, whatever the length of the directions.

    Within, ways are measured along the direction's longest axis.
    """
    radius = radius_of(boxes)
    for n in range(order.shape[0]):
        row = n & (BLOCK - 1)
        if row == 0:
            for j in range(min(BLOCK, order.shape[0] - n)):
                for k in range(3):
                    starts[j, k], ways[j, k] = origins[order[n + j], k], directions[order[n + j], k]
        r = order[n]
        for k in range(3):
            frame[0, k] = ways[row, k]
        kx, ky, kz, sx, sy = ray_frame(frame[0])
        kx, ky, kz = kx & 3, ky & 3, kz & 3  # tells the compiler that they are not negative
        length = np.sqrt(sx * sx + sy * sy + 1.0)
        longest = abs(frame[0, kz])
        sign = 1.0 if frame[0, kz] > 0.0 else -1.0
        best = reach[r % reach.shape[0]] / length
        found = np.int64(-1)
        wa, wb, wc = 0.0, 0.0, 0.0
        dx, dy, dz = frame[0, 0] / longest, frame[0, 1] / longest, frame[0, 2] / longest
        x, y, z = starts[row, 0] - center[0], starts[row, 1] - center[1], starts[row, 2] - center[2]
        ahead = approach(x, y, z, dx, dy, dz, radius)
        top = 0
        if ahead < np.inf:
            x, y, z = x + ahead * dx, y + ahead * dy, z + ahead * dz
            stack[0] = 0
            enter[0] = ZERO
            top = 1
        px, py, pz = np.float32(x), np.float32(y), np.float32(z)
        ix, iy, iz = inverse(dx), inverse(dy), inverse(dz)
        limit = np.float32((best - ahead) * WIDEN + 1e-15 * ahead)
        while top:
            top -= 1
            if enter[top] > limit:
                continue
            node = stack[top]
            while node >= 0:
                left = entry(boxes, node, np.int64(0), px, py, pz, ix, iy, iz, limit)
                right = entry(boxes, node, np.int64(6), px, py, pz, ix, iy, iz, limit)
                if min(left, right) == NONE:
                    break
                if left <= right:
                    stack[top] = child[node, 1]
                    enter[top] = right
                    node = child[node, 0]
                else:
                    stack[top] = child[node, 0]
                    enter[top] = left
                    node = child[node, 1]
                top += max(left, right) < NONE
            if node < 0:
                code = -(np.int64(node) + 1) & 0x7FFFFFFF
                for i in range(code >> 3, (code >> 3) + (code & 7)):
                    t, u, v, w = ray_triangle(corners, i, starts, row, frame, kx, ky, kz, sx, sy)
                    t *= sign
                    if t >= 0.0 and (t < best or (t == best and (found < 0 or index[i] < found))):
                        best, found, wa, wb, wc = t, np.int64(index[i]), u, v, w
                        limit = np.float32((best - ahead) * WIDEN + 1e-15 * ahead)
        triangle[r] = found
        distance[r] = best * length if found >= 0 else np.inf
        barycentric[r, 0], barycentric[r, 1], barycentric[r, 2] = wa, wb, wc


@kernel
def all_hits(
    boxes: Boxes, child: Index, corners: Array, index: Index, center: Array, start: Array, end: Array
) -> tuple[IntArray, Array]:
    """Every crossing of each segment, by (t, triangle): counts (n,) and rows t, triangle, three barycentric."""
    n = start.shape[0]
    count = np.zeros(n, np.int64)
    hits = np.empty((max(16, 2 * n), 5))
    stack = np.empty(STACK, np.int32)
    frame = np.zeros((2, 3))
    radius = radius_of(boxes)
    filled = 0
    for r in range(n):
        for k in range(3):
            frame[0, k] = end[r, k] - start[r, k]
            frame[1, k] = difference_tail(end[r, k], start[r, k], frame[0, k])
        kx, ky, kz, sx, sy = ray_frame(frame[0])
        longest = abs(frame[0, kz])
        if longest == 0.0:
            continue
        dx, dy, dz = frame[0, 0] / longest, frame[0, 1] / longest, frame[0, 2] / longest
        x, y, z = start[r, 0] - center[0], start[r, 1] - center[1], start[r, 2] - center[2]
        ahead = approach(x, y, z, dx, dy, dz, radius)
        if ahead == np.inf:
            continue
        px, py, pz = np.float32(x + ahead * dx), np.float32(y + ahead * dy), np.float32(z + ahead * dz)
        ix, iy, iz = inverse(dx), inverse(dy), inverse(dz)
        limit = np.float32((longest - ahead) * WIDEN + 1e-15 * ahead)
        stack[0] = 0
        top = 1
        while top:
            top -= 1
            node = stack[top]
            if node >= 0:
                for half in range(2):
                    if entry(boxes, node, 6 * half, px, py, pz, ix, iy, iz, limit) < NONE:
                        stack[top] = child[node, half]
                        top += 1
                continue
            code = -(np.int64(node) + 1)
            for i in range(code >> 3, (code >> 3) + (code & 7)):
                t, u, v, w = ray_triangle(corners, i, start, r, frame, kx, ky, kz, sx, sy)
                t /= frame[0, kz]
                if 1.0 < t < 1.0 + ROUNDING and exact(corners, i, np.int64(3), end, r, frame) == 0.0:
                    t = 1.0
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
