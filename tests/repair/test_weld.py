from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import ParameterError, Tolerance, Triangulation
from patchwright.repair.mender._near_edges_kernel import CANDIDATES, _pairs_within, trial_order
from patchwright.repair.mender.weld import free_edge_curve, weld, weld_distance


def test_equal_copies_merge_and_keep_every_bit() -> None:
    whole = shapes.sphere(3)
    welded = weld(shapes.soup(whole), 0.0)
    assert len(welded.triangulation.vertices) == len(whole.vertices)
    assert welded.largest_move == 0.0
    assert np.array_equal(welded.triangulation.corners, whole.corners)


@pytest.mark.parametrize("jitter", [1e-6, 1e-5, 1e-4, 1e-3])
def test_the_data_shows_the_distance_and_the_noise(jitter: float) -> None:
    whole = shapes.sphere(4)
    dirty = shapes.soup(whole, jitter)
    tolerance = Tolerance.of(dirty, fit=1.2 * jitter)
    distance, reason = weld_distance(dirty, tolerance)
    assert 1.5 * jitter < distance <= 2.0 * jitter * 1.01 or distance == tolerance.gap
    assert str(len(dirty) * 3) in reason or distance == tolerance.gap
    welded = weld(dirty, max(distance, 2.0 * jitter))
    assert len(welded.triangulation.vertices) == len(whole.vertices)
    assert (shapes.edge_uses(welded.triangulation) == 2).all()
    # a length uniform in [0, jitter] has the root mean square jitter / sqrt(3)
    assert welded.noise == pytest.approx(jitter / np.sqrt(3.0), rel=0.02)
    # the mean of about six copies is nearer to the truth than one copy
    true = whole.vertices[whole.triangles].reshape(-1, 3)
    error = np.linalg.norm(welded.triangulation.corners.reshape(-1, 3) - true, axis=1)
    assert np.sqrt(np.mean(error**2)) < 0.5 * jitter / np.sqrt(3.0)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scale_changes_nothing(scale: float) -> None:
    dirty = shapes.soup(shapes.sphere(3), 1e-4)
    big = Triangulation(dirty.vertices * scale, dirty.triangles)
    one, other = weld(dirty, 2e-4), weld(big, 2e-4 * scale)
    assert np.array_equal(one.clusters, other.clusters)
    distance = weld_distance(dirty, Tolerance.of(dirty))[0]
    assert weld_distance(big, Tolerance.of(big))[0] == pytest.approx(scale * distance, rel=1e-6)


@pytest.mark.parametrize("jitter", [1e-4, 3e-3, 1e-2])
def test_the_order_of_the_triangles_changes_nothing(jitter: float) -> None:
    dirty = shapes.soup(shapes.sphere(3), jitter)
    shuffle = np.random.default_rng(0).permutation(len(dirty))
    one = weld(dirty, 2.0 * jitter).triangulation.triangles[shuffle].reshape(-1)
    other = weld(Triangulation(dirty.vertices, dirty.triangles[shuffle]), 2.0 * jitter).triangulation.triangles
    pairs = np.unique(np.stack([one, other.reshape(-1)], axis=1), axis=0)
    assert len(pairs) == len(np.unique(one)) == len(np.unique(other))


def test_near_edges_are_those_of_the_definition() -> None:
    # edges so far apart in size and place that they lie in many grids; all pairs of ends measured one by one
    rng = np.random.default_rng(1)
    a = rng.uniform(-1.0, 1.0, (120, 3))
    b = a + rng.normal(size=a.shape) * 10.0 ** rng.uniform(-3, -0.5, (120, 1))
    noise = rng.normal(size=(2, 120, 3)) * 0.1 * np.linalg.norm(b - a, axis=1)[:, None]
    start, end = np.concatenate([a, b + noise[0]]), np.concatenate([b, a + noise[1]])
    points = np.concatenate([start, end, 0.5 * (start + end) + rng.normal(size=start.shape)])
    number = np.arange(240)
    left, right, gap, _ = _pairs_within(points, number, number + 240, number + 480, 0 * number, 0.2, 0.5)
    ends = np.stack([start, end], axis=1)
    along = np.linalg.norm(ends[:, None] - ends, axis=3).max(axis=2)
    cross = np.linalg.norm(ends[:, None] - ends[:, ::-1], axis=3).max(axis=2)
    apart = np.minimum(along, cross)
    reach = np.minimum(0.2, 0.5 * np.linalg.norm(end - start, axis=1))
    close = np.triu(apart <= np.minimum(reach[:, None], reach), 1)
    assert (close.sum(axis=0) + close.sum(axis=1)).max() <= CANDIDATES
    found = np.zeros_like(close)
    found[left, right] = True
    assert close.sum() > 60
    assert not (found & ~close).any()
    assert np.allclose(gap, apart[left, right], rtol=1e-12)
    assert (along < cross)[close & ~found].all()  # doubles: folded and run the same way


def test_pairs_are_tried_by_kind_and_near_ones_first() -> None:
    rng = np.random.default_rng(2)
    gap, kind = 10.0 ** rng.uniform(-8, 0.5, 1000), rng.integers(0, 8, 1000)
    order = trial_order(gap, kind, 1.0, 0.0)
    assert np.array_equal(np.sort(order), np.flatnonzero(gap <= 1.0))
    assert (np.diff(kind[order]) >= 0).all()
    for k in range(8):
        own = gap[order][kind[order] == k]
        assert (own * np.sqrt(2.0) * (1.0 + 1e-12) >= np.maximum.accumulate(own)).all()
    assert (kind[trial_order(gap, kind, 1.0, 0.6)] < 4).all()


def test_the_two_skins_of_a_thin_plate_stay_apart() -> None:
    # the plate is thinner than the weld distance; its skins have corners of their own, jittered
    thin = shapes.soup(shapes.box((1, 1, 2e-3)), 1e-4)
    welded = weld(thin, 2.5e-3)
    corners = welded.triangulation.corners
    side = np.sign(corners[:, :, 2])
    big = shapes.box((1, 1, 2e-3)).areas > 1e-2
    assert (np.abs(side[big].sum(axis=1)) == 3).all()


def test_the_free_edge_curve_falls_where_the_cracks_are() -> None:
    whole = shapes.sphere(3)
    crack = np.flatnonzero(whole.corners.mean(axis=1)[:, 2] > 0.0)
    upper = whole.take(crack).compact()
    lower = whole.take(np.setdiff1d(np.arange(len(whole)), crack)).compact()
    gap = 1e-4
    both = shapes.together(Triangulation(upper.vertices + np.array([0.0, 0.0, gap]), upper.triangles), lower)
    rim = int((shapes.edge_uses(upper) == 1).sum())
    curve = free_edge_curve(both, [0.0, 0.5 * gap, 1.01 * gap, 10 * gap])
    assert curve.tolist() == [2 * rim, 2 * rim, 0, 0]


def test_a_negative_distance_is_refused() -> None:
    with pytest.raises(ParameterError, match="-1"):
        weld(shapes.sphere(1), -1.0)
