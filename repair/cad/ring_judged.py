"""What a surface through rings of edges is worth: how near it comes to them, and at what angle to the faces around."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.knots import divided
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.cad.ring_sides import Normals

RIM = 64  # parts an edge is divided into where a surface is fitted to it


@dataclass(frozen=True, slots=True, eq=False)
class RingPatch:
    """A surface, the rings' uses on it, how far they are from the edges, the mean angle to the surfaces around (nan
    where there are none), and what it is in words."""

    surface: Surface
    loops: tuple[tuple[EdgeUse, ...], ...]
    residual: float
    angle: float
    how: str


def judged(
    topology: Topology, surface: Surface, loops: tuple[tuple[EdgeUse, ...], ...], normals: Normals, how: str
) -> RingPatch:
    """The patch with its largest distance from the edges and its mean angle to the surfaces around."""
    worst, angles = 0.0, []
    low, high = np.array(surface.domain).T
    for loop in loops:
        for use in loop:
            curve = topology.curves[use.edge]
            t = divided(crowded(curve.breaks), 2)
            u, v = np.clip(use.pcurve(t), low, high).T
            worst = max(worst, float(np.linalg.norm(surface(u, v) - curve(t), axis=1).max()))
            beside = normals(use.edge, t)
            if beside is not None:
                normal = np.cross(surface(u, v, (1, 0)), surface(u, v, (0, 1)))
                length = np.linalg.norm(normal, axis=1)
                sound = length > 1e-9 * max(float(length.max()), np.finfo(float).tiny)
                cosine = np.einsum("ij,ij->i", normal[sound], beside[sound]) / length[sound]
                angles.append(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    return RingPatch(surface, loops, worst, float(np.concatenate(angles).mean()) if angles else float("nan"), how)


def crowded(breaks: Array) -> Array:
    """Parameters along an edge, closer together towards its ends, where a corner bends the surface most."""
    t0, t1 = float(breaks[0]), float(breaks[-1])
    even = np.linspace(0.0, np.pi, RIM + 1)
    return np.unique(np.concatenate([t0 + (t1 - t0) * 0.5 * (1.0 - np.cos(even)), breaks]))
