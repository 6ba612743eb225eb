"""Coons patches: exact cases, invariance under rigid motion, and curves that do not meet."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models.errors import GeometryError
from patchwright.repair.patches.coons import check_corners, coons_grid, offset_distance, offset_normals


def sides_of(surface, m, n):
    u, v = np.linspace(0, 1, m + 1), np.linspace(0, 1, n + 1)
    return surface(u, 0 * u), surface(u, 0 * u + 1), surface(0 * v, v), surface(0 * v + 1, v)


def bilinear(u, v):
    return np.stack([u + 0.3 * v, v - 0.2 * u, 0.7 * u * v], axis=-1)


def translational(u, v):
    """A sum of two curves: the other family a bilinear Coons patch reproduces."""
    return np.stack([u, v, np.sin(3 * u) + np.cos(2 * v)], axis=-1)


@pytest.mark.parametrize("surface", [bilinear, translational])
def test_reproduces_what_the_bilinear_blend_can_hold(surface):
    m, n = 7, 11
    u, v = np.meshgrid(np.linspace(0, 1, m + 1), np.linspace(0, 1, n + 1), indexing="ij")
    assert np.allclose(coons_grid(*sides_of(surface, m, n)), surface(u, v), atol=1e-15)


def test_boundaries_are_kept_bit_for_bit_up_to_round_off():
    rng = np.random.default_rng(3)
    south, north, west, east = (rng.normal(size=(9, 3)) for _ in range(4))
    west[0], east[0] = south[0], south[-1]
    west[-1], east[-1] = north[0], north[-1]
    grid = coons_grid(south, north, west, east)
    for line, side in ((grid[:, 0], south), (grid[:, -1], north), (grid[0], west), (grid[-1], east)):
        assert np.allclose(line, side, atol=1e-14)


def test_many_patches_at_once_are_each_patch_alone():
    rng = np.random.default_rng(4)
    stack = [rng.normal(size=(5, k, 3)) for k in (6, 6, 8, 8)]
    together = coons_grid(*stack)
    for i in range(5):
        assert np.array_equal(together[i], coons_grid(*(s[i] for s in stack)))


def test_curves_that_miss_each_other_name_the_corner_and_the_gap():
    south, north, west, east = sides_of(bilinear, 4, 4)
    east = east + np.array([0.0, 0.0, 0.25])
    with pytest.raises(GeometryError, match=r"-east corner by 0\.25"):
        check_corners(south, north, west, east, 1e-6)
    check_corners(south, north, west, east, 0.3)


def test_offset_normals_are_exact_on_a_plane_and_turn_with_it():
    u, v = np.meshgrid(np.linspace(0, 2, 6), np.linspace(0, 1, 5), indexing="ij")
    grid = np.stack([u, v, 0 * u], axis=-1)
    assert np.allclose(offset_normals(grid), [0, 0, 1])
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    assert np.allclose(offset_normals(grid @ turn.T), turn[:, 2])
    assert offset_distance(grid) == pytest.approx(6.0 / 8.0)


def test_a_collapsed_corner_still_has_a_normal():
    u, v = np.meshgrid(np.linspace(0, 1, 6), np.linspace(0, 1, 6), indexing="ij")
    grid = np.stack([u * v, v, 0 * u], axis=-1)  # the side v = 0 is one point
    normal = offset_normals(grid)
    assert np.allclose(normal, [0, 0, 1])
