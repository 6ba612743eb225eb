"""How much room the ends of edge curves have beside them.

The leg of a curve's control polygon that is turned sideways by more than the width of the patch there crosses the side
opposite, and the patch folds. A patch may be as slim as a fraction of the tolerance and a hundred times as long.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.edge_curves import EdgeCurves

ROOM = 0.25  # of the distance to the side opposite: how far a leg may be turned sideways
SAMPLES = 17  # points of the polyline that stands for the side opposite


def leg_room(layout: QuadLayout, curves: EdgeCurves) -> Array:
    """(e, 2) the length by which the arms of each curve, its second and its last but one control point, may move.

    It is `ROOM` of the distance to the side opposite, in the slimmer of the patches on both sides.
    """
    first, last = curves.offsets[:-1], curves.offsets[1:] - 1
    arms = np.stack([curves.controls[first + 1], curves.controls[last - 1]], axis=1)
    lines = curves.sample(SAMPLES)
    out = np.full((len(layout.edges), 2), np.inf)
    for k in range(4):
        own, opposite = layout.quad_edges[:, k], layout.quad_edges[:, (k + 2) % 4]
        np.minimum.at(out, own, _distances(arms[own], lines[opposite]))
    return ROOM * out


def _distances(points: Array, lines: Array) -> Array:
    """(m, k) from points (m, k, 3) to polylines (m, s, 3)."""
    start, step = lines[:, None, :-1], np.diff(lines, axis=1)[:, None]
    ahead = points[:, :, None] - start
    square = np.maximum((step * step).sum(axis=-1), np.finfo(float).tiny)
    share = np.clip((ahead * step).sum(axis=-1) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(ahead - share[..., None] * step, axis=-1).min(axis=-1))
