from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from oracles_mesh_mesh import common_part, coplanar, has_area

from patchwright.models import Triangulation
from patchwright.ssi.intersection import Intersection
from patchwright.ssi.mesh_cull import near
from patchwright.ssi.mesh_mesh import intersect_meshes, mesh_intersection
from patchwright.ssi.mesh_topology import KINDS, OVERLAP_INNER


def box(extents=(1.0, 1.0, 1.0), at=(0.0, 0.0, 0.0), turn=None) -> Triangulation:
    """Twelve triangles."""
    mesh = trimesh.creation.box(extents=extents)
    if turn is not None:
        mesh.apply_transform(trimesh.transformations.rotation_matrix(*turn))
    mesh.apply_translation(at)
    return shapes.of(mesh)


def shuffled(mesh: Triangulation, seed: int) -> Triangulation:
    """The same triangles in another order, their corners cyclically and the vertices arbitrarily renumbered."""
    rng = np.random.default_rng(seed)
    number = rng.permutation(len(mesh.vertices))
    vertices = np.empty_like(mesh.vertices)
    vertices[number] = mesh.vertices
    triangles = number[mesh.triangles][rng.permutation(len(mesh))]
    turn = (np.arange(3)[None] + rng.integers(0, 3, len(mesh))[:, None]) % 3
    return Triangulation(vertices, np.take_along_axis(triangles, turn, axis=1))


def same(x: Intersection, y: Intersection) -> bool:
    """Bit by bit: curves, contacts, overlaps."""
    return (
        [(c.kind, c.closed, c.points.tolist()) for c in x.curves]
        == [(c.kind, c.closed, c.points.tolist()) for c in y.curves]
        and [p.point.tolist() for p in x.points] == [p.point.tolist() for p in y.points]
        and len(x.overlaps) == len(y.overlaps)
    )


small = st.integers(0, 3).map(float)
triangles = arrays(np.float64, (2, 3, 3), elements=small)


@settings(max_examples=250, deadline=None)
@given(triangles)
def test_two_triangles_meet_where_rational_arithmetic_says(corners: np.ndarray) -> None:
    """On a lattice of four points a side nearly every pair is degenerate in some way."""
    p, q = corners
    index = np.array([[0, 1, 2]])
    found = mesh_intersection(Triangulation(p, index), Triangulation(q, index))
    if not has_area(p) or not has_area(q):
        assert not len(found.points)
        return
    expected = common_part(p, q)
    assert len(found.points) == len(expected)
    if expected:
        reference = np.array([[float(x) for x in point] for point in expected])
        distance = np.linalg.norm(found.points[:, None] - reference[None], axis=2)
        assert distance.min(axis=1).max() < 1e-14 * 10
        assert distance.min(axis=0).max() < 1e-14 * 10
    assert len(found.segments) == {0: 0, 1: 0, 2: 1}.get(len(expected), len(expected))
    assert len(found.contacts) == (len(expected) == 1)
    assert len(found.coplanar) == (len(expected) > 2)
    if len(expected) > 2:
        assert coplanar(p, q)
        shape = found.points - found.points.mean(axis=0)
        around = found.traced.curve(0)
        assert found.traced.closed.all()
        vectors = np.cross(shape[around[:-1]], shape[around[1:]])
        assert found.areas[0] == pytest.approx(0.5 * np.linalg.norm(vectors.sum(axis=0)), rel=1e-12)


@settings(max_examples=60, deadline=None)
@given(arrays(np.float64, (6, 3), elements=small), arrays(np.int64, (9, 3), elements=st.integers(0, 5)), st.integers(0))
def test_the_order_of_the_input_does_not_matter_for_lattice_soups(points, rows, seed) -> None:
    a, b = Triangulation(points, rows[:4]), Triangulation(points[::-1] + np.array([0.0, 0.0, 1.0]), rows[4:])
    reference = intersect_meshes(a, b)
    assert same(reference, intersect_meshes(b, a))
    assert same(reference, intersect_meshes(shuffled(a, seed), shuffled(b, seed + 1)))


@pytest.mark.parametrize("offset", [(0.5, 0.3, 0.2), (0.5, 0.25, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.5)])
def test_the_order_of_the_input_does_not_matter(offset) -> None:
    a, b = shapes.box(), shapes.box(at=offset)
    reference = intersect_meshes(a, b)
    assert same(reference, intersect_meshes(b, a))
    for seed in range(3):
        assert same(reference, intersect_meshes(shuffled(a, seed), shuffled(b, seed + 9)))
    both = shapes.together(a, b)
    assert same(intersect_meshes(both), intersect_meshes(shuffled(both, 4)))


