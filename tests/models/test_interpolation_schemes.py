"""The registry of interpolation schemes: every claim holds, and the next stronger one fails."""

import inspect

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patchwright.models import ParameterError
from patchwright.models.interpolation import SCHEMES, interpolate, interpolated

NAMES = sorted(SCHEMES)
FREE = [n for n in NAMES if not SCHEMES[n].fixed]


def points_for(name, rng, count=11):
    """Unequal, planar data of increasing x, which every scheme takes; closed where the scheme is."""
    P = np.stack((np.cumsum(rng.uniform(0.5, 1.0, count)), rng.normal(size=count)), axis=1)
    if name == "c2-cubic-periodic":
        P[-1] = P[0]
    return P


def sites_for(name, rng, count=11):
    """Unequal parameters for the scheme, and where the curve then passes the points."""
    if SCHEMES[name].parameters == "uniform":
        return None, np.linspace(0.0, 1.0, count)
    s = np.cumsum(rng.uniform(0.5, 1.0, count))
    if SCHEMES[name].fixed:
        return None, s
    return s, interpolated(points_for(name, rng, count), name, s).parameters


def polynomial(name, rng, degree, t):
    """Planar points of a random polynomial of the degree at t; x = t for the schemes that want it."""
    values = np.stack([np.polynomial.Polynomial(rng.normal(size=degree + 1))(t) for _ in range(2)], axis=1)
    if SCHEMES[name].fixed and SCHEMES[name].parameters == "abscissa":
        values[:, 0] = t
    return values


def exactness(name, degree, seed):
    """The largest error over the size, where the points are of a polynomial of the degree."""
    rng = np.random.default_rng(seed)
    s, at = sites_for(name, rng)
    low, high = at[0], at[-1]

    def to_unit(t):
        return 2.0 * (t - low) / (high - low) - 1.0

    state = rng.bit_generator.state
    P = polynomial(name, rng, degree, to_unit(at))
    if SCHEMES[name].parameters == "abscissa":
        P[:, 0] = at
    # points of a constant coincide, so that only the build itself takes them
    curve = interpolate(P, name, s) if degree else SCHEMES[name](P, at if s is None else s, {}).curve
    t = np.linspace(*curve.domain, 301)
    rng.bit_generator.state = state
    want = polynomial(name, rng, degree, to_unit(t))
    if SCHEMES[name].parameters == "abscissa":
        want[:, 0] = t
    return np.abs(curve(t) - want).max() / np.abs(want).max()


@pytest.mark.parametrize("name", NAMES)
def test_the_curve_passes_through_its_points(name):
    rng = np.random.default_rng(1)
    P = points_for(name, rng)
    made = interpolated(P, name)
    assert np.abs(made.curve(made.parameters) - P).max() <= 1e-13 * np.abs(P).max()
    assert made.curve.domain == (made.parameters[0], made.parameters[-1])
    assert SCHEMES[name].interpolates


@pytest.mark.parametrize("name", [n for n in NAMES if SCHEMES[n].exact_degree is not None])
def test_the_exact_degree_is_reached_and_the_next_is_missed(name):
    degree = SCHEMES[name].exact_degree
    assert max(exactness(name, degree, seed) for seed in range(4)) <= 1e-12
    if name == "c2-cubic-periodic":
        with pytest.raises(ParameterError, match="closed curve"):  # no line is closed
            exactness(name, 1, 0)
    else:
        assert max(exactness(name, degree + 1, seed) for seed in range(4)) >= 1e-6


def jumps(curve, order):
    """Jumps of a derivative at inner breaks, over the largest value of the derivative there."""
    pieces = curve.bezier_pieces()
    before = np.array([p(p.domain[1], order) for p in pieces[:-1]])
    after = np.array([p(p.domain[0], order) for p in pieces[1:]])
    return np.abs(after - before).max() / max(np.abs(before).max(), np.abs(after).max())


@pytest.mark.parametrize("name", NAMES)
def test_the_continuity_claimed_holds_and_the_next_fails(name):
    curve = interpolate(points_for(name, np.random.default_rng(3)), name)
    k = SCHEMES[name].continuity
    assert max(jumps(curve, order) for order in range(k + 1)) <= 1e-10
    assert jumps(curve, k + 1) >= 1e-3


