from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import Triangulation
from patchwright.repair.mender.orient import orient


@pytest.mark.parametrize("share", [0.0, 0.4, 0.9, 1.0])
def test_flipped_triangles_come_back(share: float) -> None:
    whole = shapes.sphere(3)
    flip = np.random.default_rng(1).random(len(whole)) < share
    dirty = Triangulation(whole.vertices, np.where(flip[:, None], whole.triangles[:, ::-1], whole.triangles))
    oriented = orient(dirty)
    assert np.array_equal(oriented.flipped, flip)
    assert oriented.triangulation.volume == pytest.approx(whole.volume, rel=1e-14)


def test_an_open_surface_that_came_consistent_is_left_alone() -> None:
    inward = shapes.half(1, 0.0)
    inward = Triangulation(inward.vertices, inward.triangles[:, ::-1])
    assert not orient(inward).flipped.any()


def test_an_open_surface_that_came_mixed_faces_outward() -> None:
    whole = shapes.half(1, 0.0)
    flip = np.random.default_rng(2).random(len(whole)) < 0.7
    dirty = Triangulation(whole.vertices, np.where(flip[:, None], whole.triangles[:, ::-1], whole.triangles))
    assert np.array_equal(orient(dirty).flipped, flip)


def test_a_moebius_band_is_said_to_be_one_sided() -> None:
    n = 24
    u = np.linspace(0, 2 * np.pi, n, endpoint=False)
    rows = []
    for s in (-0.3, 0.3):
        r = 1 + s * np.cos(u / 2)
        rows.append(np.stack([r * np.cos(u), r * np.sin(u), s * np.sin(u / 2)], axis=1))
    i = np.arange(n - 1)
    last = np.array([[n - 1, n, 2 * n - 1], [n, 0, 2 * n - 1]])
    triangles = np.concatenate([np.stack([i, i + 1, n + i], axis=1), np.stack([i + 1, n + i + 1, n + i], axis=1), last])
    band = Triangulation(np.concatenate(rows), triangles)
    oriented = orient(band)
    assert oriented.one_sided.tolist() == [True]


def test_two_bodies_are_judged_one_by_one() -> None:
    a, b = shapes.sphere(2), shapes.sphere(2, at=(5, 0, 0))
    both = shapes.together(a, Triangulation(b.vertices, b.triangles[:, ::-1]))
    oriented = orient(both)
    assert oriented.flipped.tolist() == [False] * len(a) + [True] * len(b)
