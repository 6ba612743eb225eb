"""Feature curves: where sharp edges are, where they are not, and how they are chained."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from layout_shapes import cube, cylinder, jittered, moved, plate_with_hole, sphere, wedge

from patchwright.models import GeometryError, Triangulation
from patchwright.models.adjacency import Adjacency
from patchwright.repair.layout.feature_cleaning import cut_teeth
from patchwright.repair.layout.features import BOUNDARY, FOLLOWED, SHARP, find_features


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


def flap(width):
    """A unit square whose side x < 0 goes on for `width`, folded down by a right angle; both are open."""
    x, y = np.array([0.0, 0.5, 1.0]), np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    flat = np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros((3, 5))], axis=-1)
    edge = np.stack([np.zeros(5), y, np.full(5, -width)], axis=-1)
    points = np.concatenate([edge[None], flat])
    number = np.arange(points.shape[0] * 5).reshape(-1, 5)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return Triangulation(points.reshape(-1, 3), triangles)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_no_corner_right_beside_a_branch(scale):
    # the fold's ends are branches of the boundary; the flap's own corners count only where a quad fits between
    wide, narrow = find_features(moved(flap(0.2), scale)[0]), find_features(moved(flap(5e-4), scale)[0])
    assert sorted(wide.lengths / scale) == pytest.approx([0.2, 0.2, 1, 1, 1, 1, 1], rel=1e-9)
    assert sorted(narrow.lengths / scale) == pytest.approx([1, 1, 1, 1, 1.001], rel=1e-9)
    assert (wide.kind == SHARP).sum() == (narrow.kind == SHARP).sum() == 1


@pytest.mark.parametrize(("size", "kept"), [(2e-4, 4), (0.05, 10)])
def test_a_spike_smaller_than_any_quad_is_no_feature(size, kept):
    # a three-sided pyramid on a plate: six sharp edges, none of them loose
    square = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    turn = 2 * np.pi * np.arange(3) / 3
    foot = np.stack([size * np.cos(turn), size * np.sin(turn), np.zeros(3)], axis=1)
    points = np.concatenate([square, foot, [[0, 0, size]]])
    corners = [
        [0, 1, 6],
        [1, 4, 6],
        [1, 2, 4],
        [2, 5, 4],
        [2, 3, 5],
        [3, 6, 5],
        [3, 0, 6],
        [4, 5, 7],
        [5, 6, 7],
        [6, 4, 7],
    ]
    features = find_features(Triangulation(points.astype(float), np.array(corners)))
    assert len(features.kind) == kept
    assert (features.kind == BOUNDARY).sum() == 4


def test_a_tooth_is_cut_off():
    # a line along y = 0 that runs back to the apex (1, 0.1) and out again, on a fan of triangles
    points = np.array([[0, 0, 0], [1.9, 0, 0], [2, 0, 0], [4, 0, 0], [1, 0.1, 0], [2, 2, 0], [2, -2, 0]], dtype=float)
    triangles = np.array([[0, 1, 4], [1, 2, 4], [0, 4, 5], [4, 2, 5], [2, 3, 5], [0, 6, 1], [1, 6, 2], [2, 6, 3]])
    body = Triangulation(points, triangles)
    adjacency = Adjacency.of(body)
    edges, sides = np.asarray(adjacency.edges), np.asarray(adjacency.triangle_edges)
    length = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)

    def line(*vertices):
        pairs = {tuple(sorted(pair)) for pair in pairwise(vertices)}
        return np.array([tuple(edge) in pairs for edge in edges.tolist()])

    none = np.zeros(len(edges), dtype=bool)
    neighbours = np.asarray(adjacency.neighbours)
    for width, firm, straight in ((0.2, none, True), (0.05, none, False), (0.2, line(1, 4), False)):
        normals, sharp = np.array(body.normals), line(0, 1, 4, 2, 3)
        cut_teeth(body, neighbours, normals, edges, sides, sharp, firm, length, width)
        np.testing.assert_array_equal(sharp, line(0, 1, 2, 3) if straight else line(0, 1, 4, 2, 3))


def test_edges_that_were_sharp_before_stay_sharp_whatever_is_found_now():
    body = cube(3)
    found = find_features(body)
    edges = found.curve_edges(SHARP)
    assert len(edges)
    assert not len(find_features(found.body, angle=120.0).curve_edges(SHARP))
    again = find_features(found.body, angle=120.0, sharp_before=edges[::2]).curve_edges(SHARP)
    assert {frozenset(e) for e in again.tolist()} == {frozenset(e) for e in edges[::2].tolist()}
