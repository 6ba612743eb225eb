"""Opposite edges of a regular vertex brought into one line.

Where four smooth edges meet and opposite ones leave in opposite directions, the patches round the vertex can be smooth
with one another whatever the curvatures of the edges are (`smooth_joins`); grid lines run through without a bend.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.edge_curves import EdgeCurves
from patchwright.repair.patches.leg_room import leg_room
from patchwright.repair.patches.stars import LEAST_CORNER, corner_angles, corner_ends, leaving

MOST_BEND = 0.5  # cosine of 60 degrees: edges that bend more at a vertex are not one line
ALLOWANCE = 0.1  # degrees by which a corner may miss what it should have


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


def straighten(
    layout: QuadLayout, curves: EdgeCurves, smooth: BoolArray, sectors: Array
) -> tuple[EdgeCurves, BoolArray]:
    """The curves with the tangents of opposite edges in one line, and (2 e,) which ends are.

    Parameters
    ----------
    sectors : (m, 4, 3) unit normals at the corners, zero at cusps

    Both tangents keep their lengths and share the turn evenly, or as far as `leg_room` lets each of them go. Left as
    they are: ends that bend by more than 60 degrees or have no room for the turn between them, and all ends at a vertex
    where a corner would be narrower than `LEAST_CORNER`, or nearer to 180 degrees than that, and worse than it was.
    """
    opposite = opposite_ends(layout, smooth)
    leg = leaving(curves).reshape(-1, 3)
    length = np.linalg.norm(leg, axis=1)
    unit = np.divide(leg, length[:, None], out=np.zeros_like(leg), where=length[:, None] > 0)
    onward = -unit[opposite]
    along = (unit * onward).sum(axis=1)
    aside = onward - along[:, None] * unit
    size = np.linalg.norm(aside, axis=1)
    bend = np.arctan2(size, along)
    sine = np.divide(leg_room(layout, curves).reshape(-1), length, out=np.ones_like(length), where=length > 0)
    most = np.arcsin(np.minimum(1.0, sine))
    straight = (opposite >= 0) & (along >= MOST_BEND) & (most + most[opposite] >= bend)
    turn = np.clip(0.5 * bend, np.minimum(bend - most[opposite], 0.5 * bend), most)[:, None]
    aside = np.divide(aside, size[:, None], out=np.zeros_like(aside), where=size[:, None] > 0)
    line = np.cos(turn) * unit + np.sin(turn) * aside
    straight &= ~_closed(layout, unit, np.where(straight[:, None], line, unit), sectors)
    controls = curves.controls.copy()
    ends = np.flatnonzero(straight)
    edge, end = ends // 2, ends % 2
    tip = np.where(end == 0, curves.offsets[edge], curves.offsets[edge + 1] - 1)
    controls[tip + np.where(end == 0, 1, -1)] = controls[tip] + (length[:, None] * line)[ends]
    return EdgeCurves(curves.cells, curves.offsets, controls), straight


def _closed(layout: QuadLayout, before: Array, after: Array, sectors: Array) -> BoolArray:
    """(2 e,) ends at vertices where directions `after` (2 e, 3) leave a corner that is no more open, `before` did not.

    A corner is open between `LEAST_CORNER` and 180 degrees less that; one that was less open already may stay so.
    """
    known = (sectors != 0.0).any(axis=2)
    short = []
    for tips in (before, after):
        angle = corner_angles(layout, tips.reshape(-1, 2, 3), sectors)
        short.append(np.maximum(LEAST_CORNER - angle, angle - (180.0 - LEAST_CORNER)))
    bad = known & (short[1] > ALLOWANCE) & (short[1] > short[0] + ALLOWANCE)
    closed = np.zeros(len(layout.vertices), dtype=bool)
    closed[layout.quads[bad]] = True
    return np.asarray(closed[layout.edges].reshape(-1))


def bent_ends(layout: QuadLayout, smooth: BoolArray, straight: BoolArray) -> BoolArray:
    """(e, 2) ends of edges at inner vertices, all of whose edges are smooth, that are no crossing of two lines."""
    inner = np.ones(len(layout.vertices), dtype=bool)
    inner[layout.edges[~smooth]] = False
    crossed = np.ones(len(layout.vertices), dtype=bool)
    crossed[layout.edges[~straight.reshape(-1, 2)]] = False
    return np.asarray((inner & ~crossed)[layout.edges])
