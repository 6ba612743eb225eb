"""Opposite edges of a regular vertex brought into one line.

Where four smooth edges meet and opposite ones leave in opposite directions, the patches round the vertex can be smooth
with one another whatever the curvatures of the edges are (`smooth_joins`); grid lines run through without a bend.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import BoolArray, IntArray
from patchwright.repair.edge_curves import EdgeCurves
from patchwright.repair.quad_layout import QuadLayout
from patchwright.repair.stars import corner_ends, leaving

MOST_BEND = 0.5  # cosine of 60 degrees: edges that bend more at a vertex are not one line


def next_ends(layout: QuadLayout, smooth: BoolArray) -> IntArray:
    """(2 e,) for each edge end, 2 edge + end, the next one counter-clockwise round its vertex; -1 where a crease is.

    -1 also at an end whose own edge is not smooth.
    """
    ahead, back, ahead_end, back_end = corner_ends(layout)
    both = smooth[ahead] & smooth[back]
    out = np.full(2 * len(layout.edges), -1, dtype=np.int64)
    out[(2 * ahead + ahead_end)[both]] = (2 * back + back_end)[both]
    return out


def opposite_ends(layout: QuadLayout, smooth: BoolArray) -> IntArray:
    """(2 e,) the edge end that leaves a regular vertex on the other side; -1 at all other vertices."""
    onward = np.append(next_ends(layout, smooth), -1)  # index -1 stays -1
    own = np.arange(len(onward) - 1)
    second = onward[onward[own]]
    fourth = onward[onward[second]]
    return np.where((fourth == own) & (second != own), second, -1)


def straighten(layout: QuadLayout, curves: EdgeCurves, smooth: BoolArray) -> tuple[EdgeCurves, BoolArray]:
    """The curves with the tangents of opposite edges in one line, and (2 e,) which ends are.

    Both tangents keep their lengths and turn by the same angle; those that bend by more than 60 degrees stay.
    """
    opposite = opposite_ends(layout, smooth)
    leg = leaving(curves).reshape(-1, 3)
    length = np.linalg.norm(leg, axis=1, keepdims=True)
    unit = np.divide(leg, length, out=np.zeros_like(leg), where=length > 0)
    other = unit[opposite]
    straight = (opposite >= 0) & ((unit * other).sum(axis=1) <= -MOST_BEND)
    line = unit - other
    line /= np.maximum(np.linalg.norm(line, axis=1, keepdims=True), np.finfo(float).tiny)
    controls = curves.controls.copy()
    ends = np.flatnonzero(straight)
    edge, end = ends // 2, ends % 2
    tip = np.where(end == 0, curves.offsets[edge], curves.offsets[edge + 1] - 1)
    controls[tip + np.where(end == 0, 1, -1)] = controls[tip] + (length * line)[ends]
    return EdgeCurves(curves.cells, curves.offsets, controls), straight


def bent_ends(layout: QuadLayout, smooth: BoolArray, straight: BoolArray) -> BoolArray:
    """(e, 2) ends of edges at inner vertices, all of whose edges are smooth, that are no crossing of two lines."""
    inner = np.ones(len(layout.vertices), dtype=bool)
    inner[layout.edges[~smooth]] = False
    crossed = np.ones(len(layout.vertices), dtype=bool)
    crossed[layout.edges[~straight.reshape(-1, 2)]] = False
    return np.asarray((inner & ~crossed)[layout.edges])
