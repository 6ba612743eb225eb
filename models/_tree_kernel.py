"""Kernels of `tree`: binned surface-area build, order of queries, overlapping boxes.

Layout: inner node i holds the boxes of its two children in `boxes[i]` (lower x, y, z, upper x, y, z of the left, then
of the right child; float32 about `center`, padded by more than any rounding here or in the queries) and the children in
`child[i]`: an inner node c >= 0, or -(8 first + count) - 1 for a leaf of `count` triangles from row `first` of
`corners` (k, 9), which are float64 in the model's own frame; `index` gives their number in the triangulation.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from patchwright.models._compile_kernel import filling, inner, kernel
from patchwright.models.arrays import Array, IntArray

Boxes = npt.NDArray[np.float32]
Index = npt.NDArray[np.int32]

LEAF = 4
BINS = 16
DEEPEST = 48  # below this depth ranges are halved, so that no tree is deeper than 48 + 28
STACK = 160


def bounds(vertices: Array, triangles: IntArray) -> tuple[Array, Array]:
    """Lowest and highest coordinates of the triangles' corners; zeros without triangles."""
    box = np.zeros((2, 3))
    if len(triangles):
        box[:] = vertices[triangles[0, 0]]
        _bounds(vertices, triangles, box)
    return box[0], box[1]


@filling
def _bounds(vertices: Array, triangles: IntArray, box: Array) -> None:
    """Widen `box` (2, 3) by the triangles' corners."""
    for t in range(triangles.shape[0]):
        for j in range(3):
            v = triangles[t, j]
            for k in range(3):
                x = vertices[v, k]
                if x < box[0, k]:
                    box[0, k] = x
                if x > box[1, k]:
                    box[1, k] = x


def primitive_boxes(vertices: Array, triangles: IntArray, center: Array, pad: float) -> Boxes:
    """(m, 6) boxes of the triangles about `center`, padded."""
    boxes = np.empty((len(triangles), 6), np.float32)
    _primitive_boxes(vertices, triangles, center, pad, boxes)
    return boxes


@filling
def _primitive_boxes(vertices: Array, triangles: IntArray, center: Array, pad: float, boxes: Boxes) -> None:
    for t in range(triangles.shape[0]):
        a = triangles[t, 0]
        b = triangles[t, 1]
        c = triangles[t, 2]
        for k in range(3):
            x = vertices[a, k]
            y = vertices[b, k]
            z = vertices[c, k]
            boxes[t, k] = np.float32(min(min(x, y), z) - center[k] - pad)
            boxes[t, k + 3] = np.float32(max(max(x, y), z) - center[k] + pad)


@inner
def clear(boxes: Boxes, i: int) -> None:
    """Make row i of `boxes` (n, 6) the empty box."""
    for k in range(3):
        boxes[i, k] = np.inf
        boxes[i, k + 3] = -np.inf


@inner
def widen(boxes: Boxes, i: int, by: Boxes, j: int) -> None:
    """Make box i of `boxes` hold box j of `by`."""
    for k in range(3):
        low = by[j, k]
        high = by[j, k + 3]
        boxes[i, k] = low if low < boxes[i, k] else boxes[i, k]
        boxes[i, k + 3] = high if high > boxes[i, k + 3] else boxes[i, k + 3]


@inner
def half_area(boxes: Boxes, i: int) -> float:
    """Half the surface of box i."""
    dx = boxes[i, 3] - boxes[i, 0]
    dy = boxes[i, 4] - boxes[i, 1]
    dz = boxes[i, 5] - boxes[i, 2]
    return dx * dy + dy * dz + dz * dx


@inner
def partition(
    boxes: Boxes, order: Index, begin: int, end: int, bins: Boxes, count: IntArray, area: Array, halves: Boxes
) -> int:
    """Permute the boxes begin..end at the best of 15 planes; where the right half begins, `begin` if none parts them.

    `halves` (3, 6) become the boxes of the two halves; its third row is scratch.
    """
    clear(halves, np.int64(2))  # of twice the centres
    for i in range(begin, end):
        for k in range(3):
            c = boxes[i, k] + boxes[i, k + 3]
            halves[2, k] = c if c < halves[2, k] else halves[2, k]
            halves[2, k + 3] = c if c > halves[2, k + 3] else halves[2, k + 3]
    axis = 0
    origin = halves[2, 0]
    longest = halves[2, 3] - origin
    for k in range(1, 3):
        if halves[2, k + 3] - halves[2, k] > longest:
            axis = k
            origin = halves[2, k]
            longest = halves[2, k + 3] - origin
    if not longest > 0.0:
        return begin
    scale = np.float32(0.99999 * BINS) / longest
    for b in range(BINS):
        count[b] = 0
        clear(bins, b)
    for i in range(begin, end):
        slot = np.int64((boxes[i, axis] + boxes[i, axis + 3] - origin) * scale)
        if slot >= BINS:
            slot = np.int64(BINS - 1)
        count[slot] += 1
        widen(bins, slot, boxes, i)
    for half in range(2):
        clear(halves, half)
    lower, upper = np.int64(0), np.int64(1)  # plain numbers would be types of their own, and compile `widen` again
    for b in range(BINS - 1, 0, -1):
        widen(halves, upper, bins, b)
        area[b] = half_area(halves, upper)
    left = 0
    cut = 0
    best = np.inf
    for b in range(BINS - 1):
        widen(halves, lower, bins, b)
        left += count[b]
        if left > 0 and left < end - begin:
            cost = half_area(halves, lower) * left + area[b + 1] * (end - begin - left)
            if cost < best:
                best = cost
                cut = b + 1
    for side in range(2):
        clear(halves, side)
    for b in range(BINS):
        widen(halves, 0 if b < cut else 1, bins, b)
    split = begin
    last = end - 1
    while split <= last:
        if np.int64((boxes[split, axis] + boxes[split, axis + 3] - origin) * scale) < cut:
            split += 1
            continue
        i = order[split]
        order[split] = order[last]
        order[last] = i
        for k in range(6):
            c = boxes[split, k]
            boxes[split, k] = boxes[last, k]
            boxes[last, k] = c
        last -= 1
    return split


