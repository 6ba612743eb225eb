"""Loops of a face in its surface's parameters: in step across periods, in order, and whether they cross themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from patchwright.models import Cone, Cylinder, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.models.knots import divided
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse

CHORDS = 64  # per edge
SHORTEST = 1e-9  # of the loops' box: a shorter chord is a point
SMALLEST = 1e-12  # of the loops' box: a smaller turn is round-off, and the chords touch


def in_step(surface: Surface, chain: list[EdgeUse]) -> list[EdgeUse]:
    """The uses with their pcurves a whole turn on where that makes each start where the last ends."""
    periods = np.array(
        [
            2.0 * np.pi if isinstance(surface, Cylinder | Cone | Sphere | Torus) else 0.0,
            2.0 * np.pi if isinstance(surface, Torus) else 0.0,
        ]
    )
    if not periods.any():
        return chain
    out, at = [], None
    for use in chain:
        points = use.pcurve.control_points
        first, last = (points[-1], points[0]) if use.reversed else (points[0], points[-1])
        turn = np.zeros(2)
        if at is not None:
            turn = periods * np.round(np.divide(at - first, periods, out=np.zeros(2), where=periods > 0.0))
        if turn.any():
            pcurve = NurbsCurve(use.pcurve.degree, use.pcurve.knots, points + turn, use.pcurve.weights)
            use = replace(use, pcurve=pcurve)
        out.append(use)
        at = last + turn
    return out


def polygon(loop: Sequence[EdgeUse]) -> Array:
    """(k, 2) the loop in the surface's parameters, at most `CHORDS` chords per edge."""
    rows = []
    for use in loop:
        breaks = use.pcurve.breaks
        if len(breaks) > CHORDS:
            breaks = breaks[np.unique(np.linspace(0, len(breaks) - 1, CHORDS // 2 + 1).astype(np.int64))]
        uv = use.pcurve(divided(breaks, max(2, 16 // (len(breaks) - 1))))
        rows.append((uv[::-1] if use.reversed else uv)[:-1])
    return np.concatenate(rows)


def signed_area(corners: Array) -> float:
    """The area a polygon (k, 2) encloses, positive where it runs counter-clockwise."""
    x, y = (corners - corners[0]).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def outer_first(loops: list[list[EdgeUse]]) -> tuple[tuple[EdgeUse, ...], ...] | None:
    """The loops with the one that encloses the most in front; None unless it alone runs counter-clockwise."""
    areas = [signed_area(polygon(loop)) for loop in loops]
    order = sorted(range(len(loops)), key=lambda i: -areas[i])
    if areas[order[0]] <= 0.0 or any(areas[i] >= 0.0 for i in order[1:]):
        return None
    return tuple(tuple(loops[i]) for i in order)


def simple(loops: Sequence[Sequence[EdgeUse]]) -> bool:
    """Whether no two chords of the face's loops cross in its parameters."""
    polygons = [polygon(loop) for loop in loops]
    a = np.concatenate(polygons)
    b = np.concatenate([np.roll(p, -1, axis=0) for p in polygons])
    scale = np.maximum(np.ptp(a, axis=0), np.finfo(float).tiny)
    a, b = a / scale, b / scale
    keep = np.linalg.norm(b - a, axis=1) > SHORTEST
    a, b = a[keep], b[keep]

    def turn(p: Array, q: Array, r: Array) -> Array:
        """Twice the area of the triangles p, q, r."""
        return np.asarray(
            (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])
        )

    one, two = (a[:, None], b[:, None]), (a[None], b[None])
    s1, s2 = turn(*one, two[0]), turn(*one, two[1])
    s3, s4 = turn(*two, one[0]), turn(*two, one[1])
    clear = np.minimum(np.minimum(np.abs(s1), np.abs(s2)), np.minimum(np.abs(s3), np.abs(s4))) > SMALLEST
    return not bool(((s1 * s2 < 0.0) & (s3 * s4 < 0.0) & clear).any())
