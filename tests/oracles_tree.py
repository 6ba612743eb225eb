"""Slow definitions for trees: every triangle asked, in dense numpy or exactly in rational numbers."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import numpy as np

Rational = tuple[Fraction, ...]


def rational(point) -> Rational:
    return tuple(Fraction(float(x)) for x in point)


def minus(a: Rational, b: Rational) -> Rational:
    return tuple(x - y for x, y in zip(a, b, strict=True))


def along(a: Rational, b: Rational, t: Fraction) -> Rational:
    return tuple(x + t * (y - x) for x, y in zip(a, b, strict=True))


def dot(a: Rational, b: Rational) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def cross(a: Rational, b: Rational) -> Rational:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def ray_crossings(corners: np.ndarray, origin, direction) -> dict[int, Fraction]:
    """Exactly: the triangles the line origin + t direction crosses, border included, and t; not parallel ones."""
    o, d = rational(origin), rational(direction)
    found = {}
    for number, triangle in enumerate(corners):
        a, b, c = (rational(x) for x in triangle)
        n = cross(minus(b, a), minus(c, a))
        slope = dot(n, d)
        if slope == 0:
            continue
        t = dot(n, minus(a, o)) / slope
        hit = tuple(x + t * y for x, y in zip(o, d, strict=True))
        sides = [dot(n, cross(minus(y, x), minus(hit, x))) for x, y in ((a, b), (b, c), (c, a))]
        if min(sides) >= 0:
            found[number] = t
    return found


def on_segments(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n, m, 3) closest points of m segments to n points."""
    e = b - a
    length = np.einsum("ij,ij->i", e, e)
    t = np.einsum("nmj,mj->nm", points[:, None] - a[None], e) / np.where(length > 0, length, 1.0)
    return a[None] + np.clip(t, 0.0, 1.0)[..., None] * e[None]


def closest_distances(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n, m) distance of each point to each triangle: the least of its sides and, above the face, its plane."""
    a, b, c = np.moveaxis(corners, 1, 0)
    best = np.full((len(points), len(corners)), np.inf)
    for x, y in ((a, b), (b, c), (c, a)):
        best = np.minimum(best, np.linalg.norm(points[:, None] - on_segments(points, x, y), axis=2))
    n = np.cross(b - a, c - a)
    area = np.linalg.norm(n, axis=1)
    n = n / np.where(area > 0, area, 1.0)[:, None]
    height = np.einsum("nmj,mj->nm", points[:, None] - a[None], n)
    foot = points[:, None] - height[..., None] * n[None]
    above = np.broadcast_to(area > 0, height.shape).copy()
    for x, y in ((a, b), (b, c), (c, a)):
        above &= np.einsum("nmj,mj->nm", np.cross((y - x)[None], foot - x[None]), n) >= 0
    return np.where(above, np.minimum(best, np.abs(height)), best)


def solid_angle_winding(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n,) generalised winding number, every triangle's solid angle (van Oosterom & Strackee 1983)."""
    total = np.zeros(len(points))
    for a, b, c in corners:
        x, y, z = a - points, b - points, c - points
        lx, ly, lz = (np.linalg.norm(v, axis=1) for v in (x, y, z))
        volume = np.einsum("ij,ij->i", x, np.cross(y, z))
        across = lx * ly * lz + lz * (x * y).sum(1) + lx * (y * z).sum(1) + ly * (z * x).sum(1)
        total += 2.0 * np.arctan2(volume, across)
    return total / (4.0 * np.pi)


def _clip(polygon: list[Rational], a: Rational, inward: Rational) -> list[Rational]:
    """The part of a convex polygon on the inner side of the plane through a."""
    side = [dot(minus(p, a), inward) for p in polygon]
    kept = []
    for (p, s), (q, t) in pairwise([*zip(polygon, side, strict=True), (polygon[0], side[0])]):
        if s >= 0:
            kept.append(p)
        if (s > 0 > t) or (s < 0 < t):
            kept.append(along(p, q, s / (s - t)))
    return kept


def common_part(p: np.ndarray, q: np.ndarray) -> list[Rational]:
    """Exactly: the corners of what two triangles with area have in common (a point, a stretch or a polygon)."""
    first = [rational(x) for x in p]
    a, b, c = (rational(x) for x in q)
    n = cross(minus(b, a), minus(c, a))
    part = first
    for inward in (n, tuple(-x for x in n)):  # onto q's plane
        part = _clip(part, a, inward) if part else part
    for x, y in ((a, b), (b, c), (c, a)):  # within q's sides
        part = _clip(part, x, cross(n, minus(y, x))) if part else part
    return list(dict.fromkeys(part))


def crosses(p: np.ndarray, q: np.ndarray) -> bool:
    """Exactly: the intersection is a stretch or area and its middle is not on the border of both."""
    part = common_part(p, q)
    if len(part) < 2:
        return False
    middle = tuple(sum(x, Fraction(0)) / len(part) for x in zip(*part, strict=True))

    def inside(triangle: np.ndarray) -> bool:
        a, b, c = (rational(x) for x in triangle)
        n = cross(minus(b, a), minus(c, a))
        return all(dot(n, cross(minus(y, x), minus(middle, x))) > 0 for x, y in ((a, b), (b, c), (c, a)))

    spread = cross(minus(part[1], part[0]), minus(part[-1], part[0]))
    return any(spread) or inside(p) or inside(q)


def icosphere(level: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices on the unit sphere and outward triangles: the octahedron split `level` times."""
    vertices = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    points = [np.array(v, dtype=float) for v in vertices]
    triangles = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    for _ in range(level):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, middles: dict[tuple[int, int], int] = middles) -> int:
            key = (min(a, b), max(a, b))
            if key not in middles:
                point = points[a] + points[b]
                points.append(point / np.linalg.norm(point))
                middles[key] = len(points) - 1
            return middles[key]

        split = []
        for a, b, c in triangles:
            d, e, f = middle(a, b), middle(b, c), middle(c, a)
            split += [(a, d, f), (d, b, e), (f, e, c), (d, e, f)]
        triangles = split
    return np.array(points), np.array(triangles)


def noisy_torus(n: int, m: int, noise: float = 0.0, shift=(0.0, 0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and 2 n m outward triangles of a torus with radii 10 and 3, its vertices jittered by `noise`."""
    i, j = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    u, v = 2 * np.pi * i / n, 2 * np.pi * j / m
    vertices = np.stack([(10 + 3 * np.cos(v)) * np.cos(u), (10 + 3 * np.cos(v)) * np.sin(u), 3 * np.sin(v)], 1)
    vertices = vertices + np.random.default_rng(0).normal(size=vertices.shape) * noise + np.asarray(shift)
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    return vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
