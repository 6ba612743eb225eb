from __future__ import annotations

from typing import Any

import dirty_shapes as shapes
import numpy as np
import pytest
import trimesh

from patchwright.models import Cylinder, NurbsSurface, ParameterError, Plane, Sphere, Surface, Torus, Triangulation
from patchwright.models.knots import greville, uniform_knots
from patchwright.models.tree import Tree
from patchwright.ssi.mesh_surface import intersect_mesh_surface
from patchwright.ssi.mesh_surface_arcs import Arcs

Z = (0.0, 0.0, 1.0)


def plate(height: float = 0.3, size: float = 3.0, n: int = 5) -> Triangulation:
    x, y = np.meshgrid(np.linspace(-size, size, n), np.linspace(-size, size, n), indexing="ij")
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)[None]).reshape(-1)
    rows = np.concatenate([np.stack([i, i + n, i + n + 1], 1), np.stack([i, i + n + 1, i + 1], 1)])
    return Triangulation(np.stack([x, y, 0 * x + height], axis=-1).reshape(-1, 3), rows)


@pytest.mark.parametrize("make", [lambda s: s, lambda s: s.to_nurbs()], ids=["analytic", "NURBS"])
def test_a_plate_cuts_a_sphere_in_the_exact_circle(make) -> None:
    found = intersect_mesh_surface(plate(), make(Sphere((0.1, 0.05, 0.0), 1.0)), 1e-10)
    assert [c.closed for c in found.curves] == [True]
    curve = found.curves[0]
    assert found.length == pytest.approx(2 * np.pi * np.sqrt(1 - 0.09), rel=1e-10)
    assert curve.residual <= 1e-10
    # exactly in the plate's plane, and on the sphere between the points too
    low, high = curve.curve.knots[[0, -1]]
    points = curve.curve(np.linspace(low, high, 5001))
    assert np.abs(points[:, 2] - 0.3).max() < 1e-15 * 4
    assert np.abs(np.linalg.norm(points - [0.1, 0.05, 0.0], axis=1) - 1.0).max() < 1e-10


@pytest.mark.parametrize("tolerance", [1e-5, 1e-8, 1e-10])
def test_the_residual_follows_the_tolerance(tolerance: float) -> None:
    torus = Torus((0.05, 0.02, 0.01), (0.1, 0.2, 1.0), 1.0, 0.4)
    body = shapes.of(trimesh.creation.box(extents=(1.5, 1.1, 2.0)))
    found = intersect_mesh_surface(body, torus, tolerance)
    assert found.curves
    assert found.residual <= tolerance
    assert found.complete
    tree = Tree.of(body)
    for curve in found.curves:
        low, high = curve.curve.knots[[0, -1]]
        points = curve.curve(np.linspace(low, high, 10 * len(curve.points)))
        assert tree.closest(points).distance.max() < tolerance
        own = points - torus.center
        up = own @ torus.axis
        ring = np.hypot(np.linalg.norm(own - up[:, None] * torus.axis, axis=1) - 1.0, up)
        assert np.abs(ring - 0.4).max() < tolerance


def test_points_on_mesh_edges_stay_on_them() -> None:
    body = shapes.of(trimesh.creation.box(extents=(1.5, 1.1, 2.0)))
    found = intersect_mesh_surface(body, Sphere((0.1, 0.2, 0.0), 0.8), 1e-9)
    corners = np.concatenate([c.points[:1] for c in found.curves])
    assert len(corners) == len(found.curves) == 2  # x = 0.75 and y = +-0.55: the right face, and one over two faces


def test_a_curve_ends_on_the_border_of_the_surface() -> None:
    piece = Cylinder((0, 0, 0), (0, 1, 0), 1.0, v=(-0.5, 1.0))
    found = intersect_mesh_surface(plate(0.25), piece, 1e-10)
    assert len(found.curves) == 2
    for curve in found.curves:
        ends = np.sort(curve.points[[0, -1], 1])
        assert ends == pytest.approx([-0.5, 1.0], abs=1e-12)
        assert np.abs(curve.points[:, 0]) == pytest.approx(np.sqrt(1 - 0.0625), abs=1e-10)
        assert curve.curve.length() == pytest.approx(1.5, rel=1e-11)


def test_parameters_jump_by_a_period_at_a_seam() -> None:
    torus = Torus((0, 0, 0), Z, 2.0, 0.5)
    found = intersect_mesh_surface(plate(0.1), torus, 1e-9)
    assert [c.closed for c in found.curves] == [True, True]
    assert found.length == pytest.approx(2 * np.pi * 4, rel=1e-9)
    for curve in found.curves:
        assert curve.uv_b is not None
        t = np.linspace(*curve.curve.domain, 1000)
        uv = curve.uv_b(t)
        assert uv.min() >= -1e-12
        assert uv.max() <= 2 * np.pi + 1e-12
        assert np.linalg.norm(torus(uv[:, 0], uv[:, 1]) - curve.curve(t), axis=1).max() <= 4.0 * curve.residual
        steps = np.abs(np.diff(uv[:, 0]))
        jumps = steps > np.pi
        assert jumps.sum() == 1  # it runs round once
        assert steps[jumps] == pytest.approx(2 * np.pi, abs=0.05)


