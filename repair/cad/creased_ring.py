"""A ring that lies in two planes, filled by both of them: they meet in the straight line between two of its corners.

So a ring looks where two plane faces are missing side by side, or where a file stops at two planes of symmetry. That
chains of the ring are plane is evidence only where nothing forces them to be: any two straight edges are. Both planes
are trimmed by the ring's own edges and by the line, so nothing is fitted and the result is exact.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.topology import Topology
from patchwright.repair.cad.draft import Limits
from patchwright.repair.cad.loop_shape import simple
from patchwright.repair.cad.ring_patch import newell, plane_of, points_along
from patchwright.repair.cad.ring_sides import Normals, Steps
from patchwright.repair.cad.split_ring import SplitRing

MOST = 64  # edges of a ring that is looked at
SQUARE = 1e-3  # sine of the angle between two planes that are one


def creased_ring(topology: Topology, ring: Steps, normals: Normals, limits: Limits) -> SplitRing | str:
    """Two planes that fill one ring, counter-clockwise as seen from outside; a sentence where none do."""
    count = len(ring)
    if not 4 <= count <= MOST:
        return f"its ring has {count} edges, too few or too many to be looked through for two planes"
    points = [points_along(topology, step) for step in ring]
    best: tuple[float, int, int] | None = None
    for i in range(count):
        for j in range(i + 1, count):
            chains = [points[k] for k in range(i, j)], [points[k % count] for k in range(j, i + count)]
            off = [_off_plane(chain, _first(points, end)) for chain, end in zip(chains, (j, i), strict=True)]
            if max(off) <= limits.on and (best is None or max(off) < best[0]):
                best = max(off), i, j
    if best is None:
        return "it does not lie in two planes"
    _, i, j = best
    chord = np.stack([points[i][0], points[j][0]])
    wider = replace(
        topology,
        curves=(*topology.curves, NurbsCurve(1, np.array([0.0, 0.0, 1.0, 1.0]), chord)),
        ends=np.concatenate([topology.ends, [[_start(topology, ring[i]), _start(topology, ring[j])]]]),
    )
    line = len(topology.curves)
    patches = []
    for steps in ((*ring[i:j], (line, True)), (*ring[j:], *ring[:i], (line, False))):
        patch = plane_of(wider, (steps,), normals, limits)
        if patch is None or not simple(patch.loops):
            return "the line between two planes that it lies in leaves one of them"
        patches.append(replace(patch, how=f"one of two planes that meet in a line, each {patch.how}"))
    return SplitRing(wider, tuple(patches))


def _first(points: list[Array], k: int) -> Array:
    return points[k % len(points)][:1]


def _start(topology: Topology, step: tuple[int, bool]) -> int:
    """The vertex where the ring enters an edge."""
    return int(topology.ends[step[0]][1 if step[1] else 0])


def _off_plane(chain: list[Array], last: Array) -> float:
    """How far a chain of edges is from its plane; infinite where it is plane whatever the model."""
    every = np.concatenate([*chain, last])
    bent = len(chain) >= 3 or any(_bent(np.concatenate([edge, end])) for edge, end in _with_ends(chain, last))
    if not bent:
        return np.inf
    local = every - every.mean(axis=0)
    extent = np.linalg.svd(local, compute_uv=False)
    area = newell(every)
    if extent[1] <= SQUARE * extent[0] or np.linalg.norm(area) <= SQUARE * extent[0] ** 2 / len(every):
        return np.inf
    normal = np.linalg.svd(local, full_matrices=False)[2][2]
    return float(np.abs(local @ normal).max())


def _with_ends(chain: list[Array], last: Array) -> list[tuple[Array, Array]]:
    return list(zip(chain, [*(edge[:1] for edge in chain[1:]), last], strict=True))


def _bent(edge: Array) -> bool:
    """Whether an edge is no straight line."""
    extent = np.linalg.svd(edge - edge.mean(axis=0), compute_uv=False)
    return bool(extent[1] > SQUARE * extent[0])
