import numpy as np
import pytest

from patchwright.models import NurbsCurve, NurbsSurface, ParameterError, Sphere
from patchwright.models.analytic.arc import circle
from patchwright.models.arc_length import ArcLength
from patchwright.models.knots import bezier_knots, uniform_knots
from patchwright.reparam import curve_parameters, distribution, surface_parameters

RNG = np.random.default_rng(11)
WANTED = distribution("tanh-both", 41, first=1e-5, last=1e-2)


def wavy(clustered=3.0):
    """A curved surface whose parameters crowd together, and not alike everywhere."""
    a = np.linspace(0, 1, 7)
    x, y = np.meshgrid(a**clustered, np.sqrt(a), indexing="ij")
    net = np.stack((x + 0.2 * y * y, y + 0.3 * x, 0.3 * np.sin(4 * x) * np.cos(3 * y)), axis=2)
    U = uniform_knots(3, 7)
    return NurbsSurface((3, 3), (U, U), net, RNG.uniform(0.5, 2.0, (7, 7)))


def reached(surface, u, v):
    """Shares of arc length along both iso-curves of every point, by the arc length of the curves themselves."""
    out = np.empty((2, *u.shape))
    for i, j in np.ndindex(*u.shape):
        for axis, (name, fixed, t) in enumerate((("u", v, u), ("v", u, v))):
            curve = surface.iso_curve(name, fixed[i, j])
            out[axis, i, j] = ArcLength.of(curve)(t[i, j]) / curve.length()
    return out


def test_a_circle_gets_equal_angles():
    c = circle((0, 0, 0), (0, 0, 1), 2.0)
    p = c(curve_parameters(c, distribution("uniform", 13)))
    angles = np.unwrap(np.arctan2(p[:, 1], p[:, 0]))
    np.testing.assert_allclose(angles - angles[0], np.linspace(0, 2 * np.pi, 13), atol=1e-12)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_curve_with_a_kink_and_a_cusp_gets_its_shares(scale):
    points = np.array([[0, 0], [1, 0], [1, 0], [1, 0], [2, 1], [0, 1], [2, 1.5], [0, 0.5], [3, 3.0]]) * scale
    curve = NurbsCurve(3, [0, 0, 0, 0, 0.4, 0.4, 0.4, 0.7, 0.7, 1, 1, 1, 1], points)
    t = curve_parameters(curve, WANTED)
    assert (np.diff(t) > 0).all()
    np.testing.assert_allclose(ArcLength.of(curve)(t) / curve.length(), WANTED, atol=2e-12)


def test_bilinear_rectangles_need_no_search():
    plane = NurbsSurface((1, 1), ([0, 0, 2, 2], [1, 1, 4, 4]), [[[0, 0, 0], [0, 3, 0]], [[5, 0, 0], [5, 3, 0]]])
    b = distribution("cosine", 7)
    u, v = surface_parameters(plane, WANTED, b)
    np.testing.assert_allclose(u, np.repeat(2 * WANTED[:, None], 7, axis=1), atol=1e-12)
    np.testing.assert_allclose(v, np.repeat(1 + 3 * b[None], 41, axis=0), atol=1e-12)


def test_a_surface_gets_its_shares_along_both_directions():
    surface = wavy()
    a, b = distribution("tanh", 6, first=0.05), distribution("geometric", 5, ratio=1.5)
    u, v = surface_parameters(surface, a, b)
    np.testing.assert_array_equal(u[[0, -1]], np.repeat([[0.0], [1.0]], 5, axis=1))
    np.testing.assert_array_equal(v[:, [0, -1]], np.repeat([[0.0, 1.0]], 6, axis=0))
    assert (np.diff(u, axis=0) > 0).all()
    assert (np.diff(v, axis=1) > 0).all()
    got = reached(surface, u, v)
    np.testing.assert_allclose(got[0], np.repeat(a[:, None], 5, axis=1), atol=1e-9)
    np.testing.assert_allclose(got[1], np.repeat(b[None], 6, axis=0), atol=1e-9)
    swapped_v, swapped_u = surface_parameters(surface.transposed(), b, a)
    np.testing.assert_allclose(swapped_u.T, u, atol=1e-8)
    np.testing.assert_allclose(swapped_v.T, v, atol=1e-8)


def test_shares_may_differ_from_line_to_line():
    surface = wavy(1.5)
    a = np.linspace([0, 0, 0], [1, 1, 1], 5) ** [1.0, 1.3, 1.6]
    u, v = surface_parameters(surface, a, [0.0, 0.4, 1.0])
    np.testing.assert_allclose(reached(surface, u, v)[0], a, atol=1e-9)


def test_a_pole_takes_the_limit_of_its_neighbours():
    octant = Sphere((0, 0, 0), 1.0, u=(0.0, np.pi / 2), v=(0.0, np.pi / 2)).to_nurbs()
    third = np.linspace(0, 1, 4)
    u, v = surface_parameters(octant, third, third)
    p = octant(u, v)
    np.testing.assert_allclose(
        np.arcsin(np.clip(p[..., 2], -1, 1)), np.repeat(np.pi / 2 * third[None], 4, 0), atol=1e-7
    )
    np.testing.assert_allclose(np.arctan2(p[:, :-1, 1], p[:, :-1, 0])[:, 0], np.pi / 2 * third, atol=1e-9)
    np.testing.assert_allclose(u[:, -1], u[:, 0], atol=1e-9)


def test_failures():
    line = NurbsCurve(1, bezier_knots(1), [[0.0, 0.0], [1.0, 0.0]])
    with pytest.raises(ParameterError, match=r"lie in \[0, 1\]"):
        curve_parameters(line, [0.0, 1.5])
    with pytest.raises(ParameterError, match=r"lie in \[0, 1\]"):
        curve_parameters(line, [0.0, np.nan])
    with pytest.raises(ParameterError, match="not decrease"):
        curve_parameters(line, [0.0, 0.7, 0.6])
    with pytest.raises(ParameterError, match="no length"):
        curve_parameters(NurbsCurve(1, bezier_knots(1), [[2.0, 3.0], [2.0, 3.0]]), [0.0, 1.0])
    with pytest.raises(ParameterError, match="accuracy"):
        surface_parameters(wavy(), [0, 1], [0, 1], 0.0)
    with pytest.raises(ParameterError, match="make no grid"):
        surface_parameters(wavy(), np.zeros((3, 4)), [0.0, 1.0])
    flat = NurbsSurface((1, 1), ([0, 0, 1, 1], [0, 0, 1, 1]), [[[0, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 1, 0]]])
    with pytest.raises(ParameterError, match="no length along u"):
        surface_parameters(flat, [0, 1], [0, 1])
