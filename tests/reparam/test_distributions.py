import numpy as np
import pytest
from hypothesis import given as example
from hypothesis import settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from patchwright.models import NurbsCurve, ParameterError
from patchwright.models.analytic.arc import circle
from patchwright.models.arc_length import ArcLength
from patchwright.models.knots import bezier_knots
from patchwright.reparam import DISTRIBUTIONS, distribution

BEND = NurbsCurve(3, bezier_knots(3), [[0.0, 0.0], [3.0, 0.0], [3.0, 0.1], [3.0, 3.0]])
OPTIONS = {
    "uniform": {},
    "geometric": {"ratio": 1.2},
    "tanh": {"first": 1e-3},
    "tanh-both": {"first": 1e-3, "last": 1e-2},
    "cosine": {},
    "curvature": {"curve": BEND},
    "given": {"values": np.linspace(-3.0, 5.0, 21) ** 3},
}


@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_every_distribution_increases_from_0_to_1(name):
    t = distribution(name, 21, **OPTIONS[name])
    assert t.shape == (21,)
    assert (t[0], t[-1]) == (0.0, 1.0)
    assert (np.diff(t) > 0.0).all()


@settings(max_examples=60, deadline=None)
@example(st.integers(3, 200), st.floats(1e-9, 0.5), st.floats(1e-9, 0.45))
def test_the_first_and_the_last_step_come_out_as_asked(n, first, last):
    t = distribution("tanh-both", n + 1, first=first, last=last)
    assert t[1] == pytest.approx(first, rel=1e-12)
    assert 1.0 - t[-2] == pytest.approx(last, rel=1e-12, abs=1e-15)
    for name in ("tanh", "geometric"):
        if name == "tanh" or n * first < 10.0:  # growth that leaves the far end points of their own
            assert distribution(name, n + 1, first=first)[1] == pytest.approx(first, rel=1e-12)
            assert 1.0 - distribution(name, n + 1, last=first)[-2] == pytest.approx(first, rel=1e-12, abs=1e-15)


def test_tanh_is_vinokurs_function():
    """t = u / (A + (1 - A) u) with u = (1 + tanh(d (x - 1/2)) / tanh(d / 2)) / 2; one-sided t = 1 + tanh(b (x - 1)) /
    tanh(b)."""
    x = np.linspace(0.0, 1.0, 31)
    t = distribution("tanh-both", 31, first=2e-3, last=1e-2)
    A = np.sqrt((0.01 / 0.99) / (0.002 / 0.998))
    u = A * t / (1.0 - t + A * t)

    def two_sided(d, x):
        return 0.5 * (1 + np.tanh(d * (x - 0.5)) / np.tanh(d / 2))

    d = brentq(lambda d: two_sided(d, x[1]) - u[1], 1e-3, 20.0, xtol=1e-15)
    np.testing.assert_allclose(u, two_sided(d, x), atol=1e-13)
    one = distribution("tanh", 31, first=2e-3)
    b = brentq(lambda b: 1 + np.tanh(b * (x[1] - 1)) / np.tanh(b) - 2e-3, 1e-3, 10.0, xtol=1e-15)
    np.testing.assert_allclose(one, 1 + np.tanh(b * (x - 1)) / np.tanh(b), atol=1e-13)


def test_even_steps_are_the_middle_case_of_each_family():
    want = np.linspace(0.0, 1.0, 11)
    for off in (0.0, 1e-9, -1e-9):
        step = 0.1 * (1 + off)
        np.testing.assert_allclose(distribution("geometric", 11, first=step), want, atol=1e-8)
        np.testing.assert_allclose(distribution("tanh", 11, first=step), want, atol=1e-8)
        np.testing.assert_allclose(distribution("tanh-both", 11, first=step), want, atol=1e-8)


