"""A tessellation that answers with its true surfaces: welded, turned and cut triangles, creases, and a finer fit."""

from __future__ import annotations

import numpy as np
import pytest
from quad_shapes import layout_from_quads

from patchwright.models import Assembly, Cylinder, Part, Plane, Sphere, Tolerance, Triangulation
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.tree import Tree
from patchwright.repair.ground.true_deviation import true_deviation
from patchwright.repair.ground.true_ground import TrueGround, TrueSurfaces
from patchwright.repair.ground.true_surface import Outcome
from patchwright.repair.layout.true_layout import onto_curves, onto_true
from patchwright.repair.patches.projection import project


def sheet(surface, m, n, name="sheet"):
    """A part whose triangles' corners lie on the surface, with their uv."""
    (u0, u1), (v0, v1) = surface.domain
    u, v = np.meshgrid(np.linspace(u0, u1, m + 1), np.linspace(v0, v1, n + 1), indexing="ij")
    uv = np.stack([u.ravel(), v.ravel()], axis=1)
    k = np.arange((m + 1) * (n + 1)).reshape(m + 1, n + 1)
    a, b, c, d = k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel()
    corners = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Part(name, Triangulation(surface(uv[:, 0], uv[:, 1]), corners, uv=uv[corners]), surface)


def ground_over(*parts):
    raw = Assembly(tuple(parts)).triangulation
    true = TrueSurfaces.of(Assembly(tuple(parts)))
    return TrueGround.of(Tree.of(raw), np.arange(len(raw)), true)


BALL = Sphere((0, 0, 0), 1.0, v=(-1.2, 1.2))
TUBE = Cylinder((0, 0, 0), (0, 0, 1), 1.0, u=(0.0, np.pi), v=(0.0, 2.0))


def near_tube(count, height, seed=0):
    rng = np.random.default_rng(seed)
    u, z = rng.uniform(0.2, 2.9, count), rng.uniform(0.2, 1.8, count)
    r = 1.0 + rng.uniform(-height, height, count)
    return np.stack([r * np.cos(u), r * np.sin(u), z], axis=1), np.abs(r - 1.0)


@pytest.mark.parametrize("cells", [12, 24, 48])
def test_closest_points_do_not_know_how_coarse_the_triangles_are(cells):
    points, distance = near_tube(2000, 0.05)
    found, status = ground_over(sheet(TUBE, cells, 3)).closest_with_outcome(points)
    assert (status == Outcome.CONVERGED).all()
    assert np.abs(found.distance - distance).max() < 1e-11
    assert np.abs(np.hypot(found.points[:, 0], found.points[:, 1]) - 1.0).max() < 1e-12


def test_projected_points_lie_on_the_surface_and_on_their_ray():
    points, _ = near_tube(2000, 0.03)
    normals = points * [1, 1, 0] / np.hypot(points[:, 0], points[:, 1])[:, None]
    normals[:, 2] = 0.3
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    ground = ground_over(sheet(TUBE, 24, 3))
    reach = np.full(len(points), 0.2)
    flat, exact = (project(points, normals, reach, tree) for tree in (ground.tree, ground))
    assert flat.hit.all()
    assert (flat.outcome == Outcome.NO_SURFACE).all()
    assert (exact.outcome == Outcome.CONVERGED).all()
    radius = np.hypot(exact.points[:, 0], exact.points[:, 1])
    assert np.abs(radius - 1.0).max() < 1e-12 * 1e2  # 1e-12 of the diagonal, and its round-off
    assert np.abs(np.hypot(flat.points[:, 0], flat.points[:, 1]) - 1.0).max() > 1e-3
    assert np.linalg.norm(np.cross(exact.points - points, normals), axis=1).max() < 1e-13


