from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import Tolerance, Triangulation
from patchwright.repair.mender.crossings import crossing_pairs, crossing_pairs_after
from patchwright.repair.mender.mended import Work


def two_spheres() -> Triangulation:
    one = shapes.sphere(3)
    return shapes.together(one, Triangulation(one.vertices + np.array([0.7, 0.1, 0.2]), one.triangles))


@pytest.mark.parametrize("share", [0.0, 0.05, 0.4, 0.9])
def test_looking_at_new_triangles_alone_finds_what_looking_at_all_finds(share: float) -> None:
    rng = np.random.default_rng(3)
    before = two_spheres()
    known = crossing_pairs(before, 1e-12)
    assert len(known) > 50
    # some triangles go, the others come in another order, some of them moved
    left = rng.permutation(len(before))[: int(0.9 * len(before))]
    moved = rng.random(len(left)) < share
    corners = before.corners[left]
    corners[moved] += rng.normal(size=(int(moved.sum()), 1, 3)) * 0.05
    after = Triangulation(corners.reshape(-1, 3), np.arange(3 * len(left)).reshape(-1, 3))
    found = crossing_pairs_after(
        after, 1e-12, before, known, np.where(moved & (np.arange(len(left)) % 2 == 0), -1, left)
    )
    assert np.array_equal(found, crossing_pairs(after, 1e-12))


def test_a_state_on_its_way_remembers_the_crossings_of_what_stays() -> None:
    whole = two_spheres()
    nothing = np.zeros(len(whole), dtype=np.int64)
    work = Work(whole, whole, np.arange(len(whole)), nothing, Tolerance.of(whole))
    first = work.crossings()
    mark = work.mark()
    left = np.setdiff1d(np.arange(len(whole)), first[:20])
    work.follow(whole.take(left), left)
    assert np.array_equal(work.crossings(), crossing_pairs(work.now, 1e-3 * work.tolerance.gap))
    work.now = Triangulation(work.now.vertices * [1.0, 1.0, 1.1], work.now.triangles)  # behind its back
    assert np.array_equal(work.crossings(), crossing_pairs(work.now, 1e-3 * work.tolerance.gap))
    work.back(mark)
    assert np.array_equal(work.crossings(), first)