def test_two_meshes_and_one_mesh_of_both_have_the_same_curves() -> None:
    a, b = shapes.sphere(3), shapes.box(at=(0.5, 0.3, 0.2))
    assert same(intersect_meshes(shapes.together(a, b)), intersect_meshes(a, b))


def test_two_boxes_cross_in_one_loop_of_known_length() -> None:
    found = intersect_meshes(box(), box(at=(0.5, 0.3, 0.2)))
    assert [(c.kind, c.closed) for c in found.curves] == [("transversal", True)]
    assert found.length == pytest.approx(2 * (0.5 + 0.7 + 0.8), rel=1e-14)
    assert found.complete
    assert not found.points
    assert not found.overlaps


@pytest.mark.parametrize(
    ("extents", "at", "length", "area"),
    [
        ((1, 1, 1), (0, 0, 1), 4.0, 1.0),  # face on equal face
        ((1, 1, 1), (0.5, 0.25, 1), 2.5, 0.375),  # partly
        ((0.5, 0.25, 1), (0.1, 0, 1), 1.5, 0.125),  # small on large
    ],
)
def test_faces_in_contact_are_an_overlap_with_its_boundary(extents, at, length, area) -> None:
    found = intersect_meshes(box(), box(extents, at))
    assert [(c.kind, c.closed) for c in found.curves] == [("overlap-boundary", True)]
    assert found.length == pytest.approx(length, rel=1e-14)
    assert len(found.overlaps) == 1
    assert found.overlaps[0].area == pytest.approx(area, rel=1e-14)
    assert found.overlaps[0].boundary == found.curves


def test_overlaps_and_crossings_join_at_singular_points() -> None:
    found = mesh_intersection(box(), box(at=(0.5, 0.25, 0.0)))
    result = intersect_meshes(box(), box(at=(0.5, 0.25, 0.0)))
    kinds = sorted(c.kind for c in result.curves)
    assert kinds == ["overlap-boundary"] * 4 + ["transversal"] * 2
    assert sum(o.area for o in result.overlaps) == pytest.approx(2 * 0.5 * 0.75)
    assert result.length == pytest.approx(2 * (2 * (0.5 + 0.75)) + 2 * 1.0)
    assert (found.use_count == 3).sum() == 4


def test_a_mesh_coincides_with_itself_everywhere_and_has_no_boundary_there() -> None:
    found = intersect_meshes(box(), box())
    assert not found.curves
    assert [o.area for o in found.overlaps] == [pytest.approx(6.0)]


@pytest.mark.parametrize(("at", "kind", "length"), [((1, 1, 0), "tangential", 1.0), ((1, 1, 0.5), "tangential", 0.5)])
def test_bodies_edge_to_edge_touch_along_it(at, kind, length) -> None:
    found = intersect_meshes(box(), box(at=at))
    assert [c.kind for c in found.curves] == [kind]
    assert found.length == pytest.approx(length)


def test_an_edge_on_a_face_touches_and_lowered_it_crosses() -> None:
    roof = box(turn=(np.pi / 4, [1, 0, 0]))
    points = roof.vertices.copy()
    points[:, 2] = np.round(points[:, 2] * np.sqrt(2), 12)  # the lower edge at z = -1 exactly
    touching = intersect_meshes(box((4, 4, 1), (0, 0, -1.5)), Triangulation(points, roof.triangles))
    assert [c.kind for c in touching.curves] == ["tangential"]
    assert touching.length == pytest.approx(1.0)
    points[:, 2] -= 0.25
    crossing = intersect_meshes(box((4, 4, 1), (0, 0, -1.5)), Triangulation(points, roof.triangles))
    assert [(c.kind, c.closed) for c in crossing.curves] == [("transversal", True)]


def test_corner_to_corner_is_a_contact() -> None:
    found = intersect_meshes(box(), box(at=(1, 1, 1)))
    assert not found.curves
    assert [p.point.tolist() for p in found.points] == [[0.5, 0.5, 0.5]]


def test_four_branches_meet_where_two_crossing_pairs_of_planes_do() -> None:
    """A plate through a square tube's edge: the tube's wall lines cross in the edge's point."""
    tube = box((1, 1, 4), turn=(np.pi / 4, [0, 0, 1]))
    other = box((1, 1, 4), turn=(np.pi / 4, [0, 0, 1]))
    turned = Triangulation(other.vertices[:, [2, 1, 0]] * [1, 1, 1], other.triangles[:, ::-1])
    found = mesh_intersection(tube, turned)
    # two equal square prisms crossing at right angles, edges meeting in two points: two ellipse-like loops cross there
    assert (found.use_count == 4).sum() == 2
    assert len(found.traced) == 4
    assert not found.traced.closed.any()
    length = found.points[found.segments]
    total = np.linalg.norm(length[:, 0] - length[:, 1], axis=1).sum()
    r = np.sqrt(0.5)
    assert total == pytest.approx(8 * np.sqrt(3) * r, rel=1e-12)


