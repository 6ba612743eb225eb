"""Injectors that drop, tear, turn or double whole triangles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.errors import ParameterError
from patchwright.models.samples.defects import Damaged, Injected, drawn, groups, removed
from patchwright.models.triangulation import Triangulation, concatenate


def missing_triangles(triangulation: Triangulation, share: float = 0.01, *, seed: int = 0) -> Damaged:
    """Drop a random share of the triangles; a "gap" per hole (dropped triangles joined by edges)."""
    return removed(triangulation, drawn(triangulation, share, seed))


def unmerged(triangulation: Triangulation, radius: float = 0.0, *, seed: int = 0) -> Damaged:
    """Give every triangle corners of its own, each moved by an even draw from a ball of the radius (length)."""
    if radius < 0.0:
        raise ParameterError(f"the jitter's radius must not be negative, got {radius:g}")
    corners = triangulation.corners.reshape(-1, 3)
    rng = np.random.default_rng(seed)
    move = rng.standard_normal(corners.shape)
    move *= radius * np.cbrt(rng.random((len(corners), 1))) / np.linalg.norm(move, axis=1, keepdims=True)
    torn = replace(triangulation, vertices=corners + move, triangles=np.arange(len(corners)).reshape(-1, 3))
    everything = np.arange(len(triangulation))
    label = Injected.of("open-edge", torn.bounds, size=radius, triangles=everything)
    return Damaged(torn, (label,), everything)


def flipped(triangulation: Triangulation, share: float = 0.01, *, seed: int = 0) -> Damaged:
    """Turn a random share of the triangles round; a "flipped" per group joined by edges."""
    chosen = drawn(triangulation, share, seed)
    triangles = triangulation.triangles.copy()
    triangles[chosen] = triangles[chosen][:, ::-1]
    uv = None
    if triangulation.uv is not None:
        uv = triangulation.uv.copy()
        uv[chosen] = uv[chosen][:, ::-1]
    areas, corners = triangulation.areas, triangulation.corners
    labels = [
        Injected.of("flipped", corners[g].reshape(-1, 3), area=areas[g].sum(), triangles=g)
        for g in groups(triangulation, chosen)
    ]
    return Damaged(replace(triangulation, triangles=triangles, uv=uv), tuple(labels), np.arange(len(triangles)))


def duplicated(triangulation: Triangulation, share: float = 0.01, *, seed: int = 0) -> Damaged:
    """Append a second copy of a random share of the triangles; a "duplicate-face" each."""
    chosen = drawn(triangulation, share, seed)
    m = len(triangulation)
    origin = np.concatenate([np.arange(m), chosen])
    areas, corners = triangulation.areas, triangulation.corners
    labels = [
        Injected.of("duplicate-face", corners[i], area=areas[i], triangles=[i, m + k]) for k, i in enumerate(chosen)
    ]
    return Damaged(triangulation.take(origin), tuple(labels), origin)


def debris(triangulation: Triangulation, extra: Triangulation, *, seed: int = 0) -> Damaged:
    """Add a loose piece that touches nothing; one "component" (`seed` is not used)."""
    m = len(triangulation)
    both = concatenate([triangulation, extra])
    added = np.arange(m, m + len(extra))
    label = Injected.of("component", both.corners[added].reshape(-1, 3), area=extra.areas.sum(), triangles=added)
    return Damaged(both, (label,), np.concatenate([np.arange(m), np.full(len(extra), -1)]))
