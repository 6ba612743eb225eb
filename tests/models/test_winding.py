"""Winding numbers against the sum of all solid angles and against what inside and outside mean."""

from __future__ import annotations

import numpy as np
import pytest
from oracles_tree import icosphere, noisy_torus, solid_angle_winding

from patchwright.models.errors import ParameterError
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation, concatenate
from patchwright.models.winding import winding_number


@pytest.fixture(scope="module")
def soup() -> Triangulation:
    """A torus with a tenth of its triangles missing."""
    torus = Triangulation(*noisy_torus(60, 30, 0.05))
    return torus.take(np.random.default_rng(0).random(len(torus)) < 0.9)


@pytest.fixture(scope="module")
def points() -> np.ndarray:
    return np.random.default_rng(1).uniform(-14, 14, (400, 3)) * [1, 1, 0.3]


@pytest.fixture(scope="module")
def truth(soup, points) -> np.ndarray:
    return solid_angle_winding(soup.corners, points)


def test_accuracy_zero_sums_every_triangle(soup, points, truth):
    assert np.abs(winding_number(soup, points, accuracy=0.0) - truth).max() < 1e-13


@pytest.mark.parametrize("accuracy", [1e-1, 1e-2, 1e-3, 1e-4])
def test_the_accuracy_asked_for_is_reached(soup, points, truth, accuracy):
    error = np.abs(winding_number(soup, points, accuracy=accuracy) - truth).max()
    assert error <= accuracy
    if accuracy > 1e-3:
        assert error > 0.0  # it did take nodes whole


def test_one_inside_and_zero_outside_a_closed_surface():
    vertices, triangles = icosphere(3)
    rng = np.random.default_rng(2)
    ways = rng.normal(size=(500, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    sphere = Triangulation(vertices, triangles)
    assert np.abs(winding_number(sphere, ways * rng.uniform(0, 0.95, (500, 1))) - 1.0).max() < 1e-2
    assert np.abs(winding_number(sphere, ways * rng.uniform(1.02, 50, (500, 1)))).max() < 1e-2


def test_turning_the_triangles_turns_the_sign_and_doubling_them_doubles(soup, points):
    turned = Triangulation(soup.vertices, soup.triangles[:, ::-1])
    once = winding_number(soup, points)
    assert np.abs(winding_number(turned, points) + once).max() < 1e-12
    assert np.abs(winding_number(concatenate([soup, soup]), points, accuracy=0.0) - 2 * once).max() < 2e-2


@pytest.mark.parametrize("scale", [1e-3, 1e3])
@pytest.mark.parametrize("shift", [0.0, 26e3])
def test_scale_and_place_do_not_matter(soup, points, truth, scale, shift):
    moved = Triangulation((soup.vertices + shift) * scale, soup.triangles)
    assert np.abs(winding_number(moved, (points + shift) * scale) - truth).max() < 1e-2


def test_one_triangle_covers_an_eighth_of_the_sky():
    triangle = Triangulation(np.eye(3), [[0, 1, 2]])
    assert winding_number(triangle, [0.0, 0, 0], accuracy=0.0)[0] == pytest.approx(0.125, abs=1e-15)
    assert winding_number(triangle, [0.0, 0, 0], tree=Tree.of(triangle))[0] == pytest.approx(0.125, abs=1e-2)


def test_no_triangles_no_winding_and_no_area_no_nan():
    empty = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    assert winding_number(empty, np.ones((3, 3))).tolist() == [0, 0, 0]
    flat = Triangulation(np.ones((3, 3)), [[0, 1, 2]] * 9)
    assert winding_number(flat, [[1.0, 1, 1], [0, 0, 0]]).tolist() == [0, 0]


def test_bad_questions_are_refused(soup):
    with pytest.raises(ParameterError, match="row 0 of points"):
        winding_number(soup, [np.inf, 0, 0])
    with pytest.raises(ParameterError, match="accuracy"):
        winding_number(soup, [0.0, 0, 0], accuracy=-1.0)
