"""One surface with itself: curves with both parameter curves, touches, ends at pinch points, and proofs of nothing."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from patchwright.models import Cone, Cylinder, NurbsSurface, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.models.knots import greville, uniform_knots
from patchwright.ssi import intersect
from patchwright.ssi.intersection import Intersection
from patchwright.ssi.self_surface import intersect_itself

ORIGIN, Z = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def polynomial(f: Callable[[Array, Array], tuple[Array, Array, Array]], degree: tuple[int, int]) -> NurbsSurface:
    """The Bezier patch of a polynomial map of the unit square."""
    knots = tuple(uniform_knots(d, 1 + d) for d in degree)
    u, v = (greville(d, k) for d, k in zip(degree, knots, strict=True))
    x = np.stack([c + 0.0 * u[:, None] * v for c in f(u[:, None], v[None])], axis=-1)
    rows = [
        np.array([[math.comb(d, k) * t**k * (1.0 - t) ** (d - k) for k in range(d + 1)] for t in ts])
        for d, ts in zip(degree, (u, v), strict=True)
    ]
    inner = np.linalg.solve(rows[0], x.reshape(len(u), -1)).reshape(x.shape)
    return NurbsSurface(degree, knots, np.linalg.solve(rows[1], inner.swapaxes(0, 1).reshape(len(v), -1)).reshape(
        len(v), len(u), 3).swapaxes(0, 1))  # fmt: skip


def loop(u: Array, v: Array) -> tuple[Array, Array, Array]:
    """Crosses itself at s = 2 u - 1 = +-1/2 for every v: (0, v, 1/4)."""
    s = 2.0 * u - 1.0
    return s**3 - 0.25 * s, v, s * s


def umbrella(u: Array, v: Array) -> tuple[Array, Array, Array]:
    """S(s, v) = S(-s, v) where s^2 = v - 0.4: the line from (0, 0.4, 0), a pinch point, to (0, 1, 0.6)."""
    s = 2.0 * u - 1.0
    return s**3 - (v - 0.4) * s, v, s * s


def checked(found: Intersection, surface: NurbsSurface, size: float = 1.0) -> Intersection:
    """A proved result whose curves lie on the surface at both of their places, apart from each other."""
    assert found.complete, {u.reason for u in found.unresolved}
    for curve in found.curves:
        assert curve.residual <= 1e-10 * size
        t = np.linspace(*curve.curve.domain, 67)
        assert curve.uv_a is not None
        assert curve.uv_b is not None
        places = [np.clip(uv(t), *np.array(surface.domain).T) for uv in (curve.uv_a, curve.uv_b)]
        for w in places:
            assert np.linalg.norm(surface(*w.T) - curve.curve(t), axis=1).max() <= 2.0 * max(
                curve.residual, 1e-15 * size
            )
        assert np.linalg.norm(places[0] - places[1], axis=1)[1:-1].min() > 1e-3
    return found


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_looped_sheet_crosses_itself_in_a_line(scale: float) -> None:
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    plain = polynomial(loop, (3, 3))
    surface = NurbsSurface(
        plain.degree, plain.knots, scale * (plain.control_points @ turn.T + np.array([3.0, -2.0, 1.0]))
    )
    (curve,) = checked(intersect(surface), surface, scale).curves
    assert curve.kind == "transversal"
    assert curve.curve.length() == pytest.approx(scale, rel=1e-9)
    assert curve.uv_a is not None
    assert curve.uv_b is not None
    t = np.linspace(*curve.curve.domain, 33)
    ends = sorted(float(uv(t)[:, 0].mean()) for uv in (curve.uv_a, curve.uv_b))
    assert ends == pytest.approx([0.25, 0.75], abs=1e-9)


def test_knot_lines_do_not_matter() -> None:
    """Along one of them, u = 1/4, the curve runs."""
    surface = polynomial(loop, (3, 3)).insert_knots([0.25, 0.5], [0.3])
    (curve,) = checked(intersect(surface), surface).curves
    assert curve.curve.length() == pytest.approx(1.0, rel=1e-9)


def test_a_part_of_a_looped_sheet_overlaps_the_sheet_and_is_crossed_by_it() -> None:
    surface = polynomial(loop, (3, 3))
    found = intersect(surface, surface.restricted((0.1, 0.4), (0.2, 0.9)))
    assert found.complete
    assert len(found.overlaps) == 1
    (curve,) = found.curves
    assert curve.kind == "transversal"
    assert curve.curve.length() == pytest.approx(0.7, rel=1e-9)


@pytest.mark.parametrize("knots", [((), ()), ((0.31, 0.7), (0.2, 0.6))], ids=["one piece", "nine pieces"])
def test_a_curve_ends_at_a_pinch_point(knots: tuple[tuple[float, ...], tuple[float, ...]]) -> None:
    surface = polynomial(umbrella, (3, 1)).insert_knots(*knots)
    (curve,) = checked(intersect(surface), surface).curves
    assert curve.curve.length() == pytest.approx(0.6 * math.sqrt(2.0), rel=1e-9)
    assert curve.uv_a is not None
    assert curve.uv_b is not None
    apart = [float(np.linalg.norm(curve.uv_a(t) - curve.uv_b(t))) for t in curve.curve.domain]
    end = curve.curve(curve.curve.domain[int(np.argmin(apart))])
    assert min(apart) <= 1e-9
    assert end == pytest.approx([0.0, 0.4, 0.0], abs=1e-9)


def tube(height: float) -> NurbsSurface:
    """A tube of radius 0.12 along a figure of eight whose ends stand off; its axis passes itself at 2 height."""

    def axis(t: Array) -> Array:
        return np.stack([np.sin(2.0 * t), 1.5 * np.sin(t), height * np.cos(t)], axis=-1)

    t, v = np.linspace(-0.3, np.pi + 0.3, 24), np.linspace(0.0, 2.0 * np.pi, 33)
    d = np.stack([2.0 * np.cos(2.0 * t), 1.5 * np.cos(t), -height * np.sin(t)], axis=-1)
    d /= np.linalg.norm(d, axis=1)[:, None]
    e = np.cross(Z, d)
    e /= np.linalg.norm(e, axis=1)[:, None]
    ring = np.cos(v)[:, None] * e[:, None] + np.sin(v)[:, None] * np.cross(d, e)[:, None]
    along = make_interp_spline(t, axis(t)[:, None] + 0.12 * ring, 3)
    round_ = make_interp_spline(v, along.c.swapaxes(0, 1), 3, bc_type="periodic")
    return NurbsSurface((3, 3), (along.t, round_.t), round_.c.swapaxes(0, 1)).clamped()


def test_a_tube_that_passes_through_itself_and_one_that_does_not() -> None:
    """The axes cross at an angle 2 a with tan a = 1.5 / 2, off by h = 0.1: two cylinders of radius 0.12, nearly; the
    length of their curve tells that nothing is missing, all the rest is exact."""
    surface = tube(0.05)
    found = checked(intersect(surface), surface)
    assert all(c.kind == "transversal" for c in found.curves)
    assert found.length == pytest.approx(1.1375, rel=1e-3)
    apart = intersect(tube(0.15))
    assert apart.complete
    assert not apart.curves
    assert not apart.points


def test_two_arms_touch_in_a_point() -> None:
    """z = s ((s^2 - 1/4)^2 + (v - 0.4)^2) and x = 1 - s^2: the arms s > 0 and s < 0 meet at s = +-1/2, v = 0.4 only."""

    def arms(u: Array, v: Array) -> tuple[Array, Array, Array]:
        s = 2.0 * u - 1.0
        return 1.0 - s * s, v, s * ((s * s - 0.25) ** 2 + (v - 0.4) ** 2 + 0.0 * v)

    surface = polynomial(arms, (5, 2))
    found = intersect(surface)
    contacts = [p for p in found.points if np.linalg.norm(p.point - [0.75, 0.4, 0.0]) <= 1e-6]
    assert len(contacts) == 1
    assert contacts[0].kind == "touch"


@pytest.mark.parametrize(
    "surface",
    [Cylinder(ORIGIN, Z, 1.0, v=(0.0, 1.0)), Sphere(ORIGIN, 1.0), Torus(ORIGIN, Z, 2.0, 1.0)],
    ids=["cylinder", "sphere", "torus"],
)
def test_seams_and_poles_are_no_contacts(surface: Cylinder | Sphere | Torus) -> None:
    for form in (surface, surface.to_nurbs()):
        for found in (intersect(form), intersect_itself(form, 1e-10)):
            assert found.complete
            assert not found.curves
            assert not found.points


def test_tori_and_cones_meet_themselves_at_their_apexes() -> None:
    spindle = intersect(Torus(ORIGIN, Z, 1.0, 2.0))
    assert spindle.complete
    assert not spindle.curves
    heights = sorted(float(p.point[2]) for p in spindle.points)
    assert heights == pytest.approx([-math.sqrt(3.0), math.sqrt(3.0)], abs=1e-14)
    (horn,) = intersect(Torus(ORIGIN, Z, 1.0, 1.0)).points
    assert horn.point == pytest.approx(np.zeros(3), abs=1e-15)
    assert not intersect(Torus(ORIGIN, Z, 1.0, 2.0, v=(-2.0, 2.0))).points
    (apex,) = intersect(Cone((0.0, 0.0, 1.0), Z, 0.5, v=(-1.0, 1.0))).points
    assert apex.uv_a != apex.uv_b
    assert apex.point == pytest.approx([0.0, 0.0, 1.0], abs=1e-15)
    assert not intersect(Cone(ORIGIN, Z, 0.5, v=(0.0, 1.0))).points


def test_cusp_edges_are_handed_back() -> None:
    """The swallowtail (u, 4 v^3 + 2 u v, 3 v^4 + u v^2): a double curve v^2 = -u / 2 and cusps along u = -6 v^2, where
    no tangent plane is: those boxes are not claimed to be explained."""

    def swallowtail(u: Array, v: Array) -> tuple[Array, Array, Array]:
        a, b = 2.0 * u - 1.3, 2.0 * v - 1.1
        return a, 4.0 * b**3 + 2.0 * a * b, 3.0 * b**4 + a * b * b

    found = intersect(polynomial(swallowtail, (1, 4)))
    assert not found.complete
    points = np.concatenate([c.curve(np.linspace(*c.curve.domain, 101)) for c in found.curves])
    assert np.abs(points[:, 1]).max() <= 1e-7
    assert points[:, 2] == pytest.approx(0.25 * points[:, 0] ** 2, abs=1e-7)
    assert points[:, 0].min() <= -1.3 + 1e-9
    assert points[:, 0].max() >= -0.3
