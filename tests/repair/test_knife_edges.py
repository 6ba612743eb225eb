"""Edges at which a sharp line fades on the rim of a thin body are sharp, rounded rims are not."""

from __future__ import annotations

import numpy as np
import pytest
from quad_shapes import layout_from_quads

from patchwright.models.tolerance import Tolerance
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.patches.edge_fit import fit_edge_curves
from patchwright.repair.patches.knife_edges import knife_edges
from patchwright.repair.patches.patch_fit import Target, fit_group
from patchwright.repair.patches.patch_nets import PatchNets, sides
from patchwright.repair.patches.resurface import resurface


def rim(radius, half=10.0, scale=1.0):
    """A wedge along y whose rim is rounded; two quads above it, two below, the first half of the rim marked sharp.

    Its sides slope by `half` degrees, so that the surface turns by 180 - 2 `half` round the rim.
    """
    slope = np.radians(half)
    turn = np.linspace(slope - np.pi / 2, np.pi / 2 - slope, 25)
    nose = radius * np.stack([np.cos(turn) - 1.0, np.sin(turn)], axis=1)
    away = (1.0 - radius) * np.array([-np.cos(slope), np.sin(slope)])
    line = np.concatenate([[nose[0] + away * (1, -1)], nose, [nose[-1] + away]]) * scale
    y = np.array([0.0, 1.0, 2.0]) * scale
    n = len(line)
    points = np.stack([np.repeat(line[:, 0], 3), np.tile(y, n), np.repeat(line[:, 1], 3)], axis=1)
    a = (3 * np.arange(n - 1)[:, None] + np.arange(2)).reshape(-1)
    triangles = np.concatenate([np.stack([a, a + 3, a + 4], 1), np.stack([a, a + 4, a + 1], 1)])
    body = Triangulation(points, triangles[:, ::-1])
    middle = n // 2
    rows = [0, 1, 2], [3 * middle, 3 * middle + 1, 3 * middle + 2], [3 * n - 3, 3 * n - 2, 3 * n - 1]
    corners = points[np.concatenate(rows)]
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])

    def path(one, two):
        if one % 3 != two % 3:  # along the rim
            return np.stack([corners[one], corners[two]])
        return points[3 * np.arange(one // 3 * middle, two // 3 * middle + 1) + one % 3]

    layout = layout_from_quads(corners, quads, path, sharp=[(3, 4)])
    return layout, Target(Tree.of(body), np.zeros(len(body), dtype=bool))


def first_fit(layout, target):
    edges = fit_edge_curves(layout, target, np.full(len(layout.edges), 2))
    which = np.arange(len(layout.quads))
    nets = fit_group(sides(layout, edges, which, (2, 2)), (2, 2), target).nets
    return PatchNets.pack(np.full((len(which), 2), 2), [(which, nets)])


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize(("radius", "knife"), [(1e-6, True), (1e-4, True), (0.02, False), (0.2, False)])
def test_a_rim_is_a_knife_where_it_bends_within_the_tolerance(radius, knife, scale):
    layout, target = rim(radius, scale=scale)
    found = knife_edges(layout, first_fit(layout, target), target, np.full(4, 1e-3 * scale))
    ends = layout.edges[found]
    assert ends.tolist() == ([[4, 5]] if knife else [])


@pytest.mark.parametrize(("half", "knife"), [(65.0, True), (70.0, False)])
def test_a_crease_that_turns_little_is_none(half, knife):
    layout, target = rim(1e-6, half)  # turns by 180 - 2 half: 50 or 40 degrees
    assert knife_edges(layout, first_fit(layout, target), target, np.full(4, 1e-3)).any() == knife


def test_an_edge_that_leaves_no_line_stays_smooth():
    layout, target = rim(1e-6)
    lonely = layout_from_quads(layout.vertices[:6], layout.quads[:2], lambda a, b: layout.vertices[[a, b]])
    nets = first_fit(lonely, target)
    assert not knife_edges(lonely, nets, target, np.full(2, 1e-3)).any()


def test_a_network_says_which_of_its_edges_are_knives():
    layout, target = rim(1e-6)
    network = resurface(layout, target, Tolerance(1e-9, 1e-3))
    assert network.layout.edges[network.layout.sharp].tolist() == [[3, 4], [4, 5]]
    assert network.deviation.max() < 1e-6
