"""Newton onto a surface along segments and to feet: closed forms, rate, borders, seams, poles, invariance."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models import Cylinder, NurbsSurface, Plane, Sphere, Torus
from patchwright.repair.ground.true_surface import Bounds, Outcome, feet, on_segments


def segments_onto(surface, uv, reach, seed=0, tilt=0.3):
    """Segments whose lines meet the surface exactly at S(uv), tilted against its normal, t known."""
    rng = np.random.default_rng(seed)
    at = surface(uv[:, 0], uv[:, 1])
    normal = np.cross(surface(uv[:, 0], uv[:, 1], (1, 0)), surface(uv[:, 0], uv[:, 1], (0, 1)))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = normal + tilt * rng.standard_normal(normal.shape) / np.sqrt(3)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    t = rng.uniform(0.3, 0.7, len(uv))
    return at, t, at - t[:, None] * reach * along, at + (1 - t[:, None]) * reach * along


def wavy():
    rng = np.random.default_rng(5)
    x, y = np.meshgrid(np.linspace(0, 4, 7), np.linspace(0, 3, 6), indexing="ij")
    net = np.stack([x, y, 0.2 * rng.standard_normal(x.shape)], axis=2)
    U = np.concatenate([np.zeros(3), np.linspace(0, 1, 5), np.ones(3)])
    V = np.concatenate([np.zeros(3), np.linspace(0, 2, 4), np.full(3, 2.0)])
    return NurbsSurface((3, 3), (U, V), net, 1.0 + 0.3 * rng.random(x.shape))


SHAPES = {
    "sphere": Sphere((1, 2, 3), 2.0),
    "cylinder": Cylinder((1, 0, 0), (0, 1, 1), 1.5, v=(-2.0, 2.0)),
    "torus": Torus((0, 0, 0), (0, 0, 1), 3.0, 1.0),
    "rational bicubic": wavy(),
}


def inner(surface, count, margin=0.1, seed=1):
    (u0, u1), (v0, v1) = surface.domain
    share = np.random.default_rng(seed).uniform(margin, 1 - margin, (count, 2))
    return np.array([u0, v0]) + share * np.array([u1 - u0, v1 - v0])


@pytest.mark.parametrize("name", SHAPES)
def test_segments_meet_the_surface_where_they_were_made_to(name):
    surface = SHAPES[name]
    uv = inner(surface, 500)
    at, t, a, b = segments_onto(surface, uv, 0.5)
    (u0, u1), (v0, v1) = surface.domain
    start = uv + 0.02 * np.array([u1 - u0, v1 - v0]) * np.random.default_rng(2).uniform(-1, 1, uv.shape)
    found = on_segments(surface, start, t + 0.05, a, b, 1e-12)
    assert (found.status == Outcome.CONVERGED).all()
    assert np.abs(found.points - at).max() < 1e-11
    assert np.abs(found.t - t).max() < 1e-11
    assert np.allclose(found.points, (1 - found.t[:, None]) * a + found.t[:, None] * b, rtol=0, atol=2e-12)


def test_a_sphere_is_met_where_the_quadratic_equation_says():
    centre, radius = np.array([1.0, 2.0, 3.0]), 2.0
    uv = inner(SHAPES["sphere"], 400)
    _, t, a, b = segments_onto(SHAPES["sphere"], uv, 0.8)
    d, o = b - a, a - centre
    qa, qb, qc = (d * d).sum(1), 2 * (o * d).sum(1), (o * o).sum(1) - radius**2
    root = np.sqrt(qb * qb - 4 * qa * qc)
    both = np.stack([(-qb - root) / (2 * qa), (-qb + root) / (2 * qa)], axis=1)
    found = on_segments(SHAPES["sphere"], uv + 0.01, t, a, b, 1e-14)
    assert np.abs(found.t[:, None] - both).min(axis=1).max() < 1e-13


@pytest.mark.parametrize("name", SHAPES)
def test_feet_lie_square_below_their_points(name):
    surface = SHAPES[name]
    uv = inner(surface, 300)
    at, _t, _a, b = segments_onto(surface, uv, 0.02, tilt=0.0)
    found = feet(surface, uv + 1e-3, b, 1e-13)
    assert (found.status == Outcome.CONVERGED).all()
    assert np.abs(found.points - at).max() < 1e-11


def test_the_rate_is_quadratic():
    surface = SHAPES["torus"]
    uv = inner(surface, 200)
    at, t, a, b = segments_onto(surface, uv, 0.5)
    errors = []
    for size in (1e-1, 1e-2, 1e-3):
        start = uv + size * np.random.default_rng(3).uniform(-1, 1, uv.shape)
        one = on_segments(surface, start, t, a, b, 0.0, steps=1)
        errors.append(np.median(np.linalg.norm(one.points - at, axis=1)))
    assert errors[0] / errors[1] == pytest.approx(100, rel=0.3)
    assert errors[1] / errors[2] == pytest.approx(100, rel=0.3)


def test_the_seam_of_a_closed_surface_is_no_border():
    surface = SHAPES["cylinder"]
    uv = np.array([[0.01, 0.3], [2 * np.pi - 0.01, -0.4]])
    at, t, a, b = segments_onto(surface, uv, 0.5)
    start = np.array([[2 * np.pi - 0.05, 0.3], [0.05, -0.4]])
    found = on_segments(surface, start, t, a, b, 1e-12)
    assert (found.status == Outcome.CONVERGED).all()
    assert np.abs(found.points - at).max() < 1e-11
    assert Bounds.of(surface, uv).closed.tolist() == [True, False]


def test_a_line_past_the_border_leaves_the_domain_and_its_neighbours_do_not_care():
    surface = Plane((0, 0, 0), (0, 0, 1), u=(0.0, 1.0), v=(0.0, 1.0))
    x = np.array([0.5, 1.5, -0.2, 0.9])
    a, b = np.stack([x, 0 * x + 0.5, 0 * x + 1], axis=1), np.stack([x, 0 * x + 0.5, 0 * x - 1], axis=1)
    found = on_segments(surface, np.full((4, 2), 0.4), np.full(4, 0.2), a, b, 1e-12)
    left, fine = int(Outcome.LEFT_DOMAIN), int(Outcome.CONVERGED)
    assert found.status.tolist() == [fine, left, left, fine]
    assert np.allclose(found.t[[0, 3]], 0.5, rtol=0, atol=1e-12)
    low, high = np.array(surface.domain).T
    assert (found.uv >= low).all()
    assert (found.uv <= high).all()


def test_starts_at_a_pole_end_on_the_line_and_the_sphere_or_say_that_they_did_not():
    sphere = SHAPES["sphere"]
    angle = np.linspace(0, 2 * np.pi, 50)
    a = np.array([1.0, 2.0, 4.5]) + 0.2 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    b = a + np.array([0.0, 0.0, 1.0])
    start = np.stack([np.full(50, 1.0), np.full(50, np.pi / 2)], axis=1)
    found = on_segments(sphere, start, np.full(50, 0.5), a, b, 1e-12)
    met = found.status == Outcome.CONVERGED
    height = 3.0 + np.sqrt(4.0 - 0.04)
    assert np.abs(found.points[met, 2] - height).max(initial=0.0) < 1e-11
    assert set(found.status[~met].tolist()) <= {int(Outcome.STALLED), int(Outcome.LEFT_DOMAIN)}


def test_a_line_along_the_surface_stalls():
    plane = Plane((0, 0, 0), (0, 0, 1), u=(0.0, 1.0), v=(0.0, 1.0))
    a, b = np.array([[0.0, 0.5, 0.1]]), np.array([[1.0, 0.5, 0.1]])
    assert on_segments(plane, np.full((1, 2), 0.5), np.array([0.5]), a, b, 1e-12).status[0] == Outcome.STALLED


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scale_and_swapped_ends_change_nothing(scale):
    one, other = Sphere((0, 0, 0), 1.0), Sphere((0, 0, 0), scale)
    uv = inner(one, 100)
    _, t, a, b = segments_onto(one, uv, 0.4)
    here = on_segments(one, uv + 0.01, t, a, b, 1e-13)
    there = on_segments(other, uv + 0.01, 1 - t, scale * b, scale * a, 1e-13 * scale)
    assert np.allclose(there.points, scale * here.points, rtol=0, atol=1e-12 * scale)
    assert np.allclose(there.t, 1 - here.t, rtol=0, atol=1e-12)


def test_feet_beyond_a_border_are_the_nearest_places_on_it():
    surface = Cylinder((0, 0, 0), (0, 0, 1), 1.0, u=(0.0, np.pi / 2), v=(0.0, 1.0))
    u = np.linspace(0.1, 1.4, 9)
    points = np.stack([1.1 * np.cos(u), 1.1 * np.sin(u), np.full(9, 1.2)], axis=1)
    found = feet(surface, np.full((9, 2), 0.5), points, 1e-13)
    assert (found.status == Outcome.LEFT_DOMAIN).all()
    assert np.abs(found.points - np.stack([np.cos(u), np.sin(u), np.ones(9)], axis=1)).max() < 1e-11
    corner = feet(surface, np.full((1, 2), 0.5), np.array([[1.0, -0.3, -0.4]]), 1e-13)
    assert np.allclose(corner.points, [[1.0, 0.0, 0.0]], rtol=0, atol=1e-12)
