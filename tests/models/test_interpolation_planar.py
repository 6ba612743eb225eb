"""Planar schemes: the rational cubic Ball, Pollock's curve, and the construction of Fadhel and Omar."""

import itertools

import numpy as np
import pytest

from patchwright.models import NurbsCurve, ParameterError
from patchwright.models.interpolation import interpolate, interpolated
from patchwright.models.interpolation.geometric_bezier import inner_points

W = np.stack((np.array([-3.5, -1.5, 0.9, 4.2, 7.0]), np.sin([-3.5, -1.5, 0.9, 4.2, 7.0])), axis=1)


def ball(t, h, f0, f1, d0, d1, alpha, beta, gamma):
    """The rational cubic in Ball form, as it is written."""
    top = (
        alpha * f0 * (1 - t) ** 2
        + (gamma * f0 + alpha * h * d0) * t * (1 - t) ** 2
        + (gamma * f1 - beta * h * d1) * t**2 * (1 - t)
        + beta * f1 * t**2
    )
    return top / (alpha * (1 - t) ** 2 + gamma * t * (1 - t) + beta * t**2)


@pytest.mark.parametrize(("alpha", "beta", "gamma"), [(1, 1, 2), (1, 1, 0.3), (4, 0.25, 1.5), (0.5, 2.0, 30.0)])
def test_the_ball_form_is_what_the_curve_is(alpha, beta, gamma):
    curve = interpolate(W, "rational-ball", alpha=alpha, beta=beta, gamma=gamma)
    slopes = [p(p.domain[0], 1)[1] for p in curve.bezier_pieces()] + [curve(W[-1, 0], 1)[1]]
    for k in range(4):
        h = W[k + 1, 0] - W[k, 0]
        t = np.linspace(0, 1, 21)
        on = curve(W[k, 0] + h * t)
        np.testing.assert_allclose(on[:, 0], W[k, 0] + h * t, atol=1e-13)
        want = ball(t, h, W[k, 1], W[k + 1, 1], slopes[k], slopes[k + 1], alpha, beta, gamma)
        np.testing.assert_allclose(on[:, 1], want, atol=1e-13)


def test_gamma_2_is_the_cubic_hermite_interpolant():
    from scipy.interpolate import CubicHermiteSpline

    curve = interpolate(W, "rational-ball", gamma=2.0)
    slopes = curve(W[:, 0], 1)[:, 1]
    x = np.linspace(W[0, 0], W[-1, 0], 301)
    np.testing.assert_allclose(curve(x)[:, 1], CubicHermiteSpline(*W.T, slopes)(x), atol=1e-13)


def test_the_default_gamma_keeps_steep_monotone_data_monotone_where_2_does_not():
    x = np.arange(6.0)
    P = np.stack((x, [0.0, 0.01, 0.02, 5.0, 5.01, 5.02]), axis=1)
    at = np.linspace(0, 5, 5001)
    assert np.diff(interpolate(P, "rational-ball")(at)[:, 1]).min() >= 0.0
    assert np.diff(interpolate(P, "rational-ball", gamma=2.0)(at)[:, 1]).min() < -1e-4


def test_pollocks_curve_solves_the_vector_equations_of_c2_continuity():
    """p_1^k = 2 W_k - p_2^(k-1), p_2^k - p_1^(k-1) = 2 (p_1^k - p_2^(k-1)), and straight ends."""
    nets = [p.control_points for p in interpolate(W, "pollock").bezier_pieces()]
    for a, b, w in zip(nets[:-1], nets[1:], W[1:-1], strict=True):
        np.testing.assert_allclose(b[1], 2 * w - a[2], atol=1e-13)
        np.testing.assert_allclose(b[2] - a[1], 2 * (b[1] - a[2]), atol=1e-13)
    np.testing.assert_allclose(nets[0][0] - 2 * nets[0][1] + nets[0][2], 0, atol=1e-13)
    np.testing.assert_allclose(nets[-1][1] - 2 * nets[-1][2] + nets[-1][3], 0, atol=1e-13)


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def test_the_geometric_construction_keeps_the_conditions_of_its_steps():
    p1, p2, unreal = inner_points(W)
    chord = W[1] - W[0]
    tangent = W[2] - W[0]
    assert abs(cross(p2[0] - W[1], tangent)) <= 1e-13  # step 6: on the line of slope a_1 through W_1
    foot = abs(cross(W[1] - W[0], tangent)) / np.linalg.norm(tangent)
    rise = p2[0, 1] - (W[0, 1] + chord[1] / chord[0] * (p2[0, 0] - W[0, 0]))
    assert abs(rise) == pytest.approx(2 / 3 * foot, rel=1e-12)  # step 5
    np.testing.assert_allclose(p1[1:] - W[1:-1], W[1:-1] - p2[:-1], atol=1e-13)  # steps 8 and 12: C1
    for k in range(1, 4):  # steps 11 and 15: the length a C2 join would have, as far as the circle meets the line
        reach = np.linalg.norm(W[k] - p2[k - 1])
        met = np.linalg.norm(p2[k] - p1[k - 1])
        assert met == pytest.approx(4 * reach, rel=1e-12) or k in unreal
    assert abs(cross(p2[1] - p1[0], tangent)) <= 1e-12 * np.linalg.norm(p2[1] - p1[0]) * np.linalg.norm(tangent)
    for k in (2, 3):
        assert abs(cross(p2[k] - p1[k], W[k + 1] - p1[k])) <= 1e-12  # steps 10 and 14


def test_matching_lengths_alone_leaves_the_construction_c1():
    """The paper's proof of C2 compares lengths of vectors; their directions differ."""
    curve = interpolate(W, "c2gbp")
    pieces = curve.bezier_pieces()
    first = [np.linalg.norm(b(b.domain[0], 1) - a(a.domain[1], 1)) for a, b in itertools.pairwise(pieces)]
    second = [np.linalg.norm(b(b.domain[0], 2) - a(a.domain[1], 2)) for a, b in itertools.pairwise(pieces)]
    assert max(first) <= 1e-12
    assert max(second) > 0.1 * np.linalg.norm(pieces[0](pieces[0].domain[1], 2))


def test_a_step_without_a_real_root_is_told():
    x = np.array([-2.52, -1.13, -0.12, 1.23, 4.84])  # the paper's second problem
    made = interpolated(np.stack((x, (x**3 - 2) / (np.abs(x**3) + 1)), axis=1), "c2gbp")
    assert made.notes == ("step 15 has no real root in interval 3; the nearest point of its line was taken",)
    assert isinstance(made.curve, NurbsCurve)


def test_parallel_lines_are_refused():
    with pytest.raises(ParameterError, match="on a line"):
        interpolate([[0.0, 0.0], [1.0, 0.5], [2.0, 1.0], [3.0, 0.0]], "c2gbp")
