"""Dirty triangulations with known truth: how the undamaged shape looked is part of the value."""

from __future__ import annotations

import numpy as np
import trimesh

from patchwright.models import Triangulation


def of(mesh: trimesh.Trimesh) -> Triangulation:
    return Triangulation(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def sphere(subdivisions: int = 3, radius: float = 1.0, at: tuple[float, float, float] = (0, 0, 0)) -> Triangulation:
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    mesh.apply_translation(at)
    return of(mesh)


def box(extents: tuple[float, float, float] = (1, 1, 1), at: tuple[float, float, float] = (0, 0, 0)) -> Triangulation:
    mesh = trimesh.creation.box(extents=extents).subdivide().subdivide()
    mesh.apply_translation(at)
    return of(mesh)


def together(*parts: Triangulation) -> Triangulation:
    offsets = np.cumsum([0] + [len(p.vertices) for p in parts])
    return Triangulation(
        np.concatenate([p.vertices for p in parts]),
        np.concatenate([p.triangles + o for p, o in zip(parts, offsets[:-1], strict=True)]),
        tags=np.concatenate([np.full(len(p), k) for k, p in enumerate(parts)]),
        tag_names=tuple(f"part{k}" for k in range(len(parts))),
    )


def soup(triangulation: Triangulation, jitter: float = 0.0, seed: int = 0) -> Triangulation:
    """Every triangle with corners of its own, each moved by a random vector of length up to `jitter`."""
    rng = np.random.default_rng(seed)
    points = triangulation.corners.reshape(-1, 3).copy()
    way = rng.normal(size=points.shape)
    way *= jitter * rng.random((len(points), 1)) / np.linalg.norm(way, axis=1, keepdims=True)
    return Triangulation(
        points + way,
        np.arange(len(points)).reshape(-1, 3),
        tags=triangulation.tags,
        tag_names=triangulation.tag_names,
    )


def half(sign: int, shift: float, n: int = 48) -> Triangulation:
    """A hemisphere, open at its equator, moved along z."""
    u = np.linspace(0, 2 * np.pi, n, endpoint=False)
    v = np.linspace(0, np.pi / 2, n // 4 + 1)[1:]
    rings = np.stack(
        [np.sin(v)[:, None] * np.cos(u), np.sin(v)[:, None] * np.sin(u), sign * np.cos(v)[:, None] + 0 * u], axis=2
    )
    points = np.concatenate([[[0.0, 0.0, sign]], rings.reshape(-1, 3)]) + np.array([0.0, 0.0, shift])
    i = np.arange(n)
    j = np.roll(i, -1)
    rows = [np.stack([0 * i, 1 + i, 1 + j], axis=1)]
    for k in range(len(v) - 1):
        a, b = 1 + k * n, 1 + (k + 1) * n
        rows += [np.stack([a + i, b + i, b + j], axis=1), np.stack([a + i, b + j, a + j], axis=1)]
    triangles = np.concatenate(rows)
    return Triangulation(points, triangles if sign > 0 else triangles[:, ::-1])


def edge_uses(triangulation: Triangulation) -> np.ndarray:
    """How many triangles use each edge, counted by definition."""
    t = triangulation.triangles
    edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    return np.unique(edges, axis=0, return_counts=True)[1]


def directed_uses(triangulation: Triangulation) -> np.ndarray:
    """How often each directed edge is run: once each in a consistently oriented 2-manifold."""
    t = triangulation.triangles
    edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    return np.unique(edges, axis=0, return_counts=True)[1]


def is_closed_manifold(triangulation: Triangulation) -> bool:
    """Two triangles per edge, running it both ways, and one fan per vertex."""
    if not (edge_uses(triangulation) == 2).all() or not (directed_uses(triangulation) == 1).all():
        return False
    # around a vertex, each triangle leads from one neighbour to the next: all of them must be one cycle
    around: dict[int, dict[int, int]] = {}
    for a, b, c in triangulation.triangles.tolist():
        for vertex, here, there in ((a, b, c), (b, c, a), (c, a, b)):
            around.setdefault(vertex, {})[here] = there
    for ring in around.values():
        start = next(iter(ring))
        at, steps = ring[start], 1
        while at != start:
            at, steps = ring[at], steps + 1
        if steps != len(ring):
            return False
    return True
