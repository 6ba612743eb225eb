"""Kernels of orientation: a walk over neighbouring triangles, and the volumes of the components it finds."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import filling
from patchwright.models.arrays import Array, BoolArray, IntArray


def walk(triangles: IntArray, neighbours: IntArray) -> tuple[IntArray, BoolArray, BoolArray]:
    """Component of each triangle, whether it must be reversed to agree with the component's first triangle, and
    whether it disagrees with a neighbour all the same (a one-sided surface)."""
    m = len(triangles)
    component = np.full(m, -1, dtype=np.int64)
    turn, bad = np.zeros(m, dtype=np.bool_), np.zeros(m, dtype=np.bool_)
    _walk(triangles, neighbours, component, turn, bad, np.empty(m, dtype=np.int64))
    return component, turn, bad


@filling
def _walk(
    triangles: IntArray, neighbours: IntArray, component: IntArray, turn: BoolArray, bad: BoolArray, stack: IntArray
) -> None:
    m = len(triangles)
    parts = 0
    for seed in range(m):
        if component[seed] >= 0:
            continue
        component[seed] = parts
        stack[0] = seed
        top = 1
        while top:
            top -= 1
            t = stack[top]
            for k in range(3):
                s = neighbours[t, k]
                if s < 0:
                    continue
                a = triangles[t, k]
                b = triangles[t, 0 if k == 2 else k + 1]
                want = turn[t]
                for j in range(3):
                    if triangles[s, j] == a and triangles[s, 0 if j == 2 else j + 1] == b:
                        want = not turn[t]
                if component[s] < 0:
                    component[s] = parts
                    turn[s] = want
                    stack[top] = s
                    top += 1
                elif turn[s] != want:
                    bad[s] = True
        parts += 1


def volumes(
    points: Array, triangles: IntArray, turn: BoolArray, component: IntArray, parts: int, rims: BoolArray
) -> Array:
    """(c,) volume of each component of triangles, some reversed, each rim edge joined to its component's rim centre.

    `turn` (m,) are the reversed triangles, `rims` (m, 3) the edges k to k + 1, as the triangles came, that count.
    """
    volume = np.zeros(parts)
    _volumes(points, triangles, turn, component, rims, np.zeros((parts, 8)), volume)
    return volume


@filling
def _volumes(
    points: Array,
    triangles: IntArray,
    turn: BoolArray,
    component: IntArray,
    rims: BoolArray,
    middles: Array,
    volume: Array,
) -> None:
    """`middles` (c, 8), zeros: sums of the corners, their number, sums of the rim edges' starts, their number."""
    for t in range(len(triangles)):
        c = component[t]
        middles[c, 3] += 3.0
        for k in range(3):
            after = 0 if k == 2 else k + 1
            start = triangles[t, after if turn[t] else k]
            for d in range(3):
                middles[c, d] += points[triangles[t, k], d]
                if rims[t, k]:
                    middles[c, 4 + d] += points[start, d]
            if rims[t, k]:
                middles[c, 7] += 1.0
    for c in range(len(middles)):
        for d in range(3):
            middles[c, d] /= middles[c, 3]
            middles[c, 4 + d] = middles[c, 4 + d] / max(middles[c, 7], 1.0) - middles[c, d]
    for t in range(len(triangles)):
        c = component[t]
        sign = -1.0 if turn[t] else 1.0
        for k in range(4):  # the triangle, then its edges with the rim's centre
            if k > 0 and not rims[t, k - 1]:
                continue
            a = triangles[t, 0 if k == 0 else k - 1]
            b = triangles[t, 1 if k == 0 else (0 if k == 3 else k)]
            ax, ay, az = points[a, 0] - middles[c, 0], points[a, 1] - middles[c, 1], points[a, 2] - middles[c, 2]
            bx, by, bz = points[b, 0] - middles[c, 0], points[b, 1] - middles[c, 1], points[b, 2] - middles[c, 2]
            cx, cy, cz = middles[c, 4], middles[c, 5], middles[c, 6]
            if k == 0:
                v = triangles[t, 2]
                cx, cy, cz = points[v, 0] - middles[c, 0], points[v, 1] - middles[c, 1], points[v, 2] - middles[c, 2]
            six = cx * (ay * bz - az * by) + cy * (az * bx - ax * bz) + cz * (ax * by - ay * bx)
            volume[c] += (sign if k == 0 else -sign) * six / 6.0
