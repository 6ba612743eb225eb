"""Smooth edges of a layout that are sharp after all: where a sharp line fades, or ends, on the rim of a thin body.

A layout follows the sharp lines of its triangulation as far as they are long and clear. Beyond, at the tip of a
trailing edge, one patch may lie on the upper and its neighbour on the lower side: they have no tangent plane in common,
and patches made to share one would fold.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.joins import edge_end_normals, edge_uses, sector_normals, smooth_edges
from patchwright.repair.patches.patch_fit import Target
from patchwright.repair.patches.patch_nets import PatchNets, evaluate
from patchwright.repair.patches.spline_space import collocation
from patchwright.repair.patches.vertex_shapes import facing

KNIFE = 45.0  # degrees by which the target turns within the tolerance of an edge, in the mean along it
CUSP = 90.0  # degrees by which it turns so near one end, where there is no common normal
SAMPLES = 9  # along each edge
ACROSS = 0.125  # of the patch: how far from the edge the target is asked at most


def knife_edges(layout: QuadLayout, nets: PatchNets, target: Target, width: Array) -> BoolArray:
    """(e,) smooth edges that go on from a sharp line or boundary and across which the target turns like a knife.

    Parameters
    ----------
    nets : patches near the data
    width : (m,) distance from its edges within which what a patch bends cannot be told from a crease: its tolerance

    It turns so in the mean along the edge, or near an end that is a cusp (`joins.sector_normals`).
    """
    smooth = smooth_edges(layout)
    on_line = np.zeros(len(layout.vertices), dtype=bool)
    on_line[layout.edges[~smooth]] = True
    sectors = sector_normals(layout, facing(nets, target))
    cusp = (edge_end_normals(layout, sectors)[0] == 0.0).all(axis=2)
    one, two = _beside(layout, nets, target, width)[edge_uses(layout)].swapaxes(0, 1)
    cosine = np.clip((one * two).sum(axis=-1), -1.0, 1.0)
    turn = np.degrees(np.arccos(cosine))
    knife = (turn.mean(axis=1) > KNIFE) | (cusp & (turn[:, [0, -1]] > CUSP)).any(axis=1)
    return np.asarray(smooth & on_line[layout.edges].any(axis=1) & knife)


def with_knife_edges(layout: QuadLayout, nets: PatchNets, target: Target, width: Array) -> QuadLayout:
    """The layout with these edges sharp; the same layout where there are none."""
    found = knife_edges(layout, nets, target, width)
    return replace(layout, sharp=layout.sharp | found) if found.any() else layout


def _beside(layout: QuadLayout, nets: PatchNets, target: Target, width: Array) -> Array:
    """(4 m, SAMPLES, 3) normals of the target beside every side 4 q + k, in the direction of its edge."""
    at = (np.arange(SAMPLES) + 0.5) / SAMPLES
    points = np.empty((len(nets), 4, SAMPLES, 3))
    for (m, n), which, group in nets.groups():
        for k in range(4):
            across = np.array([0.0, ACROSS]) if k in (0, 3) else np.array([1.0, 1.0 - ACROSS])
            u, v = (at, across) if k in (0, 2) else (across, at)
            rows = evaluate(group, collocation(m, u), collocation(n, v))
            edge, inside = np.moveaxis(rows, 2 if k in (0, 2) else 1, 0)
            ahead = inside - edge
            size = np.linalg.norm(ahead, axis=-1, keepdims=True)
            share = np.minimum(1.0, width[which, None, None] / np.maximum(size, np.finfo(float).tiny))
            points[which, k] = edge + share * ahead
    backward = layout.edge_reversed != np.array([False, False, True, True])
    points[backward] = points[backward][:, ::-1]
    triangle = target.tree.closest(points.reshape(-1, 3)).triangle
    return np.asarray(target.tree.triangulation.normals)[triangle].reshape(-1, SAMPLES, 3)
