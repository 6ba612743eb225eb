"""Badly parametrized surfaces with known shapes, and the independent check of a reparametrization."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from patchwright.models import NurbsSurface
from patchwright.models.closest_point import closest_on_surface
from patchwright.models.knots import bezier_knots
from patchwright.models.samples import aircraft, uneven_knots


def crowded_bicubic() -> NurbsSurface:
    """One span, its control points crowded into corners and pulled aside."""
    x, y = np.array([0.0, 0.05, 0.15, 1.0]), np.array([0.0, 0.7, 0.9, 1.0])
    net = np.zeros((4, 4, 3))
    net[..., 0], net[..., 1] = x[:, None], y[None]
    net[1:3, 1:3, 2] = 0.4
    net[1, 2, 0] += 0.3
    net[2, 1, 1] -= 0.3
    net[0, 1, 1] -= 0.4
    return NurbsSurface((3, 3), (bezier_knots(3), bezier_knots(3)), net)


def clustered_wing() -> NurbsSurface:
    """A wing through clustered points on a uniform knot vector."""
    return uneven_knots(aircraft().surfaces["wing"]["upper"])


def octant() -> NurbsSurface:
    """An eighth of the unit sphere, exact; its north side is the pole."""
    arc, weight = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.array([1.0, np.sqrt(0.5), 1.0])
    net = np.stack(
        [
            arc[:, None, 0] * arc[None, :, 0],
            arc[:, None, 1] * arc[None, :, 0],
            np.broadcast_to(arc[None, :, 1], (3, 3)),
        ],
        axis=-1,
    )
    return NurbsSurface((2, 2), (bezier_knots(2), bezier_knots(2)), net, weight[:, None] * weight[None])


def size(surface: NurbsSurface) -> float:
    """The diagonal of the box round points of the surface."""
    (u0, u1), (v0, v1) = surface.domain
    points = surface.grid(np.linspace(u0, u1, 33), np.linspace(v0, v1, 33)).reshape(-1, 3)
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def distance(new: NurbsSurface, old: NurbsSurface, per_cell: int) -> float:
    """Largest distance of points of `new`, `per_cell` squared in a cell of its knots, from `old`, searched for."""
    s, t = (np.unique(np.concatenate([np.linspace(a, b, per_cell + 1) for a, b in pairwise(k)])) for k in new.breaks)
    return float(closest_on_surface(old, new.grid(s, t).reshape(-1, 3)).distance.max())


def normal_turns(new: NurbsSurface, count: int = 120) -> tuple[float, float]:
    """The least and the largest cosine between normals at neighbouring samples: a fold turns the normal round."""
    t = (np.arange(count) + 0.5) / count
    a, b = new.grid(t, t, (1, 0)), new.grid(t, t, (0, 1))
    cross = np.cross(a, b)
    unit = cross / np.linalg.norm(cross, axis=2, keepdims=True)
    along = (unit[1:] * unit[:-1]).sum(axis=2), (unit[:, 1:] * unit[:, :-1]).sum(axis=2)
    return float(min(x.min() for x in along)), float(max(x.max() for x in along))