def build(boxes: Boxes) -> tuple[Boxes, Index, Index]:
    """Top-down build by the surface-area heuristic on 16 bins of the longest axis of the box centres.

    Returns the nodes' boxes (n, 12), children (n, 2) and the order of the triangles in the leaves. `boxes` is permuted.
    """
    m = len(boxes)
    order = np.arange(m, dtype=np.int32)
    node_boxes = np.empty((max(m, 1), 12), np.float32)
    child = np.empty((max(m, 1), 2), np.int32)
    nodes = _build(
        boxes, order, node_boxes, child, np.empty((STACK, 4), np.int64), np.empty((BINS, 6), np.float32),
        np.empty(BINS, np.int64), np.empty(BINS), np.empty((3, 6), np.float32),
    )  # fmt: skip
    return node_boxes[:nodes].copy(), child[:nodes].copy(), order


@filling
def _build(
    boxes: Boxes,
    order: Index,
    node_boxes: Boxes,
    child: Index,
    stack: IntArray,
    bins: Boxes,
    count: IntArray,
    area: Array,
    halves: Boxes,
) -> int:
    """The number of nodes; rows of `stack`: begin, end, 2 parent + side, depth."""
    nodes = 0
    stack[0, 0] = 0
    stack[0, 1] = boxes.shape[0]
    stack[0, 2] = -1
    stack[0, 3] = 0
    top = 1
    while top:
        top -= 1
        begin = stack[top, 0]
        end = stack[top, 1]
        link = stack[top, 2]
        depth = stack[top, 3]
        if link >= 0:
            if end - begin <= LEAF:
                child[link >> 1, link & 1] = -(8 * begin + (end - begin)) - 1
                continue
            child[link >> 1, link & 1] = nodes
        split = begin
        if end - begin > LEAF and depth < DEEPEST:
            split = partition(boxes, order, begin, end, bins, count, area, halves)
        if split == begin:
            split = end if end - begin <= LEAF else (begin + end) >> 1  # a tree of one leaf has an empty right child
            for half in range(2):
                clear(halves, half)
            for i in range(begin, end):
                widen(halves, 0 if i < split else 1, boxes, i)
        for half in range(2):
            for k in range(6):
                node_boxes[nodes, 6 * half + k] = halves[half, k]
            stack[top, 0] = begin if half else split
            stack[top, 1] = split if half else end
            stack[top, 2] = 2 * nodes + 1 - half
            stack[top, 3] = depth + 1
            top += 1
        nodes += 1
    return nodes


@filling
def gather(vertices: Array, triangles: IntArray, order: Index, corners: Array) -> None:
    """Fill `corners` (m, 9) with the triangles' corners in the order of the leaves."""
    for i in range(order.shape[0]):
        for j in range(3):
            v = triangles[order[i], j]
            for k in range(3):
                corners[i, 3 * j + k] = vertices[v, k]


@inner
def extent(points: Array, low: Array) -> float:
    """The longest side of the box of `points`, whose lower corner goes to `low` (3,)."""
    longest = -np.inf
    for k in range(3):
        least = np.inf
        most = -np.inf
        for i in range(points.shape[0]):
            x = points[i, k]
            least = x if x < least else least
            most = x if x > most else most
        low[k] = least
        longest = most - least if most - least > longest else longest
    return longest


def morton_order(points: Array, otherwise: Array, least: float) -> IntArray:
    """(n,) an order in which successive points are near: 21-bit Morton codes, sorted by two radix passes.

    Where all `points` lie within `least`, the order is that of the points `otherwise`.
    """
    n = len(points)
    order = np.arange(n)
    _morton_order(
        points, otherwise, least, np.empty(3), np.zeros(n, np.int64), np.zeros((2, 2049), np.int64), order,
        np.empty(n, np.int64),
    )  # fmt: skip
    return order