def test_moved_along_the_curve_is_the_moved_one() -> None:
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    lengths = []
    for scale in (1e-3, 1.0, 1e3):
        mesh = plate()
        moved = Triangulation(scale * mesh.vertices @ turn.T, mesh.triangles)
        ball = Sphere(scale * turn @ np.array([0.1, 0.05, 0.0]), scale)
        lengths.append(intersect_mesh_surface(moved, ball).length / scale)
    assert lengths == pytest.approx([2 * np.pi * np.sqrt(1 - 0.09)] * 3, rel=1e-9)


def test_apart_or_unbounded() -> None:
    assert not intersect_mesh_surface(plate(5.0), Sphere((0, 0, 0), 1.0), 1e-9).curves
    with pytest.raises(ParameterError, match="bounded"):
        intersect_mesh_surface(plate(), Plane((0, 0, 0), Z), 1e-9)
    with pytest.raises(ParameterError, match="tolerance"):
        intersect_mesh_surface(plate(), Sphere((0, 0, 0), 1.0), 0.0)


@pytest.mark.parametrize("depth", [1e-2, 1e-5, 1e-8, 1e-11])
def test_loops_smaller_than_any_triangle_are_found(depth: float) -> None:
    """A plate just below the top of a sphere: a circle of radius sqrt(2 d - d^2) inside one triangle."""
    ball = Sphere((0.1, 0.05, 0.0), 1.0, (0.3, -0.5, 0.2))
    found = intersect_mesh_surface(plate(1.0 - depth), ball, min(1e-10, 1e-2 * depth))
    assert found.complete
    assert [c.closed for c in found.curves] == [True]
    # heights are good to a few units of round-off, the radius to half of that relative to the depth
    rounding = 1e-15 / depth
    assert found.length == pytest.approx(2 * np.pi * np.sqrt(2 * depth - depth**2), rel=1e-6 + rounding)
    curve = found.curves[0].curve  # on about arc length
    middle = curve(np.linspace(*curve.domain, 400, endpoint=False)).mean(axis=0)
    assert middle[:2] == pytest.approx([0.1, 0.05], abs=1e-3 * np.sqrt(depth))


@pytest.mark.parametrize("axis", [Z, (1.0, 0.0, 0.0), (0.3, -0.5, 0.2)], ids=["pole", "seam", "inside"])
def test_a_plate_on_top_of_a_sphere_touches_it_in_one_point(axis: tuple[float, float, float]) -> None:
    found = intersect_mesh_surface(plate(1.0), Sphere((0.1, 0.05, 0.0), 1.0, axis))
    assert found.complete
    assert not found.curves
    assert [p.kind for p in found.points] == ["touch"]
    # a gap of 1e-16 leaves a place to the root of it
    assert found.points[0].point == pytest.approx([0.1, 0.05, 1.0], abs=1e-7)
    assert found.points[0].gap <= 1e-15


def test_just_off_the_sphere_is_proved_empty() -> None:
    found = intersect_mesh_surface(plate(1.0 + 1e-8), Sphere((0.1, 0.05, 0.0), 1.0), 1e-10)
    assert found.complete
    assert not found.curves
    assert not found.points


def test_a_curve_runs_through_poles_and_along_seams() -> None:
    for axis in ((0.6, 0.0, 0.8), (1.0, 0.0, 0.0)):
        found = intersect_mesh_surface(plate(0.0), Sphere((0.1, 0.05, 0.0), 1.0, axis), 1e-9)
        assert found.complete
        assert [c.closed for c in found.curves] == [True]
        assert found.length == pytest.approx(2 * np.pi, rel=1e-9)


def test_curves_do_not_leave_a_mesh_finer_than_their_pieces() -> None:
    """Thousands of vertices near the curve: on which side of each it passes is decided, not sampled."""
    ball = shapes.of(trimesh.creation.icosphere(4))
    found = intersect_mesh_surface(ball, Cylinder((0.1, 0.05, 0.0), (0.1, 0.2, 1.0), 0.4, v=(-2.0, 2.0)))
    assert found.complete
    assert [c.closed for c in found.curves] == [True, True]
    tree = Tree.of(ball)
    for curve in found.curves:
        points = curve.curve(np.linspace(*curve.curve.domain, 5000))
        assert tree.closest(points).distance.max() < 1e-12


def test_the_order_of_the_triangles_does_not_matter() -> None:
    ball = shapes.of(trimesh.creation.icosphere(2))
    torus = Torus((0.3, 0.1, 0.0), (0.2, 0.1, 1.0), 1.0, 0.3)
    mixed = np.random.default_rng(3).permutation(len(ball))
    one, two = (intersect_mesh_surface(m, torus) for m in (ball, ball.take(mixed)))
    assert one.complete
    assert len(one.curves) == len(two.curves) > 0
    assert one.length == pytest.approx(two.length, rel=1e-12)


