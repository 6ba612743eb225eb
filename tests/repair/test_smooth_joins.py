"""Smooth joins and what they stand on: fair fits, shapes of vertices, edges in one line."""

from __future__ import annotations

import numpy as np
import pytest
from quad_shapes import Marks, SphereTarget, layout_from_quads, sphere_layout

from patchwright.models.tolerance import Tolerance
from patchwright.repair.patches.fair_fit import curve_fit, jumps
from patchwright.repair.patches.joins import regular_edges, seam_angles, sector_normals, side_normals
from patchwright.repair.patches.patch_fit import Target
from patchwright.repair.patches.patch_nets import PatchNets
from patchwright.repair.patches.resurface import resurface
from patchwright.repair.patches.seam_curvature import curvature_jumps, side_curvatures
from patchwright.repair.patches.smooth_joins import join, spoiled
from patchwright.repair.patches.spline_space import greville, uniform_collocation
from patchwright.repair.patches.stars import leaving
from patchwright.repair.patches.straight import opposite_ends, straighten
from patchwright.repair.patches.vertex_shapes import facing, vertex_forms, vertex_normals


@pytest.fixture(scope="module")
def ball():
    target = SphereTarget()
    layout = sphere_layout(4)
    return layout, resurface(layout, Target(target, Marks(target)), Tolerance(1e-9, 1e-4)), target


@pytest.mark.parametrize("cells", [2, 3, 8])
def test_fair_fits_give_cubics_back_whatever_their_pieces(cells):
    assert np.abs(jumps(cells) @ greville(cells)).max() < 1e-12
    t = np.linspace(0, 1, 6 * cells + 1)
    curve = 1 - 2 * t + 3 * t**2 - 4 * t**3
    from_samples, from_ends = curve_fit(cells, len(t), 1)
    ends = np.zeros(cells + 3)
    ends[[0, -1]] = curve[[0, -1]]
    controls = ends.copy()
    controls[1:-1] = from_samples @ curve + from_ends @ ends
    assert np.allclose(uniform_collocation(cells, len(t)) @ controls, curve, atol=1e-12)


def test_fair_fits_copy_less_of_the_noise_than_plain_ones():
    noise = np.random.default_rng(0).standard_normal(97)
    noise[[0, -1]] = 0.0
    from_samples, _ = curve_fit(16, 97, 1)
    plain = np.linalg.pinv(uniform_collocation(16, 97)[:, 1:-1]) @ noise
    assert np.abs(jumps(16)[:, 1:-1] @ (from_samples @ noise)).max() < np.abs(jumps(16)[:, 1:-1] @ plain).max()


@pytest.mark.parametrize("tilt", [0.0, 0.05])
def test_normals_and_forms_of_a_sphere_are_found_from_a_tilted_guess(ball, tilt):
    layout, network, target = ball
    out = layout.vertices[layout.quads]
    guess = out + tilt * np.cross(out, (0.3, 0.5, 0.8))
    guess /= np.linalg.norm(guess, axis=-1, keepdims=True)
    normals = vertex_normals(layout, network.nets, guess, Target(target, Marks(target)))
    assert np.degrees(np.linalg.norm(normals - out, axis=-1).max()) < 0.1
    forms = vertex_forms(layout, network.nets, out)
    flat = np.eye(3) - out[..., :, None] * out[..., None, :]
    assert np.abs(forms + flat).max() < 0.02  # the height over the plane falls: curvature -1 in every direction
    assert np.abs(np.einsum("mkij,mkj->mki", forms, out)).max() < 1e-12


def test_opposite_edges_leave_regular_vertices_in_one_line(ball):
    layout, network, _ = ball
    smooth = np.ones(len(layout.edges), dtype=bool)
    lined, straight = straighten(layout, network.edges, smooth, layout.vertices[layout.quads])
    opposite = opposite_ends(layout, smooth)
    legs = leaving(lined).reshape(-1, 3)
    legs /= np.linalg.norm(legs, axis=1, keepdims=True)
    ends = np.flatnonzero(straight)
    assert len(ends) == (opposite >= 0).sum() == 4 * (len(layout.vertices) - 8)
    assert np.abs(legs[ends] + legs[opposite[ends]]).max() < 1e-12
    assert (opposite[opposite[ends]] == ends).all()


def test_a_disturbed_network_is_made_smooth_and_its_boundaries_stay(ball):
    layout, network, _ = ball
    rng = np.random.default_rng(1)
    groups = []
    for _, which, nets in network.nets.groups():
        nets = nets.copy()
        nets[:, 1:-1, 1:-1] += 1e-3 * rng.standard_normal(nets[:, 1:-1, 1:-1].shape)
        groups.append((which, nets))
    rough = type(network.nets).pack(np.asarray(network.nets.cells), groups)
    room = np.full(len(rough), 1e-3)
    smooth = join(layout, rough, room)
    before, after = (seam_angles(layout, side_normals(layout, n)) for n in (rough, smooth))
    assert np.median(before) > 1.0
    assert after.max() < 0.1 * np.median(before)
    assert not spoiled(layout, smooth, rough, room).any()
    for (_, _, old), (_, _, new) in zip(rough.groups(), smooth.groups(), strict=True):
        assert (old[:, [0, -1]] == new[:, [0, -1]]).all()
        assert (old[:, :, [0, -1]] == new[:, :, [0, -1]]).all()


