"""Quadratic interpolation by maxima: the paper's knots, degenerate sites, energies, and the linear system."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patchwright.models import NurbsCurve, ParameterError
from patchwright.models.analytic.arc import circle
from patchwright.models.interpolation import interpolate, interpolate_surface, interpolated, parametrize
from patchwright.models.interpolation.maxima_knots import CLEARANCE, Meeting, maxima_knots
from patchwright.models.strain_energy import curvature, strain_energy

SITES = np.array(
    [0.0, 0.112916, 0.217241, 0.262778, 0.301353, 0.447167, 0.509941, 0.574426, 0.709191, 0.752811, 0.802359,
     0.898568, 1.0]
)  # fmt: skip
PRINTED = {
    "repeated": [-0.119939, 0.066914, 0.214838, 0.218152, 0.300582, 0.343451, 0.497283, 0.526605, 0.671234, 0.710064,
                 0.801368, 0.805427, 0.941988, 1.106319],
    "stepped": [-0.063362, 0.051907, 0.215155, 0.218152, 0.300582, 0.343461, 0.497233, 0.526610, 0.671264, 0.710064,
                0.801368, 0.804916, 0.957132, 1.053866],
}  # fmt: skip
FOURTH = np.array([0.0, 1 / 6, 1 / 3, 2 / 3, 5 / 6, 1.0])


def misses(sites, knots):
    """f_i of (3.7) and (3.8), one by one; knots t_-2..t_{n+3}."""
    t = dict(enumerate(knots, start=-2))
    return np.array(
        [t[i + 2] * t[i + 1] - t[i] * t[i - 1] - s * (t[i + 2] + t[i + 1] - t[i] - t[i - 1])
         for i, s in enumerate(sites)]
    )  # fmt: skip


@pytest.mark.parametrize("ends", ["repeated", "stepped"])
def test_the_regular_minimum_of_the_papers_first_case(ends):
    found = maxima_knots(SITES, ends)
    left = found.F
    assert left == pytest.approx(float((misses(SITES, found.knots) ** 2).sum()), rel=1e-10)
    assert found.F <= 3.302e-4
    assert np.abs(found.knots[2:-2] - PRINTED[ends]).max() <= 1e-3
    assert np.diff(found.knots[2:-2]).min() > 1e-3  # simple knots
    assert found.meeting is Meeting.NEAREST
    assert not found.kept_apart.size


@pytest.mark.parametrize("ends", ["repeated", "stepped"])
def test_it_is_a_minimum_no_feasible_neighbour_is_lower(ends):
    found = maxima_knots(SITES, ends)
    rng = np.random.default_rng(0)
    below, above = np.concatenate(([-1.0], SITES)), np.concatenate((SITES, [2.0]))
    for size in (1e-3, 1e-4, 1e-5):
        for _ in range(50):
            t = np.clip(found.knots[2:-2] + size * rng.normal(size=14), below, above)
            first = SITES[1] - SITES[0] if ends == "stepped" else 0.0
            last = SITES[-1] - SITES[-2] if ends == "stepped" else 0.0
            T = np.concatenate(([t[0] - 2 * first, t[0] - first], t, [t[-1] + last, t[-1] + 2 * last]))
            assert (misses(SITES, T) ** 2).sum() >= found.F * (1 - 1e-9)


@pytest.mark.parametrize("ends", ["repeated", "stepped"])
@pytest.mark.parametrize("size", [1e-7, 1e-5, 1e-4])
def test_the_regular_minimum_is_found_from_sites_near_by_too(ends, size):
    """The printed sites have six digits; the answer must not hang on the seventh."""
    rng = np.random.default_rng(1)
    for _ in range(8):
        sites = SITES.copy()
        sites[1:-1] += size * rng.normal(size=11)
        found = maxima_knots(sites, ends)
        assert found.meeting is Meeting.NEAREST
        assert np.abs(found.knots[2:-2] - PRINTED[ends]).max() <= 1e-3 + 20 * size


@pytest.mark.parametrize("ends", ["repeated", "stepped"])
def test_the_papers_fourth_case_is_recognised_as_degenerate(ends):
    found = maxima_knots(FOURTH, ends)
    assert found.meeting is Meeting.DEGENERATE
    np.testing.assert_array_equal(found.kept_apart, [0, 5])
    assert found.F >= 1 / 360  # the bounded minimum, at coincident knots
    room = np.diff(FOURTH)[0]
    assert np.diff(found.knots[2:-2]).min() >= 2 * CLEARANCE * room * (1 - 1e-12)
    made = interpolated(np.random.default_rng(0).normal(size=(6, 2)), "quadratic-maxima", FOURTH, ends=ends)
    assert len(made.notes) == 1
    assert "coincident knots" in made.notes[0]
    assert "points 0, 5" in made.notes[0]


def test_equal_steps_need_the_midpoints_and_meet_the_condition():
    found = maxima_knots(np.linspace(0, 1, 9), "stepped")
    assert found.meeting is Meeting.EXACT
    np.testing.assert_allclose(found.knots, (np.arange(14) - 2.5) / 8, atol=1e-7)


def test_where_the_condition_is_met_every_basis_function_is_greatest_at_its_site():
    """The basis functions themselves are asked, for sites made from knots."""
    rng = np.random.default_rng(2)
    met = 0
    for _ in range(40):
        sites = np.cumsum(rng.uniform(0.7, 1.0, 6))
        found = maxima_knots(sites)
        if found.meeting is not Meeting.EXACT:
            continue
        met += 1
        basis = NurbsCurve(2, found.knots, np.eye(len(sites) + 2))
        slopes = basis(sites, 1)[np.arange(6), np.arange(1, 7)]
        assert np.abs(slopes).max() <= 1e-6 * np.abs(basis(sites, 1)).max()
    assert met >= 10


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), ends=st.sampled_from(["repeated", "stepped"]))
def test_any_sites_give_simple_knots_between_their_sites_and_a_curve(seed, ends):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 40))
    P = np.cumsum(rng.uniform(0.05, 1.0, n)[:, None] * rng.normal(size=(n, 2)), axis=0)
    s = parametrize(P)
    found = maxima_knots(s, ends)
    t = found.knots[2:-2]
    assert (np.diff(t) > 0).all()
    assert (t[1:-1] >= s[:-1]).all()
    assert (t[1:-1] <= s[1:]).all()
    made = interpolated(P, "quadratic-maxima", ends=ends)
    assert np.abs(made.curve(s) - P).max() <= 1e-10 * np.abs(P).max()
    assert np.unique(made.curve.knots[3:-3]).size == made.curve.knots[3:-3].size


def test_twelve_spans_take_milliseconds_and_a_step_costs_as_much_for_every_site():
    def seconds(work):
        start = time.process_time()
        return work(), time.process_time() - start

    rng = np.random.default_rng(7)
    P = np.cumsum(rng.uniform(0.05, 1.0, 1001)[:, None] * rng.normal(size=(1001, 2)), axis=0)
    interpolate(P[:13], "quadratic-maxima")  # compiled and warm
    assert min(seconds(lambda: interpolate(P[:13], "quadratic-maxima"))[1] for _ in range(3)) < 0.01
    assert seconds(lambda: interpolate(P, "quadratic-maxima"))[1] < 1.0
    costs = []
    for n in (200, 1600):
        sites = np.cumsum(rng.uniform(0.7, 1.0, n))
        found, took = seconds(lambda sites=sites: maxima_knots(sites))
        costs.append(took / (n * found.steps))
    assert costs[1] < 3.0 * costs[0]


def test_moving_and_scaling_the_sites_moves_and_scales_the_knots():
    a = maxima_knots(SITES).knots
    for scale, shift in ((1e-3, 0.0), (1e3, -5.0)):
        b = maxima_knots(scale * SITES + shift).knots
        np.testing.assert_allclose((b - shift) / scale, a, atol=1e-6)


def test_end_tangents_are_met_and_default_to_bessels():
    P = np.random.default_rng(3).normal(size=(8, 3))
    s = parametrize(P)
    given = interpolate(P, "quadratic-maxima", start_tangent=[1.0, 2.0, 3.0], end_tangent=[0.0, -1.0, 0.5])
    np.testing.assert_allclose(given(np.array([0.0, 1.0]), 1), [[1, 2, 3], [0, -1, 0.5]], atol=1e-9)
    own, bessel = interpolate(P, "quadratic-maxima"), interpolate(P, "bessel")
    np.testing.assert_allclose(own(s[[0, -1]], 1), bessel(s[[0, -1]], 1), atol=1e-9)


def test_a_biquadratic_surface_by_maxima_passes_its_points_on_common_sites():
    rng = np.random.default_rng(6)
    x, y = np.meshgrid(np.cumsum(rng.uniform(0.4, 1.0, 7)), np.cumsum(rng.uniform(0.4, 1.0, 9)), indexing="ij")
    P = np.stack((x, y, np.sin(x) * np.cos(y)), axis=-1)
    S = interpolate_surface(P, "quadratic-maxima")
    assert S.degree == (2, 2)
    u = np.mean([parametrize(P[:, j]) for j in range(9)], axis=0)
    v = np.mean([parametrize(P[i]) for i in range(7)], axis=0)
    np.testing.assert_allclose(S.grid(u, v), P, atol=1e-12)


def test_bad_sites_give_one_clear_error():
    with pytest.raises(ParameterError, match="at least 3 sites"):
        maxima_knots(np.array([0.0, 1.0]))
    with pytest.raises(ParameterError, match="ends must be"):
        maxima_knots(SITES, "maximum-1")


@pytest.mark.parametrize("radius", [1e-3, 0.7, 1e3])
def test_the_strain_energy_of_a_circle_is_2_pi_over_its_radius(radius):
    round_ = circle([0, 0, 0], [0, 0, 1], radius)
    assert strain_energy(round_) == pytest.approx(2 * np.pi / radius, rel=1e-9)
    np.testing.assert_allclose(curvature(round_, np.linspace(*round_.domain, 9)), 1 / radius, rtol=1e-10)


def test_the_strain_energy_of_a_parabola_and_of_a_cusp():
    """(x, x^2) on [0, 1]: integral of 4 (1 + 4 x^2)^(-5/2); a cusp has none."""
    parabola = NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[0, 0], [0.5, 0], [1, 1]])
    x = 2.0
    want = 2 * (x / np.sqrt(1 + x * x) - (x / np.sqrt(1 + x * x)) ** 3 / 3)
    assert strain_energy(parabola) == pytest.approx(want, rel=1e-10)
    cusp = NurbsCurve(3, [0, 0, 0, 0, 1, 1, 1, 1], [[0, 0], [1, 1], [0, 1], [1, 0]])
    assert strain_energy(cusp) == np.inf
