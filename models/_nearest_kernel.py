"""Kernels of `tree`: closest points of triangles, best first by the boxes of the tree (layout: `_tree_kernel`)."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

from typing import Any

import numpy as np

from patchwright.models._compile_kernel import filling, inner
from patchwright.models._tree_kernel import STACK, Boxes, Index
from patchwright.models.arrays import Array, IntArray

SLACK = 1.0 - 4e-15  # on squared distances to boxes: more than their rounding
NEEDLE = 1e-6  # squared sine below which a triangle's own sides are asked too


@inner
def on_segment(
    px: float, py: float, pz: float, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> float:
    """Parameter in [0, 1] of the point of the segment a b closest to p; 0 where the segment is a point."""
    ex, ey, ez = bx - ax, by - ay, bz - az
    length = ex * ex + ey * ey + ez * ez
    if length == 0.0:
        return 0.0
    return min(max(((px - ax) * ex + (py - ay) * ey + (pz - az) * ez) / length, 0.0), 1.0)


@inner
def closest_on_triangle(corners: Array, i: int, px: float, py: float, pz: float) -> tuple[float, float, float, float]:
    """Squared distance and barycentric coordinates of the closest point; degenerate ones are segments."""
    ax, ay, az = corners[i, 0], corners[i, 1], corners[i, 2]
    bx, by, bz = corners[i, 3], corners[i, 4], corners[i, 5]
    cx, cy, cz = corners[i, 6], corners[i, 7], corners[i, 8]
    abx, aby, abz = bx - ax, by - ay, bz - az
    acx, acy, acz = cx - ax, cy - ay, cz - az
    qx, qy, qz = px - ax, py - ay, pz - az
    d1 = abx * qx + aby * qy + abz * qz
    d2 = acx * qx + acy * qy + acz * qz
    nx, ny, nz = aby * acz - abz * acy, abz * acx - abx * acz, abx * acy - aby * acx
    area = nx * nx + ny * ny + nz * nz
    bb = abx * abx + aby * aby + abz * abz
    cc = acx * acx + acy * acy + acz * acz
    bc = abx * acx + aby * acy + abz * acz
    longest = max(bb, cc)
    v = (cc * d1 - bc * d2) / area if area > 0.0 else -1.0
    w = (bb * d2 - bc * d1) / area if area > 0.0 else -1.0
    best = np.inf
    inside = v >= 0.0 and w >= 0.0 and v + w <= 1.0
    if inside:
        dx = qx - (v * abx + w * acx)
        dy = qy - (v * aby + w * acy)
        dz = qz - (v * abz + w * acz)
        best = dx * dx + dy * dy + dz * dz
        if area > NEEDLE * longest * longest:
            return best, 1.0 - v - w, v, w
    # outside, or a needle whose v and w are not to be trusted: its sides compete
    wa, wb, wc = 1.0 - v - w, v, w
    needle = not area > NEEDLE * longest * longest
    if needle or w <= 0.0 or v + w >= 1.0 or v <= 0.0:
        s = on_segment(px, py, pz, ax, ay, az, bx, by, bz)
        dx, dy, dz = qx - s * abx, qy - s * aby, qz - s * abz
        if s == 1.0:
            dx, dy, dz = px - bx, py - by, pz - bz
        d = dx * dx + dy * dy + dz * dz
        if d < best:
            best, wa, wb, wc = d, 1.0 - s, s, 0.0
        s = on_segment(px, py, pz, bx, by, bz, cx, cy, cz)
        dx, dy, dz = px - (bx + s * (cx - bx)), py - (by + s * (cy - by)), pz - (bz + s * (cz - bz))
        if s == 1.0:
            dx, dy, dz = px - cx, py - cy, pz - cz
        d = dx * dx + dy * dy + dz * dz
        if d < best:
            best, wa, wb, wc = d, 0.0, 1.0 - s, s
        s = on_segment(px, py, pz, cx, cy, cz, ax, ay, az)
        dx, dy, dz = px - (cx - s * acx), py - (cy - s * acy), pz - (cz - s * acz)
        if s == 1.0:
            dx, dy, dz = qx, qy, qz
        d = dx * dx + dy * dy + dz * dz
        if d < best:
            best, wa, wb, wc = d, s, 0.0, 1.0 - s
    return best, wa, wb, wc


def closest_points(*arguments: Any) -> None:
    """`_closest_points` with room of its own, so that threads may call it side by side."""
    _closest_points(*arguments, np.empty(STACK, np.int32), np.empty(STACK))


@filling
def _closest_points(
    boxes: Boxes,
    child: Index,
    corners: Array,
    index: Index,
    center: Array,
    points: Array,
    order: IntArray,
    place: Array,
    distance: Array,
    triangle: IntArray,
    barycentric: Array,
    stack: Index,
    bound: Array,
) -> None:
    """Closest points of the points `order`; the winner of one is the first candidate of the next."""
    row = np.int64(0)
    for n in range(order.shape[0]):
        r = order[n]
        px, py, pz = points[r, 0], points[r, 1], points[r, 2]
        qx, qy, qz = px - center[0], py - center[1], pz - center[2]
        best, wa, wb, wc = closest_on_triangle(corners, row, px, py, pz)
        found = index[row]
        stack[0] = 0
        bound[0] = 0.0
        top = 1
        while top:
            top -= 1
            if bound[top] > best:
                continue
            node = stack[top]
            while node >= 0:
                x0 = max(max(boxes[node, 0] - qx, qx - boxes[node, 3]), 0.0)
                y0 = max(max(boxes[node, 1] - qy, qy - boxes[node, 4]), 0.0)
                z0 = max(max(boxes[node, 2] - qz, qz - boxes[node, 5]), 0.0)
                x1 = max(max(boxes[node, 6] - qx, qx - boxes[node, 9]), 0.0)
                y1 = max(max(boxes[node, 7] - qy, qy - boxes[node, 10]), 0.0)
                z1 = max(max(boxes[node, 8] - qz, qz - boxes[node, 11]), 0.0)
                near0 = (x0 * x0 + y0 * y0 + z0 * z0) * SLACK
                near1 = (x1 * x1 + y1 * y1 + z1 * z1) * SLACK
                if near0 <= near1:
                    if near0 > best:
                        break
                    if near1 <= best:
                        stack[top] = child[node, 1]
                        bound[top] = near1
                        top += 1
                    node = child[node, 0]
                else:
                    if near1 > best:
                        break
                    if near0 <= best:
                        stack[top] = child[node, 0]
                        bound[top] = near0
                        top += 1
                    node = child[node, 1]
            if node < 0:
                code = -(np.int64(node) + 1)
                for i in range(code >> 3, (code >> 3) + (code & 7)):
                    d, u, v, w = closest_on_triangle(corners, i, px, py, pz)
                    if d < best or (d == best and index[i] < found):
                        best, found, wa, wb, wc, row = d, index[i], u, v, w, np.int64(i)
        triangle[r] = found
        distance[r] = np.sqrt(best)
        barycentric[r, 0], barycentric[r, 1], barycentric[r, 2] = wa, wb, wc
        for k in range(3):
            place[r, k] = wa * corners[row, k] + wb * corners[row, 3 + k] + wc * corners[row, 6 + k]
