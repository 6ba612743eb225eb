"""Rings of edges filled where neither one plane nor four corners are at hand: two planes, corners that are chosen."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from patchwright.models import NurbsCurve, Plane
from patchwright.models.interpolation import interpolate
from patchwright.models.topology import Topology
from patchwright.repair.cad.creased_ring import creased_ring
from patchwright.repair.cad.draft import Limits
from patchwright.repair.cad.four_sides import four_sided


def nothing_beside(edge, t):
    return None


def line(a, b):
    return NurbsCurve(1, np.array([0.0, 0.0, 1.0, 1.0]), np.array([a, b], dtype=float))


def ring_of(curves):
    """A topology of nothing but a ring of curves, each of which starts where the last ends."""
    corners = np.array([curve.control_points[0] for curve in curves])
    count = len(curves)
    ends = np.stack([np.arange(count), (np.arange(count) + 1) % count], axis=1)
    return Topology(corners, tuple(curves), ends, ()), tuple((k, False) for k in range(count))


def limits_of(topology):
    return Limits.of(float(np.linalg.norm(np.ptp(topology.vertices, axis=0))))


def polyline(*corners):
    return [line(a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]


def half_circle(radius=2.0):
    """From (r, 0, 0) round (0, r, 0) to (-r, 0, 0), exact."""
    w = np.sqrt(0.5)
    net = radius * np.array([[1, 0, 0], [1, 1, 0], [0, 1, 0], [-1, 1, 0], [-1, 0, 0]], dtype=float)
    knots = np.array([0, 0, 0, 0.5, 0.5, 1, 1, 1])
    return NurbsCurve(2, knots, net, np.array([1, w, 1, w, 1]))


def half_model():
    """Half a disc in z = 0 and a gable in y = 0, which meet along the x axis."""
    up = [(-2.0, 0.0, 0.0), (-2.0, 0.0, 1.0), (0.0, 0.0, 3.0), (2.0, 0.0, 1.0), (2.0, 0.0, 0.0)]
    return [half_circle(), *(line(a, b) for a, b in pairwise(up))]


def moved(curves, scale, seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q *= np.linalg.det(q)
    return [NurbsCurve(c.degree, c.knots, scale * (c.control_points @ q.T), c.weights) for c in curves], q


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("first", [0, 2, 4])
def test_two_planes_are_found_wherever_the_ring_begins(scale, first):
    curves, q = moved(half_model(), scale, first)
    topology, ring = ring_of([*curves[first:], *curves[:first]])
    made = creased_ring(topology, ring, nothing_beside, limits_of(topology))
    assert not isinstance(made, str), made
    assert len(made.patches) == 2
    found = []
    for patch in made.patches:
        assert isinstance(patch.surface, Plane)
        assert patch.residual <= 1e-13 * scale
        found.append(q.T @ patch.surface.normal)
    found.sort(key=lambda n: abs(n[2]))
    np.testing.assert_allclose(np.abs(found), [[0, 1, 0], [0, 0, 1]], atol=1e-9)
    # the ring runs counter-clockwise round (0, 1, 1): both planes face that way
    assert found[0][1] > 0.0
    assert found[1][2] > 0.0
    used = [use.edge for patch in made.patches for loop in patch.loops for use in loop]
    assert sorted(used) == sorted([*range(5), 5, 5])


def test_what_two_straight_edges_force_is_no_evidence():
    topology, ring = ring_of(polyline((0, 0, 0), (1, 0, 0.3), (1, 1, 0), (0, 1, 0.3)))
    assert isinstance(creased_ring(topology, ring, nothing_beside, limits_of(topology)), str)


def test_a_ring_off_its_planes_is_left():
    curves = half_model()
    curves[2] = interpolate(
        np.array([curves[2].control_points[0], [-1.3, 0.05, 1.7], [-0.6, 0.05, 2.4], curves[2].control_points[-1]])
    )
    topology, ring = ring_of(curves)
    assert isinstance(creased_ring(topology, ring, nothing_beside, limits_of(topology)), str)


def lens():
    """Two arcs that meet in corners, each bent out of every plane."""
    t = np.linspace(0.0, np.pi, 21)
    lower = np.stack([-np.cos(t), -0.6 * np.sin(t), 0.2 * np.sin(2 * t)], axis=1)
    upper = np.stack([np.cos(t), 0.6 * np.sin(t), 0.4 * np.sin(t) ** 2], axis=1)
    return [interpolate(points) for points in (lower, upper)]


def drop():
    """A closed curve with one corner."""
    t = np.linspace(0.0, 2.0 * np.pi, 41)
    return [interpolate(np.stack([np.cos(t), np.sin(t) * np.sin(t / 2), 0.1 * np.sin(t) ** 2], axis=1))]


def bent_ell():
    """The outline of an L on a cylinder: six corners, one of which opens by more than a straight angle."""
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], dtype=float)
    curves = []
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        flat = a + np.linspace(0.0, 1.0, 9)[:, None] * (b - a)
        curves.append(interpolate(np.column_stack([flat, np.cos(0.5 * flat[:, 0])])))
    return curves


@pytest.mark.parametrize("scale", [1e-3, 1e3])
@pytest.mark.parametrize("shape", [lens, drop, bent_ell])
def test_one_patch_holds_the_ring(shape, scale):
    curves, _ = moved(shape(), scale, 3)
    topology, ring = ring_of(curves)
    limits = limits_of(topology) if len(curves) > 1 else Limits.of(2.0 * scale)
    made = four_sided(topology, ring, lambda _: nothing_beside, limits)
    assert not isinstance(made, str), made
    (patch,) = made.patches
    assert patch.residual <= 1e-9 * limits.diagonal
    # every edge of the ring, whole or in parts, is used once
    assert len({use.edge for loop in patch.loops for use in loop}) == len([u for loop in patch.loops for u in loop])
    total = sum(_length(made.topology.curves[use.edge]) for loop in patch.loops for use in loop)
    assert total == pytest.approx(sum(_length(c) for c in curves), rel=1e-6)


def _length(curve):
    return float(curve.length())


def test_a_ring_of_four_corners_is_not_taken_apart():
    topology, ring = ring_of(polyline((0, 0, 0), (1, 0, 0.3), (1, 1, 0), (0, 1, 0.3)))
    assert isinstance(four_sided(topology, ring, lambda _: nothing_beside, limits_of(topology)), str)
