"""Sizes: curvature of known surfaces, grading, counts."""

from __future__ import annotations

import numpy as np
import pytest
from layout_shapes import cube, cylinder, jittered, moved, sphere, torus, wedge

from patchwright.repair.layout.features import find_features
from patchwright.repair.layout.sizing import GRADING, STRIP_ASPECT, size_field, surface_curvature


@pytest.mark.parametrize("radius", [1e-3, 1.0, 50.0])
def test_curvature_of_a_sphere(radius):
    shape, _ = moved(sphere(24), radius)
    error = np.abs(surface_curvature(find_features(shape)) * radius - 1.0)
    # the eight vertices where three square grids meet have uneven neighbourhoods
    assert np.quantile(error, 0.99) < 0.08
    assert error.max() < 0.5


def test_curvature_of_a_sphere_converges():
    error = [np.abs(surface_curvature(find_features(sphere(n))) - 1.0).mean() for n in (8, 16, 32)]
    assert error[2] < 0.5 * error[0]


def test_curvature_of_a_cylinder_away_from_its_rims():
    features = find_features(cylinder(64, 24))
    z, r = features.body.vertices[:, 2], np.hypot(*features.body.vertices[:, :2].T)
    side = (np.abs(z - 1.0) < 0.5) & (r > 0.99)
    np.testing.assert_allclose(surface_curvature(features)[side], 1.0, rtol=0.02)


def test_a_flat_face_has_none():
    features = find_features(cube(6))
    assert surface_curvature(features).max() < 1e-9


def test_noise_cancels():
    features = find_features(jittered(sphere(48), 1e-3))
    assert np.median(surface_curvature(features)) == pytest.approx(1.0, rel=0.5)


def test_growth_is_bounded():
    features = find_features(torus(minor=0.1))
    size, _ = size_field(features)
    t = features.body.triangles
    for k in range(3):
        a, b = t[:, k], t[:, (k + 1) % 3]
        length = np.linalg.norm(features.body.vertices[a] - features.body.vertices[b], axis=1)
        assert (np.abs(size[a] - size[b]) <= 1.001 * GRADING * length + 2e-4 * size.max()).all()


def test_strips_limit_the_size():
    features = find_features(wedge())
    size, _ = size_field(features)
    v = features.body.vertices
    back = (v[:, 0] > 1.0 - 1e-9) & (np.abs(v[:, 2] - 1.0) < 0.5)
    assert size[back].max() <= (STRIP_ASPECT * 0.02 + GRADING * 0.01) * 1.001


@pytest.mark.parametrize("target", [50, 200, 800])
def test_the_field_stands_for_the_wanted_number(target):
    _, number = size_field(find_features(sphere()), target=target)
    assert number == pytest.approx(target, rel=0.05)
