"""Polygons into triangles: area and direction are kept, no triangle is inverted, whatever the polygon's place in
space."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patchwright.models import UnsupportedEntity
from patchwright.models.io.polygons import MOST_CORNERS, triangulated

HERE = Path("polygons.obj")


def cut(flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed areas of a plane polygon's triangles, and the triangles."""
    points = np.column_stack([flat, np.zeros(len(flat))])
    triangles, _ = triangulated(HERE, points, np.arange(len(flat)), np.array([0, len(flat)]))
    a, b, c = np.moveaxis(flat[triangles], 1, 0)
    u, v = b - a, c - a
    return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]), triangles


def area(flat: np.ndarray) -> float:
    x, y = flat.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def star(n: int, seed: int) -> np.ndarray:
    """A polygon seen whole from the origin with random radii: simple, mostly concave, counter-clockwise."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(0.1, 0.9, n)) / n
    return rng.uniform(0.1, 1.0, (n, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])


@given(st.integers(4, 40), st.integers(0, 10**6))
@settings(deadline=None)
def test_simple_polygons_give_no_inverted_triangle_and_keep_their_area(n: int, seed: int) -> None:
    flat = star(n, seed)
    areas, triangles = cut(flat)
    assert len(triangles) == n - 2
    assert areas.min() >= -1e-15
    assert areas.sum() == pytest.approx(area(flat), rel=1e-12)
    assert set(triangles.ravel()) == set(range(n))


def test_a_comb_with_corners_on_its_edges() -> None:
    teeth = [(x, 1.0 if x % 2 else 0.2) for x in range(10, -1, -1)]
    base = [(float(x), 0.0) for x in range(11)]  # eleven corners on one straight line
    flat = np.array(base + teeth)
    areas, _ = cut(flat)
    assert areas.min() >= 0.0
    assert areas.sum() == pytest.approx(area(flat), rel=1e-12)


@pytest.mark.parametrize("turn", range(4))
def test_a_concave_quad_is_cut_along_its_only_inner_diagonal(turn: int) -> None:
    arrow = np.roll(np.array([[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.5, 1.0]]), turn, axis=0)
    areas, _ = cut(arrow)
    assert areas.min() > 0.0
    assert areas.sum() == pytest.approx(1.5)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_the_cut_does_not_depend_on_place_and_size(scale: float) -> None:
    flat = star(13, 3)
    _, expected = cut(flat)
    q, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    points = scale * np.column_stack([flat, np.zeros(13)]) @ q.T + 5.0
    triangles, _ = triangulated(HERE, points, np.arange(13), np.array([0, 13]))
    assert np.array_equal(triangles, expected)


def test_mixed_polygons_keep_order_direction_and_owner() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 2, 0]])
    corners = np.array([0, 1, 2, 3, 4, 0, 1, 0, 1, 2, 3, 0, 1])
    triangles, owners = triangulated(HERE, points, corners, np.array([0, 3, 5, 6, 6, 13]) * 1)
    assert owners.tolist() == [0] + [4] * 5
    assert triangles[0].tolist() == [0, 1, 2]


def test_polygons_without_area_still_give_their_triangles() -> None:
    triangles, _ = triangulated(HERE, np.zeros((6, 3)), np.arange(6), np.array([0, 6]))
    assert len(triangles) == 4


def test_a_polygon_with_too_many_corners_is_refused() -> None:
    n = MOST_CORNERS + 1
    with pytest.raises(UnsupportedEntity, match=str(n)):
        triangulated(HERE, np.zeros((n, 3)), np.arange(n), np.array([0, n]))
