"""Triangles within a chord of the patches: watertight at any counts, as near as asked, few where nothing bends."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from quad_shapes import Marks, SphereTarget, sphere_layout

from patchwright.models.adjacency import Adjacency
from patchwright.models.tolerance import Tolerance
from patchwright.models.tree import Tree
from patchwright.repair.mesh_route import network_invented
from patchwright.repair.patches.network import PatchNetwork
from patchwright.repair.patches.patch_fit import Target
from patchwright.repair.patches.patch_nets import PatchNets
from patchwright.repair.patches.resurface import resurface
from patchwright.repair.patches.tessellation import _strip, intervals_within, tessellation_within


@cache
def dented_ball() -> PatchNetwork:
    """A ball of 24 patches, the inner control points of one pushed in: it asks for more triangles than the others."""
    target = SphereTarget(1.0, 0.2)
    network = resurface(sphere_layout(2, 1.0), Target(target, Marks(target)), Tolerance(1e-9, 1e-4))
    m, n = network.nets.cells[5] + 3
    controls = network.nets.controls.copy()
    inner = controls[network.nets.offsets[5] : network.nets.offsets[6]].reshape(m, n, 3)[1:-1, 1:-1]
    inner *= 0.6
    return replace(network, nets=PatchNets(network.nets.cells, network.nets.offsets, controls))


def fine_points(network: PatchNetwork) -> np.ndarray:
    return network.points(64).reshape(-1, 3)


@pytest.mark.parametrize("chord", [1e-1, 1e-2, 1e-3, 1e-4])
def test_closed_and_as_near_as_asked(chord):
    network = dented_ball()
    body = tessellation_within(network, chord)
    adjacency = Adjacency.of(body)
    assert not adjacency.free.any()
    assert len(adjacency.edges) == 3 * len(body) // 2
    assert len(body.vertices) - len(adjacency.edges) + len(body) == 2  # one sphere
    assert body.areas.min() > 0.0
    assert Tree.of(body).closest(fine_points(network)).distance.max() <= 1.1 * chord


def test_a_hundredth_of_the_chord_takes_a_hundred_times_the_triangles():
    counts = [len(tessellation_within(dented_ball(), c)) for c in (1e-2, 1e-4)]
    assert 50 <= counts[1] / counts[0] <= 200


def test_only_the_patch_that_bends_is_cut_fine():
    own = intervals_within(dented_ball(), 1e-3).prod(axis=1)
    assert own.argmax() == 5
    assert own[5] >= 4 * np.median(own)


def test_vertices_lie_at_their_parameters():
    network = dented_ball()
    body = tessellation_within(network, 1e-2)
    surfaces = network.surfaces()
    for patch in (0, 5, 17):
        mine = body.tags == patch
        uv = body.uv[mine].reshape(-1, 2)
        assert np.abs(surfaces[patch](uv[:, 0], uv[:, 1]) - body.corners[mine].reshape(-1, 3)).max() < 1e-12


def test_invented_cells_are_found_by_parameters():
    network = dented_ball()
    share = [
        t.areas[network_invented(network, t)].sum()
        for t in (tessellation_within(network, 1e-4), network.tessellate(32))
    ]
    assert share[0] > 0.0
    assert share[0] == pytest.approx(share[1], rel=0.05)


def test_a_limit_on_triangles_is_kept():
    assert len(tessellation_within(dented_ball(), 1e-6, most=20_000)) <= 22_000


@pytest.mark.parametrize(("outer", "inner"), [(2, 1), (8, 1), (4, 3), (16, 3), (3, 4)])
def test_a_strip_uses_every_step_once_and_turns_one_way(outer, inner):
    place = np.concatenate([
        np.stack([np.arange(outer + 1) / outer, np.zeros(outer + 1)], axis=1),
        np.stack([np.arange(1, inner + 1) / (inner + 1), np.ones(inner)], axis=1),
    ])  # fmt: skip
    a, b, c = (place[_strip(outer, inner)[:, k]] for k in range(3))
    turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (turn > 0).all()
    assert 0.5 * turn.sum() == pytest.approx(0.5 * (1 + (inner - 1) / (inner + 1)))
