"""Kernels of `adjacency`: unique edges by a two-pass radix sort, connected components, ordered boundary chains."""

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.models.arrays import BoolArray, IntArray


@njit(cache=True, nogil=True)
def unique_edges(triangles: IntArray, count: int) -> tuple[IntArray, IntArray, IntArray, IntArray, IntArray, BoolArray]:
    """Edges, triangle_edges, CSR offsets and triangles, neighbours, and which edges are run twice in one direction.

    Half-edges (lo, hi) are sorted by two stable counting passes (hi, then lo): linear in triangles and vertices,
    whatever the valences, and within an edge its triangles stay in rising order.
    """
    m = triangles.shape[0]
    total = 3 * m
    start = np.zeros(count + 2, np.int64)  # start[v + 1] becomes the end of the bucket of v as the bucket fills
    for t in range(m):
        for k in range(3):
            start[max(triangles[t, k], triangles[t, k - 2]) + 2] += 1
    for v in range(count):
        start[v + 2] += start[v + 1]
    by_hi = np.empty(total, np.int64)  # twice the half-edge 3 t + k, plus one where it runs from hi to lo
    lo_of = np.empty(total, np.int64)
    for t in range(m):
        for k in range(3):
            a, b = triangles[t, k], triangles[t, k - 2]
            at = start[max(a, b) + 1]
            by_hi[at] = 2 * (3 * t + k) + (a > b)
            lo_of[at] = min(a, b)
            start[max(a, b) + 1] = at + 1
    fill = np.zeros(count + 2, np.int64)
    for i in range(total):
        fill[lo_of[i] + 2] += 1
    for v in range(count):
        fill[v + 2] += fill[v + 1]
    order = np.empty(total, np.int64)
    hi_of = np.empty(total, np.int64)
    for hi in range(count):
        for i in range(start[hi], start[hi + 1]):
            at = fill[lo_of[i] + 1]
            order[at] = by_hi[i]
            hi_of[at] = hi
            fill[lo_of[i] + 1] = at + 1

    edges = np.empty((total, 2), np.int64)
    offsets = np.empty(total + 1, np.int64)
    around = lo_of  # its old content is no longer needed
    triangle_edges = np.empty((m, 3), np.int64)
    neighbours = np.full((m, 3), -1, np.int64)
    inconsistent = np.zeros(total, np.bool_)
    e = 0
    for lo in range(count):
        i, end = fill[lo], fill[lo + 1]
        while i < end:
            first, hi = i, hi_of[i]
            edges[e, 0], edges[e, 1] = lo, hi
            offsets[e] = first
            while i < end and hi_of[i] == hi:
                h = order[i] >> 1
                t = h // 3
                around[i] = t
                triangle_edges[t, h - 3 * t] = e
                i += 1
            if i == first + 2 and lo != hi:
                g, h = order[first] >> 1, order[first + 1] >> 1
                inconsistent[e] = (order[first] & 1) == (order[first + 1] & 1)
                s, t = g // 3, h // 3
                if s != t:  # a folded triangle (i, j, i) is not its own neighbour
                    neighbours[s, g - 3 * s] = t
                    neighbours[t, h - 3 * t] = s
            e += 1
    offsets[e] = total
    return edges[:e].copy(), triangle_edges, offsets[: e + 1].copy(), around, neighbours, inconsistent[:e].copy()


@njit(cache=True, nogil=True)
def component_labels(offsets: IntArray, around: IntArray) -> IntArray:
    """(m,) component of each triangle, counted in the order of the components' first triangles (union-find)."""
    m = around.shape[0] // 3
    parent = np.arange(m)
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
    for t in range(m):  # a root is the lowest triangle of its component
        if parent[t] == t:
            parent[t] = found
            found += 1
        else:
            parent[t] = parent[parent[t]]
    return parent


@njit(cache=True, nogil=True)
def chains(tail: IntArray, head: IntArray, count: int) -> tuple[IntArray, IntArray, BoolArray]:
    """Directed edges tail → head joined to simple chains: CSR offsets, vertices, and whether each chain is closed.

    A walk takes an unused edge out of its vertex or, failing that, one into it (run backwards: the winding is
    inconsistent there); whenever it meets itself the loop is cut off. Walks begin at the vertices of odd degree, so
    that what is left over after them closes.
    """
    n = tail.shape[0]
    out_start = np.zeros(count + 1, np.int64)
    in_start = np.zeros(count + 1, np.int64)
    for i in range(n):
        out_start[tail[i] + 1] += 1
        in_start[head[i] + 1] += 1
    for v in range(count):
        out_start[v + 1] += out_start[v]
        in_start[v + 1] += in_start[v]
    out_edge = np.empty(n, np.int64)
    in_edge = np.empty(n, np.int64)
    out_next = out_start[:-1].copy()
    in_next = in_start[:-1].copy()
    for i in range(n):
        out_edge[out_next[tail[i]]] = i
        out_next[tail[i]] += 1
        in_edge[in_next[head[i]]] = i
        in_next[head[i]] += 1
    out_next[:] = out_start[:-1]
    in_next[:] = in_start[:-1]
    out_left, in_left = np.diff(out_start), np.diff(in_start)  # edges not walked yet
    used = np.zeros(n, np.bool_)
    place = np.full(count, -1, np.int64)  # of a vertex in the path being walked
    path = np.empty(n + 1, np.int64)
    vertices = np.empty(2 * n, np.int64)
    offsets = np.zeros(n + 1, np.int64)
    closed = np.zeros(n, np.bool_)
    done = 0
    filled = 0
    for sweep in range(3):
        for start in range(2 * n):
            if sweep == 2 and (start >= n or used[start]):
                continue
            seed = tail[start] if start < n else head[start - n]
            outward, inward = out_left[seed], in_left[seed]
            if sweep < 2 and ((outward + inward) % 2 == 0 or (sweep == 0 and outward < inward)):
                continue
            length = 1
            path[0] = seed
            place[seed] = 0
            while True:
                v = path[length - 1]
                while out_next[v] < out_start[v + 1] and used[out_edge[out_next[v]]]:
                    out_next[v] += 1
                while in_next[v] < in_start[v + 1] and used[in_edge[in_next[v]]]:
                    in_next[v] += 1
                if out_next[v] < out_start[v + 1]:
                    edge = out_edge[out_next[v]]
                    w = head[edge]
                elif in_next[v] < in_start[v + 1]:
                    edge = in_edge[in_next[v]]
                    w = tail[edge]
                else:
                    break
                used[edge] = True
                out_left[tail[edge]] -= 1
                in_left[head[edge]] -= 1
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
    return offsets[: done + 1].copy(), vertices[:filled].copy(), closed[:done].copy()
