"""Triangulated shapes with known features for the tests of layouts."""

from __future__ import annotations

import numpy as np

from patchwright.models import Triangulation


def soup(corners, decimals=9):
    """Triangles (m, 3, 3) with equal corners made one, degenerate ones left out."""
    corners = np.asarray(corners, dtype=np.float64)
    _, first, index = np.unique(
        np.round(corners.reshape(-1, 3), decimals) + 0.0, axis=0, return_index=True, return_inverse=True
    )
    triangles = index.reshape(-1, 3)
    keep = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return Triangulation(corners.reshape(-1, 3)[first], triangles[keep])


def sheet(points):
    """Triangles (m, 3, 3) of a grid (n, k, 3), normals along u x v."""
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.concatenate(
        [np.stack([a, b, c], axis=2).reshape(-1, 3, 3), np.stack([a, c, d], axis=2).reshape(-1, 3, 3)]
    )


def prism(outline, height, intervals=1):
    """A closed prism over a convex outline (k, 2), counter-clockwise; `intervals` per side and over the height."""
    outline = np.asarray(outline, dtype=np.float64)
    t = np.arange(intervals) / intervals
    ring = np.concatenate(
        [a + t[:, None] * (b - a) for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True)]
    )
    ring = np.concatenate([ring, ring[:1]])
    middle = outline.mean(axis=0)
    s = np.linspace(0.0, 1.0, intervals + 1)
    radial = middle + s[:, None, None] * (ring - middle)
    z = np.linspace(0.0, height, intervals + 1)

    def lift(plane, level):
        return np.concatenate([plane, np.full((*plane.shape[:-1], 1), level)], axis=-1)

    side = np.stack([lift(ring, level) for level in z], axis=1)
    return soup(np.concatenate([sheet(side), sheet(lift(radial, height)), sheet(lift(radial[:, ::-1], 0.0))]))


def cube(intervals=1):
    """The unit cube, `intervals` squares of two triangles along each edge."""
    t = np.linspace(0.0, 1.0, intervals + 1)
    u, v = np.meshgrid(t, t, indexing="ij")
    one, zero = np.ones_like(u), np.zeros_like(u)
    faces = [(u, v, one), (v, u, zero), (one, u, v), (zero, v, u), (v, one, u), (u, zero, v)]
    return soup(np.concatenate([sheet(np.stack(f, axis=-1)) for f in faces]))


def wedge(intervals=6):
    """A wedge of chord 1 whose blunt trailing edge is 2 % thick."""
    return prism([[0.0, -0.5], [1.0, -0.01], [1.0, 0.01], [0.0, 0.5]], 2.0, intervals)


def cylinder(sections=48, intervals=12):
    angle = 2.0 * np.pi * np.arange(sections) / sections
    t = np.linspace(0.0, 1.0, intervals + 1)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ring = np.concatenate([ring, ring[:1]])

    def lift(plane, level):
        return np.concatenate([plane, np.full((*plane.shape[:-1], 1), level)], axis=-1)

    side = np.stack([lift(ring, 2.0 * level) for level in t], axis=1)
    radial = t[:, None, None] * ring
    return soup(np.concatenate([sheet(side), sheet(lift(radial, 2.0)), sheet(lift(radial[:, ::-1], 0.0))]))


def sphere(n=24):
    """A unit sphere from six square faces."""
    t = np.tan(np.linspace(-np.pi / 4, np.pi / 4, n + 1))
    u, v = np.meshgrid(t, t, indexing="ij")
    one = np.ones_like(u)
    faces = [(u, v, one), (v, u, -one), (one, u, v), (-one, v, u), (v, one, u), (u, -one, v)]
    points = [np.stack(f, axis=-1) / np.linalg.norm(np.stack(f, axis=-1), axis=-1, keepdims=True) for f in faces]
    return soup(np.concatenate([sheet(p) for p in points]))


def torus(major=1.0, minor=0.35, n=64, k=32):
    u, v = np.meshgrid(2 * np.pi * np.arange(n + 1) / n, 2 * np.pi * np.arange(k + 1) / k, indexing="ij")
    r = major + minor * np.cos(v)
    return soup(sheet(np.stack([r * np.cos(u), r * np.sin(u), minor * np.sin(v)], axis=-1)))


def plate_with_hole(n=16, k=8, radius=0.4):
    """The square [-1, 1]^2 with a round hole, n triangles sides per quarter, flat and open."""
    angle = np.linspace(0.0, 2.0 * np.pi, 4 * n + 1) + np.pi / 4
    hole = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    square = hole / np.abs(hole).max(axis=1, keepdims=True)
    t = np.linspace(0.0, 1.0, k + 1)[:, None, None]
    grid = (1 - t) * hole + t * square
    return soup(sheet(np.concatenate([grid, np.zeros((*grid.shape[:2], 1))], axis=-1)))


def jittered(shape, scatter, seed=1):
    rng = np.random.default_rng(seed)
    return Triangulation(shape.vertices + scatter * rng.normal(size=shape.vertices.shape), shape.triangles)


def moved(shape, scale=1.0, seed=3):
    """The shape turned, scaled and shifted; the map as a function too."""
    rng = np.random.default_rng(seed)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    shift = scale * rng.normal(size=3)

    def there(points):
        return scale * points @ q.T + shift

    return Triangulation(there(shape.vertices), shape.triangles), there
