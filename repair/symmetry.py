"""Symmetry planes: the borders of a half model are put on their plane exactly and stay there to the last bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, IntArray, frozen
from patchwright.models.triangulation import Triangulation
from patchwright.repair.checks.examination import Examination
from patchwright.repair.patches.edge_curves import EdgeCurves
from patchwright.repair.patches.network import PatchNetwork
from patchwright.repair.patches.patch_nets import PatchNets
from patchwright.repair.surroundings import SymmetryPlane


def on_planes(exam: Examination) -> tuple[Triangulation, IntArray, float]:
    """A model's triangles with the border vertices that lie near a symmetry plane put on it exactly.

    A border vertex is one with a free edge once copies of points are merged; near is the fit tolerance.

    Returns
    -------
    The triangulation, the vertices that moved, and the farthest move.
    """
    raw, planes = exam.raw, exam.surroundings.planes
    at_rim = np.zeros(len(exam.body.vertices), dtype=np.bool_)
    at_rim[exam.body_adjacency.edges[exam.body_adjacency.free]] = True
    # the triangles of `body` are those of `raw` with other vertex numbers
    rim = np.zeros(len(raw.vertices), dtype=np.bool_)
    rim[raw.triangles[exam.body_index][at_rim[exam.body.triangles]]] = True
    points = raw.vertices.copy()
    for plane in planes:
        close = rim & (np.abs(points[:, plane.axis] - plane.value) <= exam.tolerance.fit)
        points[close, plane.axis] = plane.value
    move = np.linalg.norm(points - raw.vertices, axis=1)
    moved = np.flatnonzero(move > 0.0)
    return (replace(raw, vertices=points) if len(moved) else raw), moved, float(move.max(initial=0.0))


def settled(network: PatchNetwork, planes: tuple[SymmetryPlane, ...], near: float) -> PatchNetwork:
    """A network whose free edges near a symmetry plane lie on it exactly, with the patches' border rows on them.

    An edge is on a plane when both its ends and all its control points are within `near` of it; a curve whose control
    points have one coordinate in common has it everywhere, and 0 stays 0 without round-off.
    """
    layout, edges, nets = network.layout, network.edges, network.nets
    free = np.bincount(layout.quad_edges.reshape(-1), minlength=len(layout.edges)) == 1
    vertices, controls, rows = layout.vertices.copy(), edges.controls.copy(), nets.controls.copy()
    for plane in planes:
        off = np.abs(controls[:, plane.axis] - plane.value)
        worst = np.maximum.reduceat(off, edges.offsets[:-1])
        on = np.flatnonzero(free & (worst <= near))
        if not len(on):
            continue
        own = np.isin(np.repeat(np.arange(len(layout.edges)), np.diff(edges.offsets)), on)
        controls[own, plane.axis] = plane.value
        vertices[layout.edges[on], plane.axis] = plane.value
        for patch, side in np.argwhere(np.isin(layout.quad_edges, on)):
            rows[_border(nets, int(patch), int(side)), plane.axis] = plane.value
    return replace(
        network,
        layout=replace(layout, vertices=frozen(vertices, np.float64)),
        edges=EdgeCurves(edges.cells, edges.offsets, frozen(controls, np.float64)),
        nets=PatchNets(nets.cells, nets.offsets, frozen(rows, np.float64)),
    )


def _border(nets: PatchNets, patch: int, side: int) -> IntArray:
    """Rows of the control points along one side of a patch: v = 0, u = 1, v = 1, u = 0."""
    m, n = nets.cells[patch] + 3
    index: Array = nets.offsets[patch] + np.arange(m * n).reshape(m, n)
    return np.asarray((index[:, 0], index[-1], index[:, -1], index[0])[side], dtype=np.int64)
