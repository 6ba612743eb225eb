import numpy as np
import pytest

from patchwright.models import NurbsCurve, NurbsSurface, ParameterError, Sphere
from patchwright.models.arc_length import ArcLength
from patchwright.models.knots import between, bezier_knots
from patchwright.reparam import compose_curve, compose_surface, distribution, inverted, rational_linear

RNG = np.random.default_rng(5)
X = np.sort(RNG.uniform(0, 1, 9))
Y = np.cumsum(RNG.uniform(1e-3, 1, 9) ** 3)
KNOTS = np.concatenate((np.zeros(4), [0.2, 0.21, 0.8], np.ones(4)))
CURVE = NurbsCurve(3, KNOTS, RNG.normal(size=(7, 3)), RNG.uniform(0.3, 3, 7))


@pytest.mark.parametrize("split", [0.5, 0.1, 0.9])
def test_it_interpolates_values_and_slopes_and_increases(split):
    d = RNG.uniform(1e-3, 1e3, X.size)
    f = rational_linear(X, Y, d, split=split)
    np.testing.assert_allclose(f(X)[:, 0], Y, rtol=1e-14)
    np.testing.assert_allclose(f(X, 1)[:, 0], d, rtol=1e-11)
    inner = between(f.breaks, 50)
    assert (f(inner, 1) > 0.0).all()


def test_it_is_c1_and_no_more():
    f = rational_linear(X, Y)
    t = f.breaks[1:-1]
    before, after = (np.nextafter(t, s) for s in (-np.inf, np.inf))
    np.testing.assert_allclose(f(before, 1), f(after, 1), rtol=1e-9)
    assert np.abs(f(before, 2) / f(after, 2) - 1).max() > 0.1


def test_rational_linear_functions_are_reproduced_and_quadratics_are_not():
    x = np.linspace(-1.0, 2.0, 6)
    f = rational_linear(x, (3 * x + 1) / (x + 4))
    at = np.linspace(-1.0, 2.0, 101)
    np.testing.assert_allclose(f(at)[:, 0], (3 * at + 1) / (at + 4), rtol=0, atol=1e-14)
    g = rational_linear(x, (x + 2) ** 2)
    assert np.abs(g(at)[:, 0] - (at + 2) ** 2).max() > 1e-3


def test_it_converges_with_the_third_power_of_the_step():
    """Slopes through three points are second order, so that the values are third."""
    at = np.linspace(0.0, 2.0, 1001)
    errors = []
    for n in (10, 20, 40, 80):
        x = np.linspace(0.0, 2.0, n + 1)
        errors.append(np.abs(rational_linear(x, np.sinh(x))(at)[:, 0] - np.sinh(at)).max())
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (rates > 2.7).all(), rates


def test_the_inverse_is_exact():
    f = rational_linear(X, Y)
    at = np.linspace(Y[0], Y[-1], 301)
    np.testing.assert_allclose(f(inverted(f)(at)[:, 0])[:, 0], at, rtol=1e-12)


@pytest.mark.parametrize("weighted", [True, False])
def test_a_composed_curve_is_the_same_curve_of_the_same_degree(weighted):
    curve = CURVE if weighted else NurbsCurve(3, KNOTS, CURVE.control_points)
    y = np.array([0.0, 0.2, 0.35, 0.5, 0.81, 1.0])  # 0.2 is a knot of the curve as well
    f = rational_linear([3.0, 3.1, 4.0, 4.2, 5.0, 7.0], y)
    g = compose_curve(curve, f)
    at = np.linspace(3.0, 7.0, 500)
    assert g.degree == 3
    assert g.domain == (3.0, 7.0)
    np.testing.assert_allclose(g(at), curve(f(at)[:, 0]), rtol=0, atol=1e-12)
    chain = curve(f(at)[:, 0], 1) * f(at, 1)
    np.testing.assert_allclose(g(at, 1), chain, rtol=1e-9, atol=1e-10)
    back = compose_curve(g, inverted(f))
    np.testing.assert_allclose(back(at / 4 - 0.75), curve(at / 4 - 0.75), rtol=0, atol=1e-12)


def test_a_function_onto_a_part_gives_the_part():
    f = rational_linear([0.0, 0.5, 1.0], [0.1, 0.3, 0.6])
    g = compose_curve(CURVE, f)
    np.testing.assert_allclose(g(g.domain), CURVE([0.1, 0.6]), atol=1e-13)


def test_it_gives_a_curve_nearly_constant_speed():
    """The exact shape, run through by arc length at n points with the right speed there: second order between them."""
    curve = NurbsCurve(3, bezier_knots(3), [[0.0, 0.0], [1.0, 0.0], [2.0, 0.5], [3.0, 2.0]])
    arc = ArcLength.of(curve)
    at = np.linspace(0.0, arc.total, 2001)
    worst = []
    for n in (8, 16, 32, 64):
        s = distribution("uniform", n + 1) * arc.total
        t = arc.parameter(s)
        g = compose_curve(curve, rational_linear(s, t, 1.0 / np.linalg.norm(curve(t, 1), axis=1)))
        worst.append(np.abs(np.linalg.norm(g(at, 1), axis=1) - 1.0).max())
    rates = np.log2(np.array(worst[:-1]) / worst[1:])
    assert (rates > 1.8).all(), rates
    assert worst[-1] < 1e-3, worst


def test_a_composed_surface_is_the_same_surface():
    sphere = Sphere((0, 0, 0), 1.0, u=(0.0, 1.5), v=(-1.0, 1.5)).to_nurbs()
    (u0, u1), (v0, v1) = sphere.domain
    f = rational_linear([0.0, 0.3, 1.0], [u0, 0.6 * u0 + 0.4 * u1, u1])
    g = rational_linear([0.0, 0.8, 1.0], [v0, 0.5 * (v0 + v1), v1])
    at = np.linspace(0, 1, 41)
    for one, other in ((f, g), (f, None), (None, g)):
        new = compose_surface(sphere, one, other)
        u = at if one else np.linspace(u0, u1, 41)
        v = at if other else np.linspace(v0, v1, 41)
        want = sphere.grid(f(u)[:, 0] if one else u, g(v)[:, 0] if other else v)
        np.testing.assert_allclose(new.grid(u, v), want, atol=1e-14)
    plain = NurbsSurface((1, 1), ([0, 0, 1, 1], [0, 0, 1, 1]), RNG.normal(size=(2, 2, 3)))
    h = rational_linear([0.0, 0.5, 1.0], [0.0, 0.1, 1.0])
    np.testing.assert_allclose(compose_surface(plain, h).grid(at, at), plain.grid(h(at)[:, 0], at), atol=1e-14)


def test_failures():
    with pytest.raises(ParameterError, match="x must be"):
        rational_linear([0, 0, 1], [0, 1, 2])
    with pytest.raises(ParameterError, match="y must be"):
        rational_linear([0, 1, 2], [0, 2, np.nan])
    with pytest.raises(ParameterError, match="one length"):
        rational_linear([0, 1, 2], [0, 2])
    with pytest.raises(ParameterError, match="slopes must be"):
        rational_linear([0, 1], [0, 1], [1, 0])
    with pytest.raises(ParameterError, match="split"):
        rational_linear([0, 1], [0, 1], split=1.0)
    with pytest.raises(ParameterError, match="outside the domain"):
        compose_curve(CURVE, rational_linear([0, 1], [0, 1.5]))
    with pytest.raises(ParameterError, match="increasing NURBS curve of degree 1"):
        compose_curve(CURVE, CURVE)
