"""Edges of a network run together: one curve in place of several where the same two faces meet and nothing turns."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.repair.layout.blocks import Blocks
from patchwright.repair.patches.network import PatchNetwork
from patchwright.repair.patches.spline_space import DEGREE, knots

TURN = 0.5  # degrees: edges that turn more at a vertex end there


def passed_vertices(network: PatchNetwork, blocks: Blocks, kept: BoolArray) -> BoolArray:
    """(n,) vertices that an edge of the faces runs through.

    Just two of the edges `kept` (e,) meet there, between the same blocks, both sharp or both smooth, they run on
    without a turn, and no block has its corner there.
    """
    layout, edges = network.layout, network.edges
    which = np.flatnonzero(kept)
    vertex, edge = layout.edges[which].T.reshape(-1), np.tile(which, 2)
    leave = np.concatenate(
        [
            edges.controls[edges.offsets[which] + 1] - edges.controls[edges.offsets[which]],
            edges.controls[edges.offsets[which + 1] - 2] - edges.controls[edges.offsets[which + 1] - 1],
        ]
    )
    order = np.argsort(vertex, kind="stable")
    vertex, edge, leave = vertex[order], edge[order], leave[order]
    count = np.bincount(vertex, minlength=len(layout.vertices))
    one = np.flatnonzero(count[vertex] == 2)[::2]
    two = one + 1
    between = np.sort(np.where(layout.edge_quads >= 0, blocks.block[layout.edge_quads], -1), axis=1)
    alike = (between[edge[one]] == between[edge[two]]).all(axis=1)
    alike &= layout.sharp[edge[one]] == layout.sharp[edge[two]]
    length = np.linalg.norm(leave[one], axis=1) * np.linalg.norm(leave[two], axis=1)
    alike &= -(leave[one] * leave[two]).sum(axis=1) > np.cos(np.radians(TURN)) * length
    passed = np.zeros(len(layout.vertices), dtype=bool)
    passed[vertex[one[alike]]] = True
    quads, numbers = blocks.corners()
    passed[layout.quads[quads, numbers]] = False
    return passed


def joined_curve(network: PatchNetwork, run: IntArray, backward: BoolArray) -> tuple[NurbsCurve, Array]:
    """The curve of edges one after another, and its parameters at their ends, which grow with their lengths."""
    pieces = []
    for edge, back in zip(run.tolist(), backward.tolist(), strict=True):
        points = network.curve(edge).control_points
        pieces.append(points[::-1] if back else points)
    at = shares(np.array([np.linalg.norm(np.diff(points, axis=0), axis=1).sum() for points in pieces]))
    points = np.concatenate([points[(i > 0) :] for i, points in enumerate(pieces)])
    return NurbsCurve(DEGREE, joined_knots(at, [len(points) - DEGREE for points in pieces]), points), at


def polyline(at: Array, points: Array) -> NurbsCurve:
    """The piecewise linear curve through points at parameters."""
    return NurbsCurve(1, np.concatenate([at[:1], at, at[-1:]]), points)


def shares(lengths: Array) -> Array:
    """Parameters in [0, 1] that grow with lengths; evenly where there is next to no length."""
    total = lengths.sum()
    even = not total > 0.0 or lengths.min() <= 1e-6 * total
    steps = np.full(len(lengths), 1.0 / len(lengths)) if even else lengths / total
    return np.concatenate([[0.0], np.cumsum(steps)[:-1], [1.0]])


def joined_knots(at: Array, cells: list[int]) -> Array:
    """Knots of cubics of `cells` equal pieces each, one after another between the parameters `at`, triple there."""
    inner = [np.zeros(DEGREE + 1)]
    for a, b, count in zip(at[:-1], at[1:], cells, strict=True):
        inner += [a + (b - a) * knots(count)[DEGREE + 1 : -DEGREE - 1], np.full(DEGREE, b)]
    return np.concatenate([*inner, [1.0]])