def test_mended_triangles_find_their_surface_by_the_raw_one_they_came_from():
    part = sheet(BALL, 40, 20)
    raw = part.triangulation
    true = TrueSurfaces.of(Assembly((part,)))
    # turned over, corners rotated, order shuffled, and every triangle cut in four
    order = np.random.default_rng(0).permutation(len(raw))
    a, b, c = np.moveaxis(raw.corners[order][:, [1, 2, 0]][:, ::-1], 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    pieces = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    cut = Triangulation(pieces.reshape(-1, 3), np.arange(3 * len(pieces)).reshape(-1, 3))
    ground = TrueGround.of(Tree.of(cut), np.tile(order, 4), true)
    points = np.random.default_rng(1).standard_normal((1000, 3)) * [1, 1, 0.5]
    points *= 1.02 / np.linalg.norm(points, axis=1, keepdims=True)
    points = points[np.abs(points[:, 2]) < 0.85]
    found, status = ground.closest_with_outcome(points)
    assert (status == Outcome.CONVERGED).all()
    assert np.abs(found.distance - 0.02).max() < 1e-11
    nothing = TrueGround.of(Tree.of(cut), np.full(len(cut), -1), true)
    assert (nothing.closest_with_outcome(points)[1] == Outcome.NO_SURFACE).all()
    assert np.array_equal(nothing.closest(points).points, nothing.tree.closest(points).points)


def test_a_surface_that_runs_on_beyond_its_face_gives_no_foot_there():
    wide = Plane((0, 0, 0), (0, 0, 1), u=(-5.0, 5.0), v=(-5.0, 5.0))
    part = sheet(Plane((0, 0, 0), (0, 0, 1), u=(-1.0, 1.0), v=(-1.0, 1.0)), 4, 4)
    ground = ground_over(Part("face", part.triangulation, wide))
    found = ground.closest(np.array([[1.3, 0.2, 0.0], [1.3, 0.2, 0.4], [0.3, 0.2, 0.4]]))
    assert np.allclose(found.distance, [0.3, 0.5, 0.4], rtol=0, atol=1e-12)


def test_deflection_is_the_height_of_the_chords():
    part = sheet(TUBE, 24, 3)
    assert ground_over(part).deflection() == pytest.approx(1 - np.cos(np.pi / 48), rel=1e-9)


def test_deviation_from_the_true_surface_is_exact_on_coarse_triangles():
    ground = ground_over(sheet(TUBE, 8, 2))
    outer = Cylinder((0, 0, 0), (0, 0, 1), 1.01, u=(0.0, np.pi), v=(0.0, 2.0))
    fine = sheet(outer, 2000, 2).triangulation
    none = np.zeros(len(ground.triangulation), dtype=bool), np.zeros(len(fine), dtype=bool)
    spread = true_deviation(ground, fine, 0.011, *none)
    for one in (spread.input_to_output, spread.output_to_input):
        assert one.median == pytest.approx(0.01, rel=1e-3)
        assert one.largest == pytest.approx(0.01, rel=1e-3)
        assert one.coverage == 1.0


def half_circle(z):
    """u in [0, pi] at height z, exact."""
    w = np.array([1.0, np.sqrt(0.5), 1.0, np.sqrt(0.5), 1.0])
    xy = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0]], dtype=float)
    points = np.concatenate([xy, np.full((5, 1), z)], axis=1)
    return NurbsCurve(2, np.array([0, 0, 0, 0.5, 0.5, 1, 1, 1.0]), points, w)


def test_points_go_to_the_nearest_curve():
    points, _ = near_tube(500, 0.05)
    moved = onto_curves(points, (half_circle(0.0), half_circle(2.0)))
    assert np.allclose(np.hypot(moved[:, 0], moved[:, 1]), 1.0, rtol=0, atol=1e-12)
    assert np.array_equal(np.round(moved[:, 2]), np.where(points[:, 2] < 1.0, 0.0, 2.0))


def test_a_layout_goes_onto_edge_curves_and_surfaces_and_not_farther_than_told():
    part = sheet(TUBE, 12, 2)
    ground = ground_over(part)
    angles = np.linspace(0, np.pi, 13)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    middle = 0.5 * (ring[3] + ring[4])  # on a facet
    ends = [ring[0], middle, ring[-1]]
    vertices = np.array([[*p, z] for z in (0.0, 2.0) for p in ends])
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])

    def path(a, b):
        p, q = vertices[a], vertices[b]
        if p[2] != q[2]:
            return np.stack([p, q])
        inner = ring[1:4] if 0 in (a % 3, b % 3) else ring[4:-1]
        return np.concatenate([[p], [[*r, p[2]] for r in inner], [q]])

    layout = layout_from_quads(vertices, quads, path)
    curves = (half_circle(0.0), half_circle(2.0))
    reach = 2.0 * ground.deflection()
    moved = onto_true(layout, ground, curves, 0.01 * reach, reach)
    rims = [moved.path(e) for e in range(len(moved.edges)) if np.ptp(moved.path(e)[:, 2]) == 0.0]
    assert len(rims) == 4
    for rim in rims:
        assert np.abs(np.hypot(rim[:, 0], rim[:, 1]) - 1.0).max() < 1e-12
        chords = 0.5 * (rim[1:] + rim[:-1])
        assert np.abs(np.hypot(chords[:, 0], chords[:, 1]) - 1.0).max() <= 0.011 * reach
    for edge, (a, b) in enumerate(moved.edges):
        assert np.array_equal(moved.path(edge)[0], moved.vertices[a])
        assert np.array_equal(moved.path(edge)[-1], moved.vertices[b])
    still = onto_true(layout, ground, curves, 0.01 * reach, 1e-9)
    assert np.abs(still.vertices - layout.vertices).max() <= 1e-9


def test_a_mesh_has_no_true_surfaces():
    bare = Triangulation(np.eye(3), np.array([[0, 1, 2]]))
    assert TrueSurfaces.of(Assembly.of(bare)) is None
    assert Tolerance.of(bare).fit > 0
