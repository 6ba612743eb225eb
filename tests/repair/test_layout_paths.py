"""Paths of edges: round a bend the chord's feet leap across, and off features."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from patchwright.models.triangulation import Triangulation
from patchwright.repair.layout import _surface_walk_kernel as walker
from patchwright.repair.layout.features import find_features
from patchwright.repair.layout.layout_paths import PATH_POINTS, _go_round, on_curves
from patchwright.repair.layout.remesh import _start, ground_of

AROUND, UP = 48, 24


def tube(scale=1.0, flat=1.0):
    """An open tube of radius 1, height 2, flattened along y."""
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    z = np.linspace(0.0, 2.0, UP + 1)
    x = np.stack(np.broadcast_arrays(np.cos(angle), flat * np.sin(angle), z[:, None]), axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(UP), np.arange(AROUND), indexing="ij")
    a, b = (i * AROUND + j).ravel(), (i * AROUND + (j + 1) % AROUND).ravel()
    c, d = b + AROUND, a + AROUND
    body = Triangulation(scale * x, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))
    return find_features(body)


def led_round(features, first, second):
    """The nine points from one vertex to another, after the feet of their chord were put on the tube."""
    ground = ground_of(features, np.ones(len(features.body.vertices)))
    mesh = _start(features, ground)
    x = features.body.vertices
    share = np.linspace(0.0, 1.0, PATH_POINTS)[:, None]
    chord = (1 - share) * x[first] + share * x[second]
    inner, at = np.empty((PATH_POINTS - 2, 3)), np.empty(PATH_POINTS - 2, dtype=np.int64)
    starts = np.full(PATH_POINTS - 2, mesh.vt[first])
    walker.walk_many(chord[1:-1].copy(), starts, ground.v, ground.t, ground.nb, ground.block, inner, at)
    feet = inner[None].copy()
    ends = np.array([[first, second]])
    own = SimpleNamespace(mesh=mesh, ground=ground)
    region = features.region[mesh.vt[[first]]]
    _go_round(own, features, ends, region, mesh.N[[first]], feet)
    line = np.concatenate([x[[first]], feet[0], x[[second]]])
    return line, not np.array_equal(feet[0], inner)


def vertex(features, turn, height):
    """The vertex of the tube `turn` steps round and `height` steps up."""
    body = features.body.vertices
    angle = 2 * np.pi * turn / AROUND
    wanted = body[:, 2].max() / UP * height
    scale = body[:, 2].max() / 2.0
    flat = body[:, 1].max() / scale
    target = scale * np.array([np.cos(angle), flat * np.sin(angle), wanted / scale])
    return int(np.linalg.norm(body - target, axis=1).argmin())


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_path_goes_round_the_bend_in_even_steps_and_no_longer_than_needed(scale):
    features = tube(scale)
    line, changed = led_round(features, vertex(features, 1, 10), vertex(features, 22, 10))
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    assert changed
    assert steps.max() < 1.15 * steps.mean()
    assert steps.sum() == pytest.approx(scale * 2 * np.pi * 21 / AROUND, rel=0.01)


def test_the_rim_of_a_flat_tube_is_gone_round_and_not_leapt_over():
    features = tube(flat=0.3)
    first, second = vertex(features, 4, 12), vertex(features, 44, 12)
    line, changed = led_round(features, first, second)
    assert changed
    assert line[:, 0].max() > 0.99  # round the rim at x = 1; the chord is at x = 0.87
    assert np.linalg.norm(np.diff(line, axis=0), axis=1).max() < 0.07


def test_a_path_without_leaps_stays_as_it_is():
    features = tube()
    _, changed = led_round(features, vertex(features, 3, 6), vertex(features, 9, 10))
    assert not changed


def test_points_on_blocked_sides_are_told_from_all_others():
    features = tube()
    ground = ground_of(features, np.ones(len(features.body.vertices)))
    t, k = np.argwhere(features.side_curve >= 0)[5]
    corner = features.body.corners[t]
    on_side = 0.3 * corner[k] + 0.7 * corner[(k + 1) % 3]
    inside = corner.mean(axis=0)
    free = 0.3 * corner[(k + 1) % 3] + 0.7 * corner[(k + 2) % 3]
    points = np.stack([on_side, inside, free, on_side])
    assert on_curves(ground, points, np.array([t, t, t, -1])).tolist() == [True, False, False, False]
