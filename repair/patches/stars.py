"""Stars: the edges that leave a vertex, turned apart in its tangent plane until every corner of a patch is open.

Where two sides of a patch leave a corner in nearly one direction, or in nearly opposite ones, its normal there is
undefined, and the fit folds. The end tangents of smooth edges are free to turn a little in the tangent plane: the curve
leaves its path sideways, which costs no distance from the surface to first order.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.edge_curves import EdgeCurves

LEAST_CORNER = 10.0  # degrees
ROOM = 0.25  # of the shortest edge at a vertex: how far a turned leg may reach sideways
PASSES = 60  # a pass halves what is missing; chains of eight corners settle to a degree


def corner_angles(layout: QuadLayout, tips: Array, normals: Array) -> Array:
    """(m, 4) degrees in (-90, 270] from each quad's outgoing to its incoming side, counter-clockwise about the normals.

    Parameters
    ----------
    tips : (e, 2, 3) directions in which each edge leaves its start and its end
    normals : (m, 4, 3) unit normals at the corners
    """
    out = _at_corners(layout, tips)
    ahead, back = out[:, :, 0], out[:, :, 1]
    along = (ahead * back).sum(axis=-1) - (ahead * normals).sum(axis=-1) * (back * normals).sum(axis=-1)
    angle = np.degrees(np.arctan2((np.cross(ahead, back) * normals).sum(axis=-1), along))
    return np.asarray(np.where(angle <= -90.0, angle + 360.0, angle))


def leaving(curves: EdgeCurves) -> Array:
    """(e, 2, 3) first and last leg of every curve's control polygon, each away from its vertex."""
    first, last = curves.offsets[:-1], curves.offsets[1:] - 1
    points = curves.controls
    return np.stack([points[first + 1] - points[first], points[last - 1] - points[last]], axis=1)


def spread(layout: QuadLayout, curves: EdgeCurves, sectors: Array, free: BoolArray) -> EdgeCurves:
    """The curves with their end tangents turned about the vertices' normals where a corner is too narrow or too wide.

    Parameters
    ----------
    sectors : (m, 4, 3) unit normal of the smooth sector at each corner (`joins.sector_normals`), zero at a cusp, which
        is left alone
    free : (e,) edges that may turn; the others keep their tangents

    Corners between `LEAST_CORNER` and 180 degrees less that stay as they are; the others share what is missing with
    their neighbours. Where a sector is too narrow for its corners, the compromise is an even one.
    """
    tips = leaving(curves)
    angle = corner_angles(layout, tips, sectors)
    known = (sectors != 0.0).any(axis=2)
    wrong = known & ((angle < LEAST_CORNER) | (angle > 180.0 - LEAST_CORNER))
    if not wrong.any():
        return curves
    one, two, end_one, end_two = corner_ends(layout)
    slot_one, slot_two = 2 * one + end_one, 2 * two + end_two
    turn = np.zeros(2 * len(layout.edges))
    may = np.repeat(free, 2)
    share_one = np.where(may[slot_one], np.where(may[slot_two], 0.5, 1.0), 0.0)
    share_two = np.where(may[slot_two], np.where(may[slot_one], 0.5, 1.0), 0.0)
    for _ in range(PASSES):
        now = angle + turn[slot_two] - turn[slot_one]
        missing = np.maximum(LEAST_CORNER - now, 0.0) - np.maximum(now - (180.0 - LEAST_CORNER), 0.0)
        missing[~known] = 0.0
        np.add.at(turn, slot_one, -0.5 * share_one * missing)
        np.add.at(turn, slot_two, 0.5 * share_two * missing)
    # the axis of every edge end: the normal of the sector it leaves through
    axis = np.zeros((2 * len(layout.edges), 3))
    np.add.at(axis, slot_one, sectors)
    np.add.at(axis, slot_two, sectors)
    size = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = np.divide(axis, size, out=np.zeros_like(axis), where=size > 0)
    turned = np.flatnonzero(turn)
    leg, n = tips.reshape(-1, 3)[turned], axis[turned]
    c, s = np.cos(np.radians(turn[turned]))[:, None], np.sin(np.radians(turn[turned]))[:, None]
    leg = c * leg + s * np.cross(n, leg) + (1.0 - c) * (n * leg).sum(axis=1, keepdims=True) * n
    controls = curves.controls.copy()
    edge, end = turned // 2, turned % 2
    # in a slim patch a long leg turned would cross the side opposite: it gets shorter
    chord = np.linalg.norm(layout.vertices[layout.edges[:, 1]] - layout.vertices[layout.edges[:, 0]], axis=1)
    shortest = np.full(len(layout.vertices), np.inf)
    np.minimum.at(shortest, layout.edges, chord[:, None])
    aside = np.linalg.norm(leg, axis=1) * np.abs(s[:, 0])
    leg *= np.minimum(1.0, ROOM * shortest[layout.edges[edge, end]] / np.maximum(aside, np.finfo(float).tiny))[:, None]
    tip = np.where(end == 0, curves.offsets[edge], curves.offsets[edge + 1] - 1)
    controls[tip + np.where(end == 0, 1, -1)] = controls[tip] + leg
    return EdgeCurves(curves.cells, curves.offsets, controls)


def corner_ends(layout: QuadLayout) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """For every corner (m, 4) the edge it leaves by, the edge it is reached by, and which end of each is there."""
    ahead, back = layout.quad_edges, np.roll(layout.quad_edges, 1, axis=1)
    ahead_end = layout.edge_reversed.astype(np.int64)
    back_end = 1 - np.roll(layout.edge_reversed, 1, axis=1).astype(np.int64)
    return ahead, back, ahead_end, back_end


def _at_corners(layout: QuadLayout, tips: Array) -> Array:
    """(m, 4, 2, 3) the directions in which the side after and the side before each corner leave it."""
    ahead, back, ahead_end, back_end = corner_ends(layout)
    return np.stack([tips[ahead, ahead_end], tips[back, back_end]], axis=2)
