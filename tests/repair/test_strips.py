"""Narrow strips between features: long quads of right angles; short sides are opened, loose ends let go."""

from __future__ import annotations

import numpy as np
import pytest
from layout_shapes import moved, plate_with_hole, prism

from patchwright.repair.layout.feature_cleaning import SPECK_SHARE, not_specks
from patchwright.repair.layout.features import find_features
from patchwright.repair.layout.pairing import pair
from patchwright.repair.layout.quad_layout import quad_layout
from patchwright.repair.layout.quad_smooth import smooth
from patchwright.repair.layout.remesh import remesh
from patchwright.repair.layout.sizing import MOST_FEATURED, MOST_QUADS, size_field

SQUARE = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
THIN = (0.02, 0.005, 0.00125)  # heights of plates of side 1


def corners_and_aspects(vertices, quads):
    """Degrees of all corners (m, 4), the longest side of each quad over its shortest (m,)."""
    points = vertices[quads]
    ahead, back = np.roll(points, -1, axis=1) - points, np.roll(points, 1, axis=1) - points
    length = np.linalg.norm(ahead, axis=2)
    cosine = (ahead * back).sum(axis=2) / (length * np.linalg.norm(back, axis=2))
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), length.max(axis=1) / length.min(axis=1)


@pytest.fixture(scope="module")
def plates():
    return [quad_layout(prism(SQUARE, height, 16), target=300) for height in THIN]


def test_strips_are_ladders_of_right_angles(plates):
    layout = plates[0]
    rim = np.ptp(layout.vertices[layout.quads][..., 2], axis=1) > 0.1 * THIN[0]
    angle, aspect = corners_and_aspects(layout.vertices, layout.quads[rim])
    assert np.quantile(angle, 0.02) > 75.0
    assert np.quantile(angle, 0.98) < 105.0
    assert np.median(aspect) > 5.0


def test_however_thin_nothing_is_folded_and_features_are_followed(plates):
    for layout in plates:
        assert layout.report.folded == 0
        assert layout.report.median_scaled_jacobian > 0.7  # most quads: no corner 45 degrees off a right angle
        assert layout.report.feature_coverage == pytest.approx(1.0, abs=1e-9)


def test_the_number_of_quads_grows_slower_than_thinness(plates):
    """Square quads across the rim would grow sixteenfold."""
    assert len(plates[2]) < 4 * len(plates[0])


def test_rigid_motion_and_scale_keep_the_ladders():
    shape, _ = moved(prism(SQUARE, THIN[1], 16), 1e3)
    report = quad_layout(shape, target=300).report
    assert report.folded == 0
    assert report.median_scaled_jacobian > 0.8


def test_features_may_ask_for_quads_of_their_own():
    """A comb of shallow steps asks for more than a smooth shape may; the number stays within both budgets."""
    teeth = 30
    x = np.linspace(0.0, 1.0, 2 * teeth + 1)
    outline = np.concatenate(
        [np.stack([x, np.where(np.arange(len(x)) % 2, 0.96, 1.0)], axis=1)[::-1], [[0.0, 0.0], [1.0, 0.0]]]
    )
    features = find_features(prism(outline, 0.5, 4))
    _, number = size_field(features)
    assert 1.02 * MOST_QUADS < number < 1.02 * (MOST_QUADS + MOST_FEATURED)


def test_a_vertex_almost_on_another_is_moved_away():
    features = find_features(plate_with_hole())
    quads = pair(remesh(features, np.full(len(features.body.vertices), 0.5)))
    mesh = quads.mesh
    inner = np.flatnonzero(mesh.kind == 0)
    edges = np.stack([quads.quads, np.roll(quads.quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    one, two = edges[np.isin(edges, inner).all(axis=1)][0]
    mesh.X[one] = mesh.X[two] + 1e-3 * (mesh.X[one] - mesh.X[two])
    assert corners_and_aspects(mesh.X, quads.quads)[1].max() > 100.0
    smooth(quads)
    angle, aspect = corners_and_aspects(mesh.X, quads.quads)
    assert aspect.max() < 10.0
    assert angle.min() > 10.0
    assert angle.max() < 170.0


@pytest.mark.parametrize(("length", "kept"), [(0.8 * SPECK_SHARE, False), (1.5 * SPECK_SHARE, True)])
def test_loose_lines_shorter_than_the_share_are_let_go_and_rings_stay(length, kept):
    count = 12
    line = np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)
    ring = 20 + np.stack([np.arange(count), np.roll(np.arange(count), -1)], axis=1)
    edges = np.concatenate([line, ring])
    every = np.ones(len(edges), dtype=bool)
    keep = not_specks(edges, every, ~every, np.full(len(edges), length / count), 1.0)
    assert keep[:count].all() == keep[:count].any() == kept
    assert keep[count:].all()
