"""Coarse triangles: on the surface, along the features, of the wanted length, of the same topology."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from layout_shapes import cube, cylinder, plate_with_hole, sphere, torus, wedge

from patchwright.repair.layout.features import find_features
from patchwright.repair.layout.remesh import remesh

SHAPES = {
    "cube": (cube(8), 2, 12.0),
    "sphere": (sphere(24), 2, 0.0),
    "torus": (torus(), 0, 0.0),
    "cylinder": (cylinder(), 2, 2 * 96 * np.sin(np.pi / 48)),
    "plate": (plate_with_hole(), 0, 8.0 + 128 * 0.4 * np.sin(np.pi / 64)),
    "wedge": (wedge(), 2, None),
}


@pytest.fixture(scope="module")
def meshes():
    out = {}
    for name, (shape, *_) in SHAPES.items():
        features = find_features(shape)
        out[name] = features, remesh(features, np.full(len(features.body.vertices), 0.25))
    return out


@pytest.mark.parametrize("name", SHAPES)
def test_topology_is_kept(meshes, name):
    _, coarse = meshes[name]
    t = coarse.triangles
    edges, count = np.unique(
        np.sort(np.stack([t, np.roll(t, -1, axis=1)], axis=2).reshape(-1, 2)), axis=0, return_counts=True
    )
    assert len(np.unique(t)) - len(edges) + len(t) == SHAPES[name][1]
    assert count.max() == 2
    assert (count == 1).sum() == (coarse.mesh.B < 0).sum()
    # each side's neighbour has the same side the other way round
    m, k = np.nonzero(coarse.mesh.B >= 0)
    other = coarse.mesh.B[m, k]
    back = (t[other] == t[m, (k + 1) % 3][:, None]) & (np.roll(t[other], -1, axis=1) == t[m, k][:, None])
    assert back.any(axis=1).all()


@pytest.mark.parametrize("name", SHAPES)
def test_curves_are_followed_from_end_to_end(meshes, name):
    features, coarse = meshes[name]
    m, k = np.nonzero(coarse.side_curve >= 0)
    curve = coarse.side_curve[m, k]
    chord = np.linalg.norm(
        coarse.vertices[coarse.triangles[m, k]] - coarse.vertices[coarse.triangles[m, (k + 1) % 3]], axis=1
    )
    single = coarse.mesh.B[m, k] < 0
    total = np.bincount(curve, weights=chord * np.where(single, 1.0, 0.5), minlength=len(features.kind))
    assert (total <= features.lengths * (1 + 1e-9)).all()
    assert (total >= 0.95 * features.lengths).all()


@pytest.mark.parametrize("name", ["sphere", "torus", "cube", "plate"])
def test_lengths_are_the_wanted_ones(meshes, name):
    _, coarse = meshes[name]
    p = coarse.vertices[coarse.triangles]
    length = np.linalg.norm(p - np.roll(p, -1, axis=1), axis=2)
    assert np.median(length) == pytest.approx(0.25, rel=0.2)
    assert length.max() < 0.6


def test_vertices_lie_on_the_surface(meshes):
    features, coarse = meshes["sphere"]
    p = features.body.corners[coarse.mesh.vt]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    assert np.abs(np.einsum("ij,ij->i", coarse.vertices - p[:, 0], normal)).max() < 1e-12


def test_nothing_is_folded(meshes):
    _, coarse = meshes["sphere"]
    p = coarse.vertices[coarse.triangles]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    assert (np.einsum("ij,ij->i", normal, p.mean(axis=1)) > 0).all()


def test_a_coarse_input_is_refined():
    features = find_features(cube(1))
    coarse = remesh(features, np.full(8, 0.2))
    p = coarse.vertices[coarse.triangles]
    area = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    assert len(p) > 150
    assert area.sum() == pytest.approx(6.0, rel=1e-12)


def test_the_number_follows_the_length():
    features = find_features(sphere(32))
    n = len(features.body.vertices)
    count = [len(remesh(features, np.full(n, h)).triangles) for h in (0.4, 0.2, 0.1)]
    for coarse, fine in pairwise(count):
        assert 3.0 < fine / coarse < 5.2


@pytest.mark.parametrize("sections", [96, 768, 3072])
def test_long_needles_are_cleared_away(sections):
    # triangles as long as the cylinder and down to 250 times narrower, wanted lengths between
    shape = cylinder(sections, 1)
    features = find_features(shape)
    coarse = remesh(features, np.full(len(features.body.vertices), 0.25))
    corners = coarse.vertices[coarse.triangles]
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert (4 * np.sqrt(3) * area / (sides**2).sum(axis=1)).min() > 0.3
    assert sides.max() < 2 * 0.25
