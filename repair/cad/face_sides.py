"""Faces that share edges turned to one side: one face runs along each shared edge one way, its neighbour the other.

Of each connected piece the fewer faces are turned. A piece that no turning makes one-sided (a Moebius strip) stays.
"""

from __future__ import annotations

from dataclasses import replace

from patchwright.models.topology import Topology


def one_sided(topology: Topology) -> Topology:
    """The topology with `flipped` changed for the faces that look the other way."""
    runs: dict[int, list[tuple[int, bool]]] = {}
    for face, loops in enumerate(topology.loops):
        for loop in loops:
            for use in loop:
                runs.setdefault(use.edge, []).append((face, use.reversed != topology.flipped[face]))
    beside: list[list[tuple[int, bool]]] = [[] for _ in topology.loops]
    for some in runs.values():
        if len(some) == 2 and some[0][0] != some[1][0]:
            (a, one), (b, two) = some
            beside[a].append((b, one == two))
            beside[b].append((a, one == two))
    turned: dict[int, bool] = {}
    flipped = list(topology.flipped)
    for start in range(len(topology.loops)):
        if start in turned:
            continue
        turned[start] = False
        piece = [start]
        sound = True
        for face in piece:
            for other, against in beside[face]:
                wanted = turned[face] != against
                if other not in turned:
                    turned[other] = wanted
                    piece.append(other)
                sound = sound and turned[other] == wanted
        most = 2 * sum(turned[face] for face in piece) > len(piece)
        if sound:
            for face in piece:
                flipped[face] = flipped[face] != (turned[face] != most)
    return replace(topology, flipped=tuple(flipped))
