"""TCB splines against Eberly's equations written out in rational arithmetic, one point at a time."""

from fractions import Fraction as F

import numpy as np
import pytest

from patchwright.models.interpolation import interpolate
from patchwright.models.interpolation.tcb import equal_speeds, tcb_tangents


def exact_tangents(P, s, tau, gamma, beta):
    """(17), (20) and (21), exactly."""
    P = [[F(float(x)) for x in p] for p in P]
    s, tau, gamma, beta = ([F(float(x)) for x in v] for v in (s, tau, gamma, beta))
    n, d = len(P), len(P[0])
    velocity = [[(P[k + 1][x] - P[k][x]) / (s[k + 1] - s[k]) for x in range(d)] for k in range(n - 1)]
    incoming, outgoing = [], []
    for k in range(n):
        t, g, b = tau[k], gamma[k], beta[k]
        zero = [F(0)] * d
        after = velocity[k] if k < n - 1 else zero
        before = velocity[k - 1] if k > 0 else zero
        incoming.append([((1 - t) * (1 + g) * (1 - b) * a + (1 - t) * (1 - g) * (1 + b) * c) / 2
                         for a, c in zip(after, before, strict=True)])  # fmt: skip
        outgoing.append([((1 - t) * (1 - g) * (1 - b) * a + (1 - t) * (1 + g) * (1 + b) * c) / 2
                         for a, c in zip(after, before, strict=True)])  # fmt: skip
    return np.array(incoming, dtype=float), np.array(outgoing, dtype=float)


def data(seed, count=9, dimension=3):
    rng = np.random.default_rng(seed)
    P = rng.normal(size=(count, dimension))
    s = np.cumsum(rng.uniform(0.3, 1.0, count))
    return P, s, *rng.uniform(-1.0, 1.0, (3, count))


def sides(curve, s):
    """One-sided derivatives at the points: incoming at 1.., outgoing at ..n-1."""
    pieces = curve.bezier_pieces()
    assert len(pieces) == len(s) - 1
    return (
        np.array([p(p.domain[1], 1) for p in pieces]),
        np.array([p(p.domain[0], 1) for p in pieces]),
    )


@pytest.mark.parametrize("seed", range(5))
def test_tangents_are_those_of_equations_17_20_and_21(seed):
    P, s, tau, gamma, beta = data(seed)
    want_in, want_out = exact_tangents(P, s, tau, gamma, beta)
    got_in, got_out = tcb_tangents(P, s, tau, gamma, beta)
    scale = np.abs(want_out).max()
    np.testing.assert_allclose(got_in[1:], want_in[1:], rtol=0, atol=1e-14 * scale)
    np.testing.assert_allclose(got_out[:-1], want_out[:-1], rtol=0, atol=1e-14 * scale)
    curve = interpolate(P, "tcb", s, tension=tau, continuity=gamma, bias=beta)
    incoming, outgoing = sides(curve, s)
    np.testing.assert_allclose(incoming, want_in[1:], rtol=0, atol=1e-13 * scale)
    np.testing.assert_allclose(outgoing, want_out[:-1], rtol=0, atol=1e-13 * scale)


@pytest.mark.parametrize("seed", range(3))
def test_segments_are_the_cubics_of_equation_8(seed):
    P, s, tau, gamma, beta = data(seed, dimension=2)
    incoming, outgoing = tcb_tangents(P, s, tau, gamma, beta)
    curve = interpolate(P, "tcb", s, tension=tau, continuity=gamma, bias=beta)
    for k in range(len(P) - 1):
        step = s[k + 1] - s[k]
        u = np.linspace(0.01, 0.99, 25)[:, None]
        C = 3 * (P[k + 1] - P[k]) - step * (2 * outgoing[k] + incoming[k + 1])
        D = -2 * (P[k + 1] - P[k]) + step * (outgoing[k] + incoming[k + 1])
        want = P[k] + u * step * outgoing[k] + u**2 * C + u**3 * D
        np.testing.assert_allclose(curve(s[k] + u[:, 0] * step), want, rtol=0, atol=1e-14 * max(1, np.abs(want).max()))


@pytest.mark.parametrize("seed", range(5))
def test_it_is_c1_where_the_continuity_is_0_and_only_there(seed):
    P, s, tau, gamma, beta = data(seed)
    gamma[::2] = 0.0
    curve = interpolate(P, "tcb", s, tension=tau, continuity=gamma, bias=beta)
    incoming, outgoing = sides(curve, s)
    jump = np.linalg.norm(outgoing[1:] - incoming[:-1], axis=1)
    smooth = gamma[1:-1] == 0.0
    assert jump[smooth].max() <= 1e-13 * np.linalg.norm(outgoing, axis=1).max()
    assert jump[~smooth].min() > 1e-3
    multiplicity = [np.count_nonzero(curve.knots == k) for k in s[1:-1]]
    np.testing.assert_array_equal(multiplicity, np.where(smooth, 2, 3))


