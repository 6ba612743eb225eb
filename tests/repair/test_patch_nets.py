"""Coons nets are exact Coons patches; folds are told from bends."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.repair.patches.coons import coons_grid
from patchwright.repair.patches.patch_nets import PatchNets, coons_nets, evaluate, folds
from patchwright.repair.patches.spline_space import collocation, greville, uniform_collocation


def boundary(m, n):
    rng = np.random.default_rng(m + 16 * n)
    rows = [rng.normal(size=(3, count + 3, 3)) for count in (m, m, n, n)]
    for side, end, other, tip in ((0, 0, 2, 0), (0, -1, 3, 0), (1, 0, 2, -1), (1, -1, 3, -1)):
        rows[other][:, tip] = rows[side][:, end]
    return rows


@pytest.mark.parametrize("cells", [(2, 2), (4, 2), (8, 16)])
def test_coons_nets_are_the_coons_patches_of_their_sides(cells):
    m, n = cells
    south, north, west, east = boundary(m, n)
    nets = coons_nets(south, north, west, east)
    u, v = uniform_collocation(m, 9), uniform_collocation(n, 7)
    assert np.allclose(evaluate(nets, u, v), coons_grid(u @ south, u @ north, v @ west, v @ east), atol=1e-13)
    for ours, given in ((nets[:, :, 0], south), (nets[:, :, -1], north), (nets[:, 0], west), (nets[:, -1], east)):
        assert np.allclose(ours, given, atol=1e-14)


def net_of(surface, cells=8):
    """One net that interpolates surface(u, v) at the Greville abscissae."""
    sites = greville(cells)
    u, v = np.meshgrid(sites, sites, indexing="ij")
    inverse = np.linalg.inv(collocation(cells, sites))
    nets = np.einsum("ai,bj,ijd->abd", inverse, inverse, surface(u, v))
    return PatchNets.pack(np.array([[cells, cells]]), [(np.array([0]), nets[None])])


@pytest.mark.parametrize("turn", [0.1, 180.0, 300.0])
def test_a_bend_is_no_fold(turn):
    angle = np.radians(turn)
    bent = net_of(lambda u, v: np.stack([np.sin(angle * u), v, np.cos(angle * u)], axis=-1))
    assert folds(bent)[0] == 0.0


def test_a_sheet_that_turns_back_is_a_fold_and_the_way_of_its_parameters_does_not_matter():
    folded = net_of(lambda u, v: np.stack([u * (1.5 - u), v, 0.0 * u], axis=-1))
    across = net_of(lambda u, v: np.stack([v * (1.5 - v), u, 0.0 * u], axis=-1))
    assert folds(folded)[0] > 0.0
    assert folds(across)[0] == folds(folded)[0]


def test_refined_nets_are_the_same_surfaces():
    rng = np.random.default_rng(3)
    cells = np.array([[2, 2], [4, 2], [2, 4]])
    groups = [(np.array([i]), rng.normal(size=(1, m + 3, n + 3, 3))) for i, (m, n) in enumerate(cells)]
    nets = PatchNets.pack(cells, groups)
    finer = nets.refined(cells * [[2, 1], [1, 1], [2, 4]])
    assert finer.cells.tolist() == [[4, 2], [4, 2], [4, 16]]
    np.testing.assert_allclose(finer.sample(17), nets.sample(17), atol=1e-13)
