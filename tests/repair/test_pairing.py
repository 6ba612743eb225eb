"""Triangles to quads: pure quads, consistent, same topology, good pairs preferred."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from layout_shapes import cube, plate_with_hole, sphere, torus

from patchwright.repair.layout._quad_kernel import match
from patchwright.repair.layout.features import find_features
from patchwright.repair.layout.pairing import UNPAIRED, pair, pair_score, part_doublets
from patchwright.repair.layout.quad_smooth import scaled_jacobians, smooth
from patchwright.repair.layout.remesh import remesh


def coarse_of(shape, size):
    features = find_features(shape)
    return remesh(features, np.full(len(features.body.vertices), size))


@pytest.mark.parametrize(("shape", "euler"), [(cube(4), 2), (sphere(), 2), (torus(), 0), (plate_with_hole(), 0)])
def test_pure_quads_of_the_same_topology(shape, euler):
    mesh = pair(coarse_of(shape, 0.35))
    q = mesh.quads
    start, end = q.reshape(-1), np.roll(q, -1, axis=1).reshape(-1)
    assert len(np.unique(np.stack([start, end], axis=1), axis=0)) == q.size
    edges = np.unique(np.sort(np.stack([start, end], axis=1), axis=1), axis=0)
    assert len(np.unique(q)) - len(edges) + len(q) == euler
    assert len(np.unique(q)) == len(mesh.mesh.X)


def test_score_of_right_angles_is_one():
    coarse = coarse_of(cube(1), 2.0)  # nothing to refine: two right triangles per face
    assert len(coarse.triangles) == 12
    score = pair_score(coarse)
    smooth_sides = coarse.side_curve < 0
    np.testing.assert_allclose(score[smooth_sides], 1.0, rtol=1e-12)
    assert (score[~smooth_sides] == 0.0).all()


def test_an_unlucky_first_choice_is_repaired():
    # a row of four triangles: the middle pair scores best, but taking it leaves both ends alone
    neighbours = np.array([[1, -1, -1], [0, 2, -1], [1, 3, -1], [2, -1, -1]])
    score = np.array([[0.9, 0, 0], [0.9, 1.0, 0], [1.0, 0.9, 0], [0.9, 0, 0]], dtype=float)
    partner = match(neighbours, score, np.argsort(-score.reshape(-1), kind="stable"), UNPAIRED)
    assert (partner >= 0).all()
    assert neighbours[0, partner[0]] == 1
    assert neighbours[3, partner[3]] == 2


def test_partners_are_mutual():
    coarse = coarse_of(sphere(), 0.3)
    score = pair_score(coarse)
    partner = match(coarse.mesh.B, score, np.argsort(-score.reshape(-1), kind="stable"), UNPAIRED)
    t = np.flatnonzero(partner >= 0)
    o = coarse.mesh.B[t, partner[t]]
    np.testing.assert_array_equal(coarse.mesh.B[o, partner[o]], t)
    assert len(t) > 0.75 * len(partner)


def test_smoothing_betters_the_worst_quad():
    mesh = pair(coarse_of(torus(), 0.3))
    smooth(mesh, rounds=0)
    before = scaled_jacobians(mesh)
    smooth(mesh)
    after = scaled_jacobians(mesh)
    assert after.min() >= min(before.min(), 0.55)
    assert np.median(after) > np.median(before)


@pytest.mark.parametrize(("kind", "kept"), [(0, False), (1, True)])
def test_no_inner_vertex_keeps_two_edges(kind, kept):
    # a triangle split at vertex 0: joining two of the three leaves 0 between two quads that share both its edges
    mesh = SimpleNamespace(
        T=np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1]]),
        B=np.array([[2, -1, 1], [0, -1, 2], [1, -1, 0]]),
        X=np.zeros((4, 3)),
        kind=np.array([kind, 2, 2, 2]),
    )
    partner = np.array([2, 0, -1])
    part_doublets(mesh, np.ones((3, 3)), partner)
    np.testing.assert_array_equal(partner, [2, 0, -1] if kept else [-1, -1, -1])


def test_layouts_have_no_doublets():
    for shape, size in ((sphere(), 0.3), (sphere(), 0.7), (torus(), 0.35)):
        quads = pair(coarse_of(shape, size)).quads
        assert np.bincount(quads.reshape(-1)).min() >= 3
