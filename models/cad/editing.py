"""Edits of a topology that give a new one: other loops, edges without faces dropped, coincident corners made one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.topology import EdgeUse, Topology

Loops = tuple[tuple[EdgeUse, ...], ...]


def with_loops(topology: Topology, changed: dict[int, Loops]) -> Topology:
    """The topology with other loops for some faces."""
    loops = tuple(changed.get(face, own) for face, own in enumerate(topology.loops))
    return replace(topology, loops=loops)


def with_edges(topology: Topology, curves: list[NurbsCurve], ends: list[tuple[Array, Array]]) -> Topology:
    """The topology with further edges, each between two corners of its own (`welded` makes equal ones one)."""
    if not curves:
        return topology
    first = len(topology.vertices)
    fresh = np.arange(first, first + 2 * len(curves)).reshape(-1, 2)
    return replace(
        topology,
        vertices=np.concatenate([topology.vertices, np.array(ends).reshape(-1, 3)]),
        curves=(*topology.curves, *curves),
        ends=np.concatenate([topology.ends, fresh]),
    )


def with_cut(topology: Topology, edge: int, t: float) -> tuple[Topology, tuple[int, int]]:
    """The topology with an edge cut in two at a parameter, and its parts' numbers; the old edge has no use left."""
    curve, corner, first = topology.curves[edge], len(topology.vertices), len(topology.curves)
    t0, t1 = curve.domain
    a, b = topology.ends[edge].tolist()
    loops = []
    for own in topology.loops:
        rows = []
        for loop in own:
            row: list[EdgeUse] = []
            for use in loop:
                if use.edge != edge:
                    row.append(use)
                    continue
                parts = [
                    EdgeUse(first, use.reversed, use.pcurve.restricted(t0, t)),
                    EdgeUse(first + 1, use.reversed, use.pcurve.restricted(t, t1)),
                ]
                row += parts[::-1] if use.reversed else parts
            rows.append(tuple(row))
        loops.append(tuple(rows))
    cut = replace(
        topology,
        vertices=np.concatenate([topology.vertices, curve(np.array([t]))]),
        curves=(*topology.curves, curve.restricted(t0, t), curve.restricted(t, t1)),
        ends=np.concatenate([topology.ends, [[a, corner], [corner, b]]]),
        loops=tuple(loops),
    )
    return cut, (first, first + 1)


def welded(topology: Topology, distance: float) -> Topology:
    """Corners within the distance are one; which of them stays is the one with the lowest number.

    Chains of near corners are not followed: every corner goes to the first one near it, so that nothing moves farther.
    """
    from scipy.spatial import cKDTree

    to = np.arange(len(topology.vertices))
    if len(to):
        for i, j in sorted(cKDTree(topology.vertices).query_pairs(distance)):
            if to[i] == i and to[j] == j:
                to[j] = i
    return replace(topology, ends=to[topology.ends])


def compacted(topology: Topology) -> Topology:
    """The topology without edges that no face uses and without corners that no edge has."""
    used = np.unique([use.edge for loops in topology.loops for loop in loops for use in loop]).astype(np.int64)
    place = np.full(len(topology.curves), -1)
    place[used] = np.arange(len(used))
    ends = topology.ends[used]
    corners = np.unique(ends)
    at = np.zeros(len(topology.vertices), dtype=np.int64)
    at[corners] = np.arange(len(corners))
    loops = tuple(
        tuple(tuple(replace(use, edge=int(place[use.edge])) for use in loop) for loop in own) for own in topology.loops
    )
    curves = tuple(topology.curves[int(i)] for i in used)
    return Topology(topology.vertices[corners], curves, at[ends], loops, topology.flipped)


def in_chains(uses: list[EdgeUse], ends: IntArray) -> list[list[EdgeUse]] | None:
    """The uses head to tail in closed chains; None where some do not close or a corner leads two ways."""
    after: dict[int, EdgeUse] = {}
    for use in uses:
        tail = int(ends[use.edge][1 if use.reversed else 0])
        if tail in after:
            return None
        after[tail] = use
    chains = []
    while after:
        start, use = after.popitem()
        chain, at = [use], int(ends[use.edge][0 if use.reversed else 1])
        while at != start:
            step = after.pop(at, None)
            if step is None:
                return None
            chain.append(step)
            at = int(ends[step.edge][0 if step.reversed else 1])
        chains.append(chain)
    return chains
