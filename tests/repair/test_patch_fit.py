"""Patches on stacked sheets and on true surfaces: which skin a hit counts on, and how near the fit comes."""

from __future__ import annotations

import numpy as np
import pytest
from quad_shapes import layout_from_quads

from patchwright.models import Assembly, Cylinder, Part, Tolerance, Triangulation
from patchwright.models.adjacency import Adjacency
from patchwright.models.tree import Tree
from patchwright.models.triangulation import concatenate
from patchwright.repair.ground.true_ground import TrueGround, TrueSurfaces
from patchwright.repair.patches.patch_fit import Target
from patchwright.repair.patches.resurface import resurface


def flat(height, n=24, hole=0.0):
    """The unit square in triangles facing up, without those nearer than `hole` to its middle."""
    x = np.linspace(0, 1, n + 1)
    points = np.stack([*np.meshgrid(x, x, indexing="ij"), np.full((n + 1, n + 1), height)], axis=-1).reshape(-1, 3)
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel()
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    middle = points[triangles].mean(axis=1)[:, :2]
    return Triangulation(points, triangles[np.linalg.norm(middle - 0.5, axis=1) >= hole]).compact()


def one_quad(corners):
    corners = np.asarray(corners, dtype=float)
    t = np.linspace(0, 1, 17)[:, None]
    return layout_from_quads(corners, np.array([[0, 1, 2, 3]]), lambda a, b: (1 - t) * corners[a] + t * corners[b])


@pytest.mark.parametrize("labelled", [False, True])
def test_a_hole_in_the_upper_of_two_sheets_is_seen_only_with_labels(labelled):
    body = concatenate([flat(0.0, hole=0.25), flat(-0.1)])
    region = np.asarray(Adjacency.of(body).components()) if labelled else None
    target = Target(Tree.of(body), np.zeros(len(body), dtype=bool), region)
    network = resurface(one_quad([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), target, Tolerance(1e-9, 1e-3))
    height = network.nets.sample(33)[..., 2]
    if labelled:
        assert np.abs(height).max() < 1e-9
        assert network.deviation.max() == pytest.approx(0.1)  # over the hole the nearest surface is the lower sheet
    else:
        assert height.min() < -0.05  # the dent a wrong skin makes


def tube_part(cells):
    surface = Cylinder((0, 0, 0), (0, 0, 1), 1.0, u=(0.0, np.pi / 2), v=(0.0, 1.0))
    u, v = np.meshgrid(np.linspace(0, np.pi / 2, cells + 1), [0.0, 1.0], indexing="ij")
    uv = np.stack([u.ravel(), v.ravel()], axis=1)
    k = np.arange(2 * (cells + 1)).reshape(-1, 2)
    a, b, c, d = k[:-1, 0], k[1:, 0], k[1:, 1], k[:-1, 1]
    corners = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Part("tube", Triangulation(surface(uv[:, 0], uv[:, 1]), corners, uv=uv[corners]), surface)


def test_the_fit_is_as_good_as_the_true_surface_however_coarse_the_triangles():
    model = Assembly((tube_part(5),))
    raw, true = model.triangulation, TrueSurfaces.of(model)
    tree, none = Tree.of(raw), np.zeros(len(raw), dtype=bool)
    ground = TrueGround.of(tree, np.arange(len(raw)), true)
    corners = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 1.0, 1.0], [1.0, 0, 1.0]])

    def arc(a, b):
        p, q = corners[a], corners[b]
        t = np.linspace(0, 1, 1025)[:, None]  # chords 3e-7 high
        line = (1 - t) * p + t * q
        line[:, :2] /= np.linalg.norm(line[:, :2], axis=1, keepdims=True)
        return line

    layout = layout_from_quads(corners, np.array([[0, 1, 2, 3]]), arc)
    away = []
    for where in (tree, ground):
        network = resurface(layout, Target(where, none), Tolerance(1e-9, 1e-6))
        points = network.nets.sample(41)
        away.append(np.abs(np.hypot(points[..., 0], points[..., 1]) - 1.0)[0])
    chords = 1.0 - np.cos(np.pi / 20)
    assert away[0].max() > 0.3 * chords
    # the ends of the rims follow the tangent planes guessed at their corners, and the rows beside them follow the rims
    assert np.median(away[1]) < 1e-6
    assert network.deviation[0] == pytest.approx(away[1].max(), rel=0.05)  # what is said is what is true
