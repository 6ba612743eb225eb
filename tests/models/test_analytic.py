import math

import numpy as np
import pytest

from patchwright.models import Cone, Cylinder, ParameterError, Plane, Sphere, Surface, Torus
from patchwright.models.differential import curvature, normals

RNG = np.random.default_rng(11)
C, A, X = RNG.normal(size=(3, 3))
A = A / np.linalg.norm(A)
TURN = 2 * math.pi


def implicit(s, p):
    """Signed distances, or for the cone the defect of its equation, computed without the surface's parameters."""
    if isinstance(s, Plane):
        return (p - s.origin) @ s.normal
    q = p - (s.center if isinstance(s, Sphere | Torus) else s.origin)
    along = q @ s.axis
    off = np.linalg.norm(q - along[..., None] * s.axis, axis=-1)
    if isinstance(s, Cylinder):
        return off - s.radius
    if isinstance(s, Cone):
        return off - np.abs(s.ref_radius + along * math.tan(s.half_angle))
    if isinstance(s, Sphere):
        return np.linalg.norm(q, axis=-1) - s.radius
    return np.hypot(off - s.major_radius, along) - s.minor_radius


SURFACES = [
    Plane(C, A, X, (0, 2), (-1, 1)),
    Cylinder(C, A, 2.0, X, None, (-1, 3)),
    Cylinder(C, A, 2.0, X, (0.3, 1.1), (-1, 3)),
    Cone(C, A, 0.4, 1.0, X, None, (-5, 3)),
    Cone(C, A, -0.4, 1.0, X, (-1, 4.0), (-5, 3)),
    Sphere(C, 2.0, A, X),
    Sphere(C, 2.0, A, X, (1, 2), (-0.3, 0.9)),
    Torus(C, A, 3.0, 1.0, X),
    Torus(C, A, 3.0, 1.0, X, (0.5, 0.5 + TURN), (-2, 1)),
]


@pytest.mark.parametrize("s", SURFACES, ids=lambda s: type(s).__name__)
def test_points_and_the_nurbs_form_fulfil_the_implicit_equation(s):
    (u0, u1), (v0, v1) = s.domain
    u, v = np.linspace(u0, u1, 41)[:, None], np.linspace(v0, v1, 37)
    n = s.to_nurbs()
    assert n.domain == s.domain
    assert np.abs(implicit(s, s(u, v))).max() < 2e-14
    assert np.abs(implicit(s, n(u, v))).max() < 2e-14
    ku, kv = n.breaks
    np.testing.assert_allclose(n(ku[:, None], kv), s(ku[:, None], kv), atol=3e-15 * 5)
    assert isinstance(s, Surface)


@pytest.mark.parametrize("s", SURFACES, ids=lambda s: type(s).__name__)
def test_derivatives_are_those_of_the_points(s):
    (u0, u1), (v0, v1) = s.domain
    u, v = RNG.uniform(u0 + 0.01, u1 - 0.01, 20), RNG.uniform(v0 + 0.01, v1 - 0.01, 20)
    h = 1e-5
    for a, b in [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (3, 1)]:
        du = (s(u + h, v, (a, b)) - s(u - h, v, (a, b))) / (2 * h)
        dv = (s(u, v + h, (a, b)) - s(u, v - h, (a, b))) / (2 * h)
        np.testing.assert_allclose(du, s(u, v, (a + 1, b)), atol=2e-9)
        np.testing.assert_allclose(dv, s(u, v, (a, b + 1)), atol=2e-9)


def test_normals_point_outwards():
    for s in (Cylinder(C, A, 2.0, None, None, (0, 1)), Torus(C, A, 3, 1), Sphere(C, 2)):
        p, n = s(0.3, 0.4), normals(s, 0.3, 0.4)
        assert implicit(s, (p + 1e-3 * n)[None])[0] == pytest.approx(1e-3)
    np.testing.assert_allclose(normals(Plane(C, A), 5.0, -7.0), A, atol=1e-15)


