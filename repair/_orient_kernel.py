"""Kernel of orientation: a walk over neighbouring triangles."""

from __future__ import annotations

import numpy as np
from numba import njit
from patchwright.models.arrays import BoolArray, IntArray


@njit(cache=True)
def walk(triangles: IntArray, neighbours: IntArray) -> tuple[IntArray, BoolArray, BoolArray]:
    """Component of each triangle, whether it must be reversed to agree with the component's first triangle, and
    whether it disagrees with a neighbour all the same (a one-sided surface)."""
    m = len(triangles)
    component = np.full(m, -1, dtype=np.int64)
    turn = np.zeros(m, dtype=np.bool_)
    bad = np.zeros(m, dtype=np.bool_)
    stack = np.empty(m, dtype=np.int64)
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
                a, b = triangles[t, k], triangles[t, (k + 1) % 3]
                same = False
                for j in range(3):
                    if triangles[s, j] == a and triangles[s, (j + 1) % 3] == b:
                        same = True
                want = turn[t] ^ same
                if component[s] < 0:
                    component[s] = parts
                    turn[s] = want
                    stack[top] = s
                    top += 1
                elif turn[s] != want:
                    bad[s] = True
        parts += 1
    return component, turn, bad
