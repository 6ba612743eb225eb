"""The patch chain on the exact sphere: convergence, exact joins, smooth joins, gaps, invariance."""

from __future__ import annotations

import numpy as np
import pytest
from quad_shapes import Marks, SphereTarget, sphere_layout

from patchwright.models.tolerance import Tolerance
from patchwright.repair.layout.blocks import single_blocks
from patchwright.repair.patches.block_faces import block_faces
from patchwright.repair.patches.network_seams import measure
from patchwright.repair.patches.patch_fit import Target
from patchwright.repair.patches.resurface import resurface


def network_of(n, fit, radius=1.0, slit=0.0):
    target = SphereTarget(radius, slit)
    return resurface(sphere_layout(n, radius), Target(target, Marks(target)), Tolerance(1e-9, fit))


def true_error(network, radius=1.0):
    return np.abs(np.linalg.norm(network.nets.sample(41), axis=-1) - radius).max()


@pytest.mark.parametrize("fit", [1e-2, 1e-3, 1e-4, 1e-5])
def test_the_tolerance_is_met_and_the_stated_deviation_is_true(fit):
    network = network_of(1, fit)
    assert true_error(network) <= 1.5 * fit
    assert network.deviation.max() == pytest.approx(true_error(network), rel=0.3, abs=1e-9)


def test_a_hundred_times_finer_costs_ten_times_the_control_points_at_most():
    coarse, fine = network_of(2, 1e-4), network_of(2, 1e-6)
    assert true_error(fine) <= 1.5e-6
    assert len(fine.nets.controls) <= 10 * len(coarse.nets.controls)  # fourth order in each of two directions


@pytest.mark.parametrize("n", [1, 2, 4])
def test_neighbours_meet_exactly_and_smoothly_without_refinement(n):
    seams = measure(network_of(n, 1.0))
    assert max(s.gap for s in seams) < 1e-14
    assert {s.kind for s in seams} == {"smooth"}
    assert max(s.angle for s in seams) <= 0.1


@pytest.mark.parametrize("fit", [1e-2, 1e-4])
def test_seams_turn_by_half_a_degree_at_most_at_irregular_vertices_too(fit):
    network = network_of(2, fit)
    assert max(s.angle for s in measure(network)) <= 0.5
    assert true_error(network) <= 2.0 * fit


def test_joins_stay_exact_where_neighbours_have_different_pieces():
    network = network_of(1, 1e-5, slit=0.2)
    assert max(s.gap for s in measure(network)) < 1e-13


def test_the_tessellation_is_closed_and_encloses_the_ball():
    body = network_of(2, 1e-4).tessellate(8)
    edges = np.sort(np.stack([body.triangles, np.roll(body.triangles, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert body.volume == pytest.approx(4 / 3 * np.pi, rel=5e-3)
    assert (np.einsum("ij,ij->i", body.normals, body.corners.mean(axis=1)) > 0).all()


def test_a_slit_is_filled_smoothly_and_marked_as_invented():
    network = network_of(2, 1e-3, slit=0.2)  # twice the cells the marks can tell apart
    assert true_error(network) < 2e-3
    z = network.nets.sample(17)[:, 1::2, 1::2, 2]  # the middles of the 8 x 8 cells
    assert network.invented[np.abs(z - 0.3) < 0.1].all()
    assert not network.invented[np.abs(z - 0.3) > 0.3].any()


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scale_changes_nothing_but_the_scale(scale):
    one, other = network_of(2, 1e-4), network_of(2, 1e-4 * scale, radius=scale)
    # the joins are one ill-conditioned least-squares problem: a hundredth of the tolerance is what round-off leaves
    assert np.allclose(other.nets.controls, scale * one.nets.controls, rtol=0, atol=1e-6 * scale)


def test_the_grid_agrees_node_for_node_and_the_surfaces_with_the_nets():
    network = network_of(2, 1e-3)
    nodes = network.points(8)
    distinct = len(np.unique(nodes.reshape(-1, 3), axis=0))
    m, e, v = len(network), len(network.layout.edges), len(network.layout.vertices)
    assert distinct == v + 7 * e + 49 * m
    t = np.linspace(0, 1, 9)
    for surface, own in zip(network.surfaces(), nodes, strict=True):
        assert np.allclose(surface.grid(t, t), own, atol=1e-14)


def test_the_topology_runs_every_pcurve_with_its_edge():
    network = network_of(1, 1e-3)
    made = block_faces(network, single_blocks(network.layout))
    topology, surfaces = made.topology, made.surfaces
    assert all(
        np.array_equal(a.control_points, b.control_points) for a, b in zip(surfaces, network.surfaces(), strict=True)
    )
    assert (topology.use_counts() == 2).all()
    t = np.linspace(0, 1, 7)
    for surface, ((loop),) in zip(surfaces, topology.loops, strict=True):
        for use in loop:
            uv = use.pcurve(t)
            assert np.allclose(surface(uv[:, 0], uv[:, 1]), topology.curves[use.edge](t), atol=1e-14)
