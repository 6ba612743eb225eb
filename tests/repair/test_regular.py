"""Quads made regular: patterns of discs, what stays as it was, how many irregular vertices are left."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from layout_shapes import cube, cylinder, moved, plate_with_hole, sphere, torus, wedge

from patchwright.models import Triangulation
from patchwright.repair.layout._pattern_kernel import CUT, GRID, STAR, fill, patterns
from patchwright.repair.layout.blocks import find_blocks
from patchwright.repair.layout.features import find_features
from patchwright.repair.layout.pairing import pair
from patchwright.repair.layout.quad_layout import quad_layout
from patchwright.repair.layout.quad_smooth import scaled_jacobians, smooth
from patchwright.repair.layout.regular import closed, opened, regularize, unfolded
from patchwright.repair.layout.remesh import remesh


def found_patterns(sides):
    rows = np.zeros((8, 6), dtype=np.int64)
    return rows[: patterns(np.array(sides, dtype=np.int64), len(sides), rows)].copy()


def filled(sides, row):
    """Quads of a pattern and how many vertices there are."""
    quads = np.zeros((4000, 4), dtype=np.int64)
    corner = np.concatenate([[0], np.cumsum(sides)[:-1]])
    count, vertices = fill(int(np.sum(sides)), corner, len(sides), row, quads)
    return quads[:count], vertices


SIDES = [
    *itertools.product(range(1, 8), repeat=2),
    *itertools.product(range(1, 6), repeat=3),
    *itertools.product(range(1, 6), repeat=4),
    *itertools.product(range(2, 5), repeat=5),
    *itertools.product(range(2, 5), repeat=6),
    (4, 7, 5, 6, 4, 8),
]
INNER = {
    (2, CUT): [3, 3],
    (3, STAR): [3],
    (4, GRID): [],
    (4, CUT): [3, 5],
    (5, STAR): [5],
    (6, STAR): [6],
    (6, CUT): [5, 5],
}


def test_every_pattern_is_a_disc_with_the_border_and_the_irregular_vertices_it_promises():
    seen = set()
    for sides in SIDES:
        for row in found_patterns(sides):
            quads, count = filled(sides, row)
            border = sum(sides)
            tail, head = quads.reshape(-1), np.roll(quads, -1, axis=1).reshape(-1)
            forth, back = tail * count + head, head * count + tail
            assert len(np.unique(forth)) == len(forth)
            rim = ~np.isin(forth, back)
            assert sorted(tail[rim].tolist()) == list(range(border))
            np.testing.assert_array_equal((tail[rim] + 1) % border, head[rim])
            edges = (len(forth) + rim.sum()) // 2
            assert count - edges + len(quads) == 1
            degree = np.bincount(tail, minlength=count)
            convex = np.zeros(border, dtype=np.int64)
            convex[np.concatenate([[0], np.cumsum(sides)[:-1]])] = 1
            np.testing.assert_array_equal(degree[:border], 2 - convex)
            assert sorted(degree[border:][degree[border:] != 4].tolist()) == INNER[len(sides), row[0]]
            seen.add((len(sides), int(row[0])))
    assert seen == set(INNER)


@pytest.mark.parametrize("sides", [(1, 1, 2), (3, 3, 3), (1, 4, 1, 2), (2, 2, 2, 2, 3), (5, 1, 1, 1, 1)])
def test_no_pattern_where_there_is_none(sides):
    assert not len(found_patterns(sides))


def test_turning_a_disc_turns_its_patterns():
    for sides in ((4, 6, 6, 4), (5, 4, 5, 6), (3, 5, 4)):
        counts = {len(found_patterns(np.roll(sides, k))) for k in range(len(sides))}
        assert len(counts) == 1


def paired(shape, size):
    features = find_features(shape)
    return pair(remesh(features, np.full(len(features.body.vertices), size)))


def key_of(quads):
    """The quads as rows that do not hang on their first corner, sorted."""
    first = quads.argmin(axis=1)
    turned = np.take_along_axis(quads, (first[:, None] + np.arange(4)) % 4, axis=1)
    return turned[np.lexsort(turned.T)]


def irregular(quad_mesh):
    degree = np.bincount(quad_mesh.quads.reshape(-1))
    degree[quad_mesh.sides.reshape(-1)] = 4
    return int((degree != 4).sum())


@pytest.mark.parametrize("shape", [sphere(), cylinder(), plate_with_hole()])
def test_opened_and_closed_again_is_the_same(shape):
    given = paired(shape, 0.35)
    again = closed(given, *opened(given, 2, 10))
    np.testing.assert_array_equal(key_of(again.quads), key_of(given.quads))
    np.testing.assert_array_equal(again.mesh.X, given.mesh.X)
    order, other = np.lexsort(given.sides.T), np.lexsort(again.sides.T)
    np.testing.assert_array_equal(given.sides[order], again.sides[other])
    np.testing.assert_array_equal(given.side_curve[order], again.side_curve[other])


@pytest.mark.parametrize(
    ("shape", "euler"), [(sphere(), 2), (torus(), 0), (cube(4), 2), (cylinder(), 2), (plate_with_hole(), 0)]
)
def test_fewer_irregular_vertices_on_the_same_topology_and_features(shape, euler):
    given = paired(shape, 0.3)
    regular = regularize(given)
    assert irregular(regular) <= irregular(given) * 2 / 3
    tail, head = regular.quads.reshape(-1), np.roll(regular.quads, -1, axis=1).reshape(-1)
    n = len(regular.mesh.X)
    assert len(np.unique(tail * n + head)) == len(tail)
    edges = np.unique(np.minimum(tail, head) * n + np.maximum(tail, head))
    assert n - len(edges) + len(regular.quads) == euler
    # curves end where they did, their vertices lie on them in order, and every side is an edge of quads
    ends = regular.sides
    assert np.isin(np.minimum(*ends.T) * n + np.maximum(*ends.T), edges).all()
    for curve in np.unique(given.side_curve):
        length = [
            np.linalg.norm(np.diff(mesh.mesh.X[mesh.sides[mesh.side_curve == curve]], axis=1)[:, 0], axis=1).sum()
            for mesh in (given, regular)
        ]
        assert 0.8 * length[0] < length[1] < length[0] * (1 + 1e-12)
    assert (given.mesh.kind == 2).sum() == (regular.mesh.kind == 2).sum()
    smooth(regular)
    assert scaled_jacobians(regular).min() > 0.1


def test_what_is_regular_stays():
    again = regularize(regularize(paired(sphere(), 0.3)))
    twice = regularize(again)
    np.testing.assert_array_equal(key_of(twice.quads), key_of(again.quads))


def test_folded_quads_start_smoothed():
    given = paired(sphere(), 0.4)
    assert unfolded(given) == (given, None)
    broken = given.copy()
    corner, opposite = given.quads[0, [0, 2]]
    broken.mesh.X[corner] = 1.3 * given.mesh.X[opposite] - 0.3 * given.mesh.X[corner]
    whole, smoothed = unfolded(broken)
    assert smoothed is not None
    assert scaled_jacobians(broken).min() <= 0.0 < scaled_jacobians(whole).min()
    away = np.linalg.norm(given.mesh.X - given.mesh.X[corner], axis=1) > 1.2
    assert away.any()
    assert np.array_equal(whole.mesh.X[away], given.mesh.X[away])


def test_a_given_mesh_is_not_changed():
    given = paired(torus(), 0.3)
    before, quads = given.mesh.X.copy(), given.quads.copy()
    regularize(given)
    assert np.array_equal(given.mesh.X, before)
    assert np.array_equal(given.quads, quads)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_blocks_are_large_whatever_the_motion_and_scale(scale):
    shape, _ = moved(wedge(), scale)
    layout = quad_layout(shape, target=300)
    assert len(layout) > 5 * len(find_blocks(layout))  # pairs alone: between two and three quads a block
    assert layout.irregular_vertices < 0.12 * len(layout.vertices)  # pairs alone: a sixth of the vertices or more


def test_an_ellipsoid_has_the_fewest_there_can_be():
    # eight of three quads each: by Gauss and Bonnet the defects of a sphere sum up to eight
    body = sphere(48)
    layout = quad_layout(Triangulation(body.vertices * [1.0, 0.6, 0.4], body.triangles), target=200)
    degree = np.bincount(layout.edges.reshape(-1))
    assert (4 - degree).sum() == 8
    assert (degree != 4).sum() <= 12
    assert len(find_blocks(layout)) <= 24


def test_blocks_of_a_real_blade_are_large(data):
    from patchwright.models.io import read

    body = read(data("cgal_blade.off")).triangulation
    layout = quad_layout(body)
    assert len(layout) > 10 * len(find_blocks(layout))
    assert layout.irregular_vertices < 0.02 * len(layout.vertices)
    assert layout.report.feature_coverage == pytest.approx(1.0, abs=1e-9)
    assert layout.report.folded == 0
