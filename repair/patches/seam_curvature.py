"""Jumps of curvature across the seams of a patch network.

Where two patches share a tangent plane and their boundary, only the normal curvature across the seam can differ; it
shows in reflections and in a pressure distribution.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.joins import edge_uses
from patchwright.repair.patches.patch_nets import PatchNets, evaluate
from patchwright.repair.patches.spline_space import uniform_collocation

SAMPLES = 9  # per edge, its ends left out


def curvature_jumps(layout: QuadLayout, nets: PatchNets) -> Array:
    """(e,) the largest difference of both patches' normal curvatures across each edge, 1 / length.

    Measured perpendicular to the edge in the tangent planes at `SAMPLES` inner parameters; zero on a boundary, and
    where a patch has no tangent plane.
    """
    across = side_curvatures(layout, nets).reshape(-1, SAMPLES)[edge_uses(layout)]
    return np.asarray(np.abs(across[:, 0] - across[:, 1]).max(axis=1))


def side_curvatures(layout: QuadLayout, nets: PatchNets) -> Array:
    """(m, 4, SAMPLES) normal curvatures across the sides, in the direction of the edges."""
    out = np.empty((len(nets), 4, SAMPLES))
    ends = np.array([0, -1])
    orders = ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    for (m, n), which, group in nets.groups():
        u = [uniform_collocation(m, SAMPLES + 2, order) for order in range(3)]
        v = [uniform_collocation(n, SAMPLES + 2, order) for order in range(3)]
        south_north = [evaluate(group, u[a][1:-1], v[b][ends]) for a, b in orders]
        west_east = [evaluate(group, u[a][ends], v[b][1:-1]) for a, b in orders]
        for k, (parts, along) in enumerate(
            (
                ([d[:, :, 0] for d in south_north], 0),
                ([d[:, 1] for d in west_east], 1),
                ([d[:, :, 1] for d in south_north], 0),
                ([d[:, 0] for d in west_east], 1),
            )
        ):
            out[which, k] = _across(*parts, along=along)
    backward = layout.edge_reversed != np.array([False, False, True, True])
    out[backward] = out[backward][:, ::-1]
    return out


def _across(su: Array, sv: Array, suu: Array, suv: Array, svv: Array, *, along: int) -> Array:
    """Normal curvatures perpendicular to u (`along` 0) or to v, from the derivatives (k, s, 3)."""
    normal = np.cross(su, sv)
    area = np.linalg.norm(normal, axis=-1)
    sound = area > 0.0
    safe = np.where(sound, area, 1.0)
    e, f, g = (su * su).sum(-1), (su * sv).sum(-1), (sv * sv).sum(-1)
    second = [(d * normal).sum(-1) / safe for d in (suu, suv, svv)]
    # across u runs f S_u - e S_v, across v g S_u - f S_v; their squares are e area^2 and g area^2
    a, b, size = (f, -e, e) if along == 0 else (g, -f, g)
    bend = a * a * second[0] + 2.0 * a * b * second[1] + b * b * second[2]
    return np.asarray(np.where(sound, bend / (np.where(sound, size, 1.0) * safe**2), 0.0))