def test_a_plane_meets_a_mesh_exactly_and_lies_in_it() -> None:
    plane = Plane((0.0, 0.0, 0.3), Z, (1.0, 0.0, 0.0), (-1.0, 1.0), (-0.5, 1.5))
    lying = intersect_mesh_surface(plate(0.3), plane)
    assert lying.complete
    assert [o.area for o in lying.overlaps] == pytest.approx([4.0], rel=1e-14)
    body = shapes.of(trimesh.creation.box(extents=(1.0, 1.0, 1.0)))
    found = intersect_mesh_surface(body, plane)
    assert found.complete
    assert [c.closed for c in found.curves] == [True]
    assert found.length == pytest.approx(4.0, rel=1e-14)
    uv = found.curves[0].uv_b
    assert uv is not None
    t = np.linspace(*uv.domain, 100)
    assert np.abs(plane(*uv(t).T) - found.curves[0].curve(t)).max() < 1e-15


def test_a_ruling_that_touches_is_left_open() -> None:
    tube = Cylinder((0, 0, 0), (0.3, 1, 0), 1.0, v=(-0.5, 1.0))
    found = intersect_mesh_surface(plate(1.0), tube, 1e-6)
    assert not found.complete
    assert "touches it along a curve" in found.unresolved[0].reason


def test_a_curve_along_a_seam_through_many_small_triangles() -> None:
    """Points of mesh edges that lie across the seam from where the triangulation put them."""
    mesh = shapes.of(trimesh.creation.torus(2.0, 0.7, 60, 30))
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    torus = Torus((1.1, 0.3, 0.2), turn[:, 2], 2.0, 0.7)
    found = intersect_mesh_surface(mesh, torus, 1e-9)
    assert len(found.curves) == 2
    assert all(c.closed for c in found.curves)
    assert found.residual <= 1e-9


def relief(p: int, knots: np.ndarray) -> NurbsSurface:
    """A height field of degree p over a square of side 2, bumps of fixed height."""
    x, y = np.meshgrid(2.0 * greville(p, knots) - 1.0, 2.0 * greville(p, knots) - 1.0, indexing="ij")
    z = 0.3 * np.sin(5.0 * x + 1.0) * np.cos(4.0 * y)
    return NurbsSurface((p, p), (knots, knots), np.stack([x, y, z], axis=-1))


KINK = np.array([0, 0, 0, 0, 0.4, 0.4, 0.4, 1, 1, 1, 1], dtype=float)
ON_BOTH: dict[str, Surface] = {
    "bilinear facets": relief(1, uniform_knots(1, 6)),
    "kinked": relief(3, KINK),
    "smooth": relief(3, uniform_knots(3, 7)),
    "closed": Torus((0.3, 0.1, 0.0), (0.2, 0.1, 1.0), 1.0, 0.3),
}


@pytest.mark.parametrize("surface", ON_BOTH.values(), ids=ON_BOTH.keys())
def test_every_curve_lies_on_the_mesh_and_on_the_surface(surface: Surface) -> None:
    """Between the places the fit was measured at, too: no farther from either than the residual says."""
    ball = shapes.of(trimesh.creation.icosphere(3, radius=0.7))
    found = intersect_mesh_surface(ball, surface)
    assert found.complete
    assert found.curves
    tree = Tree.of(ball)
    for curve in found.curves:
        assert curve.residual <= 1e-10 * ball.diagonal
        assert curve.uv_b is not None
        t = np.linspace(*curve.curve.domain, 64 * len(curve.points))
        points, (u, v) = curve.curve(t), curve.uv_b(t).T
        allowed = 1.05 * curve.residual + 1e-15  # the largest of nine samples is nearly the largest of all
        assert tree.closest(points).distance.max() <= allowed
        assert np.linalg.norm(surface(u, v) - points, axis=1).max() <= allowed


@pytest.mark.parametrize("slope", [0.25, 0.5, 0.75, 1.0])
def test_a_side_in_line_with_the_end_of_an_arc(slope: float) -> None:
    """A triangle within a tube meets it nowhere, though the line of one side, x = 0, ends at a border of a piece."""
    corners = np.array([[0.0, 0.9], [-0.5, 0.7], [0.0, 0.5]])
    inside = Triangulation(np.column_stack([corners, slope * corners[:, 1]]), np.array([[0, 1, 2]]))
    found = intersect_mesh_surface(inside, Cylinder((0, 0, 0), Z, 1.0, (1.0, 0.0, 0.0), v=(-2.0, 2.0)))
    assert found.complete
    assert not found.curves
    assert not found.points


@pytest.mark.parametrize("distance", [1e-6, 1e-3])
def test_a_curve_that_was_led_off_its_triangle_is_not_complete(
    distance: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The end check does not trust what came before: arcs are spoilt, and the answer says so."""
    honest = Arcs.of

    def spoilt(*given: Any) -> Arcs:
        arcs = honest(*given)
        arcs.ends[:, :, 0] += distance
        return arcs

    monkeypatch.setattr(Arcs, "of", spoilt)
    found = intersect_mesh_surface(shapes.of(trimesh.creation.icosphere(2)), Sphere((0.9, 0.2, 0.1), 0.8))
    assert not found.complete
    assert any("off the mesh or the surface" in u.reason for u in found.unresolved)
    assert found.residual >= 0.1 * distance
