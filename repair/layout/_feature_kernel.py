"""Kernels of `features`: normals that noise and needles do not turn, chains of feature edges, regions between them."""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
from numba import njit

from patchwright.repair.layout._surface_walk_kernel import inner


@inner
def squared(points, i, j):
    return (points[i, 0] - points[j, 0]) ** 2 + (points[i, 1] - points[j, 1]) ** 2 + (points[i, 2] - points[j, 2]) ** 2


@inner
def straightness(points, i, j, k):
    """Cosine of the turn at j on the way from i to k, 1 where there is no way."""
    ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    bx, by, bz = points[k, 0] - points[j, 0], points[k, 1] - points[j, 1], points[k, 2] - points[j, 2]
    size = np.sqrt((ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz))
    return (ax * bx + ay * by + az * bz) / size if size > 0.0 else 1.0


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True)
def settle_needles(order, neighbours, longest, height, threshold, normals):
    """Give a triangle flatter than `threshold` the normal of the neighbour across its longest side.

    `order` runs from the highest to the lowest triangle, so that rows of needles take over settled normals.
    """
    for i in order:
        if height[i] >= threshold:
            continue
        best = -1
        other = neighbours[i, longest[i]]
        if other >= 0 and height[other] > 4.0 * height[i]:
            best = other
        if best < 0:
            for k in range(3):
                other = neighbours[i, k]
                if other >= 0 and height[other] > 4.0 * height[i] and (best < 0 or height[other] > height[best]):
                    best = other
        if best >= 0:
            for c in range(3):
                normals[i, c] = normals[best, c]


@njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
def filter_normals(triangles, offsets, fans, areas, noisy, width, rounds, normals):
    """Average each noisy triangle's normal over its one-ring.

    Normals that differ by more than `width` (a chord) hardly count.
    """
    old = normals.copy()
    for _ in range(rounds):
        for i in range(len(triangles)):
            if not noisy[i]:
                continue
            sx, sy, sz = 0.0, 0.0, 0.0
            for c in range(3):
                p = triangles[i, c]
                for a in range(offsets[p], offsets[p + 1]):
                    j = fans[a]
                    d = (old[j, 0] - old[i, 0]) ** 2 + (old[j, 1] - old[i, 1]) ** 2 + (old[j, 2] - old[i, 2]) ** 2
                    w = areas[j] * np.exp(-d / (width * width))
                    sx += w * old[j, 0]
                    sy += w * old[j, 1]
                    sz += w * old[j, 2]
            size = np.sqrt(sx * sx + sy * sy + sz * sz)
            if size > 0.0:
                normals[i, 0], normals[i, 1], normals[i, 2] = sx / size, sy / size, sz / size
        for i in range(len(triangles)):
            for c in range(3):
                old[i, c] = normals[i, c]


@njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
def grow_ends(points, ends, offsets, incident, strong, weak):
    """Carry on each loose end of the strong edges along weak ones that go straight on; `strong` is changed in place."""
    degree = np.zeros(len(offsets) - 1, dtype=np.int64)
    for e in range(len(ends)):
        if strong[e]:
            degree[ends[e, 0]] += 1
            degree[ends[e, 1]] += 1
    for p0 in range(len(degree)):
        if degree[p0] != 1:
            continue
        p = p0
        came = -1
        for a in range(offsets[p], offsets[p + 1]):
            if strong[incident[a]]:
                came = incident[a]
        while degree[p] == 1 and came >= 0:
            q = ends[came, 0] + ends[came, 1] - p
            best, straight = -1, 0.5
            for a in range(offsets[p], offsets[p + 1]):
                e = incident[a]
                if strong[e] or not weak[e]:
                    continue
                r = ends[e, 0] + ends[e, 1] - p
                on = straightness(points, q, p, r)
                if on > straight:
                    best, straight = e, on
            if best < 0:
                break
            strong[best] = True
            degree[p] += 1
            p = ends[best, 0] + ends[best, 1] - p
            degree[p] += 1
            came = best


@njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
def trace(ends, offsets, incident, stop):
    """Chains of edges between `stop` vertices, and rings without one.

    Returns (chain offsets, vertices of the chains, edges of the chains, chain of each edge): chain c has the vertices
    `starts[c] + c` to `starts[c + 1] + c` inclusive and the edges `starts[c]` to `starts[c + 1]`.
    """
    count = len(ends)
    chain = np.full(count, -1, dtype=np.int64)
    starts = np.zeros(count + 1, dtype=np.int64)
    walked_vertices = np.empty(2 * count, dtype=np.int64)
    walked_edges = np.empty(count, dtype=np.int64)
    chains, n = 0, 0
    for turn in range(2):
        for first in range(count):
            if chain[first] >= 0:
                continue
            p = ends[first, 0]
            if turn == 0:
                if stop[ends[first, 0]]:
                    p = ends[first, 0]
                elif stop[ends[first, 1]]:
                    p = ends[first, 1]
                else:
                    continue
            e = first
            begin = p
            walked_vertices[n + chains] = p
            while True:
                chain[e] = chains
                walked_edges[n] = e
                n += 1
                p = ends[e, 0] + ends[e, 1] - p
                walked_vertices[n + chains] = p
                if stop[p] or p == begin:
                    break
                following = -1
                for a in range(offsets[p], offsets[p + 1]):
                    if chain[incident[a]] < 0:
                        following = incident[a]
                if following < 0:
                    break
                e = following
            chains += 1
            starts[chains] = n
    return starts[: chains + 1], walked_vertices[: n + chains], walked_edges[:n], chain


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True)
def turning(points, starts, vertices, reach, turn):
    """Into `turn` (as `vertices`) the cosine of the turn at every inner chain vertex, seen over at least `reach`.

    A ring's first vertex counts as inner. Where nothing turns, 1.
    """
    for c in range(len(starts) - 1):
        lo, hi = starts[c] + c, starts[c + 1] + c
        ring = vertices[lo] == vertices[hi]
        n = hi - lo
        for i in range(lo, hi + 1):
            turn[i] = 1.0
            if i in (lo, hi) and not ring:
                continue
            p = vertices[i]
            back, ahead = p, p
            j = i
            for _ in range(n):
                j -= 1
                if j < lo:
                    if not ring:
                        break
                    j = hi - 1
                back = vertices[j]
                if squared(points, back, p) >= reach * reach:
                    break
            j = i
            for _ in range(n):
                j += 1
                if j > hi:
                    if not ring:
                        break
                    j = lo + 1
                ahead = vertices[j]
                if squared(points, ahead, p) >= reach * reach:
                    break
            turn[i] = straightness(points, back, p, ahead)
        # of several inner vertices within the reach only the sharpest turns
        for i in range(lo + 1, hi):
            p = vertices[i]
            j = i + 1
            while j < hi and squared(points, vertices[j], p) < reach * reach:
                if turn[j] < turn[i]:
                    turn[i] = 1.0
                    break
                turn[j] = 1.0
                j += 1


@njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
def regions(neighbours, blocked):
    """(m,) number of the piece each triangle lies in, pieces being parted by blocked sides."""
    label = np.full(len(neighbours), -1, dtype=np.int64)
    stack = np.empty(len(neighbours), dtype=np.int64)
    count = 0
    for seed in range(len(neighbours)):
        if label[seed] >= 0:
            continue
        label[seed] = count
        stack[0] = seed
        top = 1
        while top:
            top -= 1
            t = stack[top]
            for k in range(3):
                other = neighbours[t, k]
                if other >= 0 and blocked[t, k] < 0 and label[other] < 0:
                    label[other] = count
                    stack[top] = other
                    top += 1
        count += 1
    return label