@pytest.mark.parametrize("name", NAMES)
def test_a_point_moves_the_spans_it_is_said_to_reach_and_no_others(name):
    rng = np.random.default_rng(4)
    count, k = 15, 7
    P = points_for(name, rng, count)
    s = None if SCHEMES[name].fixed else np.linspace(0.0, 1.0, count)
    if name != "c2-cubic-periodic":
        P[:, 1] = np.cumsum(rng.uniform(0.5, 1.0, count))  # slopes limited at an extremum would hide the reach
    moved = P.copy()
    moved[k, 1] += 0.1
    if name == "c2gbp":  # gentle enough for the construction
        P[:, 1] = P[:, 0] ** 2 / 20.0
        moved = P.copy()
        moved[k, 1] += 0.01
    a, b = interpolated(P, name, s), interpolated(moved, name, s)
    at = a.parameters
    middles = (at[:-1, None] + np.diff(at)[:, None] * np.linspace(0.1, 0.9, 9)).T
    change = np.abs(a.curve(middles) - b.curve(middles)).max(axis=(0, 2))
    touched = np.flatnonzero(change > 1e-14)
    reach = SCHEMES[name].reach
    if reach is None:
        assert not SCHEMES[name].local
        far = touched[-1] - touched[0] + 1
        assert far > 6
    else:
        assert SCHEMES[name].local
        assert (touched[0], touched[-1]) == (k - reach, k + reach - 1)


@pytest.mark.parametrize("name", [n for n in NAMES if n not in ("c2gbp", "c2-cubic-periodic")])
def test_monotone_points_give_monotone_curves_exactly_where_claimed(name):
    rng = np.random.default_rng(5)
    worst = 0.0
    for _ in range(12):
        steps = rng.uniform(0.0, 1.0, 11) ** 6 + 1e-3
        P = np.concatenate((np.zeros((1, 2)), np.cumsum(np.stack((rng.uniform(0.5, 1.0, 11), steps), axis=1), axis=0)))
        s = None if SCHEMES[name].fixed else np.arange(12.0)
        curve = interpolate(P, name, s)
        y = curve(np.linspace(*curve.domain, 4001))[:, 1]
        worst = min(worst, np.diff(y).min() / np.ptp(y))
    if SCHEMES[name].monotone:
        assert worst >= -1e-15
    else:
        assert worst < -1e-7


@pytest.mark.parametrize("name", [n for n in FREE if n != "c2-cubic-periodic"])
def test_linear_schemes_are_linear_in_the_points_and_others_are_not(name):
    rng = np.random.default_rng(6)
    s = np.cumsum(rng.uniform(0.5, 1.0, 9))
    options = {"continuity": 0.5} if name.startswith("tcb") else {}
    P, Q = rng.normal(size=(2, 9, 3))

    def curve(X):
        return interpolate(X, name, s, **options)

    t = np.linspace(*curve(P).domain, 101)
    error = np.abs(curve(P + 2.0 * Q)(t) - curve(P)(t) - 2.0 * curve(Q)(t)).max()
    assert (error <= 1e-12) == SCHEMES[name].linear


@pytest.mark.parametrize("name", [n for n in FREE if SCHEMES[n].linear])
@pytest.mark.parametrize("parameters", ["chord", "centripetal", "uniform"])
def test_turning_moving_and_scaling_the_points_does_the_same_to_the_curve(name, parameters):
    rng = np.random.default_rng(7)
    P = rng.normal(size=(9, 3))
    if name == "c2-cubic-periodic":
        P[-1] = P[0]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    for scale in (1e-3, 1.0, 1e3):
        a = interpolate(P, name, parameters)
        b = interpolate(scale * P @ turn + scale, name, parameters)
        t = np.linspace(*a.domain, 101)
        u = np.linspace(*b.domain, 101)
        exact = 1e-11 if not name.startswith("quadratic") else 1e-6  # a minimum is known to the root of round-off
        np.testing.assert_allclose(b(u), scale * a(t) @ turn + scale, rtol=0, atol=exact * scale)


