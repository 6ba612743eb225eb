import numpy as np
import pytest
from scipy.special import ellipe

from patchwright.models import NurbsCurve, ParameterError
from patchwright.models.analytic.arc import circle
from patchwright.models.arc_length import ArcLength
from patchwright.models.knots import bezier_knots

CIRCLE = circle((0, 0, 0), (0, 0, 1), 1.0)


def ellipse(b: float) -> NurbsCurve:
    return NurbsCurve(2, CIRCLE.knots, CIRCLE.control_points * [1.0, b, 0.0], CIRCLE.weights)


@pytest.mark.parametrize("b", [1.0, 0.7, 0.3, 0.1, 1e-2, 1e-3, 1e-5])
def test_an_ellipse_has_the_length_of_the_elliptic_integral(b):
    assert ellipse(b).length() == pytest.approx(4 * ellipe(1 - b * b), rel=1e-12)


@pytest.mark.parametrize("accuracy", [1e-2, 1e-5, 1e-8, 1e-11])
def test_the_accuracy_asked_for_is_reached_with_no_more_work_than_needed(accuracy):
    want = 4 * ellipe(1 - 0.02**2)
    table = ArcLength.of(ellipse(0.02), accuracy)
    assert abs(table.total / want - 1) <= accuracy
    assert len(table.knots) <= len(ArcLength.of(ellipse(0.02), 1e-12).knots)


def test_a_parabola_has_its_closed_form():
    parabola = NurbsCurve(2, bezier_knots(2), [[0.0, 0.0], [0.5, 0.0], [1.0, 1.0]])  # y = x^2
    want = 0.5 * np.sqrt(5) + 0.25 * np.arcsinh(2)
    assert parabola.length() == pytest.approx(want, rel=1e-14)
    x = 0.3
    part = 0.5 * x * np.sqrt(1 + 4 * x * x) + 0.25 * np.arcsinh(2 * x)
    assert parabola.length(0.0, x) == pytest.approx(part, rel=1e-14)
    assert parabola.length(1.0, x) == pytest.approx(part - want, rel=1e-14)


def test_a_cusp_keeps_the_accuracy():
    """(t^2, t^3) on [-1, 1] stands still at 0: length 2 (13^1.5 - 8) / 27, the cusp at no knot."""
    cubic = NurbsCurve(3, np.repeat([-0.9, 1.0], 4), np.zeros((4, 2)))
    t = np.linspace(-0.9, 1.0, 4)
    basis = np.stack([NurbsCurve(3, cubic.knots, np.eye(4))(x) for x in t])
    curve = NurbsCurve(3, cubic.knots, np.linalg.solve(basis, np.stack((t**2, t**3), axis=1)))
    want = ((4 + 9) ** 1.5 - 8) / 27 + ((4 + 9 * 0.81) ** 1.5 - 8) / 27
    assert curve.length() == pytest.approx(want, rel=1e-12)
    arc = ArcLength.of(curve)
    s = np.linspace(0, arc.total, 101)
    np.testing.assert_allclose(arc(arc.parameter(s)), s, rtol=0, atol=1e-12 * arc.total)


@pytest.mark.parametrize("b", [1.0, 0.1, 1e-3])
def test_the_inverse_inverts(b):
    arc = ArcLength.of(ellipse(b))
    s = np.concatenate((np.random.default_rng(0).random(500), [0.0, 1.0])) * arc.total
    t = arc.parameter(s)
    np.testing.assert_allclose(arc(t), s, rtol=0, atol=1e-12 * arc.total)
    assert t[-2:].tolist() == [*CIRCLE.domain]
    assert (np.diff(arc.parameter(np.sort(s))) >= 0).all()


def test_invariance_under_motion_scale_and_reversal():
    rng = np.random.default_rng(3)
    knots = np.concatenate((np.zeros(4), [0.2, 0.21, 0.8], np.ones(4)))
    c = NurbsCurve(3, knots, rng.normal(size=(7, 3)), rng.uniform(0.3, 3, 7))
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    for scale in (1e-3, 1.0, 1e3):
        moved = NurbsCurve(3, knots, scale * c.control_points @ turn.T + 7.0, c.weights)
        assert moved.length() == pytest.approx(scale * c.length(), rel=1e-11)
    assert c.reversed().length() == pytest.approx(c.length(), rel=1e-12)
    assert c.length(0.1, 0.5) + c.length(0.5, 0.9) == pytest.approx(c.length(0.1, 0.9), rel=1e-12)
    assert c.insert_knots([0.3, 0.5]).length() == pytest.approx(c.length(), rel=1e-12)
    assert c.length(0.4, 0.4) == 0


def test_a_curve_that_is_one_point_has_no_length():
    assert NurbsCurve(3, bezier_knots(3), np.ones((4, 3))).length() < 1e-15


def test_failures():
    with pytest.raises(ParameterError, match="accuracy"):
        ArcLength.of(CIRCLE, 0.0)
    with pytest.raises(ParameterError, match="empty"):
        ArcLength.of(CIRCLE, 1e-9, (1.0, 1.0))
    arc = ArcLength.of(CIRCLE)
    with pytest.raises(ParameterError, match="outside"):
        arc.parameter(arc.total * 1.01)
    with pytest.raises(ParameterError, match="outside"):
        arc.parameter(-0.1)
    with pytest.raises(ParameterError, match="outside"):
        CIRCLE.length(0.0, 9.0)