def changed(nets, patch, change):
    """Nets with the net (M, N, 3) of one patch changed."""
    controls = np.array(nets.controls)
    rows = slice(nets.offsets[patch], nets.offsets[patch + 1])
    controls[rows] = change(nets.nets(np.array([patch]))[0].copy()).reshape(-1, 3)
    return PatchNets(nets.cells, nets.offsets, controls)


def bulge(net):
    net[1:-1, 1:-1] *= 1.001
    return net


def backwards(net):
    net[1:-1, 1:-1] = net[-2:0:-1, 1:-1]
    return net


def test_stiff_patches_stay_and_their_neighbours_follow(ball):
    layout, network, _ = ball
    bulged = changed(network.nets, 7, bulge)
    rows = slice(bulged.offsets[7], bulged.offsets[8])
    moved = []
    for stiffness in (1.0, 1e3, 1e6):
        again = join(layout, bulged, np.full(len(bulged), 1e-3), np.where(np.arange(len(bulged)) == 7, stiffness, 1.0))
        moved.append(np.abs(again.controls[rows] - bulged.controls[rows]).max())
    assert moved[0] > 10.0 * moved[1] > 100.0 * moved[2] > 0.0
    before, after = (seam_angles(layout, side_normals(layout, nets)).max() for nets in (bulged, again))
    assert after < 0.2 * before


def test_only_a_patch_that_had_no_folded_seam_is_spoiled_by_a_fold(ball):
    layout, network, _ = ball
    folded, room = changed(network.nets, 7, backwards), np.ones(len(network))
    assert spoiled(layout, folded, network.nets, room).nonzero()[0].tolist() == [7]
    inside_out = changed(network.nets, 7, lambda net: 2.0 * net[[0, -1]].mean(axis=0) - net)
    assert seam_angles(layout, side_normals(layout, inside_out)).max() > 90.0
    assert not spoiled(layout, folded, inside_out, room).any()
    assert spoiled(layout, folded, inside_out, 1e-3 * room).nonzero()[0].tolist() == [7]


def test_regular_edges_keep_away_from_the_eight_corners_of_the_cube(ball):
    layout, _, _ = ball
    count = np.bincount(layout.edges.reshape(-1))
    assert (regular_edges(layout) == (count[layout.edges] == 4).all(axis=1)).all()


def test_the_target_tells_normals_where_patches_fold(ball):
    layout, network, target = ball
    out = layout.vertices[layout.quads]
    for nets in (network.nets, changed(network.nets, 7, backwards)):
        found = facing(nets, Target(target, Marks(target)))
        assert np.degrees(np.linalg.norm(found - out, axis=-1).max()) < 3.0
        assert np.degrees(np.linalg.norm(sector_normals(layout, found) - out, axis=-1).max()) < 3.0


def test_a_guess_far_off_is_not_turned(ball):
    layout, network, target = ball
    out = layout.vertices[layout.quads]
    guess = out + 0.7 * np.cross(out, (0.3, 0.5, 0.8))
    guess /= np.linalg.norm(guess, axis=-1, keepdims=True)
    off = np.degrees(np.arccos((guess * out).sum(axis=-1)))
    normals = vertex_normals(layout, network.nets, guess, Target(target, Marks(target)))
    assert np.array_equal(normals[off > 25.0], guess[off > 25.0])
    assert (off > 25.0).any()


@pytest.mark.parametrize("radius", [0.5, 4.0])
def test_curvatures_across_seams_are_those_of_the_ball(radius):
    target = SphereTarget(radius)
    layout = sphere_layout(2, radius)
    nets = resurface(layout, Target(target, Marks(target)), Tolerance(1e-9, 1e-4 * radius)).nets
    assert np.abs(side_curvatures(layout, nets) * radius + 1.0).max() < 0.02
    assert curvature_jumps(layout, nets).max() * radius < 0.02


def test_a_jump_of_curvature_is_measured():
    # a plane that meets the parabola z = k x^2 / 2 along x = 0 with one tangent plane
    k, t = 3.0, np.linspace(0.0, 1.0, 9)[:, None]
    corners = np.array([[-1.0, 0, 0], [0, 0, 0], [0, 1, 0], [-1, 1, 0], [1, 0, k / 2], [1, 1, k / 2]])
    quads = np.array([[0, 1, 2, 3], [1, 4, 5, 2]])
    layout = layout_from_quads(corners, quads, lambda a, b: (1 - t) * corners[a] + t * corners[b])
    u = greville(2)
    flat, bent = np.zeros((5, 5, 3)), np.zeros((5, 5, 3))
    flat[..., 0], bent[..., 0] = (u - 1.0)[:, None], u[:, None]
    flat[..., 1] = bent[..., 1] = u[None]
    sites = np.linspace(0, 1, 5)
    bent[..., 2] = np.linalg.solve(uniform_collocation(2, 5), 0.5 * k * sites**2)[:, None]
    nets = PatchNets.pack(np.full((2, 2), 2), [(np.arange(2), np.stack([flat, bent]))])
    jumps = curvature_jumps(layout, nets)
    assert jumps.max() == pytest.approx(k, rel=1e-12)
    assert (jumps > 1e-9).sum() == 1  # the boundaries have none
