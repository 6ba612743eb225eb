"""Ridge lines of shapes whose crest is known in closed form."""

import numpy as np
import pytest

from patchwright.models import Triangulation
from patchwright.repair.layout.features import find_features
from patchwright.repair.layout.quad_layout import quad_layout
from patchwright.repair.layout.ridges import find_ridges, flanks
from patchwright.repair.layout.sizing import surface_curvature

RADIUS, DEPTH, SPAN = 0.02, 1.0, 4.0


def sheet(x, y, z):
    """Triangles over a grid of points."""
    n, m = x.shape
    number = np.arange(n * m).reshape(n, m)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return Triangulation(np.stack([x, y, z], axis=-1).reshape(-1, 3), triangles)


def nose(radius=RADIUS, stations=41):
    """The parabolic cylinder z^2 = 2 r x, spanned along y; its crest is x = z = 0."""
    half = np.sqrt(2.0 * radius * DEPTH)
    z = half * np.sinh(np.linspace(-4.0, 4.0, 121)) / np.sinh(4.0)
    z, y = np.meshgrid(z, np.linspace(0.0, SPAN, stations), indexing="ij")
    return sheet(z**2 / (2.0 * radius), y, z)


def ridges_of(body, widest):
    features = find_features(body)
    curvature = surface_curvature(features)
    return features, curvature, find_ridges(features, curvature, widest)


def turned(points):
    a, b = 0.7, 1.1
    one = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    two = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    return points @ (one @ two).T + np.array([3.0, -2.0, 5.0])


def test_crest_of_a_parabolic_cylinder():
    features, _, ridges = ridges_of(nose(), 0.05)
    points = features.body.vertices
    line = points[ridges.edges]
    assert np.abs(line[..., 2]).max() < RADIUS / 4
    length = np.linalg.norm(line[:, 1] - line[:, 0], axis=1).sum()
    assert length == pytest.approx(SPAN, rel=0.01)
    found = ridges.radius[np.isfinite(ridges.radius)]
    assert np.median(found) == pytest.approx(RADIUS, rel=0.3)  # the bend is averaged over a neighbourhood


def test_a_ridge_ends_on_the_boundary():
    features, _, ridges = ridges_of(nose(), 0.05)
    count = np.bincount(ridges.edges.reshape(-1), minlength=len(features.body.vertices))
    ends = features.body.vertices[count == 1]
    assert sorted(ends[:, 1].tolist()) == pytest.approx([0.0, SPAN])


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_ridges_do_not_depend_on_size_and_place(scale):
    body = nose()
    moved = Triangulation(turned(body.vertices) * scale, body.triangles)
    edges = ridges_of(body, 0.05)[2].edges
    assert np.array_equal(ridges_of(moved, 0.05 * scale)[2].edges, edges)


def test_gentle_bends_are_no_ridges():
    assert not len(ridges_of(nose(), RADIUS / 2)[2].edges)


def test_a_small_ball_has_no_ridge():
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.04)
    _, _, ridges = ridges_of(Triangulation(np.array(ball.vertices), np.array(ball.faces)), 0.05)
    assert not len(ridges.edges)


def test_flanks_lie_beside_the_crest_only():
    features, curvature, ridges = ridges_of(nose(), 0.05)
    flank = flanks(features, ridges, curvature, 12.0)
    x = features.body.vertices[:, 0]
    assert flank[x < RADIUS / 10].mean() > 0.95
    assert not flank[x > 0.5].any()


def test_quad_edges_follow_the_crest():
    layout = quad_layout(nose())
    a, b = layout.vertices[layout.edges[:, 0]], layout.vertices[layout.edges[:, 1]]
    on = (np.abs(a[:, 2]) < RADIUS / 4) & (np.abs(b[:, 2]) < RADIUS / 4)
    assert np.abs(a - b)[on, 1].sum() == pytest.approx(SPAN, rel=0.02)
    assert layout.report.folded == 0
