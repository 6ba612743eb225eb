"""Which free edge a rim vertex lies on: the grid finds what looking at all edges finds."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models import Triangulation
from patchwright.repair.mender._conform_kernel import nearest_edges
from patchwright.repair.mender.conform import conform


def every_edge(rim, points, start, end, apex, distance, share):
    """The definition: the nearest of all edges, the one beginning at the lowest x of equally near ones."""
    found = np.full(len(rim), -1)
    rank = np.argsort(np.minimum(points[start, 0], points[end, 0]), kind="stable")
    for i, v in enumerate(rim):
        best = np.inf
        for e in rank:
            a, b, c = points[start[e]], points[end[e]], points[apex[e]]
            if v in (start[e], end[e], apex[e]) or not (b - a).any():
                continue
            t = (points[v] - a) @ (b - a) / ((b - a) @ (b - a))
            d = np.linalg.norm(points[v] - a - t * (b - a))
            height = np.linalg.norm(np.cross(b - a, c - a)) / np.linalg.norm(b - a)
            inner = min(t, 1.0 - t) * np.linalg.norm(b - a)
            if 0.0 < t < 1.0 and d <= min(distance, share * height) and inner > d and d < best:
                best, found[i] = d, e
    return found


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_grid_finds_what_all_edges_hold(seed, scale):
    rng = np.random.default_rng(seed)
    start_at = rng.normal(size=(300, 3))
    length = 10.0 ** rng.uniform(-2.5, 0.5, size=(300, 1))  # short ones and a few as long as all of it
    points = np.concatenate([start_at, start_at + length * rng.normal(size=(300, 3)), rng.normal(size=(300, 3))])
    on = rng.integers(0, 300, 200)  # vertices beside edges
    place = rng.uniform(0.1, 0.9, size=(200, 1))
    beside = (1 - place) * points[on] + place * points[300 + on] + rng.normal(size=(200, 3)) * 3e-3
    points = scale * np.concatenate([points, beside])
    start, end, apex = np.arange(300), np.arange(300, 600), np.arange(600, 900)
    rim = np.concatenate([start, end, np.arange(900, 1100)])
    edge, at, gap = nearest_edges(rim, points, start, end, apex, 1e-2 * scale, 0.25)
    wanted = every_edge(rim, points, start, end, apex, 1e-2 * scale, 0.25)
    assert np.count_nonzero(wanted >= 0) > 100
    np.testing.assert_array_equal(edge, wanted)
    hit = edge >= 0
    foot = points[start[edge[hit]]] + at[hit, None] * (points[end[edge[hit]]] - points[start[edge[hit]]])
    np.testing.assert_allclose(np.linalg.norm(foot - points[rim[hit]], axis=1), gap[hit], atol=1e-9 * scale)


def test_a_seam_meshed_twice_as_fine_on_one_side_conforms():
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0, 0, 0], [0.5, 0, 0], [1, 0, 0], [0.5, -1, 0]], dtype=float)
    triangles = np.array([[0, 1, 2], [4, 3, 6], [5, 4, 6]])
    conformed = conform(Triangulation(points, triangles), 1e-6)
    assert conformed.inserted == 1
    np.testing.assert_array_equal(conformed.parents, [0, 0, 1, 2])
    np.testing.assert_allclose(np.abs(conformed.triangulation.areas), [0.25, 0.25, 0.25, 0.25])
