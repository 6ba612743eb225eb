"""Kernels of `adjacency`: unique edges by a two-pass radix sort, connected components, ordered boundary chains.

Each public function makes the arrays and its kernel fills them: allocating inside would be typed and compiled too.
"""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import filling
from patchwright.models.arrays import BoolArray, IntArray


def unique_edges(triangles: IntArray, count: int) -> tuple[IntArray, IntArray, IntArray, IntArray, IntArray, BoolArray]:
    """Edges, triangle_edges, CSR offsets and triangles, neighbours, and which edges are run twice in one direction.

    Half-edges (lo, hi) are sorted by two stable counting passes (hi, then lo): linear in triangles and vertices,
    whatever the valences, and within an edge its triangles stay in rising order.
    """
    m = len(triangles)
    around = np.empty(3 * m, np.int64)
    edges = np.empty((3 * m, 2), np.int64)
    offsets = np.empty(3 * m + 1, np.int64)
    triangle_edges = np.empty((m, 3), np.int64)
    neighbours = np.full((m, 3), -1, np.int64)
    inconsistent = np.zeros(3 * m, np.bool_)
    e = _unique_edges(
        triangles, count, np.zeros(count + 2, np.int64), np.zeros(count + 2, np.int64), np.empty((3, 3 * m), np.int64),
        around, edges, offsets, triangle_edges, neighbours, inconsistent,
    )  # fmt: skip
    return edges[:e].copy(), triangle_edges, offsets[: e + 1].copy(), around, neighbours, inconsistent[:e].copy()


@filling
def _unique_edges(
    triangles: IntArray,
    count: int,
    start: IntArray,
    fill: IntArray,
    half_edges: IntArray,
    around: IntArray,
    edges: IntArray,
    offsets: IntArray,
    triangle_edges: IntArray,
    neighbours: IntArray,
    inconsistent: BoolArray,
) -> int:
    """The number of edges. `half_edges` rows: twice the half-edge 3 t + k, plus one where it runs from hi to lo, by
    hi; the same by lo and hi; its hi. `start[v + 1]` becomes the end of the bucket of v as the bucket fills."""
    m = triangles.shape[0]
    total = 3 * m
    for t in range(m):
        for k in range(3):
            a = triangles[t, k]
            b = triangles[t, 0 if k == 2 else k + 1]
            start[(b if a < b else a) + 2] += 1
            fill[(a if a < b else b) + 2] += 1
    for v in range(count):
        start[v + 2] += start[v + 1]
        fill[v + 2] += fill[v + 1]
    for t in range(m):
        for k in range(3):
            a = triangles[t, k]
            b = triangles[t, 0 if k == 2 else k + 1]
            hi, lo, back = b, a, 0
            if a > b:
                hi, lo, back = a, b, 1
            at = start[hi + 1]
            half_edges[0, at] = 6 * t + 2 * k + back
            around[at] = lo
            start[hi + 1] = at + 1
    for hi in range(count):
        for i in range(start[hi], start[hi + 1]):
            lo = around[i]
            at = fill[lo + 1]
            half_edges[1, at] = half_edges[0, i]
            half_edges[2, at] = hi
            fill[lo + 1] = at + 1
    e = 0
    for lo in range(count):
        i = fill[lo]
        end = fill[lo + 1]
        while i < end:
            first = i
            hi = half_edges[2, i]
            edges[e, 0] = lo
            edges[e, 1] = hi
            offsets[e] = first
            t = 0
            k = 0
            back = 0
            while i < end and half_edges[2, i] == hi:
                other, corner, way = t, k, back
                h = half_edges[1, i]
                back = h & 1
                t = h // 6
                k = (h >> 1) - 3 * t
                around[i] = t
                triangle_edges[t, k] = e
                i += 1
            if i == first + 2 and lo != hi:
                inconsistent[e] = way == back
                if other != t:  # a folded triangle (i, j, i) is not its own neighbour
                    neighbours[other, corner] = t
                    neighbours[t, k] = other
            e += 1
    offsets[e] = total
    return e


