from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest
import trimesh

from patchwright.models import Cylinder, ParameterError, Plane, Sphere, Torus, Triangulation
from patchwright.models.tree import Tree
from patchwright.ssi.mesh_surface import intersect_mesh_surface

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
    found = intersect_mesh_surface(body, torus, tolerance, chord=1e-3)
    assert found.curves
    assert found.residual <= tolerance
    assert not found.complete  # a triangulation proves nothing
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
    found = intersect_mesh_surface(body, Sphere((0.1, 0.2, 0.0), 0.8), 1e-9, chord=1e-3)
    corners = np.concatenate([c.points[:1] for c in found.curves])
    assert len(corners) == len(found.curves) == 2  # x = 0.75 and y = +-0.55: the right face, and one over two faces


def test_a_curve_ends_on_the_border_of_the_surface() -> None:
    piece = Cylinder((0, 0, 0), (0, 1, 0), 1.0, v=(-0.5, 1.0))
    found = intersect_mesh_surface(plate(0.25), piece, 1e-10, chord=1e-3)
    assert len(found.curves) == 2
    for curve in found.curves:
        ends = np.sort(curve.points[[0, -1], 1])
        assert ends == pytest.approx([-0.5, 1.0], abs=1e-12)
        assert np.abs(curve.points[:, 0]) == pytest.approx(np.sqrt(1 - 0.0625), abs=1e-10)
        assert curve.curve.length() == pytest.approx(1.5, rel=1e-11)


@pytest.mark.parametrize("chord", [1e-2, 2e-3, 5e-4])
def test_parameters_jump_by_a_period_at_a_seam(chord: float) -> None:
    torus = Torus((0, 0, 0), Z, 2.0, 0.5)
    found = intersect_mesh_surface(plate(0.1), torus, 1e-9, chord=chord)
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
        lengths.append(intersect_mesh_surface(moved, ball, chord=2e-3 * scale).length / scale)
    assert lengths == pytest.approx([2 * np.pi * np.sqrt(1 - 0.09)] * 3, rel=1e-9)


def test_apart_or_unbounded() -> None:
    assert not intersect_mesh_surface(plate(5.0), Sphere((0, 0, 0), 1.0), 1e-9).curves
    with pytest.raises(ParameterError, match="bounded"):
        intersect_mesh_surface(plate(), Plane((0, 0, 0), Z), 1e-9)
    with pytest.raises(ParameterError, match="tolerance"):
        intersect_mesh_surface(plate(), Sphere((0, 0, 0), 1.0), 0.0)


def test_a_curve_along_a_seam_through_many_small_triangles() -> None:
    """Points of mesh edges that lie across the seam from where the triangulation put them."""
    mesh = shapes.of(trimesh.creation.torus(2.0, 0.7, 60, 30))
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    torus = Torus((1.1, 0.3, 0.2), turn[:, 2], 2.0, 0.7)
    found = intersect_mesh_surface(mesh, torus, 1e-9, chord=1e-3)
    assert len(found.curves) == 2
    assert all(c.closed for c in found.curves)
    assert found.residual <= 1e-9
