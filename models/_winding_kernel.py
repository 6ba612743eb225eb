"""Kernels of `winding`: moments of the tree's nodes and the sum of solid angles, far nodes by their moments."""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import inner, kernel
from patchwright.models._tree_kernel import STACK, Boxes, Index
from patchwright.models.arrays import Array, IntArray

# columns of a child's moments: area vector, middle, radius, area, first moments (area vector's component major)
NORMAL, MIDDLE, RADIUS, AREA, FIRST, WIDTH = 0, 3, 6, 7, 8, 17


@kernel
def moments(boxes: Boxes, child: Index, corners: Array, center: Array) -> Array:
    """(2 n, 17) moments of each node's two children, in the frame about `center`."""
    n = child.shape[0]
    m = np.zeros((2 * n, WIDTH))
    normal = np.empty(3)
    middle = np.empty(3)
    for slot in range(2 * n - 1, -1, -1):  # children come after their parents
        node, half = slot >> 1, slot & 1
        c = np.int64(child[node, half])
        first, last = (2 * c, 2 * c + 2) if c >= 0 else (-(c + 1) >> 3, (-(c + 1) >> 3) + (-(c + 1) & 7))
        for sweep in range(2):  # the middle, then the moments about it
            for i in range(first, last):
                if c >= 0:
                    area = m[i, AREA]
                    for k in range(3):
                        normal[k], middle[k] = m[i, NORMAL + k], m[i, MIDDLE + k]
                else:
                    area = triangle_area(corners, i, normal)
                    for k in range(3):
                        middle[k] = (corners[i, k] + corners[i, 3 + k] + corners[i, 6 + k]) / 3.0 - center[k]
                if sweep == 0:
                    m[slot, AREA] += area
                    for k in range(3):
                        m[slot, NORMAL + k] += normal[k]
                        m[slot, MIDDLE + k] += area * middle[k]
                    continue
                for j in range(3):
                    for k in range(3):
                        own = m[i, FIRST + 3 * j + k] if c >= 0 else 0.0
                        m[slot, FIRST + 3 * j + k] += own + normal[j] * (middle[k] - m[slot, MIDDLE + k])
            if sweep == 0 and last > first:
                square = 0.0
                for k in range(3):
                    low, high = boxes[node, 6 * half + k], boxes[node, 6 * half + 3 + k]
                    if m[slot, AREA] > 0.0:
                        m[slot, MIDDLE + k] /= m[slot, AREA]
                    else:
                        m[slot, MIDDLE + k] = 0.5 * (low + high)
                    square += max(high - m[slot, MIDDLE + k], m[slot, MIDDLE + k] - low) ** 2
                m[slot, RADIUS] = np.sqrt(square)
    return m


@inner
def triangle_area(corners: Array, i: int, normal: Array) -> float:
    """Area of row i; `normal` becomes the area vector."""
    size = 0.0
    for k in range(3):
        x, y = (k + 1) % 3, (k + 2) % 3
        normal[k] = 0.5 * (
            (corners[i, 3 + x] - corners[i, x]) * (corners[i, 6 + y] - corners[i, y])
            - (corners[i, 3 + y] - corners[i, y]) * (corners[i, 6 + x] - corners[i, x])
        )
        size += normal[k] * normal[k]
    return np.sqrt(size)


@inner
def solid_angle(corners: Array, i: int, qx: float, qy: float, qz: float) -> float:
    """Signed solid angle of row i seen from q over 2 (van Oosterom & Strackee 1983)."""
    ax, ay, az = corners[i, 0] - qx, corners[i, 1] - qy, corners[i, 2] - qz
    bx, by, bz = corners[i, 3] - qx, corners[i, 4] - qy, corners[i, 5] - qz
    cx, cy, cz = corners[i, 6] - qx, corners[i, 7] - qy, corners[i, 8] - qz
    a = np.sqrt(ax * ax + ay * ay + az * az)
    b = np.sqrt(bx * bx + by * by + bz * bz)
    c = np.sqrt(cx * cx + cy * cy + cz * cz)
    volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    across = a * b * c + (ax * bx + ay * by + az * bz) * c
    across += (bx * cx + by * cy + bz * cz) * a + (cx * ax + cy * ay + cz * az) * b
    return np.arctan2(volume, across)


@kernel
def winding(
    child: Index, corners: Array, center: Array, m: Array, points: Array, beta: float, order: IntArray, result: Array
) -> None:
    """Winding numbers of the points `order`; a child farther than `beta` radii is its dipole and first moments."""
    stack = np.empty(STACK, np.int32)
    for r in order:
        angle, far = 0.0, 0.0
        stack[0] = 0
        top = 1
        while top:
            top -= 1
            node = stack[top]
            if node < 0:
                code = -(np.int64(node) + 1)
                for i in range(code >> 3, (code >> 3) + (code & 7)):
                    angle += solid_angle(corners, i, points[r, 0], points[r, 1], points[r, 2])
                continue
            for half in range(2):
                s = 2 * np.int64(node) + half
                x = m[s, MIDDLE] - (points[r, 0] - center[0])
                y = m[s, MIDDLE + 1] - (points[r, 1] - center[1])
                z = m[s, MIDDLE + 2] - (points[r, 2] - center[2])
                square = x * x + y * y + z * z
                if square <= (beta * m[s, RADIUS]) ** 2 or square == 0.0:
                    stack[top] = child[node, half]
                    top += 1
                    continue
                f = 8  # FIRST
                trace = m[s, f] + m[s, f + 4] + m[s, f + 8]
                xx = m[s, f] * x * x + m[s, f + 4] * y * y + m[s, f + 8] * z * z
                xx += (m[s, f + 1] + m[s, f + 3]) * x * y + (m[s, f + 2] + m[s, f + 6]) * x * z
                xx += (m[s, f + 5] + m[s, f + 7]) * y * z
                dipole = m[s, NORMAL] * x + m[s, NORMAL + 1] * y + m[s, NORMAL + 2] * z
                far += (dipole + trace - 3.0 * xx / square) / (square * np.sqrt(square))
        result[r] = (2.0 * angle + far) / (4.0 * np.pi)