def component_labels(offsets: IntArray, around: IntArray) -> IntArray:
    """(m,) component of each triangle, counted in the order of the components' first triangles (union-find)."""
    parent = np.arange(len(around) // 3)
    _component_labels(offsets, around, parent)
    return parent


@filling
def _component_labels(offsets: IntArray, around: IntArray, parent: IntArray) -> None:
    for e in range(offsets.shape[0] - 1):
        a = around[offsets[e]]
        while parent[a] != a:
            parent[a] = parent[parent[a]]
            a = parent[a]
        for i in range(offsets[e] + 1, offsets[e + 1]):
            b = around[i]
            while parent[b] != b:
                parent[b] = parent[parent[b]]
                b = parent[b]
            if a < b:
                parent[b] = a
            else:
                parent[a] = b
                a = b
    found = 0
    for t in range(parent.shape[0]):  # a root is the lowest triangle of its component
        if parent[t] == t:
            parent[t] = found
            found += 1
        else:
            parent[t] = parent[parent[t]]


def chains(tail: IntArray, head: IntArray, count: int) -> tuple[IntArray, IntArray, BoolArray]:
    """Directed edges tail → head joined to simple chains: CSR offsets, vertices, and whether each chain is closed.

    A walk takes an unused edge out of its vertex or, failing that, one into it (run backwards: the winding is
    inconsistent there); whenever it meets itself the loop is cut off. Walks begin at the vertices of odd degree, so
    that what is left over after them closes.
    """
    n = len(tail)
    start = np.zeros((2, count + 1), np.int64)
    incident = np.empty((2, n), np.int64)  # edges out of each vertex, edges into each vertex
    for row, end in enumerate((tail, head)):
        np.cumsum(np.bincount(end, minlength=count), out=start[row, 1:])
        incident[row] = np.argsort(end, kind="stable")
    vertices = np.empty(2 * n, np.int64)
    offsets = np.zeros(n + 1, np.int64)
    closed = np.zeros(n, np.bool_)
    done = _chains(
        np.ascontiguousarray(tail), np.ascontiguousarray(head), start, incident, start[:, :-1].copy(),
        np.diff(start, axis=1), np.zeros(n, np.bool_), np.full(count, -1, np.int64), np.empty(n + 1, np.int64),
        vertices, offsets, closed,
    )  # fmt: skip
    return offsets[: done + 1].copy(), vertices[: offsets[done]].copy(), closed[:done].copy()


@filling
def _chains(
    tail: IntArray,
    head: IntArray,
    start_of: IntArray,
    incident: IntArray,
    following: IntArray,
    left: IntArray,
    used: BoolArray,
    place: IntArray,
    path: IntArray,
    vertices: IntArray,
    offsets: IntArray,
    closed: BoolArray,
) -> int:
    """The number of chains. Row 0 of `start_of`, `incident`, `following`, `left` is about edges out, row 1 about edges
    in: CSR of the edges at each vertex, the next to look at, how many not walked yet. `place` of a vertex in `path`."""
    n = tail.shape[0]
    done = 0
    filled = 0
    for sweep in range(3):
        for start in range(2 * n):
            if sweep == 2 and (start >= n or used[start]):
                continue
            seed = tail[start] if start < n else head[start - n]
            outward = left[0, seed]
            inward = left[1, seed]
            if sweep < 2 and ((outward + inward) & 1 == 0 or (sweep == 0 and outward < inward)):
                continue
            length = 1
            path[0] = seed
            place[seed] = 0
            while True:
                v = path[length - 1]
                edge = -1
                w = v
                for side in range(2):
                    at = following[side, v]
                    end = start_of[side, v + 1]
                    while at < end and used[incident[side, at]]:
                        at += 1
                    following[side, v] = at
                    if edge < 0 and at < end:
                        edge = incident[side, at]
                        w = tail[edge] if side else head[edge]
                if edge < 0:
                    break
                used[edge] = True
                left[0, tail[edge]] -= 1
                left[1, head[edge]] -= 1
                if place[w] < 0:
                    place[w] = length
                    path[length] = w
                    length += 1
                    continue
                for j in range(place[w], length):  # met itself: the loop from w back to w is done
                    vertices[filled] = path[j]
                    filled += 1
                    if j > place[w]:
                        place[path[j]] = -1
                length = place[w] + 1
                closed[done] = True
                done += 1
                offsets[done] = filled
            if length > 1:
                for j in range(length):
                    vertices[filled] = path[j]
                    filled += 1
                done += 1
                offsets[done] = filled
            for j in range(length):
                place[path[j]] = -1
    return done
