"""Closed forms against known lengths and points, their invariances, and a brute-force search for what they miss."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles_closed_forms import missed, moved, rotation, sign_changes, signed, worst
from oracles_ssi_cases import load, smooth_curves, verdicts
from scipy.special import ellipe

from patchwright.models import Cone, Cylinder, NurbsSurface, ParameterError, Plane, Sphere, Torus
from patchwright.ssi.closed_forms import clip, closed_form

ORIGIN, X, Y, Z = np.zeros(3), np.eye(3)[0], np.eye(3)[1], np.eye(3)[2]
TORUS = Torus(ORIGIN, Z, 3.0, 1.0)
TUBE = Cylinder(ORIGIN, Z, 1.0, v=(-3.0, 3.0))
CONE = Cone(ORIGIN, Z, math.pi / 4.0, 0.0, v=(-2.0, 2.0))
STEINMETZ = 8.0 * math.sqrt(2.0) * float(ellipe(0.5))  # two ellipses with semi-axes 1 and sqrt 2

# name: surfaces, smooth curves, arcs, length, touching points, branch points, kind
FAMILIES = {
    "a01 equal crossing cylinders": (TUBE, Cylinder(ORIGIN, X, 1.0, v=(-3, 3)), 2, 4, STEINMETZ, 0, 2, "transversal"),
    "a05 sphere beside a cylinder": (Sphere((2, 0, 0), 1.0), TUBE, 0, 0, 0.0, 1, 0, None),
    "a06 sphere in a cylinder": (Sphere(ORIGIN, 1.0), TUBE, 1, 1, 2 * math.pi, 0, 0, "tangential"),
    "a07 Villarceau": (TORUS, Plane(ORIGIN, (-1 / 3, 0, math.sqrt(8) / 3)), 2, 4, 12 * math.pi, 0, 2, "transversal"),
    "a08 plane on top of a torus": (TORUS, Plane((0, 0, 1), Z), 1, 1, 6 * math.pi, 0, 0, "tangential"),
    "a12 apex on a pole": (
        Cone(ORIGIN, Z, math.atan(-1.5), 15.0, v=(0, 10)),
        Sphere(ORIGIN, 10.0),
        1,
        1,
        2 * math.pi * 120.0 / 13.0,  # rho = 1.5 (10 - z) meets rho^2 + z^2 = 100 at z = 50 / 13
        1,
        0,
        "transversal",
    ),
    "a13 plane along a ruling": (Plane(ORIGIN, (1, 0, 1)), CONE, 1, 1, 4 * math.sqrt(2), 0, 0, "tangential"),
    "a14 tangent cylinders": (TUBE, Cylinder((2, 0, 0), Z, 1.0, v=(-1, 5)), 1, 1, 4.0, 0, 0, "tangential"),
    "a16 spheres meeting in a circle of 1e-4": (
        Sphere(ORIGIN, 1.0),
        Sphere((2 * math.sqrt(1 - 1e-8), 0, 0), 1.0),
        1,
        1,
        2e-4 * math.pi,
        0,
        0,
        "transversal",
    ),
    "a17 circles 2.8e-4 apart": (TUBE, Sphere(ORIGIN, 1.0 + 1e-8), 2, 2, 4 * math.pi, 0, 0, "transversal"),
    "plane through the apex": (Plane(ORIGIN, X), CONE, 2, 4, 8 * math.sqrt(2), 0, 1, "transversal"),
    "sphere along two circles of the tube": (
        Torus(ORIGIN, Z, 2, 1),
        Sphere((1, 2, 0), math.sqrt(2)),
        2,
        2,
        4 * math.pi,
        0,
        0,
        "transversal",
    ),
    "sphere through Villarceau circles": (
        Torus(ORIGIN, Z, 2, 1),
        Sphere((1, 1, math.sqrt(3)), math.sqrt(8)),
        2,
        4,
        8 * math.pi,
        0,
        2,
        "transversal",
    ),
    "parallel cylinders": (TUBE, Cylinder(X, Z, 1.0, v=(-2, 9)), 2, 2, 10.0, 0, 0, "transversal"),
    "plane through both poles": (Plane(ORIGIN, (1, 2, 0)), Sphere(ORIGIN, 2.0), 1, 1, 4 * math.pi, 0, 0, "transversal"),
    "skew cylinders touching": (TUBE, Cylinder((0, 3, 0.5), X, 2.0, v=(-3, 3)), 0, 0, 0.0, 1, 0, None),
    "nothing": (TUBE, Sphere((9, 0, 0), 1.0), 0, 0, 0.0, 0, 0, None),
}


def counted(found, a, b):
    return (
        smooth_curves(found),
        len(found.curves),
        found.length,
        sum(p.kind == "touch" for p in found.points),
        sum(p.kind == "branch" for p in found.points),
    )


@pytest.mark.parametrize("name", FAMILIES)
def test_family(name):
    a, b, curves, arcs, length, touches, branches, kind = FAMILIES[name]
    for one, other in ((a, b), (b, a)):
        found = closed_form(one, other, 1e-10)
        assert found is not None
        assert found.complete
        got = counted(found, one, other)
        assert got[:2] + got[3:] == (curves, arcs, touches, branches)
        # a radius of 1e-4 comes from a depth of 1e-8, known to round-off of 1
        assert got[2] == pytest.approx(length, rel=2e-8 if "1e-4" in name else 1e-12)
        assert {c.kind for c in found.curves} <= {kind}
        assert worst(found, *clip(one, other)) <= 1e-12 * max(1.0, length / 4.0)
        assert found.residual <= 1e-12 * max(1.0, length / 4.0)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
@pytest.mark.parametrize("name", FAMILIES)
def test_rigid_motion_and_scale(name, scale):
    a, b, curves, arcs, length, touches, branches, _ = FAMILIES[name]
    a, b = clip(a, b)
    rng = np.random.default_rng(len(name))
    turn, shift = rotation(rng), scale * rng.normal(size=3)
    found = closed_form(moved(a, turn, shift, scale), moved(b, turn, shift, scale), 1e-10 * scale)
    assert found is not None
    got = counted(found, a, b)
    assert got[:2] + got[3:] == (curves, arcs, touches, branches)
    assert got[2] == pytest.approx(length * scale, rel=3e-7 if "1e-4" in name else 1e-11)


def test_overlap_of_bands():
    found = closed_form(TUBE, Cylinder(ORIGIN, -Z, 1.0, u=(1.0, 2.0), v=(-1.0, 5.0)), 1e-10)
    assert found is not None
    (overlap,) = found.overlaps
    assert overlap.area == pytest.approx(4.0, rel=1e-13)
    assert sum(c.curve.length() for c in overlap.boundary) == pytest.approx(2 * 1.0 + 2 * 4.0, rel=1e-12)
    assert {c.kind for c in overlap.boundary} == {"overlap-boundary"}
    assert max(c.residual for c in overlap.boundary) <= 1e-12


def test_overlap_of_squares_is_an_octagon():
    square = Plane(ORIGIN, Z, u=(-1, 1), v=(-1, 1))
    found = closed_form(square, Plane(ORIGIN, -Z, (1, 1, 0), (-1, 1), (-1, 1)), 1e-10)
    assert found is not None
    (overlap,) = found.overlaps
    assert len(overlap.boundary) == 8
    assert overlap.area == pytest.approx(8.0 * math.tan(math.pi / 8.0), rel=1e-13)
    shared = closed_form(square, Plane((2, 0, 0), Z, u=(-1, 1), v=(-1, 1)), 1e-10)
    assert shared is not None
    assert [c.kind for c in shared.curves] == ["tangential"]
    assert shared.length == pytest.approx(2.0)
    corner = closed_form(square, Plane((2, 2, 0), Z, u=(-1, 1), v=(-1, 1)), 1e-10)
    assert corner is not None
    assert [p.kind for p in corner.points] == ["touch"]


@pytest.mark.parametrize(
    ("surface", "area"),
    [
        (Torus(ORIGIN, Z, 3, 1), 12 * math.pi**2),
        (Sphere(ORIGIN, 2.0), 16 * math.pi),
        (Cone(ORIGIN, Z, math.pi / 4, v=(-1.0, 2.0)), 5.0 * math.sqrt(2.0) * math.pi),
    ],
)
def test_a_surface_on_itself(surface, area):
    found = closed_form(surface, surface, 1e-10)
    assert found is not None
    assert sum(o.area for o in found.overlaps) == pytest.approx(area, rel=1e-13)


@pytest.mark.parametrize("delta", [1e-4, 1e-6, 1e-8])
def test_nearly_special_positions_are_left_alone(delta):
    """Radii 1 and 1 - delta: two loops, not ellipses; above the tolerance the closed form must not answer."""
    other = Cylinder(ORIGIN, X, 1.0 - delta, v=(-3, 3))
    assert closed_form(TUBE, other, 1e-10) is None
    assert closed_form(TUBE, Cylinder((0, delta, 0), X, 1.0, v=(-3, 3)), 1e-10) is None
    assert closed_form(TUBE, Sphere((delta, 0, 0), 1.5), 1e-10) is None
    assert closed_form(TORUS, Plane((0, 0, delta), (-1 / 3, 0, math.sqrt(8) / 3)), 1e-10) is None


@pytest.mark.parametrize("depth", [1e-4, 1e-6, 1e-8])
def test_existence_is_decided_by_depth(depth):
    """Spheres overlapping by d meet in a circle of radius sqrt(d - d^2 / 4); apart by d they do not meet."""
    for sign, tolerance, curves, points in ((-1, 1e-10, 1, 0), (1, 1e-10, 0, 0), (-1, 1e-3, 0, 1), (1, 1e-3, 0, 1)):
        found = closed_form(Sphere(ORIGIN, 1.0), Sphere((0, 0, 2.0 + sign * depth), 1.0), tolerance)
        assert found is not None
        assert (len(found.curves), len(found.points)) == (curves, points)
        if curves:
            radius = math.sqrt(depth - 0.25 * depth * depth)
            assert found.length == pytest.approx(2 * math.pi * radius, rel=1e-15 / depth + 1e-12)


@pytest.mark.parametrize("lean", [0.3, 0.785398163397448, 1.2])
def test_conic_sections_of_a_cone(lean):
    """Ellipse, parabola and hyperbola: the curve satisfies both implicit equations, the ends lie on the rims."""
    plane = Plane((0.3, 0.1, 0.4), (math.sin(lean), 0.0, math.cos(lean)))
    cone = Cone(ORIGIN, Z, math.pi / 4.0, v=(-3.0, 5.0))
    found = closed_form(plane, cone, 1e-10)
    assert found is not None
    for c in found.curves:
        p = c.curve(np.linspace(*c.curve.domain, 999))
        assert np.abs(signed(plane, p)).max() <= 1e-12
        assert np.abs(signed(cone, p)).max() <= 1e-12
        if not c.closed:
            z = c.curve.control_points[[0, -1], 2]
            assert np.minimum(np.abs(z + 3.0), np.abs(z - 5.0)).max() <= 1e-12


@pytest.mark.parametrize("tilt", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12])
def test_slender_conics_are_right_or_declined(tilt):
    """Next to a parabola or a pair of rulings the conic's axes grow without bound and its digits are lost."""
    lean = math.pi / 4.0 + tilt
    section = Plane((0.3, 0.1, 0.4), (math.sin(lean), 0.0, math.cos(lean)))
    wall = Plane((0.3, 0.0, 0.0), (1.0, 0.0, tilt))
    for found in (closed_form(section, CONE, 1e-10), closed_form(wall, TUBE, 1e-10)):
        assert found is not None or 1e-10 <= tilt <= 1e-6
        assert found is None or found.residual <= 1e-10


