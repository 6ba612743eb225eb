"""Exact merging: equal coordinates are one vertex, anything else is two."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from patchwright.models import Triangulation
from patchwright.models.io.merge import merge_points, merged

FEW = st.sampled_from([0.0, -0.0, 1.0, -1.0, np.nextafter(1.0, 2.0), 1e-320, 1e300])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@given(values=arrays(np.float64, st.tuples(st.integers(1, 60), st.just(3)), elements=FEW))
@settings(deadline=None)
def test_merging_is_equality_of_coordinates(dtype: type, values: np.ndarray) -> None:
    points = np.clip(values, -3e38, 3e38).astype(dtype)
    first, index = merge_points(points)
    classes: dict[tuple[float, ...], int] = {}
    expected = [classes.setdefault(tuple(float(x) + 0.0 for x in row), len(classes)) for row in points]
    assert index.tolist() == expected
    assert np.array_equal(points[first][index], points)
    assert len(first) == len(classes)


@pytest.mark.parametrize("n", [1, 5_000, 200_000])
def test_the_table_grows_with_the_number_of_different_points(n: int) -> None:
    points = np.random.default_rng(7).permutation(np.arange(3 * n, dtype=np.float64)).reshape(n, 3)
    first, index = merge_points(np.concatenate([points, points[::-1]]))
    assert np.array_equal(first, np.arange(n))
    assert np.array_equal(index, np.concatenate([np.arange(n), np.arange(n)[::-1]]))


def test_grid_points_do_not_pile_up_in_the_hash() -> None:
    # small whole numbers have mostly zero bits: a weak hash would make this quadratic and run for minutes
    i, j, k = np.meshgrid(*[np.arange(60.0)] * 3, indexing="ij")
    points = np.stack([i, j, k], axis=-1).reshape(-1, 3)
    first, _ = merge_points(points)
    assert len(first) == 60**3


def test_merged_keeps_the_corners_and_drops_unused_vertices() -> None:
    doubled = Triangulation(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, -0.0], [1, 1, 0], [0, 1, 0], [9, 9, 9]], [[0, 1, 2], [3, 4, 5]]
    )
    result = merged(doubled)
    assert len(result.vertices) == 4
    assert np.array_equal(result.corners, doubled.corners)
