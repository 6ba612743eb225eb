"""Tips: the apex of a cone, at any size and place, and nothing on smooth, sharp or noisy surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models import Triangulation
from patchwright.models.samples import cube, sphere
from patchwright.repair.layout.features import find_features
from patchwright.repair.layout.quad_layout import quad_layout
from patchwright.repair.layout.tips import find_tips


def cone(sides=48, height=2.0, rings=1):
    """A closed cone with its apex as vertex 0 and a fan for its base."""
    angle = 2 * np.pi * np.arange(sides) / sides
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    levels = np.arange(1, rings + 1) / rings
    points = [np.array([[0.0, 0.0, height]])]
    points += [np.column_stack([s * rim, np.full(sides, height * (1.0 - s))]) for s in levels]
    points.append(np.zeros((1, 3)))
    a = np.arange(sides)
    b = (a + 1) % sides
    triangles = [np.column_stack([0 * a, 1 + a, 1 + b])]
    for k in range(rings - 1):
        low, high = 1 + k * sides, 1 + (k + 1) * sides
        triangles += [np.column_stack([low + a, high + a, high + b]), np.column_stack([low + a, high + b, low + b])]
    last = 1 + (rings - 1) * sides
    triangles.append(np.column_stack([last + a, 0 * a + len(np.concatenate(points)) - 1, last + b]))
    return Triangulation(np.concatenate(points), np.concatenate(triangles))


def tips_of(body):
    return find_features(body).corners.tolist()


@pytest.mark.parametrize("height", [0.7, 2.0, 9.0])
@pytest.mark.parametrize("rings", [1, 8])
def test_the_apex_of_a_cone_is_a_tip(height, rings):
    body = cone(height=height, rings=rings)
    corners = tips_of(body)
    assert 0 in corners
    assert len(corners) == 2  # and where the rim's curve begins


def test_a_blunt_cone_has_none():
    assert 0 not in tips_of(cone(height=0.5))  # its normals lean 26.6 degrees away from the axis


def test_tips_move_with_the_body():
    body = cone(rings=6)
    turn, _ = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    moved = Triangulation(1e3 * body.vertices @ turn.T + 1e4, body.triangles)
    assert 0 in tips_of(moved)


def test_smooth_and_sharp_bodies_have_none():
    for body in (sphere().assembly.triangulation, cube().assembly.triangulation):
        normals = body.normals
        assert not find_tips(body, normals, np.zeros(len(body.vertices), dtype=bool), 60.0, 0.0).any()
    body = sphere().assembly.triangulation
    rng = np.random.default_rng(0)
    noisy = Triangulation(body.vertices + 1e-3 * rng.standard_normal(body.vertices.shape), body.triangles)
    assert not tips_of(noisy)


@pytest.mark.parametrize("rings", [1, 10])
def test_the_layout_of_a_cone_keeps_its_apex(rings):
    body = cone(height=3.0, rings=rings)
    layout = quad_layout(body)
    assert (layout.vertices == body.vertices[0]).all(axis=1).any()
    assert layout.report.folded == 0
    assert layout.report.min_scaled_jacobian > 0.15  # of 4 x 4 in each quad: the one at the apex is the narrowest
    assert len(layout) < 300


def test_a_scratch_is_no_tip():
    # one vertex pushed out of a fine flat grid leans its own triangles only
    n = 21
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    points = np.stack([i.ravel(), j.ravel(), np.zeros(n * n)], axis=1) / (n - 1.0)
    a = (i[:-1, :-1] * n + j[:-1, :-1]).ravel()
    triangles = np.concatenate([np.stack([a, a + n, a + n + 1], 1), np.stack([a, a + n + 1, a + 1], 1)])
    points[n * n // 2, 2] = 0.05
    body = Triangulation(points, triangles)
    free = np.zeros(n * n, dtype=bool)
    assert find_tips(body, body.normals, free, 30.0, 0.0)[n * n // 2]
    assert not find_tips(body, body.normals, free, 30.0, 0.15)[n * n // 2]


def test_a_scratch_beside_an_edge_or_turned_round_is_no_tip():
    body = cone(height=3.0, rings=4)
    along = np.zeros(len(body.vertices), dtype=bool)
    assert find_tips(body, body.normals, along, 30.0)[0]
    along[1] = True  # a curve one ring below
    ring = float(np.linalg.norm(body.vertices[1] - body.vertices[0]))
    assert find_tips(body, body.normals, along, 30.0, reach=0.99 * ring)[0]
    assert not find_tips(body, body.normals, along, 30.0, reach=1.01 * ring)[0]
    blunt = cone(height=0.8, rings=4)  # its triangles lean 51 degrees, one that is turned round 129
    turned = blunt.normals.copy()
    assert find_tips(blunt, turned, np.zeros_like(along), 30.0)[0]
    turned[0] *= -1.0
    assert not find_tips(blunt, turned, np.zeros_like(along), 30.0)[0]