def test_refusals():
    with pytest.raises(ParameterError, match="tolerance"):
        closed_form(TUBE, TUBE, 0.0)
    with pytest.raises(ParameterError, match="unbounded"):
        closed_form(Plane(ORIGIN, Z), Plane(ORIGIN, X), 1e-10)
    with pytest.raises(ParameterError, match="unbounded"):
        clip(Cylinder(ORIGIN, Z, 1.0), Cylinder(X, Z, 1.0))
    square = NurbsSurface(
        (1, 1), ([0, 0, 1, 1],) * 2, np.array([[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]], float)
    )
    assert closed_form(TUBE, square, 1e-10) is None


def test_unbounded_surfaces_are_clipped_to_each_other():
    found = closed_form(Cylinder(ORIGIN, Z, 1.0), Cylinder(ORIGIN, X, 1.0), 1e-10)
    assert found is not None
    assert found.length == pytest.approx(STEINMETZ, rel=1e-12)
    plane, sphere = clip(Plane((0, 0, 0.5), Z), Sphere((7, 0, 0), 1.0))
    assert np.isfinite(plane.domain).all()
    assert (closed_form(plane, sphere, 1e-10)).length == pytest.approx(math.sqrt(3.0) * math.pi, rel=1e-12)
    ellipse = closed_form(Plane(ORIGIN, (0, 1, 1)), Cylinder(ORIGIN, Z, 1.0), 1e-10)
    assert ellipse is not None
    assert ellipse.length == pytest.approx(0.5 * STEINMETZ, rel=1e-12)


