"""Feature curves: where sharp edges are, where they are not, and how they are chained."""

from __future__ import annotations

import numpy as np
import pytest
from layout_shapes import cube, cylinder, jittered, moved, plate_with_hole, sphere, wedge

from patchwright.models import GeometryError, Triangulation
from patchwright.repair.features import BOUNDARY, FOLLOWED, SHARP, find_features


@pytest.mark.parametrize("intervals", [1, 5])
def test_cube_has_twelve_edges_and_eight_corners(intervals):
    features = find_features(cube(intervals))
    assert (features.kind == SHARP).all()
    assert len(features.kind) == 12
    np.testing.assert_allclose(features.lengths, 1.0, rtol=1e-12)
    corners = features.body.vertices[features.corners]
    assert len(corners) == 8
    assert np.isin(np.round(corners, 12), [0.0, 1.0]).all()
    assert len(np.unique(features.region)) == 6


def test_cylinder_has_two_rings():
    features = find_features(cylinder(48))
    assert len(features.kind) == 2
    np.testing.assert_allclose(features.lengths, 96 * np.sin(np.pi / 48), rtol=1e-12)
    first, last = features.vertices[features.offsets[:-1]], features.vertices[features.offsets[1:] - 1]
    assert (first == last).all()


def test_angle_decides():
    # 16 sides turn by 22.5 degrees each
    assert len(find_features(cylinder(16), angle=30.0).kind) == 2
    assert len(np.unique(find_features(cylinder(16), angle=20.0).region)) == 18


def test_boundary_of_a_plate():
    features = find_features(plate_with_hole())
    assert (features.kind == BOUNDARY).all()
    assert len(features.kind) == 5  # four sides and the hole
    assert features.lengths.sum() == pytest.approx(8.0 + 128 * 0.4 * np.sin(np.pi / 64), rel=1e-12)


def test_thin_trailing_edge_keeps_both_its_edges():
    features = find_features(wedge())
    assert (features.kind == SHARP).all()
    assert len(features.kind) == 12
    assert len(features.corners) == 8


@pytest.mark.parametrize("scatter", [0.0, 1e-4, 1e-3, 3e-3])
def test_noise_makes_no_feature(scatter):
    features = find_features(jittered(sphere(40), scatter))
    assert len(features.kind) == 0
    if scatter:
        assert features.noise == pytest.approx(scatter, rel=0.35)


def test_noise_hides_no_feature():
    shape = cube(20)
    features = find_features(jittered(shape, 1e-3))
    assert features.lengths.sum() == pytest.approx(12.0, rel=0.02)
    assert len(np.unique(features.region)) == 6


def test_rigid_motion_and_scale_do_not_matter():
    shape = wedge()
    for scale in (1e-3, 1.0, 1e3):
        other, _ = moved(shape, scale)
        assert sorted(find_features(other).lengths / scale) == pytest.approx(
            sorted(find_features(shape).lengths), rel=1e-9
        )


def test_frozen_edges_are_followed():
    shape = cube(2)
    v = shape.vertices
    on_line = np.flatnonzero((np.abs(v[:, 2] - 1.0) < 1e-12) & (np.abs(v[:, 1] - 0.5) < 1e-12))
    on_line = on_line[np.argsort(v[on_line, 0])]
    pairs = np.stack([on_line[:-1], on_line[1:]], axis=1)
    features = find_features(shape, frozen=pairs)
    assert features.lengths[features.kind == FOLLOWED].sum() == pytest.approx(1.0)


def test_sharing_only_a_vertex_is_taken_apart():
    one = cube()
    two = Triangulation(one.vertices + 1.0, one.triangles)
    corner = int(np.flatnonzero((one.vertices == 1.0).all(axis=1))[0])
    start = int(np.flatnonzero((two.vertices == 1.0).all(axis=1))[0])
    index = np.arange(8) + 8
    index[start] = corner
    both = Triangulation(
        np.concatenate([one.vertices, two.vertices]), np.concatenate([one.triangles, index[two.triangles]])
    )
    features = find_features(both)
    assert len(features.body.vertices) == 16
    assert len(features.kind) == 24


def test_what_is_not_a_manifold_is_refused():
    shape = cube()
    extra = np.array([[*shape.triangles[0, :2], len(shape.vertices)]])
    fin = Triangulation(np.concatenate([shape.vertices, [[3.0, 3.0, 3.0]]]), np.concatenate([shape.triangles, extra]))
    with pytest.raises(GeometryError, match="2-manifold"):
        find_features(fin)
    turned = shape.triangles.copy()
    turned[0] = turned[0, ::-1]
    with pytest.raises(GeometryError, match="outside"):
        find_features(Triangulation(shape.vertices, turned))
    with pytest.raises(GeometryError, match="at least one"):
        find_features(Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)))
