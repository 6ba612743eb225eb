"""Slow definitions for mesh intersection: the common part of two triangles, by clipping in rational numbers."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from oracles_tree import Rational, along, cross, dot, minus, rational


def clipped(polygon: list[Rational], normal: Rational, origin: Rational) -> list[Rational]:
    """The part of a convex polygon (or segment, or point) where normal . (x - origin) >= 0."""
    if not polygon:
        return []
    height = [dot(normal, minus(x, origin)) for x in polygon]
    result = []
    for i, x in enumerate(polygon):
        j = (i + 1) % len(polygon)
        if height[i] >= 0:
            result.append(x)
        if height[i] * height[j] < 0:
            result.append(along(x, polygon[j], Fraction(height[i], height[i] - height[j])))
    return list(dict.fromkeys(result))


def common_part(p: np.ndarray, q: np.ndarray) -> list[Rational]:
    """Corners of the common part of two triangles with area; none, one point, two ends, or a polygon."""
    a, b = [rational(x) for x in p], [rational(x) for x in q]
    polygon = a
    normal = cross(minus(b[1], b[0]), minus(b[2], b[0]))
    for sign in (1, -1):
        polygon = clipped(polygon, tuple(sign * x for x in normal), b[0])
    for i in range(3):
        inward = cross(normal, minus(b[(i + 1) % 3], b[i]))
        polygon = clipped(polygon, inward, b[i])
    return polygon


def coplanar(p: np.ndarray, q: np.ndarray) -> bool:
    """Whether both triangles lie in one plane."""
    a = [rational(x) for x in p]
    normal = cross(minus(a[1], a[0]), minus(a[2], a[0]))
    return all(dot(normal, minus(rational(x), a[0])) == 0 for x in q)


def has_area(p: np.ndarray) -> bool:
    """Whether the corners are not in one line."""
    a = [rational(x) for x in p]
    return any(cross(minus(a[1], a[0]), minus(a[2], a[0])))
