"""Trees against every triangle asked, in rational numbers where a sign decides."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles_tree import closest_distances, icosphere, noisy_torus, ray_crossings

from patchwright.models.errors import ParameterError
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
CUBE_FACES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)
lattice = st.integers(-3, 3).map(float)
point = st.tuples(lattice, lattice, lattice)


def soup(corners) -> Triangulation:
    corners = np.asarray(corners, dtype=float).reshape(-1, 3)
    return Triangulation(corners, np.arange(len(corners)).reshape(-1, 3))


def rotation(seed: int) -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


@pytest.fixture(scope="module")
def torus() -> Tree:
    return Tree.of(Triangulation(*noisy_torus(60, 30, 0.05)))


def test_one_triangle_exactly():
    tree = Tree.of(Triangulation([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]]))
    hit = tree.first_hit([1.0, 1.0, 3.0], [0.0, 0.0, -7.0])
    assert hit.distance.tolist() == [3.0]
    assert hit.barycentric.tolist() == [[0.5, 0.25, 0.25]]
    near = tree.closest([[1, 1, 2], [-3, -4, 0], [2, -1, 0], [4, 4, 1]])
    assert near.points.tolist() == [[1, 1, 0], [0, 0, 0], [2, 0, 0], [2, 2, 0]]
    assert near.distance.tolist() == [2.0, 5.0, 1.0, 3.0]
    assert near.barycentric.tolist() == [[0.5, 0.25, 0.25], [1, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0.5]]


@settings(max_examples=80, deadline=None)
@given(st.lists(st.tuples(point, point, point), min_size=1, max_size=14), point, point)
def test_rays_agree_with_rational_arithmetic_on_a_lattice(corners, origin, direction):
    """Lattice soups are full of edges, corners, parallel faces and triangles without area hit exactly."""
    corners = np.array(corners)
    tree = Tree.of(soup(corners))
    if not any(direction):
        with pytest.raises(ParameterError, match="length zero"):
            tree.first_hit([origin], [direction])
        return
    truth = ray_crossings(corners, origin, direction)
    ahead = {t: n for n, t in truth.items() if t >= 0}
    hit = tree.first_hit([origin], [direction])
    if not ahead:
        assert hit.triangle[0] == -1
        assert hit.distance[0] == np.inf
    else:
        length = np.linalg.norm(direction)
        assert hit.distance[0] == pytest.approx(float(min(ahead)) * length, rel=4e-15, abs=1e-14)
        assert truth[int(hit.triangle[0])] == min(ahead)
        assert hit.barycentric[0].sum() == pytest.approx(1.0, abs=1e-15)
    end = np.array(origin) + 2.0 * np.array(direction)
    crossed = tree.all_hits([origin], [end])
    assert set(crossed.triangle.tolist()) == {n for n, t in truth.items() if 0 <= t <= 2}
    assert (np.diff(crossed.t) >= 0).all()
    for t, n in zip(crossed.t, crossed.triangle, strict=True):
        assert 2.0 * t == pytest.approx(float(truth[int(n)]), rel=4e-15, abs=1e-15)


@settings(max_examples=80, deadline=None)
@given(st.lists(st.tuples(point, point, point), min_size=1, max_size=14), st.lists(point, min_size=1, max_size=5))
def test_closest_points_agree_with_asking_every_triangle_degenerate_ones_too(corners, points):
    corners, points = np.array(corners), np.array(points) + 0.3
    near = Tree.of(soup(corners)).closest(points)
    distances = closest_distances(corners, points)
    assert np.allclose(near.distance, distances.min(axis=1), rtol=1e-14, atol=1e-14)
    assert np.allclose(distances[np.arange(len(points)), near.triangle], near.distance, rtol=1e-14, atol=1e-14)
    assert np.allclose(np.linalg.norm(points - near.points, axis=1), near.distance, rtol=1e-14, atol=1e-14)
    assert (near.barycentric >= 0).all()
    rebuilt = np.einsum("ni,nij->nj", near.barycentric, corners[near.triangle])
    assert np.allclose(rebuilt, near.points, atol=1e-14)


def test_closest_points_of_a_torus_agree_with_asking_every_triangle(torus):
    points = np.random.default_rng(1).uniform(-14, 14, (150, 3))
    distances = closest_distances(torus.triangulation.corners, points)
    near = torus.closest(points)
    assert np.abs(near.distance - distances.min(axis=1)).max() < 1e-14 * 30
    clear = np.partition(distances, 1, axis=1)[:, :2] @ [-1, 1] > 1e-12
    assert clear.sum() > 30
    assert (near.triangle == distances.argmin(axis=1))[clear].all()


def test_needles_are_as_close_as_their_longest_side():
    height = 10.0 ** -np.arange(2, 18)
    for h in height:
        tree = Tree.of(soup([[[0, 0, 0], [1, 0, 0], [0.3, h, 0]]]))
        near = tree.closest([[0.7, -1.0, 1.0], [0.31, 0.5, 0.25]])
        assert near.distance[0] == pytest.approx(np.sqrt(2.0), rel=1e-15)
        assert near.distance[1] == pytest.approx(np.hypot(0.5, 0.25), abs=2 * h + 1e-15)


def test_no_ray_leaks_through_the_edges_and_corners_of_a_cube():
    tree = Tree.of(Triangulation(CUBE, CUBE_FACES))
    corners = CUBE[CUBE_FACES]
    share = np.linspace(0, 1, 33)[:, None]
    targets = np.concatenate([c[k] + share * (c[(k + 1) % 3] - c[k]) for c in corners for k in range(3)])
    for inside in ([0.5, 0.5, 0.5], [0.1, 0.7, 0.3], [1 / 3, 1 / 7, 0.9]):
        hit = tree.first_hit(inside, targets - inside)
        assert hit.hit.all()
        assert np.abs(hit.distance - np.linalg.norm(targets - inside, axis=1)).max() < 1e-15


@pytest.mark.parametrize("shift", [0.0, 2e3])
def test_no_ray_leaks_out_of_a_sphere_however_it_lies(shift):
    vertices, triangles = icosphere(3)
    rng = np.random.default_rng(4)
    vertices = vertices @ rotation(1).T + shift * np.array([1.0, -0.7, 0.4])
    tree = Tree.of(Triangulation(vertices, triangles))
    corners = vertices[triangles]
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    share = rng.random((len(edges), 1))
    targets = np.concatenate([vertices, edges[:, 0] + share * (edges[:, 1] - edges[:, 0]), edges.mean(axis=1)])
    for _ in range(8):
        inside = vertices.mean(axis=0) + rng.uniform(-0.5, 0.5, 3)
        assert tree.first_hit(inside, targets - inside).hit.all()
        crossed = tree.all_hits(2 * targets - inside, inside)
        assert (np.diff(crossed.offsets) > 0).all()


def test_two_skins_closer_than_single_precision_are_told_apart():
    gap = 1e-12
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    triangles = [[0, 1, 2], [0, 2, 3]]
    vertices = np.concatenate([square + np.array([0, 0, z]) for z in (1.0 + gap, 1.0, 1.0 + 2 * gap)])
    tree = Tree.of(Triangulation(vertices, np.concatenate([np.array(triangles) + 4 * k for k in range(3)])))
    xy = np.random.default_rng(0).random((50, 2))
    below, above = np.c_[xy, np.zeros(50)], np.c_[xy, np.full(50, 2.0)]
    assert set(tree.first_hit(below, [0, 0, 1.0]).triangle.tolist()) == {2, 3}
    assert set(tree.first_hit(above, [0, 0, -1.0]).triangle.tolist()) == {4, 5}
    assert (np.diff(tree.all_hits(below, above).offsets) == 3).all()


def test_equal_distances_go_to_the_lowest_triangle(torus):
    three = Triangulation(torus.triangulation.vertices, np.tile(torus.triangulation.triangles, (3, 1)))
    tree = Tree.of(three)
    rng = np.random.default_rng(2)
    points, directions = rng.normal(size=(400, 3)) * 8, rng.normal(size=(400, 3))
    assert (tree.closest(points).triangle == torus.closest(points).triangle).all()
    assert (tree.first_hit(points, directions).triangle == torus.first_hit(points, directions).triangle).all()


def test_reach_is_a_length_and_includes_its_end():
    tree = Tree.of(Triangulation(CUBE, CUBE_FACES))
    origins = np.tile([0.25, 0.5, -2.0], (3, 1))
    hit = tree.first_hit(origins, [0, 0, 5.0], reach=[1.5, 2.0, np.inf])
    assert hit.distance.tolist() == [np.inf, 2.0, 2.0]
    assert tree.first_hit(origins, [0, 0, 5.0], reach=1.0).triangle.tolist() == [-1, -1, -1]


def test_a_ray_in_the_plane_of_a_triangle_or_at_one_without_area_hits_nothing():
    flat = Tree.of(soup([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]))
    assert not flat.first_hit([-1.0, 0.25, 0.0], [1.0, 0.0, 0.0]).hit.any()
    line = Tree.of(soup([[[0, 0, 0], [1, 1, 1], [2, 2, 2]], [[5, 5, 5]] * 3]))
    assert not line.first_hit([[0.5, 0.5, 3.0], [5, 5, 0]], [[0, 0, -1.0], [0, 0, 1.0]]).hit.any()
    near = line.closest([[0.5, 0.5, 3.0], [6, 5, 5]])
    assert np.isfinite(near.barycentric).all()
    assert near.triangle.tolist() == [0, 1]


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("offset", [0.0, 26e3])
def test_rigid_motion_scale_and_a_far_origin_change_nothing_but_round_off(torus, scale, offset):
    rng = np.random.default_rng(5)
    points, directions = rng.normal(size=(300, 3)) * 8, rng.normal(size=(300, 3))
    turn, shift = rotation(2), offset * np.array([1.0, -0.5, 0.2])
    mesh = torus.triangulation
    moved = Tree.of(Triangulation((mesh.vertices @ turn.T + shift) * scale, mesh.triangles))
    exact = 1e-12 if offset == 0.0 else 1e-9
    a, b = torus.first_hit(points, directions), moved.first_hit((points @ turn.T + shift) * scale, directions @ turn.T)
    assert (a.triangle == b.triangle).all()
    assert np.allclose(a.distance[a.hit], b.distance[a.hit] / scale, rtol=0, atol=exact)
    c, d = torus.closest(points), moved.closest((points @ turn.T + shift) * scale)
    assert np.allclose(c.distance, d.distance / scale, rtol=0, atol=exact)


def test_thread_count_and_order_of_the_questions_change_nothing(torus, monkeypatch):
    rng = np.random.default_rng(6)
    points, directions = rng.normal(size=(20000, 3)) * 8, rng.normal(size=(20000, 3))
    results = []
    for count in (1, 2, 3):
        monkeypatch.setattr("patchwright.models.tree.threads", lambda count=count: count)
        results.append((torus.first_hit(points, directions), torus.closest(points)))
        results[-1] += (torus.all_hits(points, points + directions),)
    results.append((torus.first_hit(points[::-1], directions[::-1]), torus.closest(points[::-1])))
    for hit, near, crossed in results[1:-1]:
        assert (hit.distance == results[0][0].distance).all()
        assert (near.points == results[0][1].points).all()
        assert (crossed.offsets == results[0][2].offsets).all()
        assert (crossed.t == results[0][2].t).all()
    assert (results[-1][0].distance[::-1] == results[0][0].distance).all()
    assert (results[-1][1].triangle[::-1] == results[0][1].triangle).all()
    assert (results[-1][1].distance[::-1] == results[0][1].distance).all()


def test_pairs_are_the_touching_boxes(torus):
    corners = torus.triangulation.corners
    low, high = corners.min(axis=1), corners.max(axis=1)
    aside = torus.triangulation.vertices + np.array([3.0, 0.4, 0.1])
    shifted = Tree.of(Triangulation(aside, torus.triangulation.triangles[:500]))

    def touching(low, high, low2, high2):
        return ((low[:, None] <= high2[None]) & (low2[None] <= high[:, None])).all(axis=2)

    own = np.argwhere(np.triu(touching(low, high, low, high), 1))
    assert (torus.pairs() == own).all()
    corners = shifted.triangulation.corners
    both = np.argwhere(touching(low, high, corners.min(axis=1), corners.max(axis=1)))
    assert len(both) > 100
    assert (torus.pairs(shifted) == both).all()


def test_many_equal_triangles_do_not_make_a_deep_tree():
    corners = np.repeat([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], 5000, axis=0)
    tree = Tree.of(soup(corners))
    assert tree.closest([0.2, 0.2, 1.0]).triangle.tolist() == [0]
    assert len(tree.all_hits([0.2, 0.2, 1.0], [0.2, 0.2, -1.0]).t) == 5000
    spread = soup([[[x, 0, 0], [2 * x, 0, 0], [x, x, 0]] for x in 2.0 ** -np.arange(900.0)])
    assert np.isfinite(Tree.of(spread).closest([-1.0, 0.0, 0.0]).distance).all()


def test_nothing_is_hit_in_an_empty_triangulation():
    tree = Tree.of(Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)))
    assert tree.first_hit([0.0, 0, 0], [1.0, 0, 0]).triangle.tolist() == [-1]
    assert tree.all_hits(np.zeros((2, 3)), np.ones((2, 3))).offsets.tolist() == [0, 0, 0]
    assert tree.pairs().shape == (0, 2)
    with pytest.raises(ParameterError, match="without triangles"):
        tree.closest([0.0, 0, 0])


def test_no_questions_no_answers(torus):
    assert torus.closest(np.zeros((0, 3))).points.shape == (0, 3)
    assert torus.first_hit(np.zeros((0, 3)), np.zeros((0, 3))).distance.shape == (0,)
    assert torus.all_hits(np.zeros((0, 3)), np.zeros((0, 3))).offsets.tolist() == [0]


def test_bad_questions_are_refused_with_the_row(torus):
    bad = np.array([[0.0, 0, 0], [0, np.nan, 0]])
    with pytest.raises(ParameterError, match="row 1 of points"):
        torus.closest(bad)
    with pytest.raises(ParameterError, match="row 1 of origins"):
        torus.first_hit(bad, [0, 0, 1.0])
    with pytest.raises(ParameterError, match="row 1 of end"):
        torus.all_hits(np.zeros((2, 3)), bad)
    with pytest.raises(ParameterError, match="reach of ray 0 is NaN"):
        torus.first_hit([0.0, 0, 0], [0, 0, 1.0], reach=np.nan)
    with pytest.raises(ParameterError, match="2 origins do not go with 3 directions"):
        torus.first_hit(np.zeros((2, 3)), np.ones((3, 3)))
    with pytest.raises(ParameterError, match=r"\(n, 3\)"):
        torus.closest(np.zeros((4, 2)))
