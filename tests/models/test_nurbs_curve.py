import pickle

import numpy as np
import oracles_nurbs as oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patchwright.models import KnotError, NurbsCurve, ParameterError
from patchwright.models.analytic.arc import circle
from patchwright.models.knots import bezier_knots, distinct, greville, uniform_knots


def random_curve(seed: int, degree: int, rational: bool, dimension: int = 3, clamped: bool = True) -> NurbsCurve:
    """Unequal spans, a double and a full inner knot where the degree allows them."""
    rng = np.random.default_rng(seed)
    inner = np.sort(rng.uniform(0.05, 0.95, 4))
    inner = np.sort(np.concatenate((inner, inner[1:2].repeat(min(1, degree - 1)), inner[3:].repeat(degree - 1))))
    ends = (np.zeros(degree + 1), np.ones(degree + 1))
    if not clamped:
        ends = (-np.sort(-np.arange(degree + 1)) * 0.07, 1 + np.arange(degree + 1) * 0.11)
        ends = (np.sort(-np.arange(degree + 1) * 0.07), ends[1])
    knots = np.concatenate((ends[0], inner, ends[1]))
    n = len(knots) - degree - 1
    weights = rng.uniform(0.3, 3.0, n) if rational else None
    return NurbsCurve(degree, knots, rng.normal(size=(n, dimension)), weights)


def parameters(curve: NurbsCurve, count: int = 200) -> np.ndarray:
    t0, t1 = curve.domain
    return np.concatenate((np.random.default_rng(7).uniform(t0, t1, count), curve.breaks))


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 9])
@pytest.mark.parametrize("rational", [False, True])
@pytest.mark.parametrize("clamped", [True, False])
def test_points_and_derivatives_agree_with_the_exact_recursion(degree, rational, clamped):
    curve = random_curve(degree, degree, rational, dimension=2, clamped=clamped)
    for t in (*np.random.default_rng(1).uniform(*curve.domain, 3), curve.domain[1]):
        for nu in range(4):
            want = oracle.curve_derivative(degree, curve.knots, curve.control_points, curve.weights, t, nu)
            scale = max(1.0, np.abs(want).max(), np.abs(curve(t, max(nu - 1, 0))).max())
            np.testing.assert_allclose(curve(t, nu), want, rtol=0, atol=1e-9 * scale if nu > 1 else 1e-12 * scale)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), degree=st.integers(1, 8))
def test_constant_control_points_give_a_constant(seed, degree):
    """Partition of unity, whatever knots and weights."""
    c = random_curve(seed, degree, rational=True)
    constant = NurbsCurve(degree, c.knots, np.full_like(c.control_points, 2.5), c.weights)
    np.testing.assert_allclose(constant(parameters(c)), 2.5, rtol=1e-14)
    assert np.abs(constant(parameters(c), 1)).max() < 1e-9


def test_greville_points_reproduce_a_line():
    knots = random_curve(3, 4, False).knots
    line = NurbsCurve(4, knots, np.outer(greville(4, knots), [1.0, -2.0, 3.0]))
    t = np.linspace(0, 1, 50)
    np.testing.assert_allclose(line(t), np.outer(t, [1, -2, 3]), atol=1e-15)


