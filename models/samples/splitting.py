"""Injectors that split single triangles badly: T-junctions, needles, triangles without area."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.samples.defects import Damaged, Injected, drawn
from patchwright.models.triangulation import Triangulation


def t_junctions(triangulation: Triangulation, share: float = 0.01, *, offset: float = 0.0, seed: int = 0) -> Damaged:
    """Split a random share of the triangles in two across an edge, their neighbours not; a "t-junction" each.

    Parameters
    ----------
    offset : how far the new vertex lies off the edge along the triangle's normal (length); 0 puts it on the edge
    """
    chosen = drawn(triangulation, share, seed)
    a, b, _ = np.moveaxis(triangulation.corners[chosen], 1, 0)
    new = 0.5 * (a + b) + offset * triangulation.normals[chosen]
    out, origin, added = _split(triangulation, chosen, new, 0.5)
    labels = [
        Injected.of("t-junction", new[i : i + 1], size=float(np.linalg.norm(b[i] - a[i])), triangles=t)
        for i, t in enumerate(added)
    ]
    return Damaged(out, tuple(labels), origin)


def needles(triangulation: Triangulation, share: float = 0.01, *, aspect: float = 1e4, seed: int = 0) -> Damaged:
    """Split a random share of the triangles close to a corner, so that one piece is a needle; a "needle" each.

    The needle's longest edge is about `aspect` times its shortest. The neighbour across the split edge is not split.
    """
    if aspect <= 2.0:
        raise ParameterError(f"a needle's aspect must be above 2, got {aspect:g}")
    return _sliver(triangulation, share, aspect, "needle", seed)


def degenerate(triangulation: Triangulation, share: float = 0.01, *, seed: int = 0) -> Damaged:
    """Put a triangle without area on an edge of a random share of the triangles; a "degenerate-face" each.

    The added triangle runs from the edge's start to its end and back to its middle, a vertex of its own.
    """
    chosen = drawn(triangulation, share, seed)
    start, end = triangulation.triangles[chosen, 0], triangulation.triangles[chosen, 1]
    middle = 0.5 * (triangulation.vertices[start] + triangulation.vertices[end])
    m, n = len(triangulation), len(triangulation.vertices)
    extra = np.stack([start, end, n + np.arange(len(chosen))], axis=1)
    origin = np.concatenate([np.arange(m), chosen])
    base = triangulation.take(origin)
    uv = None
    if base.uv is not None:
        uv = base.uv.copy()
        uv[m:, 2] = 0.5 * (uv[m:, 0] + uv[m:, 1])
    out = replace(
        base,
        vertices=np.concatenate([triangulation.vertices, middle]),
        triangles=np.concatenate([triangulation.triangles, extra]),
        uv=uv,
    )
    labels = [Injected.of("degenerate-face", out.corners[m + k], triangles=[m + k]) for k in range(len(chosen))]
    return Damaged(out, tuple(labels), np.concatenate([np.arange(m), np.full(len(chosen), -1)]))


def _sliver(triangulation: Triangulation, share: float, aspect: float, kind: str, seed: int) -> Damaged:
    chosen = drawn(triangulation, share, seed)
    a, b, c = np.moveaxis(triangulation.corners[chosen], 1, 0)
    t = np.minimum(0.5, np.linalg.norm(c - a, axis=1) / (aspect * np.linalg.norm(b - a, axis=1)))
    out, origin, added = _split(triangulation, chosen, a + t[:, None] * (b - a), t)
    corners, areas = out.corners, out.areas
    labels = [Injected.of(kind, corners[t[0]], area=areas[t[0]], triangles=t[:1]) for t in added]
    return Damaged(out, tuple(labels), origin)


def _split(
    triangulation: Triangulation, chosen: IntArray, new: Array, t: float | Array
) -> tuple[Triangulation, IntArray, IntArray]:
    """Triangles (a, b, c) become (a, x, c) in place and (x, b, c) at the end, x at the share t of a-b; (k, 2) both."""
    m, n = len(triangulation), len(triangulation.vertices)
    x = n + np.arange(len(chosen))
    a, b, c = triangulation.triangles[chosen].T
    triangles = np.concatenate([triangulation.triangles, np.stack([x, b, c], axis=1)])
    triangles[chosen] = np.stack([a, x, c], axis=1)
    origin = np.concatenate([np.arange(m), chosen])
    uv = None
    if triangulation.uv is not None:
        uv = triangulation.uv[origin]
        share = np.broadcast_to(np.asarray(t, dtype=np.float64), (len(chosen),))[:, None]
        middle = (1.0 - share) * triangulation.uv[chosen, 0] + share * triangulation.uv[chosen, 1]
        uv[chosen, 1] = middle
        uv[m:, 0] = middle
    tags = None if triangulation.tags is None else triangulation.tags[origin]
    vertices = np.concatenate([triangulation.vertices, new])
    out = replace(triangulation, vertices=vertices, triangles=triangles, uv=uv, tags=tags)
    return out, origin, np.stack([chosen, m + np.arange(len(chosen))], axis=1)