@pytest.mark.parametrize("name", [n for n in FREE if n not in ("tcb", "tcb-equal-speed", "c2-cubic-periodic")])
def test_running_the_points_backwards_runs_the_curve_backwards(name):
    P = points_for(name, np.random.default_rng(8))
    a, b = interpolate(P, name), interpolate(P[::-1], name)
    t = np.linspace(0.0, 1.0, 101)
    error = np.abs(a(a.domain[0] + t * np.ptp(a.domain)) - b(b.domain[1] - t * np.ptp(b.domain))).max()
    assert error <= 1e-6 if name.startswith("quadratic") else error <= 1e-12


@pytest.mark.parametrize("degree", range(1, 8))
def test_any_degree_reproduces_its_own_polynomials_and_not_the_next(degree):
    rng = np.random.default_rng(degree)
    s = np.cumsum(rng.uniform(0.5, 1.0, 12))
    s = 2.0 * (s - s[0]) / np.ptp(s) - 1.0
    for extra, holds in ((0, True), (1, False)):
        p = np.polynomial.Polynomial(rng.normal(size=degree + extra + 1))
        curve = interpolate(p(s)[:, None], "b-spline", s, degree=degree)
        assert curve.degree == degree
        t = np.linspace(-1, 1, 200)
        assert (np.abs(curve(t)[:, 0] - p(t)).max() < 1e-11) == holds


def test_given_end_tangents_make_the_clamped_cubic_exact_for_cubics():
    s = np.array([0.0, 0.2, 0.7, 1.5, 2.0])
    p = np.polynomial.Polynomial([1.0, -2.0, 0.5, 1.5])
    d = p.deriv()
    curve = interpolate(p(s)[:, None], "c2-cubic-clamped", s, start_tangent=[d(s[0])], end_tangent=[d(s[-1])])
    t = np.linspace(0, 2, 50)
    np.testing.assert_allclose(curve(t)[:, 0], p(t), atol=1e-13)


def test_natural_ends_are_straight_and_periodic_ends_join_twice_smoothly():
    rng = np.random.default_rng(9)
    P = rng.normal(size=(8, 3))
    natural = interpolate(P, "c2-cubic-natural")
    assert np.abs(natural(np.array(natural.domain), 2)).max() <= 1e-10 * np.abs(natural(0.5, 2)).max()
    P[-1] = P[0]
    closed = interpolate(P, "c2-cubic-periodic")
    for order in range(3):
        start, end = closed(np.array(closed.domain), order)
        np.testing.assert_allclose(start, end, atol=1e-9 * max(1.0, np.abs(start).max()))


@pytest.mark.parametrize(
    "name", [n for n in NAMES if n not in ("c2gbp", "c2-cubic-periodic", "tcb", "tcb-equal-speed")]
)
def test_the_convergence_rate_is_that_of_the_exact_degree_at_least(name):
    """For f = exp on equal steps: halving them divides the error by 2^(exact degree + 1) or more, ends apart; for open
    schemes that are exact for lines at constant speed."""
    errors = []
    for n in (16, 32):
        x = np.linspace(0.0, 1.0, n + 1)
        curve = interpolate(np.stack((x, np.exp(x)), axis=1), name, None if SCHEMES[name].fixed else x)
        t = np.linspace(0.25, 0.75, 301)
        on = curve(t)
        errors.append(np.abs(on[:, 1] - np.exp(on[:, 0])).max())
    assert np.log2(errors[0] / errors[1]) >= SCHEMES[name].exact_degree + 0.8


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), name=st.sampled_from([n for n in FREE if n != "c2-cubic-periodic"]))
def test_any_distinct_points_in_any_dimension_are_passed(seed, name):
    rng = np.random.default_rng(seed)
    P = rng.normal(size=(rng.integers(6, 14), rng.integers(1, 5))) * 10.0 ** rng.integers(-3, 4)
    made = interpolated(P, name)
    assert np.abs(made.curve(made.parameters) - P).max() <= 1e-9 * np.abs(P).max()