@filling
def _morton_order(
    points: Array,
    otherwise: Array,
    least: float,
    low: Array,
    code: IntArray,
    start: IntArray,
    order: IntArray,
    other: IntArray,
) -> None:
    """`order` is 0, 1, ... before and the order after; `code` and `start` are zeros, `start` (2, 2049)."""
    n = points.shape[0]
    size = extent(points, low)
    if size <= least:
        points = otherwise
        size = extent(points, low)
    scale = 127.0 / size if 0.0 < size < np.inf else 0.0
    for i in range(n):
        for k in range(3):
            x = np.int64((points[i, k] - low[k]) * scale)
            x = (x | (x << 16)) & 0x030000FF  # three bits apart
            x = (x | (x << 8)) & 0x0300F00F
            x = (x | (x << 4)) & 0x030C30C3
            code[i] |= ((x | (x << 2)) & 0x09249249) << k
    for i in range(n):
        start[0, (code[i] & 2047) + 1] += 1
        start[1, (code[i] >> 11) + 1] += 1
    for b in range(2048):
        start[0, b + 1] += start[0, b]
        start[1, b + 1] += start[1, b]
    for i in range(n):
        b = code[i] & 2047
        other[start[0, b]] = i
        start[0, b] += 1
    for j in range(n):
        i = other[j]
        b = code[i] >> 11
        order[start[1, b]] = i
        start[1, b] += 1


def exact_boxes(corners: Array) -> Array:
    """(m, 6) boxes of the triangles in the order of the leaves, not padded."""
    boxes = np.empty((len(corners), 6))
    _exact_boxes(corners, boxes)
    return boxes


@filling
def _exact_boxes(corners: Array, boxes: Array) -> None:
    for i in range(corners.shape[0]):
        for k in range(3):
            low = corners[i, k]
            high = low
            for j in range(3, 9, 3):
                x = corners[i, j + k]
                low = x if x < low else low
                high = x if x > high else high
            boxes[i, k] = low
            boxes[i, k + 3] = high


@inner
def children_boxes(boxes: Boxes, exact: Array, center: Array, code: int, out: Array) -> int:
    """How many boxes stand for `code` (two for an inner node, one for a leaf), and the boxes, in the model frame."""
    if code >= 0:
        for half in range(2):
            for k in range(6):
                out[half, k] = boxes[code, 6 * half + k] + center[k % 3]
        return 2
    code = -(code + 1)
    for k in range(3):
        out[0, k], out[0, k + 3] = np.inf, -np.inf
    for i in range(code >> 3, (code >> 3) + (code & 7)):
        for k in range(3):
            out[0, k] = min(out[0, k], exact[i, k])
            out[0, k + 3] = max(out[0, k + 3], exact[i, k + 3])
    return 1


@inner
def touch(a: Array, i: int, b: Array, j: int) -> bool:
    """Whether box i of `a` and box j of `b` have a point in common."""
    apart = False
    for k in range(3):
        apart |= (a[i, k] > b[j, k + 3]) | (b[j, k] > a[i, k + 3])
    return not apart


@kernel
def overlapping(
    a_boxes: Boxes,
    a_child: Index,
    a_exact: Array,
    a_index: Index,
    a_center: Array,
    b_boxes: Boxes,
    b_child: Index,
    b_exact: Array,
    b_index: Index,
    b_center: Array,
    own: bool,
) -> IntArray:
    """Pairs of triangles whose exact boxes touch; with `own` the trees are one and each pair comes once, i < j."""
    capacity = max(64, 8 * a_index.shape[0])
    pairs = np.empty((capacity, 2), np.int64)
    filled = 0
    stack = np.empty((4 * STACK, 2), np.int64)
    a_box = np.empty((2, 6))
    b_box = np.empty((2, 6))
    stack[0, 0], stack[0, 1] = 0, 0
    top = 1
    while top:
        top -= 1
        a, b = stack[top, 0], stack[top, 1]
        if a >= 0 or b >= 0:
            na = children_boxes(a_boxes, a_exact, a_center, a, a_box)
            nb = children_boxes(b_boxes, b_exact, b_center, b, b_box)
            for g in range(na):
                for h in range(nb):
                    if not (own and a == b and g > h) and touch(a_box, g, b_box, h):
                        stack[top, 0] = a_child[a, g] if a >= 0 else a
                        stack[top, 1] = b_child[b, h] if b >= 0 else b
                        top += 1
            continue
        first_a, first_b = -(a + 1), -(b + 1)
        for i in range(first_a >> 3, (first_a >> 3) + (first_a & 7)):
            for j in range(first_b >> 3, (first_b >> 3) + (first_b & 7)):
                if (own and a == b and i >= j) or not touch(a_exact, i, b_exact, j):
                    continue
                if filled == capacity:
                    capacity *= 2
                    grown = np.empty((capacity, 2), np.int64)
                    for row in range(filled):
                        grown[row, 0], grown[row, 1] = pairs[row, 0], pairs[row, 1]
                    pairs = grown
                first, second = np.int64(a_index[i]), np.int64(b_index[j])
                swap = own and first > second
                pairs[filled, 0], pairs[filled, 1] = second if swap else first, first if swap else second
                filled += 1
    return pairs[:filled].copy()
