"""Kernel of `mesh_surface`: subdivision of a surface against triangles until every pair is excluded or explained."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

import numpy as np

from patchwright.models._compile_kernel import kernel
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.ssi._bernstein_kernel import copied, halve, reach
from patchwright.ssi._triangle_box_kernel import ARC, BUDGET, EXCLUDED, LEFT, ROW, SPLIT, TOUCH, judge

DEEP = 160  # halvings at most: two parameters down to the last bit


@kernel
def meet(
    nets: Array, goes_on: BoolArray, first: IntArray, candidates: IntArray, planes: Array, boxes: Array, tol: float,
    eps: float, small: float, budget: int,
) -> tuple[Array, int]:  # fmt: skip
    """Findings (k, ROW) of all pieces and their candidates, and how many pairs were judged.

    Parameters
    ----------
    nets : (k, p + 1, q + 1, 4) homogeneous; weights near 1
    goes_on : (k, 2) whether there is surface beyond the far border in u, in v
    candidates : triangles of piece i are `candidates[first[i]:first[i + 1]]`
    planes : (m, 4, 4) the planes of each triangle, unit normals; boxes (m, 2, 3)
    tol, eps, small : lengths in the scale of the nets: of touch, of round-off, of the least box
    """
    P = nets.shape[1]
    Q = nets.shape[2]
    stack = np.empty((DEEP + 2, P, Q, 4))
    domain = np.empty((DEEP + 2, 4))
    spans = np.empty((DEEP + 2, 2), np.int64)
    lists = np.empty(4 * candidates.shape[0] + 1024, np.int64)
    out = np.empty((256, ROW))
    count = 0
    judged = 0
    most = max(P, Q) + 1
    C = np.empty((5, P, Q))  # the last is scratch
    F = np.empty((5, Q, P))
    row = np.empty(ROW)
    line = np.empty(most)
    b = np.empty(most)
    work = (line, b, np.empty(most), np.empty((5, 4)), np.empty(2), np.empty(4), np.empty(4))
    touch = (b, np.empty(6), np.empty(6), np.empty((3, most)))
    box = np.empty((2, 3))
    for piece in range(nets.shape[0]):
        if first[piece] == first[piece + 1]:
            continue
        total = first[piece + 1] - first[piece]
        for k in range(total):
            lists[k] = candidates[first[piece] + k]
        copied(nets[piece], stack[0])
        domain[0, 0] = domain[0, 2] = 0.0
        domain[0, 1] = domain[0, 3] = 1.0
        spans[0, 0] = 0
        spans[0, 1] = total
        top = 1
        while top > 0:
            top -= 1
            net = stack[top]
            low_list = spans[top, 0]
            high_list = spans[top, 1]
            light = math.inf
            heavy = 0.0
            for c in range(3):
                box[0, c] = math.inf
                box[1, c] = -math.inf
            for i in range(P):
                for j in range(Q):
                    w = net[i, j, 3]
                    light = min(light, w)
                    heavy = max(heavy, w)
                    for c in range(3):
                        x = net[i, j, c] / w
                        box[0, c] = min(box[0, c], x)
                        box[1, c] = max(box[1, c], x)
            size = math.sqrt((box[1, 0] - box[0, 0]) ** 2 + (box[1, 1] - box[0, 1]) ** 2 + (box[1, 2] - box[0, 2]) ** 2)
            if lists.shape[0] < 2 * high_list - low_list:
                wider = np.empty(2 * (2 * high_list - low_list), np.int64)
                for k in range(high_list):
                    wider[k] = lists[k]
                lists = wider
            on_u = goes_on[piece, 0] or domain[top, 1] < 1.0
            on_v = goes_on[piece, 1] or domain[top, 3] < 1.0
            kept = high_list
            for index in range(low_list, high_list):
                t = lists[index]
                apart = False
                for c in range(3):
                    apart |= box[0, c] > boxes[t, 1, c] + tol or boxes[t, 0, c] > box[1, c] + tol
                if apart:
                    continue
                judged += 1
                if judged > budget:
                    code = BUDGET
                else:
                    code = judge(
                        net, planes[t], C, F, light, heavy, tol, eps, size, small, on_u, on_v, row, work, touch
                    )  # fmt: skip
                if code == EXCLUDED:
                    continue
                if code == SPLIT:
                    if size > small and top + 2 < DEEP:
                        lists[kept] = t
                        kept += 1
                        continue
                    code = LEFT
                if code == BUDGET and judged > budget + 1:
                    continue
                if count == out.shape[0]:
                    wider_out = np.empty((2 * count, ROW))
                    for k in range(count):
                        for c in range(ROW):
                            wider_out[k, c] = out[k, c]
                    out = wider_out
                row[0] = code
                row[1] = t
                row[2] = piece
                for k in range(4):
                    row[4 + k] = domain[top, k]
                if ARC <= code <= TOUCH:
                    for k in range(4):
                        a = 2 * (k % 2)
                        row[8 + k] = domain[top, a] + row[8 + k] * (domain[top, a + 1] - domain[top, a])
                for k in range(ROW):
                    out[count, k] = row[k]
                count += 1
            if kept == high_list:
                continue
            # halve along the longer direction
            axis = 0 if reach(net, np.int64(0)) >= reach(net, np.int64(1)) else 1
            left = stack[top]
            right = stack[top + 1]
            halve(left, right, axis)
            for k in range(4):
                domain[top + 1, k] = domain[top, k]
            middle = 0.5 * (domain[top, 2 * axis] + domain[top, 2 * axis + 1])
            domain[top, 2 * axis + 1] = middle
            domain[top + 1, 2 * axis] = middle
            for k in range(2):
                spans[top + k, 0] = high_list
                spans[top + k, 1] = kept
            top += 2
    return out[:count], judged