def test_curvatures_are_the_known_ones():
    t = Torus(C, A, 3.0, 1.0)
    u, v = np.linspace(0, TURN, 7)[:, None], np.linspace(0, TURN, 9)
    for s in (t, t.to_nurbs()):
        vs = v if s is t else t.to_nurbs().breaks[1]
        k = curvature(s, u, vs)
        np.testing.assert_allclose(k.gauss, np.broadcast_to(np.cos(vs) / (3 + np.cos(vs)), k.gauss.shape), atol=1e-12)
        np.testing.assert_allclose(
            k.mean, np.broadcast_to(-0.5 - 0.5 * np.cos(vs) / (3 + np.cos(vs)), k.mean.shape), atol=1e-12
        )
    c = curvature(Cylinder(C, A, 2.0, None, None, (0, 1)), 1.0, 0.5)
    assert c.maximum == pytest.approx(0, abs=1e-15)
    assert c.minimum == pytest.approx(-0.5)
    assert abs(c.maximum_direction @ A) == pytest.approx(1)
    s = Sphere(C, 4.0).to_nurbs()
    k = curvature(s, [0.0, 1.0, 2.0], [0.0, np.pi / 2, -np.pi / 2])
    np.testing.assert_allclose(k.gauss, 1 / 16, rtol=1e-5)
    np.testing.assert_allclose(k.mean, -1 / 4, rtol=1e-5)
    p = curvature(Plane(C, A), 0.0, 1.0)
    assert p.maximum == p.minimum == 0


def test_cone_apex_has_the_normal_of_each_line():
    cone = Cone((0, 0, 0), (0, 0, 1), math.pi / 6, v=(0, 1))
    u = np.linspace(0, TURN, 9)
    want = np.stack((np.cos(u) * math.cos(math.pi / 6), np.sin(u) * math.cos(math.pi / 6), np.full(9, -0.5)), axis=1)
    np.testing.assert_allclose(normals(cone, u, 0.0), want, atol=1e-12)
    np.testing.assert_allclose(normals(cone.to_nurbs(), cone.to_nurbs().breaks[0], 0.0), want[::2], atol=1e-12)


def test_poles_and_seams_are_exact():
    n = Sphere((0, 0, 0), 2.0).to_nurbs()
    assert (n.control_points[:, 0] == n.control_points[0, 0]).all()
    assert (n.control_points[:, -1] == [0, 0, 2]).all()
    for s in SURFACES:
        if s.domain[0][1] - s.domain[0][0] > 6.28:
            m = s.to_nurbs().control_points
            assert (m[0] == m[-1]).all()


def test_scale():
    for scale in (1e-3, 1e3):
        p = Torus(scale * C, A, 3 * scale, scale, X).to_nurbs()(*RNG.random((2, 50)))
        assert np.abs(implicit(Torus(C, A, 3.0, 1.0), p / scale)).max() < 2e-14


@pytest.mark.parametrize(
    "bad",
    [
        lambda: Plane(C, (0, 0, 0)),
        lambda: Plane(C, A, A),
        lambda: Plane((0, 0, np.nan), A),
        lambda: Cylinder(C, A, 0.0),
        lambda: Cylinder(C, A, 1.0, u=(0, 7)),
        lambda: Cylinder(C, A, 1.0, v=(1, 1)),
        lambda: Cone(C, A, 0.0),
        lambda: Cone(C, A, 1.6),
        lambda: Cone(C, A, 0.3, -1.0),
        lambda: Sphere(C, np.inf),
        lambda: Sphere(C, 1.0, v=(0, 2)),
        lambda: Torus(C, A, 1.0, -1.0),
        lambda: Plane(C, A).to_nurbs(),
        lambda: Cylinder(C, A, 1.0).to_nurbs(),
        lambda: Sphere(C, 1.0)(7.0, 0.0),
        lambda: Sphere(C, 1.0)(0.0, 0.0, (0, -1)),
    ],
)
def test_arguments_without_meaning_are_refused(bad):
    with pytest.raises(ParameterError):
        bad()


def test_the_default_xdir_is_square_and_deterministic():
    assert (Plane((0, 0, 0), (0, 0, 5)).xdir == [1, 0, 0]).all()
    for axis in RNG.normal(size=(50, 3)):
        c = Cylinder(C, axis, 1.0)
        assert abs(c.xdir @ c.axis) < 1e-15
        assert np.linalg.norm(c.xdir) == pytest.approx(1, abs=1e-15)