# ----- random special positions --------------------------------------------------------------------------------------


def _range(rng, low, high):
    a, b = np.sort(rng.uniform(low, high, 2))
    return (float(a), float(b)) if b - a > 0.2 * (high - low) else (low, high)


def _turn(rng):
    return None if rng.random() < 0.4 else _range(rng, -1.0, 5.0)


def _direction(rng):
    d = rng.normal(size=3)
    return d / np.linalg.norm(d)


def _plane(rng):
    return Plane(0.4 * rng.normal(size=3), _direction(rng), None, _range(rng, -3, 3), _range(rng, -3, 3))


def _revolved(rng, point, axis):
    kind = rng.integers(4)
    at = point + rng.normal() * axis
    if kind == 0:
        return Cylinder(at, axis, rng.uniform(0.5, 1.5), None, _turn(rng), _range(rng, -3, 3))
    if kind == 1:
        return Cone(at, axis, rng.uniform(0.2, 1.2), rng.uniform(0, 1), None, _turn(rng), _range(rng, -3, 3))
    if kind == 2:
        return Sphere(at, rng.uniform(0.5, 2), _direction(rng), None, _turn(rng))
    return Torus(at, axis, rng.uniform(1.2, 2), rng.uniform(0.3, 1.1), None, _turn(rng), _turn(rng))