def test_geometric_steps_have_one_ratio():
    for options in ({"ratio": 1.3}, {"ratio": 0.7}, {"first": 1e-4}, {"last": 1e-4}, {"ratio": 1.0}):
        steps = np.diff(distribution("geometric", 25, **options))
        ratios = steps[1:] / steps[:-1]
        np.testing.assert_allclose(ratios, ratios[12], rtol=1e-9)
        if "ratio" in options:
            assert ratios[12] == pytest.approx(options["ratio"], rel=1e-12)


def test_cosine_points_are_those_of_a_circle():
    x = np.linspace(0.0, np.pi, 15)
    np.testing.assert_allclose(distribution("cosine", 15), (1 - np.cos(x)) / 2, atol=1e-15)
    start = distribution("cosine", 15, clustered="start")
    np.testing.assert_allclose(start, 1 - np.cos(x / 2), atol=1e-15)
    np.testing.assert_allclose(distribution("cosine", 15, clustered="end"), 1 - start[::-1], atol=1e-15)


def test_curvature_spreads_by_length_where_curvature_is_constant():
    for curve in (circle((0, 0, 0), (0, 0, 1), 2.5), NurbsCurve(1, bezier_knots(1), [[0.0, 0.0], [1.0, 2.0]])):
        np.testing.assert_allclose(distribution("curvature", 17, curve=curve), np.linspace(0, 1, 17), atol=1e-9)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_curvature_divides_length_and_turning_in_the_share_asked_for(share):
    """On the parabola y = x^2 / 2 the turning angle is arctan x and the length (x sqrt(1 + x^2) + arcsinh x) / 2."""
    low, high = -1.0, 3.0
    curve = NurbsCurve(2, bezier_knots(2), [[low, low**2 / 2], [(low + high) / 2, low * high / 2], [high, high**2 / 2]])
    s = distribution("curvature", 33, curve=curve, share=share)
    x = curve(ArcLength.of(curve).parameter(s * curve.length()))[:, 0]
    turn = np.arctan(x) - np.arctan(low)
    np.testing.assert_allclose((1 - share) * s + share * turn / turn[-1], np.linspace(0, 1, 33), atol=1e-8)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_curvature_does_not_depend_on_the_unit(scale):
    bent = NurbsCurve(3, BEND.knots, BEND.control_points * scale + 5.0)
    want = distribution("curvature", 21, curve=BEND)
    np.testing.assert_allclose(distribution("curvature", 21, curve=bent), want, atol=1e-8)


@pytest.mark.parametrize(
    ("name", "count", "options", "message"),
    [
        ("hyperbolic", 5, {}, "there is no distribution"),
        ("uniform", 1, {}, "at least 2 points"),
        ("uniform", 2.5, {}, "whole number"),
        ("uniform", float("nan"), {}, "whole number"),
        ("uniform", "5", {}, "whole number"),
        ("uniform", 5, {"ratio": 2}, "no option 'ratio'"),
        ("tanh-both", 5, {}, "needs the option 'first'"),
        ("tanh-both", 5, {"first": 0.6, "last": 0.5}, "leave room"),
        ("tanh-both", 3, {"first": 0.6, "last": 0.6}, "two steps"),
        ("tanh-both", 5, {"first": float("nan")}, "between 0 and 1"),
        ("tanh", 5, {}, "one of first and last"),
        ("tanh", 5, {"first": 0.0}, "between 0 and 1"),
        ("tanh", 2, {"first": 0.3}, "one step"),
        ("geometric", 5, {"ratio": 2, "first": 0.1}, "one of ratio"),
        ("geometric", 5, {"ratio": -1}, "positive"),
        ("geometric", 2000, {"ratio": 2}, "fall together"),
        ("cosine", 5, {"clustered": "left"}, "clustered"),
        ("curvature", 5, {"curve": BEND, "share": 1.0}, "share"),
        ("given", 3, {"values": [0, 2, 1]}, "increasing"),
        ("given", 4, {"values": [0, 1, 2]}, "4 finite"),
    ],
)
def test_failures(name, count, options, message):
    with pytest.raises(ParameterError, match=message):
        distribution(name, count, **options)
