"""Surface-surface intersection against closed forms: every branch, its length, its kind, and a measured residual."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from oracles_ssi import contour, dome, flat, graph, wavy
from scipy.integrate import quad

from patchwright.models import Cone, Cylinder, NurbsSurface, Plane, Sphere, Torus
from patchwright.models.errors import ParameterError
from patchwright.models.surface import Surface
from patchwright.ssi.intersection import Intersection
from patchwright.ssi.surface_surface import intersect_surfaces

ELLIPSE = 7.640395578055424  # perimeter with semi-axes 1 and sqrt 2; also of Viviani's curve on the unit sphere


def size_of(surface: Surface) -> float:
    return float(np.linalg.norm(np.ptp(surface.to_nurbs().control_points.reshape(-1, 3), axis=0)))


def checked(a: Surface, b: Surface, tolerance: float = 1e-10, tangential: bool = False) -> Intersection:
    """The intersection, proved complete, its fitted curves within the promised residual of both surfaces."""
    found = intersect_surfaces(a, b, tolerance)
    assert found.complete, {u.reason for u in found.unresolved}
    size = min(size_of(a), size_of(b))
    assert found.residual <= (1e-7 if tangential else 1e-10) * size
    for curve in found.curves:
        assert curve.kind == ("tangential" if tangential else "transversal")
        t = np.linspace(*curve.curve.domain, 77)
        for uv, surface in ((curve.uv_a, a), (curve.uv_b, b)):
            assert uv is not None
            (u0, u1), (v0, v1) = surface.domain
            w = uv(t)
            on = surface(np.clip(w[:, 0], u0, u1), np.clip(w[:, 1], v0, v1))
            assert np.linalg.norm(on - curve.curve(t), axis=1).max() <= 2.0 * max(found.residual, 1e-14 * size)
    return found


@pytest.mark.parametrize("depth", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("at", [(0.5, 0.5), (0.37, 0.412)])
def test_no_loop_is_too_small(depth: float, at: tuple[float, float]) -> None:
    found = checked(dome(depth, at), flat(), tolerance=1e-3 * depth)
    (curve,) = found.curves
    radius = math.sqrt(depth / 4.5)
    assert curve.closed
    assert found.length == pytest.approx(2.0 * math.pi * radius, rel=1e-3 if depth < 1e-8 else 1e-6)
    far = np.linalg.norm(curve.points - [*at, 0.0], axis=1)
    assert far == pytest.approx(np.full(far.shape, radius), rel=1e-3)


@pytest.mark.parametrize("at", [(0.5, 0.5), (0.37, 0.412)])
def test_a_touch_is_a_point_and_a_gap_is_nothing(at: tuple[float, float]) -> None:
    found = checked(dome(0.0, at), flat())
    assert not found.curves
    (point,) = found.points
    assert point.kind == "touch"
    assert point.point == pytest.approx([*at, 0.0], abs=1e-9)
    nothing = checked(dome(-1e-8, at), flat())
    assert not nothing.curves
    assert not nothing.points


def test_a_saddle_is_split_at_its_branch_point() -> None:
    found = checked(graph(lambda x, y: (x - 0.5) ** 2 - (y - 0.5) ** 2), flat())
    assert len(found.curves) == 4
    assert found.length == pytest.approx(2.0 * math.sqrt(2.0), rel=1e-9)
    (point,) = found.points
    assert point.kind == "branch"
    assert point.point == pytest.approx([0.5, 0.5, 0.0], abs=1e-9)


@pytest.mark.parametrize("off", [1e-6, -1e-6])
def test_a_missed_saddle_is_two_hyperbola_branches(off: float) -> None:
    found = checked(graph(lambda x, y: (x - 0.5) ** 2 - (y - 0.5) ** 2 + off), flat())
    assert len(found.curves) == 2
    assert not found.points
    across = 1 if off > 0.0 else 0
    points = [c.curve(np.linspace(*c.curve.domain, 20001))[:, across] for c in found.curves]
    nearest = float(np.abs(np.concatenate(points) - 0.5).min())
    assert nearest == pytest.approx(1e-3, rel=1e-3)


def test_a_monkey_saddle_has_six_branches() -> None:
    found = intersect_surfaces(graph(lambda x, y: (x - 0.5) ** 3 - 3.0 * (x - 0.5) * (y - 0.5) ** 2), flat(), 1e-10)
    assert found.complete
    assert len(found.curves) == 6
    assert found.length == pytest.approx(1.0 + 4.0 / math.sqrt(3.0), rel=1e-6)
    assert [p.kind for p in found.points] == ["branch"]


def test_a_tangent_line_and_a_tangent_circle() -> None:
    line = checked(graph(lambda x, y: (x - 0.4) ** 2 * (1.0 + y)), flat(), tangential=True)
    assert len(line.curves) == 1
    assert line.length == pytest.approx(1.0, rel=1e-9)
    circle = graph(lambda x, y: ((x - 0.5) ** 2 + (y - 0.5) ** 2 - 0.09) ** 2, degree=(4, 4))
    ring = checked(circle, flat(), tangential=True)
    assert [c.closed for c in ring.curves] == [True]
    assert ring.length == pytest.approx(0.6 * math.pi, rel=1e-7)


@pytest.mark.parametrize("epsilon", [1e-2, 1e-4])
def test_a_small_crossing_angle(epsilon: float) -> None:
    base = lambda x, y: 0.3 * x * y + 0.2 * x**3  # noqa: E731
    a = graph(lambda x, y: base(x, y) + epsilon * ((x - 0.5) ** 2 + (y - 0.5) ** 2 - 0.09))
    (curve,) = checked(a, graph(base, spans=2)).curves
    assert curve.closed
    far = np.linalg.norm(curve.points[:, :2] - 0.5, axis=1)
    assert np.abs(far - 0.3).max() <= 1e-9


@pytest.mark.parametrize("k", [3, 5])
def test_many_loops(k: int) -> None:
    a, b = wavy(k)
    found = checked(a, b)
    count, length, _ = contour(a, b)
    assert len(found.curves) == count
    xy = sum(
        float(np.linalg.norm(np.diff(c.curve(np.linspace(*c.curve.domain, 4001))[:, :2], axis=0), axis=1).sum())
        for c in found.curves
    )
    assert xy == pytest.approx(length, rel=1e-4)


PAIRS = {
    "equal cylinders": (
        Cylinder((0, 0, 0), (0, 0, 1), 1.0, v=(-2, 2)), Cylinder((0, 0, 0), (1, 0, 0), 1.0, v=(-2, 2)),
        2.0 * ELLIPSE, 2, False,
    ),
    "Viviani": (Sphere((0, 0, 0), 1.0), Cylinder((0.5, 0, 0), (0, 0, 1), 0.5, v=(-2, 2)), ELLIPSE, 1, False),
    "sphere beside a cylinder": (
        Sphere((0, 0, 0), 1.0), Cylinder((2, 0, 0), (0, 0, 1), 1.0, v=(-2, 2)), 0.0, 1, False,
    ),
    "sphere inside a cylinder": (
        Sphere((0, 0, 0), 1.0), Cylinder((0, 0, 0), (0, 0, 1), 1.0, v=(-2, 2)), 2.0 * math.pi, 0, True,
    ),
    "Villarceau": (
        Torus((0, 0, 0), (0, 0, 1), 2.0, 1.0), Plane((0, 0, 0), (-0.5, 0, math.sqrt(0.75)), u=(-4, 4), v=(-4, 4)),
        8.0 * math.pi, 2, False,
    ),
    "plane on a torus": (
        Torus((0, 0, 0), (0, 0, 1), 2.0, 1.0), Plane((0, 0, 1), (0, 0, 1), u=(-4, 4), v=(-4, 4)),
        4.0 * math.pi, 0, True,
    ),
    "cone apex on a pole": (
        Cone((0, 0, 1), (0, 0, 1), 0.5, v=(-3, 0)), Sphere((0, 0, 0), 1.0), 2.0 * math.pi * math.sin(1.0), 1, False,
    ),
    "cylinders along a ruling": (
        Cylinder((0, 0, 0), (0, 0, 1), 1.0, v=(-2, 2)), Cylinder((2, 0, 0), (0, 0, 1), 1.0, v=(-1, 3)), 3.0, 0, True,
    ),
    "tiny circle": (
        Sphere((0, 0, 0), 1.0), Sphere((2.0 * math.sqrt(1.0 - 1e-8), 0, 0), 1.0), 2e-4 * math.pi, 0, False,
    ),
}  # fmt: skip


@pytest.mark.parametrize("as_nurbs", [False, True], ids=["analytic", "nurbs"])
@pytest.mark.parametrize("name", PAIRS)
def test_closed_forms(name: str, as_nurbs: bool) -> None:
    a, b, length, points, tangential = PAIRS[name]
    found = checked(a.to_nurbs(), b.to_nurbs(), tangential=tangential) if as_nurbs else checked(
        a, b, tangential=tangential
    )  # fmt: skip
    assert found.length == pytest.approx(length, rel=1e-6, abs=1e-12)
    assert len(found.points) == points


@pytest.mark.parametrize("delta", [1e-4, 1e-6, 1e-8])
def test_nearly_equal_cylinders_are_two_loops(delta: float) -> None:
    a, b = Cylinder((0, 0, 0), (0, 0, 1), 1.0, v=(-2, 2)), Cylinder((0, 0, 0), (1, 0, 0), 1.0 - delta, v=(-2, 2))
    found = checked(a, b, tolerance=1e-12)
    assert not found.points
    r = 1.0 - delta

    def speed(phi: float) -> float:  # of x = sqrt(1 - r^2 sin^2), y = r sin, z = r cos
        return math.hypot(r, r * r * math.sin(phi) * math.cos(phi) / math.sqrt(1.0 - (r * math.sin(phi)) ** 2))

    cuts = [0.5 * math.pi - t for t in (0.3, 0.1, 0.03, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5)]
    ends = [0.0, *cuts, 0.5 * math.pi]
    quarter = sum(quad(speed, p, q, epsabs=1e-13)[0] for p, q in itertools.pairwise(ends))
    assert found.length == pytest.approx(8.0 * quarter, rel=1e-7)


def moved(surface: NurbsSurface, scale: float, shift: float) -> NurbsSurface:
    """The surface turned about a skew axis, scaled and shifted."""
    axis = np.array([0.48, 0.6, 0.64])
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    R = np.eye(3) + math.sin(0.7) * K + (1.0 - math.cos(0.7)) * K @ K
    return NurbsSurface(surface.degree, surface.knots, scale * (surface.control_points @ R.T + shift), surface.weights)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("swap", [False, True])
def test_motion_scale_and_order_change_nothing(scale: float, swap: bool) -> None:
    cases = [
        (dome(1e-4, (0.37, 0.412)), flat(), 1, 0),
        (graph(lambda x, y: (x - 0.37) ** 2 - 1.3 * (y - 0.45) ** 2 + 0.2 * (x - 0.37) ** 3), flat(), 4, 1),
        (dome(0.0, (0.3, 0.7)), flat(), 0, 1),
        (*wavy(2), 2, 0),
    ]
    for a, b, curves, points in cases:
        plain = intersect_surfaces(a, b, 1e-9)
        pair = (moved(a, scale, 0.3), moved(b, scale, 0.3))
        found = intersect_surfaces(*(pair[::-1] if swap else pair), 1e-9 * scale)
        assert found.complete
        assert (len(found.curves), len(found.points)) == (curves, points)
        assert found.length == pytest.approx(scale * plain.length, rel=1e-7)
        assert found.residual <= 1e-10 * scale * 1.5


@pytest.mark.parametrize("seed", range(12))
def test_random_graphs_against_contours(seed: int) -> None:
    random = np.random.default_rng(seed)

    def rough(spans: int, height: float) -> NurbsSurface:
        s = flat() if spans == 1 else graph(lambda x, y: 0.0 * x, spans=spans)
        net = s.control_points.copy()
        net[..., 2] = height * random.standard_normal(net.shape[:2])
        return NurbsSurface(s.degree, s.knots, net)

    a, b = rough(int(random.integers(1, 6)), 0.3), rough(int(random.integers(1, 4)), 0.1)
    found = checked(a, b, tolerance=1e-9)
    points = [c.curve(np.linspace(*c.curve.domain, 1001))[:, :2] for c in found.curves]
    length = sum(float(np.linalg.norm(np.diff(x, axis=0), axis=1).sum()) for x in points)
    assert length == pytest.approx(contour(a, b, 801)[1], rel=2e-3, abs=2e-4)


@pytest.mark.parametrize("off", [2e-9, -3e-9, 1e-11])
def test_a_curve_past_a_corner_of_pieces_has_no_jump(off: float) -> None:
    a = graph(lambda x, y: y - x - off + 0.3 * (x - 0.5) ** 2, spans=2)
    found = intersect_surfaces(a, graph(lambda x, y: 0.0 * x, spans=2), 1e-10)
    (curve,) = found.curves
    t = np.linspace(*curve.curve.domain, 20001)
    x, y, z = curve.curve(t).T
    assert np.abs(y - x - off + 0.3 * (x - 0.5) ** 2).max() <= 1e-11
    assert curve.uv_a is not None
    assert curve.uv_b is not None
    assert np.abs(curve.uv_a(t) - np.stack((x, y), axis=1)).max() <= 1e-11
    assert np.abs(curve.uv_b(t) - np.stack((x, y), axis=1)).max() <= 1e-11
    assert np.abs(z).max() <= 1e-11


def test_apart_is_empty_and_proved() -> None:
    found = intersect_surfaces(flat(), flat(1e-6), 1e-9)
    assert found.complete
    assert not found.curves
    assert not found.points


def test_coincident_surfaces_are_an_overlap() -> None:
    s = graph(lambda x, y: 0.3 * x * y + 0.2 * x**3)
    found = intersect_surfaces(s, s.restricted((0.2, 0.7), (0.3, 0.6)), 1e-10)
    assert found.complete
    (region,) = found.overlaps
    assert len(region.boundary) == 4


def test_a_tolerance_must_be_positive() -> None:
    with pytest.raises(ParameterError, match="tolerance"):
        intersect_surfaces(flat(), flat(), 0.0)