def test_spheres_cross_in_a_circle_at_second_order() -> None:
    error = []
    for level in (2, 3, 4, 5):
        found = intersect_meshes(shapes.sphere(level), shapes.sphere(level, at=(1.0, 0.013, 0.007)))
        d = np.sqrt(1 + 0.013**2 + 0.007**2)
        error.append(abs(found.length - 2 * np.pi * np.sqrt(1 - d * d / 4)))
        assert [c.closed for c in found.curves] == [True]
    assert np.log2(np.array(error[:-1]) / np.array(error[1:])).mean() > 1.8


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_moved_and_scaled_input_gives_the_moved_and_scaled_curve(scale: float) -> None:
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    shift = rng.normal(size=3) * 10 * scale
    a, b = shapes.sphere(3), shapes.box(at=(0.7, 0.1, 0.05))
    moved = [Triangulation(scale * m.vertices @ turn.T + shift, m.triangles) for m in (a, b)]
    reference, found = intersect_meshes(a, b), intersect_meshes(*moved)
    assert len(found.curves) == len(reference.curves)
    assert found.length == pytest.approx(scale * reference.length, rel=1e-11)


def test_segments_lie_in_both_of_their_triangles() -> None:
    a, b = shapes.sphere(4), shapes.box(at=(0.7, 0.1, 0.05))
    found = mesh_intersection(a, b)
    assert (found.kinds != OVERLAP_INNER).all()
    for k, mesh in enumerate((a, b)):
        corners = mesh.corners[found.triangles[:, k]]
        height = np.einsum(
            "ijk,ik->ij", found.points[found.segments] - corners[:, :1], mesh.normals[found.triangles[:, k]]
        )
        assert np.abs(height).max() < 1e-15 * 8
    assert len(found.sources) == len(found.segments)


def test_a_clean_mesh_does_not_meet_itself_and_a_folded_one_does() -> None:
    assert intersect_meshes(shapes.sphere(4)).length == 0.0
    x, y = np.meshgrid(np.linspace(-1, 1, 41), np.linspace(0, 1, 11), indexing="ij")
    loop = np.stack([x * (x * x - 0.5), y, x * x], axis=-1).reshape(-1, 3)  # crosses itself at x = +-sqrt(1/2)
    i = (np.arange(40)[:, None] * 11 + np.arange(10)[None]).reshape(-1)
    sheet = Triangulation(loop, np.concatenate([np.stack(c, 1) for c in ((i, i + 11, i + 12), (i, i + 12, i + 1))]))
    found = intersect_meshes(sheet)
    assert [(c.kind, c.closed) for c in found.curves] == [("transversal", False)]
    assert found.length == pytest.approx(1.0, rel=1e-12)


def test_a_soup_of_unshared_vertices_gives_the_same_curve() -> None:
    a, b = shapes.sphere(3), shapes.box(at=(0.7, 0.1, 0.05))
    assert same(intersect_meshes(shapes.soup(a), shapes.soup(b)), intersect_meshes(a, b))
    assert not intersect_meshes(shapes.soup(a)).curves


def test_meshes_apart_or_empty_share_nothing() -> None:
    nothing = Triangulation(np.zeros((0, 3)), np.zeros((0, 3)))
    for pair in ((box(), box(at=(3, 0, 0))), (box(), nothing), (nothing, None)):
        found = intersect_meshes(*pair)
        assert not found.curves
        assert not found.points
        assert found.complete


def test_the_sieve_drops_no_triangle_whose_box_touches_one_of_the_other() -> None:
    rng = np.random.default_rng(2)
    fine = shapes.sphere(5)
    size = 10.0 ** rng.uniform(-3, 0.5, (3000, 1, 1))
    soup = rng.uniform(-2, 2, (3000, 1, 3)) + size * rng.normal(size=(3000, 3, 3))
    mixed = Triangulation(soup.reshape(-1, 3), np.arange(9000).reshape(-1, 3))
    keep_a, keep_b = near(fine, mixed)
    low_a, high_a = fine.corners.min(axis=1), fine.corners.max(axis=1)
    low_b, high_b = mixed.corners.min(axis=1), mixed.corners.max(axis=1)
    touch = np.ones((len(fine), len(mixed)), dtype=bool)
    for k in range(3):
        touch &= (low_a[:, None, k] <= high_b[None, :, k]) & (low_b[None, :, k] <= high_a[:, None, k])
    assert np.isin(np.flatnonzero(touch.any(axis=1)), keep_a).all()
    assert np.isin(np.flatnonzero(touch.any(axis=0)), keep_b).all()
    assert len(keep_b) < len(mixed)
    assert len(KINDS) == 4
