"""Kernel of `paths_on_surface`: plane sections of a triangulation, walked from one of its triangles to another."""

# mypy: disable-error-code="no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import filling


@filling
def walk_sections(begin, finish, triangle, plane, longest, v, t, neighbours, normals, least_cosine, count, out):
    """Walk from points begin (k, 3) to finish (k, 3), along their planes with normals plane (k, 3).

    triangle (k, 2) are those of the ends, inside which both lie. Points where sides are crossed go into out (k, n, 3),
    their number into count (k,), -1 where the way does not arrive within n sides and the length `longest` (k,), meets a
    boundary, or a turn between triangles whose normals (m, 3) have a cosine below `least_cosine`. It sets out, seen
    against the plane's normal, with the surface's outside on its left.
    """
    for i in range(len(begin)):
        k, goal = triangle[i, 0], triangle[i, 1]
        came = np.int64(-1)
        x, y, z = begin[i, 0], begin[i, 1], begin[i, 2]
        length = 0.0
        number = np.int64(0)
        while k != goal:
            if number == out.shape[1] or length > longest[i]:
                number = np.int64(-1)
                break
            side = np.int64(-1)
            first, second = 0.0, 0.0
            for s in range(3):
                if s == came:
                    continue
                a, b = t[k, s], t[k, (s + 1) % 3]
                first, second = 0.0, 0.0
                for d in range(3):
                    first += plane[i, d] * (v[a, d] - begin[i, d])
                    second += plane[i, d] * (v[b, d] - begin[i, d])
                if first >= 0.0 and second < 0.0:
                    side = np.int64(s)
                    break
            if side < 0 or neighbours[k, side] < 0:
                number = np.int64(-1)
                break
            share = first / (first - second)
            a, b = t[k, side], t[k, (side + 1) % 3]
            for d in range(3):
                out[i, number, d] = (1.0 - share) * v[a, d] + share * v[b, d]
            square = (out[i, number, 0] - x) ** 2 + (out[i, number, 1] - y) ** 2 + (out[i, number, 2] - z) ** 2
            x, y, z = out[i, number, 0], out[i, number, 1], out[i, number, 2]
            length += np.sqrt(square)
            number += np.int64(1)
            other = neighbours[k, side]
            turn = 0.0
            for d in range(3):
                turn += normals[k, d] * normals[other, d]
            if turn < least_cosine:
                number = np.int64(-1)
                break
            came = np.int64(0)
            while t[other, came] != b:
                came += np.int64(1)
            k = other
        count[i] = number
