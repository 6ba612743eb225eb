"""The nested cubic spaces: partition of unity, exact refinement, least squares that reproduce the space."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.repair.patches import spline_space as space


@pytest.mark.parametrize("cells", [1, 2, 3, 8, 16])
def test_basis_sums_to_one_and_reproduces_cubics(cells):
    t = np.linspace(0, 1, 57)
    basis = space.collocation(cells, t)
    assert np.allclose(basis.sum(axis=1), 1.0, atol=1e-14)
    coefficients = np.linalg.solve(space.collocation(cells, space.greville(cells)), space.greville(cells) ** 3)
    assert np.allclose(basis @ coefficients, t**3, atol=1e-13)


@pytest.mark.parametrize(("coarse", "fine"), [(1, 2), (1, 16), (2, 8), (3, 12)])
def test_refinement_is_the_same_curve(coarse, fine):
    control = np.random.default_rng(coarse).normal(size=(coarse + 3, 3))
    t = np.linspace(0, 1, 101)
    refined = space.refinement(coarse, fine) @ control
    assert np.allclose(space.collocation(fine, t) @ refined, space.collocation(coarse, t) @ control, atol=1e-13)
    assert np.array_equal(refined[[0, -1]], control[[0, -1]])


def test_spaces_that_are_not_nested_are_refused():
    with pytest.raises(ValueError, match="4 cells do not refine 3"):
        space.refinement(3, 4)
