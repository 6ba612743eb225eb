"""Shared edges whose two surfaces do not meet, taken apart: each face gets its own border, where its surface really is.

A file may call an edge shared although its faces are apart, and hide the gap in the edge's tolerance. The pcurves say
where each face ends; lifted onto the surfaces they are free edges, which the rungs above sewing then bring together.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad.connectivity import is_point
from patchwright.models.cad.editing import compacted, welded, with_edges, with_loops
from patchwright.models.cad.seams import measure_seams
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.repair.cad.draft import Draft, Limits
from patchwright.repair.cad.pcurves import fitted


def opened(draft: Draft, limits: Limits) -> tuple[Draft, int, float]:
    """The draft with every loose edge taken apart, their number, and the widest gap of the seams that stay.

    A seam wider than a closed one but within `limits.loose` is the file's own precision: it is left as it came.
    """
    topology = draft.topology
    seams = measure_seams(replace(draft.assembly, topology=topology, native=None))
    loose = {s.edge for s in seams if s.gap > limits.loose and not is_point(topology.curves[s.edge])}
    widest = max((s.gap for s in seams if s.edge not in loose), default=0.0)
    if not loose:
        return draft, 0, widest
    curves: list[NurbsCurve] = []
    ends: list[tuple[Array, Array]] = []
    changed = {}
    for face, loops in enumerate(topology.loops):
        surface, rows = draft.surface(face), []
        for loop in loops:
            row = []
            for use in loop:
                if use.edge in loose:
                    lifted = _lifted(surface, use.pcurve, limits)
                    t = np.linspace(*lifted.domain, 33)
                    if np.linalg.norm(lifted(t) - topology.curves[use.edge](t), axis=1).max() > limits.on:
                        use = replace(use, edge=len(topology.curves) + len(curves))
                        curves.append(lifted)
                        ends.append((lifted.control_points[0], lifted.control_points[-1]))
                row.append(use)
            rows.append(tuple(row))
        changed[face] = tuple(rows)
    wider = with_loops(with_edges(topology, curves, ends), changed)
    return replace(draft, topology=compacted(welded(wider, 2.0 * limits.on))), len(loose), widest


def _lifted(surface: Surface, pcurve: NurbsCurve, limits: Limits) -> NurbsCurve:
    """The curve S(pcurve(t)) in space."""
    low, high = np.array(surface.domain).T

    def place(t: Array) -> Array:
        u, v = np.clip(pcurve(t), low, high).T
        return surface(u, v)

    return fitted(place, pcurve, limits.fit)
