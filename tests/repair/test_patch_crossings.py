from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patchwright.models import Assembly, Triangulation, samples
from patchwright.models.arrays import frozen
from patchwright.repair import repair
from patchwright.repair.patches.network import PatchNetwork
from patchwright.repair.patches.patch_crossings import crossing_entries, patch_crossings


@pytest.fixture(scope="module")
def ball() -> PatchNetwork:
    network = repair(samples.sphere().assembly).network
    assert network is not None
    return network


def pushed(network: PatchNetwork, patch: int, factor: float) -> PatchNetwork:
    """With the inner control points of one patch moved towards or through the origin; its border stays."""
    nets = network.nets
    m, n = nets.cells[patch] + 3
    inner = (nets.offsets[patch] + np.arange(m * n).reshape(m, n))[1:-1, 1:-1]
    controls = nets.controls.copy()
    controls[inner] *= factor
    return replace(network, nets=replace(nets, controls=frozen(controls, np.float64)))


def test_a_ball_crosses_itself_nowhere(ball: PatchNetwork) -> None:
    pairs, where = patch_crossings(ball, 1e-9)
    assert pairs.shape == (0, 2)
    assert where.shape == (0, 3)
    assert crossing_entries(ball, (), 1e-9) == ()


def test_a_patch_pushed_through_the_others_is_told_with_its_place(ball: PatchNetwork) -> None:
    pairs, where = patch_crossings(pushed(ball, 0, -3.0), 1e-9)
    assert len(pairs) > 0
    assert (pairs == 0).any(axis=1).all()
    # the places lie on the ball, which the patch passes through
    others = where[(pairs != 0).any(axis=1)]
    assert len(others) > 0
    assert np.linalg.norm(others, axis=1).max() < 1.05
    (entry,) = crossing_entries(pushed(ball, 0, -3.0), ("skin",), 1e-9)
    assert entry.count == len(pairs)
    assert entry.parts == ("skin",)
    assert "pass through each other" in entry.reason


def test_a_patch_pushed_in_but_not_through_crosses_nothing(ball: PatchNetwork) -> None:
    assert len(patch_crossings(pushed(ball, 0, 0.97), 1e-9)[0]) == 0


def test_a_clean_ball_is_repaired_without_a_word_of_crossings() -> None:
    body = samples.sphere().assembly.triangulation
    result = repair(Assembly.of(Triangulation(1e3 * body.vertices, body.triangles)))
    assert result.figures["pairs of patches that cross"] == 0
    assert not [entry for entry in result.ledger if entry.what == "patches cross"]
