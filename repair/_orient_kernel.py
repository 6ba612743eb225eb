"""Kernel of orientation: a walk over neighbouring triangles."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import filling
from patchwright.models.arrays import BoolArray, IntArray


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
