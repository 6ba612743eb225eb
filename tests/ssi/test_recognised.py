"""NURBS forms of analytic surfaces meet as their sources do, in their own parameters."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from oracles_closed_forms import moved, rotation
from oracles_ssi import dome, flat

from patchwright.models import Cone, Cylinder, NurbsSurface, ParameterError, Plane, Sphere, Torus
from patchwright.models.surface import Surface
from patchwright.ssi import Intersection, intersect
from patchwright.ssi.closed_forms import closed_form
from patchwright.ssi.recognised import by_closed_form

ORIGIN, X, Y, Z = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
WALL = Plane(ORIGIN, (1.0, 2.0, 0.0), u=(-5, 5), v=(-5, 5))
SLOPE = Plane((0.1, 0.0, 0.2), (0.3, 0.5, 1.0), u=(-5, 5), v=(-5, 5))
TUBE = Cylinder(ORIGIN, Z, 1.0, v=(-3, 3))
TORUS = Torus(ORIGIN, Z, 2.0, 1.0)
PAIRS = {
    "plane across a cylinder": (SLOPE, TUBE),
    "plane through both poles": (WALL, Sphere(ORIGIN, 2.0)),
    "plane beside a pole": (Plane((1e-3, 0, 0), X, u=(-5, 5), v=(-5, 5)), Sphere(ORIGIN, 2.0)),
    "plane on a seam": (Plane(ORIGIN, Y, u=(-5, 5), v=(-5, 5)), TUBE),
    "plane and cone": (SLOPE, Cone(ORIGIN, Z, 0.5, 0.3, v=(-0.2, 3))),
    "plane through the apex": (WALL, Cone(ORIGIN, Z, 0.5, v=(0, 3))),
    "Villarceau": (TORUS, Plane(ORIGIN, (-0.5, 0.0, math.sqrt(0.75)), u=(-4, 4), v=(-4, 4))),
    "plane on a torus": (TORUS, Plane(Z, Z, u=(-4, 4), v=(-4, 4))),
    "equal cylinders": (TUBE, Cylinder(ORIGIN, X, 1.0, v=(-3, 3))),
    "arcs of a cylinder": (Cylinder(ORIGIN, Z, 1.0, u=(0.3, 2.0), v=(-1, 0.5)), SLOPE),
    "spheres": (Sphere(ORIGIN, 1.0), Sphere((0.7, 0.4, 1.1), 0.8, (1, 1, 0))),
    "sphere round a torus": (TORUS, Sphere((1, 1, math.sqrt(3)), math.sqrt(8.0))),
    "touching": (Sphere((2, 0.1, 0.3), 1.0), Cylinder((0, 0.1, 0), Z, 1.0, v=(-3, 3))),
    "apart": (TUBE, Sphere((9, 0, 0), 1.0)),
}


def disguised(surface: Surface) -> NurbsSurface:
    """The NURBS form with its two directions exchanged and more knots."""
    n = surface.to_nurbs()
    (u0, u1), _ = n.domain
    return n.insert_knots([u0 + 0.3 * (u1 - u0), u0 + 0.77 * (u1 - u0)]).transposed()


def size_of(*surfaces: Surface) -> float:
    return min(float(np.linalg.norm(np.ptp(s.to_nurbs().control_points.reshape(-1, 3), axis=0))) for s in surfaces)


def off(found: Intersection, pair: tuple[Surface, Surface]) -> float:
    """The largest distance of curves and contacts from the surfaces at their parameters, never outside the domain."""
    worst = 0.0
    curves = [*found.curves, *(c for o in found.overlaps for c in o.boundary)]
    for which, surface in enumerate(pair):
        low, high = np.array(surface.domain).T
        for c in curves:
            uv = (c.uv_a, c.uv_b)[which]
            assert uv is not None
            assert uv.domain == pytest.approx(c.curve.domain, abs=0.0)
            t = np.linspace(*uv.domain, 2003)
            w = uv(t)
            assert (np.maximum(low - w, w - high) <= 1e-12 * (high - low)).all()
            w = np.clip(w, low, high)
            worst = max(worst, float(np.linalg.norm(surface(w[:, 0], w[:, 1]) - c.curve(t), axis=1).max()))
        for p in found.points:
            at = (p.uv_a, p.uv_b)[which]
            assert at is not None
            worst = max(worst, float(np.linalg.norm(surface(*at) - p.point)))
    return worst


def same(found: Intersection | None, source: Intersection | None, size: float) -> None:
    assert found is not None
    assert source is not None
    assert found.complete
    assert sorted(c.kind for c in found.curves) == sorted(c.kind for c in source.curves)
    assert sorted(p.kind for p in found.points) == sorted(p.kind for p in source.points)
    assert found.length == pytest.approx(source.length, rel=1e-9, abs=1e-12 * size)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
@pytest.mark.parametrize("name", PAIRS)
def test_as_their_sources(name: str, scale: float) -> None:
    rng = np.random.default_rng(len(name))
    turn, shift = rotation(rng), scale * rng.normal(size=3)
    a, b = (moved(s, turn, shift, scale) for s in PAIRS[name])
    size = size_of(a, b)
    source = closed_form(a, b, 1e-10 * size)
    for pair in ((disguised(a), b.to_nurbs()), (b, disguised(a))):
        found = by_closed_form(*pair, 1e-10 * size)
        same(found, source, size)
        assert found is not None
        assert found.residual <= 1e-10 * size
        assert off(found, pair) <= max(2.0 * found.residual, 1e-13 * size)


def at_random(rng: np.random.Generator) -> Surface:
    """A piece of a surface about the origin, whole turns or parts of one."""

    def length() -> float:
        return float(np.round(rng.uniform(0.5, 2.0), 1))

    whole = rng.random() < 0.5
    u = (0.0, 2.0 * math.pi) if whole else tuple(np.sort(rng.uniform(0.0, 2.0 * math.pi, 2)).tolist())
    kind = rng.integers(5)
    if kind == 0:
        return Plane(ORIGIN, Z, u=(-length(), length()), v=(-length(), length()))
    if kind == 1:
        return Cylinder(ORIGIN, Z, length(), u=u, v=(-length(), length()))
    if kind == 2:
        return Cone(ORIGIN, Z, 0.4, length(), u=u, v=(0.0, length()))
    if kind == 3:
        return Sphere(ORIGIN, length(), u=u, v=(-0.5 * math.pi, 0.5 * math.pi) if whole else (-0.7, 0.9))
    minor = 0.5 * length()
    return Torus(ORIGIN, Z, 2.0 * minor + 0.6, minor, u=u, v=(0.0, 2.0 * math.pi) if whole else (-1.0, 1.5))


def test_random_pairs_in_special_and_general_positions() -> None:
    rng = np.random.default_rng(7)
    axes = [np.eye(3), np.roll(np.eye(3), 1, axis=0), np.roll(np.eye(3), -1, axis=0)]
    judged = 0
    for _ in range(40):
        turn = axes[rng.integers(3)] if rng.random() < 0.7 else rotation(rng)
        a, b = at_random(rng), moved(at_random(rng), turn, 0.5 * rng.integers(-2, 3, 3) * (rng.random(3) < 0.4))
        turn, shift = rotation(rng), rng.normal(size=3)
        a, b = moved(a, turn, shift), moved(b, turn, shift)
        size = size_of(a, b)
        source = closed_form(a, b, 1e-10 * size)
        pair = (disguised(a), b.to_nurbs() if rng.random() < 0.5 else b)
        found = by_closed_form(*pair, 1e-10 * size)
        if source is None:
            assert found is None
        elif found is not None:  # None: a strip too narrow to be recognised
            judged += 1
            same(found, source, size)
            assert off(found, pair) <= max(2.0 * found.residual, 1e-13 * size)
            assert found.residual <= 1e-10 * size
    assert judged >= 15


def test_parameters_jump_at_seams_only() -> None:
    """The ellipse on a cylinder crosses the seam once; in between its parameters are continuous."""
    tube = TUBE.to_nurbs()
    found = by_closed_form(SLOPE, tube, 1e-10)
    assert found is not None
    (curve,) = found.curves
    uv = curve.uv_b
    assert uv is not None
    times, counts = np.unique(uv.knots, return_counts=True)
    inner = slice(1, -1)
    jumps = times[inner][counts[inner] == uv.degree + 1]
    (low, high), _ = tube.domain
    beside = 1e-9 * (uv.domain[1] - uv.domain[0])
    for t in times[inner]:
        before, after = uv(t - beside), uv(t + beside)
        if t in jumps:
            assert sorted((before[0], after[0])) == pytest.approx([low, high], abs=1e-6)
        else:
            assert after == pytest.approx(before, abs=1e-7)
    assert len(jumps) + (uv(uv.domain[0])[0] in (low, high)) == 1


def test_a_rectangle_gets_exact_parameters() -> None:
    corners = np.array([[[-4, -4, 0], [-4, 4, 0]], [[4, -4, 2], [4, 4, 2]]], dtype=float)
    ramp = NurbsSurface((1, 1), ([0, 0, 1, 1], [2, 2, 5, 5]), corners)
    slope = Plane((0, 0, 1), (-0.25, 0, 1), u=(-9, 9), v=(-9, 9))
    found, source = by_closed_form(ramp, TUBE, 1e-10), closed_form(slope, TUBE, 1e-10)
    same(found, source, 4.0)
    assert found is not None
    for curve in found.curves:
        assert curve.uv_a is not None
        assert curve.uv_a.degree == curve.curve.degree
        assert curve.uv_a.control_points.shape[0] == curve.curve.control_points.shape[0]
        t = np.linspace(*curve.uv_a.domain, 1001)
        assert np.linalg.norm(ramp(*curve.uv_a(t).T) - curve.curve(t), axis=1).max() <= 1e-14
    assert off(found, (ramp, TUBE)) <= 1e-12  # the cylinder's own fit


def test_overlaps_keep_their_area() -> None:
    a, b = Cylinder(ORIGIN, Z, 1.0, v=(-2, 1)), Cylinder(ORIGIN, Z, 1.0, u=(1.0, 4.0), v=(-1, 2))
    for pair in itertools.product((a, disguised(a)), (b, disguised(b))):
        found = by_closed_form(*pair, 1e-10)
        assert found is not None
        assert sum(o.area for o in found.overlaps) == pytest.approx(6.0, rel=1e-12)
        assert off(found, pair) <= 1e-10


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6, 1e-8])
def test_however_near_a_pole(gap: float) -> None:
    """Longitude swings by half a turn within the gap."""
    ball = Sphere(ORIGIN, 2.0).to_nurbs()
    wall = Plane((gap, 0, 0), X, u=(-5, 5), v=(-5, 5))
    found = by_closed_form(ball, wall, 1e-10)
    assert found is not None
    assert found.length == pytest.approx(2.0 * math.pi * math.sqrt(4.0 - gap * gap), rel=1e-10)
    assert off(found, (ball, wall)) <= 1e-10


def test_the_tolerance_decides_what_is_recognised() -> None:
    """A bump of a tenth of the tolerance could turn touching into crossing: such a surface is left to subdivision."""
    ball = Sphere(ORIGIN, 1.0).to_nurbs()
    net = ball.control_points.copy()
    net[2, 2] *= 1.0 + 1e-7
    bumped = NurbsSurface(ball.degree, ball.knots, net, ball.weights)
    assert by_closed_form(bumped, SLOPE, 1e-6) is None
    assert by_closed_form(bumped, SLOPE, 1e-4) is None  # recognised, but 1e-7 off is more than the promised residual
    assert by_closed_form(ball, SLOPE, 1e-6) is not None


def test_what_is_left_to_subdivision() -> None:
    wide = np.array([[[-3, -3, 0], [-3, 3, 0]], [[3, -3, 0], [3, 2, 0]]], dtype=float)
    trapezium = NurbsSurface((1, 1), ([0, 0, 1, 1],) * 2, wide)
    assert by_closed_form(trapezium, TUBE, 1e-10) is None  # its ranges would reach beyond it
    assert by_closed_form(dome(0.1), flat(), 1e-10) is None
    assert by_closed_form(TUBE.to_nurbs(), Cylinder(ORIGIN, X, 0.5, v=(-3, 3)).to_nurbs(), 1e-10) is None  # degree four
    for pair in ((trapezium, TUBE), (TUBE.to_nurbs(), Cylinder(ORIGIN, X, 0.5, v=(-3, 3)))):
        found = intersect(*pair)  # and the front gets there all the same
        assert found.complete
        assert found.curves


def test_unbounded_partners_are_clipped() -> None:
    found = intersect(TUBE.to_nurbs(), Plane(ORIGIN, Z))
    assert found.length == pytest.approx(2.0 * math.pi, rel=1e-12)
    assert [c.curve.degree for c in found.curves] == [2]  # the exact circle


def test_a_tolerance_must_be_positive() -> None:
    with pytest.raises(ParameterError, match="tolerance"):
        by_closed_form(TUBE.to_nurbs(), SLOPE, 0.0)
