"""Corners held open, sector normals that folds do not spoil: exact cases and invariances."""

from __future__ import annotations

import numpy as np
import pytest
from quad_shapes import layout_from_quads

from patchwright.repair.patches.edge_curves import EdgeCurves, with_end_tangents
from patchwright.repair.patches.joins import sector_normals, smooth_edges
from patchwright.repair.patches.stars import LEAST_CORNER, corner_angles, leaving, spread


def star(angles, turn=None):
    """Four quads round the origin in a plane, the edges leaving it at `angles` (degrees); curves of two pieces."""
    angles = np.radians(angles)
    rim = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    between = np.radians([45.0, 135.0, 225.0, 315.0])
    far = 2.0 * np.stack([np.cos(between), np.sin(between), 0 * between], axis=1)
    vertices = np.concatenate([np.zeros((1, 3)), rim, far])
    if turn is not None:
        vertices = vertices @ turn.T
    quads = np.array([[0, 1 + k, 5 + k, 1 + (k + 1) % 4] for k in range(4)])

    def path(a, b):
        return (1 - np.linspace(0, 1, 5)[:, None]) * vertices[a] + np.linspace(0, 1, 5)[:, None] * vertices[b]

    layout = layout_from_quads(vertices, quads, path)
    t = np.array([0.0, 1 / 6, 1 / 2, 5 / 6, 1.0])[:, None]
    ends = vertices[layout.edges]
    controls = (1 - t) * ends[:, :1] + t * ends[:, 1:]
    curves = EdgeCurves.pack(np.full(len(layout.edges), 2), [(np.arange(len(layout.edges)), controls)])
    normal = np.array([0.0, 0.0, 1.0]) if turn is None else turn[:, 2]
    return layout, curves, np.broadcast_to(normal, (4, 4, 3))


def at_centre(layout, curves, normals):
    return corner_angles(layout, leaving(curves), normals)[:, 0]


def rotation():
    return np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0] * -1.0


def test_corner_angles_are_those_of_the_plane_and_go_once_round():
    layout, curves, normals = star([0.0, 70.0, 200.0, 290.0])
    assert np.allclose(at_centre(layout, curves, normals), [70.0, 130.0, 90.0, 70.0], atol=1e-12)


def test_an_open_star_keeps_its_curves_bit_for_bit():
    layout, curves, normals = star([0.0, 70.0, 200.0, 290.0])
    assert spread(layout, curves, normals, ~layout.boundary) is curves


@pytest.mark.parametrize("angles", [[0.0, -15.0, 130.0, 250.0], [0.0, 3.0, 178.0, 182.0], [0.0, 90.0, 180.0, 184.0]])
def test_closed_and_crossed_corners_open_and_still_go_once_round(angles):
    layout, curves, normals = star(angles)
    opened = spread(layout, curves, normals, smooth_edges(layout))
    corners = at_centre(layout, opened, normals)
    assert corners.min() > LEAST_CORNER - 0.5
    assert corners.max() < 180.0 - LEAST_CORNER + 0.5
    assert corners.sum() == pytest.approx(360.0, abs=1e-9)
    # the ends stay where they are, and the legs in the plane
    assert np.array_equal(opened.sample(2), curves.sample(2))
    assert np.abs(opened.controls[:, 2]).max() == 0.0


def test_spreading_turns_with_the_body():
    turn = rotation()
    turn *= np.sign(np.linalg.det(turn))
    plain, turned = star([0.0, -15.0, 130.0, 250.0]), star([0.0, -15.0, 130.0, 250.0], turn)
    one = spread(*plain, smooth_edges(plain[0]))
    other = spread(*turned, smooth_edges(turned[0]))
    assert np.allclose(other.controls, one.controls @ turn.T, atol=1e-12)


def test_edges_that_may_not_turn_do_not():
    layout, curves, normals = star([0.0, 3.0, 130.0, 250.0])
    free = smooth_edges(layout)
    held = np.flatnonzero((layout.edges == (0, 1)).all(axis=1))
    free[held] = False
    opened = spread(layout, curves, normals, free)
    assert np.array_equal(leaving(opened)[held], leaving(curves)[held])
    assert at_centre(layout, opened, normals).min() > LEAST_CORNER - 0.5


def test_one_folded_corner_does_not_spoil_its_sector():
    layout, _, normals = star([0.0, 90.0, 180.0, 270.0])
    folded = np.array(normals)
    folded[2, 0] = (np.sin(2.0), 0.0, np.cos(2.0))
    assert np.allclose(sector_normals(layout, folded)[:, 0], (0.0, 0.0, 1.0), atol=1e-15)


def test_a_cusp_has_no_common_normal_and_leaves_its_curves_alone():
    layout, curves, normals = star([0.0, 90.0, 180.0, 270.0])
    steep = np.array(normals)
    around = np.radians([45.0, 135.0, 225.0, 315.0])
    for degrees, cusp in ((50.0, False), (70.0, True)):
        tilt = np.radians(degrees)
        steep[:, 0] = np.stack([np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), 0 * around], axis=1)
        steep[:, 0, 2] = np.cos(tilt)
        sectors = sector_normals(layout, steep)
        assert (np.abs(sectors[:, 0]).max() == 0.0) == cusp
    assert spread(layout, curves, sectors, smooth_edges(layout)) is curves


def test_a_crease_is_not_turned_into_planes_that_contradict_it():
    line = np.array([[[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [4, 0, 0]]])
    curve = EdgeCurves.pack(np.array([2]), [(np.array([0]), line)])

    def meeting_along(direction):
        other = np.cross(direction, (0.0, 0.0, 1.0))
        one = np.broadcast_to((0.0, 0.0, 1.0), (1, 2, 3))
        return one, np.broadcast_to(other / np.linalg.norm(other), (1, 2, 3))

    near, far = np.radians(20.0), np.radians(50.0)
    turned = with_end_tangents(curve, *meeting_along((np.cos(near), np.sin(near), 0.0)), np.array([False]))
    assert np.allclose(leaving(turned)[0, 0], (np.cos(near), np.sin(near), 0.0), atol=1e-12)
    left = with_end_tangents(curve, *meeting_along((np.cos(far), np.sin(far), 0.0)), np.array([False]))
    assert np.array_equal(left.controls, curve.controls)
