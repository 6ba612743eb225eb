"""Points that hang together are found whole, however many lie in one place."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.ssi.singular_points import grouped


@pytest.mark.parametrize("scale", [1e-7, 1.0, 1e4])
def test_chains_are_one_group_each(scale: float) -> None:
    x = np.concatenate([0.9 * np.arange(10), 20.0 + 0.9 * np.arange(5)])
    mixed = np.random.default_rng(1).permutation(15)
    points = scale * np.column_stack([x, 0.0 * x, 0.0 * x])[mixed]
    groups = [set(mixed[g].tolist()) for g in grouped(points, scale)]
    assert len(groups) == 2
    assert {frozenset(g) for g in groups} == {frozenset(range(10)), frozenset(range(10, 15))}
    assert int(grouped(points, scale)[0][0]) == 0  # in the order of their first points


def test_a_crowd_costs_no_more_than_its_places() -> None:
    """2e5 points within a reach of each other have 2e10 pairs: they are not listed."""
    rng = np.random.default_rng(2)
    crowd = 0.3 * rng.uniform(size=(200_000, 3))
    groups = grouped(np.concatenate([crowd, crowd[:10] + 5.0]), 1.0)
    assert [len(g) for g in groups] == [200_000, 10]
    assert not grouped(np.zeros((0, 3)), 1.0)
