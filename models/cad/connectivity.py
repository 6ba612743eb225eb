"""Which faces of a topology hang together, and which groups of them are closed."""

from __future__ import annotations

from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.topology import Topology


def components(topology: Topology) -> list[list[int]]:
    """Faces connected through edges, in order of their first face."""
    parent = list(range(len(topology.loops)))

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    first: dict[int, int] = {}
    for face, loops in enumerate(topology.loops):
        for loop in loops:
            for use in loop:
                other = first.setdefault(use.edge, face)
                a, b = sorted((root(face), root(other)))
                parent[b] = a
    groups: dict[int, list[int]] = {}
    for face in range(len(parent)):
        groups.setdefault(root(face), []).append(face)
    return list(groups.values())


def is_closed(topology: Topology, faces: list[int]) -> bool:
    """Whether every edge of the faces (poles aside) is run exactly once each way."""
    runs: dict[int, list[bool]] = {}
    for face in faces:
        if not topology.loops[face]:
            return False
        for loop in topology.loops[face]:
            for use in loop:
                if not is_point(topology.curves[use.edge]):
                    runs.setdefault(use.edge, []).append(use.reversed != topology.flipped[face])
    return all(len(run) == 2 and run[0] != run[1] for run in runs.values())


def is_point(curve: NurbsCurve) -> bool:
    """Whether a curve stays at one point, as the edge at a pole does."""
    return bool((curve.control_points == curve.control_points[0]).all())