def test_the_registry_is_complete_and_says_where_schemes_come_from():
    wanted = {
        "c2-cubic", "c2-cubic-natural", "c2-cubic-clamped", "c2-cubic-periodic", "b-spline", "quadratic-maxima",
        "quadratic-midpoint", "tcb", "tcb-equal-speed", "catmull-rom", "bessel", "akima", "modified-akima", "pchip",
        "rational-ball", "pollock", "c2gbp",
    }  # fmt: skip
    assert set(SCHEMES) == wanted
    assert all(s.source and inspect.getdoc(s.build) for s in SCHEMES.values())


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda P: np.insert(P, 4, P[4], axis=0), "points 4 and 5 coincide"),
        (lambda P: np.where(np.arange(11)[:, None] == 3, np.nan, P), "point 3 is not finite"),
        (lambda P: P[:1], "shape"),
        (lambda P: P[:, 0], "shape"),
    ],
)
def test_bad_points_give_one_clear_error(name, spoil, sentence):
    with pytest.raises(ParameterError, match=sentence):
        interpolate(spoil(points_for(name, np.random.default_rng(0))), name)


@pytest.mark.parametrize("name", [n for n in NAMES if SCHEMES[n].least > 2])
def test_too_few_points_are_counted(name):
    few = np.arange(2.0 * (SCHEMES[name].least - 1)).reshape(-1, 2) ** 1.5
    with pytest.raises(ParameterError, match=f"at least {SCHEMES[name].least} points, got {len(few)}"):
        interpolate(few, name)


@pytest.mark.parametrize("name", [n for n in NAMES if SCHEMES[n].least == 2])
def test_two_points_give_a_segment(name):
    curve = interpolate([[0.0, 1.0], [2.0, 3.0]], name)
    on = curve(np.linspace(*curve.domain, 20))
    np.testing.assert_allclose(on[:, 1], on[:, 0] + 1.0, atol=1e-15)


@pytest.mark.parametrize(
    ("name", "options", "sentence"),
    [
        ("c2-cubic", {"tension": 0.5}, "no option 'tension'"),
        ("tcb", {"tension": 1.5}, r"tension must lie in \[-1, 1\], got 1.5 at point 0"),
        ("tcb", {"continuity": [0.0] * 10 + [-2.0]}, "continuity .* at point 10"),
        ("tcb", {"bias": [0.0, 0.1]}, "bias must be one number or one for each of the 11"),
        ("tcb", {"bias": np.nan}, "bias"),
        ("tcb-equal-speed", {"speed": 0.0}, "speed must be positive"),
        ("tcb", {"start_tangent": [1.0]}, "start_tangent must be 2 finite numbers"),
        ("quadratic-maxima", {"ends": "maximum-1"}, "ends must be"),
        ("b-spline", {"degree": 0}, "degree"),
        ("b-spline", {"degree": 11}, "at least 12 points"),
        ("rational-ball", {"gamma": -1.0}, "positive"),
        ("rational-ball", {"alpha": 2.0}, "gamma"),
        ("rational-ball", {"slopes": "harmonic"}, "slopes"),
    ],
)
def test_bad_options_give_one_clear_error(name, options, sentence):
    with pytest.raises(ParameterError, match=sentence):
        interpolate(points_for(name, np.random.default_rng(0)), name, **options)


def test_unknown_names_wrong_dimensions_and_foreign_parameters_are_refused():
    P = points_for("c2-cubic", np.random.default_rng(0))
    with pytest.raises(ParameterError, match="no interpolation scheme 'cubic'; there are: akima"):
        interpolate(P, "cubic")
    for name in ("c2gbp", "rational-ball"):
        with pytest.raises(ParameterError, match="takes points in 2-D, got 3-D"):
            interpolate(np.c_[P, P[:, 0]], name)
        with pytest.raises(ParameterError, match="takes no others"):
            interpolate(P, name, "chord")
        with pytest.raises(ParameterError, match="x must increase"):
            interpolate(P[[0, 2, 1, 3, 4]], name)
    with pytest.raises(ParameterError, match="closed curve"):
        interpolate(P, "c2-cubic-periodic")
    with pytest.raises(ParameterError, match="on a line"):
        interpolate([[0, 0], [1, 1], [2, 2], [3, 5]], "c2gbp")
