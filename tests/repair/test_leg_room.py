"""Ends of edge curves turn no farther than the patches beside them are wide."""

from __future__ import annotations

import numpy as np
import pytest
from quad_shapes import layout_from_quads

from patchwright.repair.patches.edge_curves import fit_edges
from patchwright.repair.patches.leg_room import ROOM, leg_room
from patchwright.repair.patches.stars import LEAST_CORNER, corner_angles, leaving
from patchwright.repair.patches.straight import opposite_ends, straighten


def bent_strips(width, *, scale=1.0, kink=0.15):
    """Four columns of quads in the plane whose rows bend at every column; the second row is `width` high."""
    y = np.array([0.0, 1.0, 1.0 + width, 2.0 + width, 3.0 + width])
    x = np.arange(5.0)
    points = np.stack([np.tile(x, 5), np.repeat(y, 5) + kink * np.tile(x % 2, 5), np.zeros(25)], axis=1) * scale
    first = (5 * np.arange(4)[:, None] + np.arange(4)).reshape(-1)
    quads = np.stack([first, first + 1, first + 6, first + 5], axis=1)
    t = np.linspace(0.0, 1.0, 13)[:, None]
    layout = layout_from_quads(points, quads, lambda a, b: (1 - t) * points[a] + t * points[b])
    ends = layout.vertices[layout.edges]
    samples = (1 - t) * ends[:, None, 0] + t * ends[:, None, 1]
    curves = fit_edges([(np.arange(len(ends)), samples)], np.full(len(ends), 2))
    up = np.zeros((len(quads), 4, 3))
    up[..., 2] = 1.0
    return layout, curves, up


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("width", [0.3, 0.01])
def test_room_is_a_share_of_the_width(width, scale):
    layout, curves, _ = bent_strips(width, scale=scale, kink=0.0)
    rows = np.isclose(layout.vertices[layout.edges][..., 1] / scale, 1.0).all(axis=1)
    assert rows.sum() == 4
    assert np.allclose(leg_room(layout, curves)[rows], ROOM * width * scale, rtol=1e-9)


@pytest.mark.parametrize("width", [1.0, 0.3, 0.1, 0.01, 1e-4])
def test_lines_are_made_only_where_both_ends_have_room(width):
    layout, curves, up = bent_strips(width)
    smooth = ~layout.boundary
    lined, straight = straighten(layout, curves, smooth, up)
    before, after = leaving(curves).reshape(-1, 3), leaving(lined).reshape(-1, 3)
    size = np.linalg.norm(before, axis=1)
    aside = np.linalg.norm(np.cross(before, after), axis=1) / size
    assert (aside <= leg_room(layout, curves).reshape(-1) * (1.0 + 1e-9)).all()
    assert np.allclose(np.linalg.norm(after, axis=1), size, rtol=1e-12)
    opposite = opposite_ends(layout, smooth)
    ends = np.flatnonzero(straight)
    unit = after / size[:, None]
    assert np.abs(unit[ends] + unit[opposite[ends]]).max() < 1e-13 / width  # round-off over the shortest leg
    assert straight[opposite >= 0].all() == (width >= 0.3)


def test_a_line_that_would_close_a_corner_is_not_made():
    layout, curves, up = bent_strips(1.0, kink=0.0)
    middle = int(np.flatnonzero((layout.vertices == (2.0, 2.0, 0.0)).all(axis=1))[0])
    tips = leaving(curves)
    edge, end = np.nonzero(layout.edges == middle)
    around = np.argsort(np.arctan2(tips[edge, end, 1], tips[edge, end, 0]) % (2 * np.pi - 0.1))  # east, north, ...
    edge, end = edge[around], end[around]
    size = np.linalg.norm(tips[edge, end], axis=1)
    controls = curves.controls.copy()

    def ends_straight(degrees):
        angle = np.radians(degrees)
        tip = np.where(end == 0, curves.offsets[edge], curves.offsets[edge + 1] - 1)
        leg = size[:, None] * np.stack([np.cos(angle), np.sin(angle), np.zeros(4)], axis=1)
        controls[tip + np.where(end == 0, 1, -1)] = controls[tip] + leg
        bent = type(curves)(curves.cells, curves.offsets, controls)
        lined, straight = straighten(layout, bent, ~layout.boundary, up)
        kept = (leaving(lined)[edge, end] == leaving(bent)[edge, end]).all(axis=1)
        assert (kept == ~straight.reshape(-1, 2)[edge, end]).all()
        corners = corner_angles(layout, leaving(lined), up)[layout.quads == middle]
        return straight.reshape(-1, 2)[edge, end], np.sort(corners)

    # opposite corners get their mean: 10 and 12 degrees are open, 4 and 12 would both be closed
    straight, corners = ends_straight([0.0, 10.0, 160.0, 172.0])
    assert straight.all()
    assert np.allclose(corners, [11.0, 11.0, 169.0, 169.0])
    straight, corners = ends_straight([0.0, 4.0, 154.0, 166.0])
    assert not straight.any()
    assert np.allclose(corners, [4.0, 12.0, 150.0, 194.0])
    assert LEAST_CORNER == 10.0