@pytest.mark.parametrize("angles", [(0, 2 * np.pi), (0.3, 0.3 + 2 * np.pi), (-1.0, 0.5), (0.0, 3.2), (2.0, 2.0 + 1e-6)])
def test_circles_are_exact(angles):
    centre, axis = np.array([1.0, -2.0, 0.5]), np.array([1.0, 2.0, -0.5])
    c = circle(centre, axis, 3.0, angles=angles)
    p = c(np.linspace(*c.domain, 300)) - centre
    np.testing.assert_allclose(np.linalg.norm(p, axis=1), 3.0, rtol=4e-16 * 4)
    np.testing.assert_allclose(p @ axis, 0.0, atol=1e-14)
    if angles[1] - angles[0] > 6.28:
        assert (c.control_points[0] == c.control_points[-1]).all()


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), degree=st.integers(1, 7), rational=st.booleans(), clamped=st.booleans())
def test_insertion_splitting_clamping_elevation_keep_the_shape(seed, degree, rational, clamped):
    c = random_curve(seed, degree, rational, clamped=clamped)
    t = parameters(c)
    t = t[(t != c.breaks[-2])]  # a full inner knot is a legal jump of nothing, but evaluation is from the right
    x = c(t)
    more = np.random.default_rng(seed).uniform(*c.domain, 5)
    atol = 1e-13 * np.abs(c.control_points).max()
    if rational:
        atol *= c.weights.max() / c.weights.min()
    np.testing.assert_allclose(c.insert_knots(more)(t), x, rtol=0, atol=atol)
    np.testing.assert_allclose(c.clamped()(t), x, rtol=0, atol=atol)
    before, after = c.split(more[0])
    np.testing.assert_allclose(before(t[t <= more[0]]), x[t <= more[0]], rtol=0, atol=atol)
    np.testing.assert_allclose(after(t[t >= more[0]]), x[t >= more[0]], rtol=0, atol=atol)
    assert before.domain == (c.domain[0], more[0])
    assert after.domain == (more[0], c.domain[1])
    np.testing.assert_allclose(before.control_points[-1], c(more[0]), rtol=0, atol=atol)
    for times in (1, 3):
        up = c.elevated(times)
        assert up.degree == degree + times
        np.testing.assert_allclose(up(t), x, rtol=0, atol=10 * atol)
    for piece in c.bezier_pieces():
        inside = (t > piece.domain[0]) & (t < piece.domain[1])
        assert len(piece.control_points) == degree + 1
        np.testing.assert_allclose(piece(t[inside]), x[inside], rtol=0, atol=atol)


def test_insertion_leaves_points_outside_the_touched_spans_bit_for_bit():
    c = random_curve(1, 3, False)
    r = c.insert_knots([0.5 * (c.breaks[1] + c.breaks[2])])
    same = (r.control_points[:, None] == c.control_points[None]).all(axis=2).any(axis=1)
    assert (~same).sum() <= 3


def test_elevation_raises_every_multiplicity_by_one():
    c = random_curve(2, 3, True)
    _, before = distinct(c.knots)
    _, after = distinct(c.elevated().knots)
    assert (after == before + 1).all()


def test_bezier_elevation_is_the_textbook_formula():
    P = np.random.default_rng(0).normal(size=(4, 3))
    i = np.arange(1, 4)[:, None] / 4
    want = np.concatenate((P[:1], i * P[:-1] + (1 - i) * P[1:], P[-1:]))
    np.testing.assert_allclose(NurbsCurve(3, bezier_knots(3), P).elevated().control_points, want, atol=1e-15)


@pytest.mark.parametrize("clamped", [True, False])
def test_reversal(clamped):
    c = random_curve(4, 3, True, clamped=clamped)
    r = c.reversed()
    t0, t1 = c.domain
    t = np.linspace(t0, t1, 77)
    assert r.domain == c.domain
    np.testing.assert_allclose(r(t0 + t1 - t), c(t), atol=1e-13)
    np.testing.assert_allclose(r.reversed().control_points, c.control_points)


@pytest.mark.parametrize("multiplicity", [1, 2, 3])
@pytest.mark.parametrize("rational", [False, True])
def test_periodic_curves_unroll_with_their_continuity(multiplicity, rational):
    """Of degree 3 with end multiplicity k: C(3 - k) across the seam, and shifted control points give the
    shifted curve."""
    rng = np.random.default_rng(5)
    values = np.array([0.0, 1.0, 1.5, 3.0, 4.0])
    k = np.full(5, multiplicity)
    n = 4 * multiplicity
    points, w = rng.normal(size=(n, 3)), rng.uniform(0.5, 2, n) if rational else None
    c = NurbsCurve.from_periodic(3, values, k, points, w)
    assert c.domain == (0.0, 4.0)
    for nu in range(4 - multiplicity):
        np.testing.assert_allclose(c(0.0, nu), c(4.0, nu), atol=1e-11)
    assert np.abs(c(0.0, 4 - multiplicity) - c(4.0, 4 - multiplicity)).max() > 1e-3
    shifted = NurbsCurve.from_periodic(
        3, np.array([1.0, 1.5, 3.0, 4.0, 5.0]), k, np.roll(points, -multiplicity, axis=0),
        None if w is None else np.roll(w, -multiplicity),
    )  # fmt: skip
    t = np.linspace(1.0, 4.0, 60)
    np.testing.assert_allclose(shifted(t), c(t), atol=1e-13)
    np.testing.assert_allclose(shifted(np.linspace(4, 5, 30)), c(np.linspace(0, 1, 30)), atol=1e-13)


