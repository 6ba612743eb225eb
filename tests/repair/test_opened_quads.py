"""Quads that fold are opened: plane nets whose corners are torn across each other, and sides beside round holes."""

from __future__ import annotations

import numpy as np
import pytest
from layout_shapes import cylinder, moved, plate_with_hole, sheet, soup, sphere

from patchwright.repair.layout.features import find_features
from patchwright.repair.layout.finer_quads import side_arcs, split_in_four
from patchwright.repair.layout.opened_quads import opened
from patchwright.repair.layout.pairing import pair
from patchwright.repair.layout.quad_layout import quad_layout
from patchwright.repair.layout.quad_smooth import scaled_jacobians, smooth, update_outward
from patchwright.repair.layout.regular import regularize, unfolded
from patchwright.repair.layout.remesh import remesh


def paired(shape, size):
    features = find_features(shape)
    return pair(remesh(features, np.full(len(features.body.vertices), size))), features


def square(n=24):
    t = np.linspace(0.0, 1.0, n + 1)
    return soup(sheet(np.stack([*np.meshgrid(t, t, indexing="ij"), np.zeros((n + 1, n + 1))], axis=-1)))


def middles(quad_mesh):
    """Middles of the chords of all edges, in ascending order of their ends."""
    quads = quad_mesh.quads
    ends = np.unique(np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2), axis=1), axis=0)
    return quad_mesh.mesh.X[ends].mean(axis=1)