def _circumscribed(rng, center, radius):
    axis = _direction(rng)
    if rng.random() < 0.5:
        return Cylinder(center, axis, radius, None, _turn(rng), _range(rng, -3, 3))
    t = rng.uniform(0.1, 0.9)
    apex = center - radius / math.sin(t) * axis
    return Cone(apex, axis, t, 0.0, None, _turn(rng), _range(rng, -1, 8))


def special(rng):
    kind = rng.integers(6)
    if kind == 0:
        p, z = 0.3 * rng.normal(size=3), _direction(rng)
        other = _revolved(rng, p, z)
        return (_plane(rng), other) if not isinstance(other, Torus) else (_plane(rng), Sphere(p, 1.3, z))
    if kind == 1:
        p, z = rng.normal(size=3), _direction(rng)
        return _revolved(rng, p, z), _revolved(rng, p, z)
    if kind == 2:
        c = rng.normal(size=3)
        return _circumscribed(rng, c, 0.8), _circumscribed(rng, c, 0.8)
    if kind == 3:
        z, p = _direction(rng), rng.normal(size=3)
        a = Cylinder(p, z, rng.uniform(0.5, 1.5), None, _turn(rng), _range(rng, -3, 3))
        return a, Cylinder(p + rng.normal(size=3), z, rng.uniform(0.5, 1.5), None, _turn(rng), _range(rng, -3, 3))
    if kind == 4:
        z, p, t = _direction(rng), rng.normal(size=3), rng.uniform(0.2, 1.0)
        a = Cone(p, z, t, 0.0, None, _turn(rng), _range(rng, -3, 3))
        return a, Cone(p + rng.normal(size=3), -z, t, 0.0, None, _turn(rng), _range(rng, -3, 3))
    return Sphere(rng.normal(size=3), 1.5), Sphere(
        0.5 * rng.normal(size=3), rng.uniform(0.5, 2), _direction(rng), None, _turn(rng)
    )


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_random_special_positions(seed):
    rng = np.random.default_rng(seed)
    a, b = special(rng)
    found = closed_form(a, b, 1e-10)
    assert found is not None
    size = max(float(np.ptp(s.to_nurbs().control_points, axis=(0, 1)).max()) for s in (a, b))
    assert worst(found, a, b) <= 1e-12 * size
    points, spacing = sign_changes(a, b)
    if not found.overlaps:
        assert missed(found, points) <= 2.0 * spacing
    back = closed_form(b, a, 1e-10)
    assert back is not None
    assert back.length == pytest.approx(found.length, rel=1e-10, abs=1e-9)


def test_a_circle_touching_an_edge_of_the_range_is_one_point():
    """The tilted circle reaches latitude pi / 4 in one point from outside: both argument orders agree on it."""
    cap = Sphere(ORIGIN, 1.0, v=(math.pi / 4.0, math.pi / 2.0))
    tilt = 0.25 * math.pi - 0.3
    plane = Plane(ORIGIN, (-math.sin(0.25 * math.pi), 0.0, math.cos(0.25 * math.pi)))
    for one, other in ((cap, plane), (plane, cap)):
        found = closed_form(one, other, 1e-10)
        assert found is not None
        assert len(found.curves) == 0
        assert [p.kind for p in found.points] == ["touch"]
        assert np.linalg.norm(found.points[0].point - np.array([1.0, 0.0, 1.0]) / math.sqrt(2.0)) <= 1e-7
    above = closed_form(cap, Plane(ORIGIN, (-math.cos(tilt), 0.0, math.sin(tilt))), 1e-10)
    assert above is not None
    assert len(above.curves) == 1


def test_collected_cases():
    """Every analytic case of the collection with a closed form is right; the others are declined, none is wrong."""
    if not load():
        pytest.skip("ssi_cases.json is not there")
    rows = verdicts(closed_form)
    assert [v for v in rows if v.state == "wrong"] == []
    assert sum(v.state == "right" for v in rows) >= 61