@pytest.mark.parametrize("seed", range(5))
def test_speeds_are_equal_with_18_and_scaled_by_19_and_22(seed):
    P, s, tau, gamma, beta = data(seed)
    speed = np.random.default_rng(seed).uniform(0.2, 3.0, len(P))
    plain_in, plain_out = exact_tangents(P, s, tau, gamma, beta)
    i, o = np.linalg.norm(plain_in, axis=1), np.linalg.norm(plain_out, axis=1)
    for factor in (1.0, speed):
        got_in, got_out = equal_speeds(*tcb_tangents(P, s, tau, gamma, beta), factor)
        scale = np.linalg.norm(got_out, axis=1).max()
        a, b = np.linalg.norm(got_in, axis=1), np.linalg.norm(got_out, axis=1)
        assert np.abs(a - b).max() <= 1e-14 * scale
        inner = slice(1, -1)
        lam = np.broadcast_to(factor, len(P))
        common = (2 * lam / (i + o))[inner, None]
        np.testing.assert_allclose(got_in[inner], common * o[inner, None] * plain_in[inner], atol=1e-14 * scale)
        np.testing.assert_allclose(got_out[inner], common * i[inner, None] * plain_out[inner], atol=1e-14 * scale)
        np.testing.assert_allclose(got_out[0], lam[0] * plain_out[0], atol=1e-14 * scale)  # 22
        np.testing.assert_allclose(got_in[-1], lam[-1] * plain_in[-1], atol=1e-14 * scale)
    curve = interpolate(P, "tcb-equal-speed", s, tension=tau, continuity=gamma, bias=beta, speed=speed)
    incoming, outgoing = sides(curve, s)
    jumps = np.linalg.norm(incoming[:-1], axis=1) - np.linalg.norm(outgoing[1:], axis=1)
    assert np.abs(jumps).max() <= 1e-13 * scale


def test_equal_speed_at_a_vanishing_tangent_is_zero_and_finite():
    P = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 1.0], [3.0, 0.0]])
    incoming, outgoing = equal_speeds(*tcb_tangents(P, np.arange(4.0), tension=[0.0, 1.0, 0.0, 0.0]))
    assert not incoming[1].any()
    assert not outgoing[1].any()
    one_sided = tcb_tangents(P, np.arange(4.0), continuity=[0.0, 1.0, 0.0, 0.0], bias=[0.0, -1.0, 0.0, 0.0])
    assert one_sided[0][1].any()
    assert not one_sided[1][1].any()
    assert not np.any(equal_speeds(*one_sided)[0][1])
    assert np.isfinite(interpolate(P, "tcb-equal-speed", np.arange(4.0), tension=1.0)(np.linspace(0, 3, 30))).all()


def test_catmull_rom_is_recovered_at_unit_steps():
    """With no tension, continuity and bias, and the end tangents of the other scheme's convention."""
    P = data(3)[0]
    s = np.arange(len(P), dtype=float)
    ends = {"start_tangent": P[1] - P[0], "end_tangent": P[-1] - P[-2]}
    a, b = interpolate(P, "tcb", s, **ends), interpolate(P, "catmull-rom", s)
    np.testing.assert_allclose(a.control_points, b.control_points, atol=1e-15)
    np.testing.assert_allclose(a(s[1:-1], 1), (P[2:] - P[:-2]) / 2, atol=1e-14)
    np.testing.assert_allclose(interpolate(P, "tcb", s)(s[0], 1), (P[1] - P[0]) / 2, atol=1e-14)  # 20


@pytest.mark.parametrize("parameters", ["uniform", "centripetal", "chord"])
def test_catmull_rom_is_the_pyramid_of_barry_and_goldman(parameters):
    from patchwright.models.interpolation import parametrize

    P = data(4)[0]
    t = parametrize(P, parameters)
    curve = interpolate(P, "catmull-rom", parameters)
    for k in range(1, len(P) - 2):
        u = np.linspace(t[k], t[k + 1], 9)[:, None]
        A = [((t[j + 1] - u) * P[j] + (u - t[j]) * P[j + 1]) / (t[j + 1] - t[j]) for j in (k - 1, k, k + 1)]
        B = [((t[j + 2] - u) * a + (u - t[j]) * b) / (t[j + 2] - t[j])
             for j, a, b in ((k - 1, A[0], A[1]), (k, A[1], A[2]))]  # fmt: skip
        want = ((t[k + 1] - u) * B[0] + (u - t[k]) * B[1]) / (t[k + 1] - t[k])
        np.testing.assert_allclose(curve(u[:, 0]), want, atol=1e-12)


def test_tension_1_makes_straight_segments_and_the_sign_of_bias_leans_the_tangent():
    P = data(5, dimension=2)[0]
    s = np.arange(len(P), dtype=float)
    tight = interpolate(P, "tcb", s, tension=1.0)
    u = np.linspace(0, 1, 11)[:, None]
    for k in range(len(P) - 1):
        on = tight(k + u[:, 0])
        across = np.cross(np.c_[on - P[k], u * 0], np.r_[P[k + 1] - P[k], 0])[:, 2]
        assert np.abs(across).max() <= 1e-14 * np.abs(P).max() ** 2
    out = tcb_tangents(P, s, bias=1.0)[1]
    np.testing.assert_allclose(out[1:-1], P[1:-1] - P[:-2], atol=1e-15)
    out = tcb_tangents(P, s, bias=-1.0)[1]
    np.testing.assert_allclose(out[1:-1], P[2:] - P[1:-1], atol=1e-15)