@pytest.mark.parametrize("shape", [cylinder(), plate_with_hole(), sphere()])
def test_four_quads_of_each_with_the_same_topology_on_the_same_curves(shape):
    mesh, features = paired(shape, 0.4)
    finer = split_in_four(mesh)
    fine = finer.quad_mesh
    n, e, m = len(mesh.mesh.X), len(finer.keys), len(mesh.quads)
    assert len(fine.mesh.X) == n + e + m
    assert len(fine.quads) == 4 * m
    tail, head = fine.quads.reshape(-1), np.roll(fine.quads, -1, axis=1).reshape(-1)
    count = np.unique(np.minimum(tail, head) * len(fine.mesh.X) + np.maximum(tail, head)).size
    assert count == 2 * e + 4 * m
    np.testing.assert_array_equal(fine.quads.reshape(m, 4, 4)[:, :, 0], mesh.quads)
    # every curve is covered once, by sides half as long
    low, high = side_arcs(fine).T
    np.testing.assert_allclose(np.bincount(fine.side_curve, weights=high - low), features.lengths, rtol=1e-12)
    assert len(fine.sides) == 2 * len(mesh.sides)
    assert (fine.mesh.kind[fine.sides] > 0).all()
    # refined lines run over the middles
    lines = finer.refined(np.stack([finer.keys // n, finer.keys % n], axis=1))
    np.testing.assert_array_equal(lines[:, 1], n + np.arange(e))


def torn(shape, where, to):
    """A smoothed layout's quads with the free vertex nearest to a place moved to another."""
    mesh, _ = paired(shape, 0.2)
    smooth(mesh)
    free = np.flatnonzero(mesh.mesh.kind == 0)
    v = free[np.linalg.norm(mesh.mesh.X[free] - where, axis=1).argmin()]
    mesh.mesh.X[v] = to
    corners = shape.corners
    mesh.mesh.vt[v] = np.linalg.norm(corners.mean(axis=1) - to, axis=1).argmin()
    update_outward(mesh.mesh, mesh.ground, mesh.quads, mesh.region, mesh.outward)
    return mesh


@pytest.mark.parametrize("to", [(0.75, 0.5, 0.0), (0.5, 0.2, 0.0), (0.8, 0.85, 0.0)])
def test_torn_plane_quads_are_unfolded_and_those_far_away_and_the_rim_stay(to):
    mesh = torn(square(), (0.5, 0.5, 0.0), np.array(to))
    assert scaled_jacobians(mesh).min() < 0.0
    found = opened(mesh, middles(mesh))
    assert found.quality.min() > 0.0
    assert scaled_jacobians(found.quad_mesh).min() > 0.0
    held = mesh.mesh.kind > 0
    np.testing.assert_array_equal(found.quad_mesh.mesh.X[held], mesh.mesh.X[held])
    assert np.abs(found.quad_mesh.mesh.X[:, 2]).max() == 0.0
    assert len(found.edges)
    assert (found.paths[:, 0] == found.quad_mesh.mesh.X[found.edges[:, 0]]).all()
    assert (found.paths[:, -1] == found.quad_mesh.mesh.X[found.edges[:, 1]]).all()


def test_good_quads_stay_where_they_are():
    mesh, _ = paired(plate_with_hole(), 0.25)
    smooth(mesh)
    before = mesh.mesh.X.copy()
    found = opened(mesh, middles(mesh))
    assert found.quality.min() > 0.1
    assert not len(found.edges)
    np.testing.assert_array_equal(found.quad_mesh.mesh.X, before)


def hole_near_a_corner(near=0.03, segments=64, radius=0.35):
    """A unit square plate, 0.1 thick, with a round hole that comes near to two of its sides."""
    from patchwright.models import Triangulation

    middle = np.array([radius + near, radius + near])
    angle = 2 * np.pi * np.arange(segments) / segments
    ring = middle + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    # the rays from the middle through the ring's points to the square, its corners among them
    way = ring - middle
    with np.errstate(divide="ignore"):
        reach = np.where(way > 0, (1.0 - middle) / way, np.where(way < 0, -middle / way, np.inf)).min(axis=1)
    outer = middle + reach[:, None] * way
    for corner in ((0, 0), (1, 0), (0, 1), (1, 1)):
        outer[np.linalg.norm(outer - corner, axis=1).argmin()] = corner
    steps = np.linspace(0.0, 1.0, 7)
    face = (1 - steps[:, None, None]) * ring + steps[:, None, None] * outer
    face = np.concatenate([face, face[:, :1]], axis=1)
    flat = np.zeros(face.shape[:2])
    top = np.concatenate([face, flat[..., None] + 0.1], axis=2)
    bottom = np.concatenate([face, flat[..., None]], axis=2)
    rim = lambda k: np.stack([bottom[k], top[k]], axis=0)  # noqa: E731
    parts = [sheet(top), sheet(bottom[::-1]), sheet(rim(0)), sheet(rim(-1)[::-1])]
    body = soup(np.concatenate(parts))
    return body if body.volume > 0 else Triangulation(body.vertices, body.triangles[:, ::-1])


@pytest.mark.parametrize("scale", [1.0, 1e3])
@pytest.mark.parametrize("near", [0.03, 0.02, 0.01])
def test_no_quad_folds_where_a_round_hole_comes_near_to_a_corner(near, scale):
    layout = quad_layout(moved(hole_near_a_corner(near), scale)[0])
    assert layout.report.folded == 0
    assert layout.report.feature_coverage == pytest.approx(1.0)
    assert layout.report.euler == (0, 0)


@pytest.mark.parametrize("shape", [cylinder(), plate_with_hole(), hole_near_a_corner(0.1)])
def test_curves_lose_no_edge_where_the_sides_left_would_bend_through_a_quarter_circle(shape):
    mesh, features = paired(shape, 0.4)

    def straightness(quads):
        """Chord over the two to the arc's middle: cos(turn / 4) on a circle."""
        arcs = side_arcs(quads)
        ends = quads.mesh.X[quads.sides]
        middle = np.empty((len(arcs), 3))
        for i, c in enumerate(quads.side_curve):
            rows = slice(features.offsets[c], features.offsets[c + 1])
            points, s = features.body.vertices[features.vertices[rows]], features.along[rows]
            middle[i] = [np.interp(arcs[i].mean(), s, points[:, d]) for d in range(3)]
        return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / np.linalg.norm(ends - middle[:, None], axis=2).sum(
            axis=1
        )

    before = straightness(mesh).min()
    regular = regularize(unfolded(mesh)[0])
    assert straightness(regular).min() >= min(0.93, before) - 1e-12


@pytest.mark.parametrize("shape", [cylinder(), plate_with_hole(), hole_near_a_corner()])
def test_no_corner_of_a_quad_is_flat_on_a_curve(shape):
    mesh, _ = paired(shape, 0.4)
    n = len(mesh.mesh.X)
    hard = np.sort(mesh.sides, axis=1) @ np.array([n, 1])
    ahead = np.roll(mesh.quads, -1, axis=1)
    on = np.isin(np.minimum(mesh.quads, ahead) * n + np.maximum(mesh.quads, ahead), hard)
    flat = on & np.roll(on, 1, axis=1) & (mesh.mesh.kind[mesh.quads] == 1)
    assert not flat.any()