def test_one_span_period_wraps_more_than_once():
    """Fewer control points than the degree: every control point serves several basis functions."""
    c = NurbsCurve.from_periodic(3, [0.0, 1.0, 2.0], [1, 1, 1], [[0.0], [1.0]])
    np.testing.assert_allclose(c(0.0), c(2.0), atol=1e-15)
    np.testing.assert_allclose(c(np.linspace(0, 1, 9)) + c(np.linspace(1, 2, 9)), 1.0, atol=1e-14)


def test_values_are_own_read_only_copies_and_pickle():
    P = np.zeros((4, 2))
    P[:, 0] = range(4)
    c = NurbsCurve(3, bezier_knots(3), P)
    P[0, 0] = 9
    assert c.control_points[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        c.knots[0] = 1
    back = pickle.loads(pickle.dumps(c))
    assert (back(0.3) == c(0.3)).all()


def test_shapes_broadcast():
    c = random_curve(0, 3, True)
    assert c(0.5).shape == (3,)
    assert c(np.zeros((2, 5))).shape == (2, 5, 3)
    assert c(np.zeros(0)).shape == (0, 3)
    assert c.derivatives(np.zeros((2, 5)), 2).shape == (3, 2, 5, 3)


def test_ends_are_the_end_control_points_bit_for_bit():
    c = random_curve(0, 3, False)
    assert (c(1.0) == c.control_points[-1]).all()
    assert (c(0.0) == c.control_points[0]).all()


@pytest.mark.parametrize(
    ("degree", "knots", "match"),
    [
        (3, [0, 0, 0, 0, 1, 1, 1], "need 8 knots"),
        (2, [0, 0, 0, 0.6, 0.5, 1, 1], "decrease"),
        (2, [0, 0, 0, 0, 1, 1, 1], "multiplicity above degree"),
        (2, [0, 0, 0, np.nan, 1, 1, 1], "finite"),
        (0, [0, 0, 0, 1, 1], "degree must be at least 1"),
        (5, [0] * 5 + [1] * 5, "at least 6 control points"),
    ],
)
def test_bad_knots_are_refused(degree, knots, match):
    with pytest.raises(KnotError, match=match):
        NurbsCurve(degree, knots, np.zeros((4, 3)))


@pytest.mark.parametrize("weights", [[1, 1, 0, 1], [1, 1, -1, 1], [1, np.nan, 1, 1], [1, 1, 1], [1, np.inf, 1, 1]])
def test_bad_weights_are_refused(weights):
    with pytest.raises(ParameterError, match="weights must"):
        NurbsCurve(3, bezier_knots(3), np.zeros((4, 3)), weights)


def test_parameters_outside_are_refused_and_round_off_is_clamped():
    c = random_curve(0, 3, False)
    np.testing.assert_array_equal(c(1.0 + 1e-15), c(1.0))
    for t in (1.0 + 1e-9, -1e-9, np.nan, np.inf, [0.5, np.nan]):
        with pytest.raises(ParameterError, match="outside the domain"):
            c(t)
    with pytest.raises(ParameterError, match="order"):
        c(0.5, -1)
    with pytest.raises(KnotError, match="outside"):
        c.insert_knots([1.5])
    with pytest.raises(KnotError, match="above the degree"):
        NurbsCurve(3, uniform_knots(3, 5), np.zeros((5, 1))).insert_knots([0.5] * 3)
    with pytest.raises(ParameterError, match="not finite"):
        NurbsCurve(1, [0, 0, 1, 1], [[0, np.nan], [1, 1]])
    with pytest.raises(KnotError, match="sum to"):
        NurbsCurve.from_periodic(3, [0, 1, 2], [1, 1, 1], np.zeros((5, 2)))
