"""Parameters of data points: their definitions, what they are invariant to, and bad input."""

import numpy as np
import pytest

from patchwright.models import ParameterError
from patchwright.models.interpolation import parametrize

P = np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0], [3.0, 4.0, 2.0], [4.0, 6.0, 4.0], [4.0, 6.0, 20.0]])
CHORDS = np.array([5.0, 2.0, 3.0, 16.0])


@pytest.mark.parametrize(
    ("wanted", "steps"),
    [
        ("uniform", np.ones(4)),
        ("chord", CHORDS),
        ("centripetal", np.sqrt(CHORDS)),
        (0.75, CHORDS**0.75),
        (0, np.ones(4)),
        (1.0, CHORDS),
    ],
)
def test_steps_are_powers_of_the_chord_length(wanted, steps):
    t = parametrize(P, wanted)
    np.testing.assert_allclose(np.diff(t), steps / steps.sum(), rtol=1e-14)
    assert (t[0], t[-1]) == (0.0, 1.0)


def foley_nielson(points):
    """The formula point by point, in the metric of the pseudo-inverse covariance."""
    G = np.linalg.pinv(np.cov(points.T, bias=True), rcond=1e-10, hermitian=True)
    n = len(points) - 1

    def dot(a, b):
        return a @ G @ b

    D = [np.sqrt(dot(points[i + 1] - points[i], points[i + 1] - points[i])) for i in range(n)]

    def size(i):
        return D[i] if 0 <= i < n else 0.0

    turn = [0.0] * (n + 1)
    for i in range(1, n):
        a, b = points[i - 1] - points[i], points[i + 1] - points[i]
        turn[i] = min(np.pi - np.arccos(dot(a, b) / np.sqrt(dot(a, a) * dot(b, b))), np.pi / 2)
    steps = []
    for i in range(n):
        before = 1.5 * turn[i] * size(i - 1) / (size(i - 1) + D[i])
        after = 1.5 * turn[i + 1] * size(i + 1) / (D[i] + size(i + 1))
        steps.append(D[i] * (1 + before + after))
    return np.concatenate(([0], np.cumsum(steps))) / np.sum(steps)


@pytest.mark.parametrize("planar", [False, True])
def test_foley_nielson_agrees_with_its_formula(planar):
    points = np.random.default_rng(1).normal(size=(9, 3))
    if planar:
        points[:, 2] = 0.3 * points[:, 0] - points[:, 1] + 2.0
    np.testing.assert_allclose(parametrize(points, "foley-nielson"), foley_nielson(points), atol=1e-13)


def test_foley_nielson_is_the_same_after_any_affine_map_and_chord_length_is_not():
    rng = np.random.default_rng(2)
    points = rng.normal(size=(9, 3))
    mapped = points @ rng.normal(size=(3, 3)) + 5.0
    np.testing.assert_allclose(parametrize(mapped, "foley-nielson"), parametrize(points, "foley-nielson"), atol=1e-12)
    assert np.abs(parametrize(mapped, "chord") - parametrize(points, "chord")).max() > 1e-2


def test_collinear_points_have_foley_nielson_parameters_of_their_chords():
    line = np.outer([0.0, 1.0, 1.5, 4.0], [1.0, 2.0, -1.0]) + 7.0
    np.testing.assert_allclose(parametrize(line, "foley-nielson"), [0, 0.25, 0.375, 1], atol=1e-14)


@pytest.mark.parametrize("wanted", ["uniform", "chord", "centripetal", "foley-nielson", 0.3])
@pytest.mark.parametrize("scale", [1e-200, 1e-3, 1e3, 1e200])
def test_scale_does_not_matter(wanted, scale):
    np.testing.assert_allclose(parametrize(P * scale, wanted), parametrize(P, wanted), atol=1e-13)


@pytest.mark.parametrize("wanted", ["uniform", "chord", "centripetal", "foley-nielson"])
def test_running_backwards_mirrors_the_parameters(wanted):
    np.testing.assert_allclose(parametrize(P[::-1], wanted), 1.0 - parametrize(P, wanted)[::-1], atol=1e-14)


def test_given_parameters_and_the_abscissa_are_kept():
    given = [2.0, 3.0, 7.0, 8.0, 9.5]
    np.testing.assert_array_equal(parametrize(P, given), given)
    sorted_x = P.copy()
    sorted_x[:, 0] = given
    np.testing.assert_array_equal(parametrize(sorted_x, "abscissa"), given)


@pytest.mark.parametrize(
    ("wanted", "sentence"),
    [
        ("lee", "there are no parameters 'lee'"),
        (np.inf, "exponent"),
        (float("nan"), "exponent"),
        ([0, 1, 2], "5 points need as many parameters"),
        ([0, 1, 1, 2, 3], "must increase, but 1 is followed by 1 at 2"),
        ([0, 1, np.nan, 2, 3], "number 2 is not finite"),
        ("abscissa", "x must increase, but 3 is followed by 3"),
        (60.0, "too close"),
    ],
)
def test_bad_parameters_give_one_clear_error(wanted, sentence):
    with pytest.raises(ParameterError, match=sentence):
        parametrize(P, wanted)


def test_bad_points_give_one_clear_error():
    with pytest.raises(ParameterError, match="points 1 and 2 coincide"):
        parametrize([[0, 0], [1, 1], [1, 1]], "chord")
    with pytest.raises(ParameterError, match="point 1 is not finite"):
        parametrize([[0, 0], [np.nan, 1]], "uniform")
    with pytest.raises(ParameterError, match="rows of equal length"):
        parametrize([[0, 0], [1]], "chord")
    with pytest.raises(ParameterError, match="real numbers"):
        parametrize([["a", "b"], ["c", "d"]], "chord")
