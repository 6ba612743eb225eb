"""Interpolation points of curves: fourth order, few where the curve is straight, none too many."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models import NurbsCurve, ParameterError
from patchwright.models.closest_point import closest_on_curve
from patchwright.models.knots import bezier_knots
from patchwright.reparam import approximate_curve
from patchwright.reparam.curve_sites import fewest_sites
from patchwright.reparam.reconciliation import reconciled


def quarter(x: np.ndarray) -> np.ndarray:
    """A quarter of the unit circle by its arc share."""
    return np.stack((np.cos(0.5 * np.pi * x), np.sin(0.5 * np.pi * x)), axis=-1)


def test_number_grows_with_the_fourth_root_of_the_tolerance() -> None:
    ends = np.array([0.0, 1.0])
    counts = np.array([len(fewest_sites(quarter, 10.0**-k, ends)) for k in (4, 6, 8, 10)])
    assert (counts[3] - 1) / (counts[2] - 1) == pytest.approx(100**0.25, rel=0.02)
    # |x''''| = (pi / 2)^4: an error of h^4 |x''''| / 384 inside, and at the ends, where four points have one cubic,
    # no more than that of Lagrange's, h^4 |x''''| / 24
    least, most = (0.5 * np.pi * (1e10 / c) ** 0.25 for c in (384, 24))
    assert least < counts[3] - 1 < most


def test_circle_gets_even_points_and_a_straight_line_four() -> None:
    sites = fewest_sites(quarter, 1e-7, np.array([0.0, 1.0]))
    assert np.diff(sites) == pytest.approx(1.0 / (len(sites) - 1), rel=0.02)
    line = fewest_sites(lambda x: x[:, None] * np.array([1.0, 2.0, 2.0]), 1e-12, np.array([0.0, 1.0]))
    assert line == pytest.approx(np.linspace(0.0, 1.0, 4), abs=1e-4)


def test_breaks_are_sites_and_corners_cost_nothing() -> None:
    corner = np.array([0.0, 0.3, 1.0])
    sites = fewest_sites(lambda x: np.stack((x, np.abs(x - 0.3)), axis=-1), 1e-12, corner)
    assert np.isin(corner, sites).all()
    assert len(sites) == 7


def test_curve_within_the_tolerance_over_its_arc() -> None:
    old = NurbsCurve(3, bezier_knots(3), [[0, 0, 0], [0.1, 2, 0], [0.2, -1, 1], [3, 0, 1]])
    made = approximate_curve(old, 1e-5)
    points = made.curve(np.linspace(0.0, 1.0, 40 * len(made.shares)))
    assert closest_on_curve(old, points).distance.max() <= 1e-5
    speed = np.linalg.norm(made.curve(np.linspace(0.0, 1.0, 200), 1), axis=1)
    assert speed == pytest.approx(speed.mean(), rel=5e-3)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan])
def test_bad_curves(tolerance: float) -> None:
    arc = NurbsCurve(2, bezier_knots(2), [[0, 0], [1, 0], [1, 1]])
    with pytest.raises(ParameterError, match="positive length"):
        approximate_curve(arc, tolerance)
    with pytest.raises(ParameterError, match="no length"):
        approximate_curve(NurbsCurve(1, bezier_knots(1), np.ones((2, 3))), 1e-3)
    with pytest.raises(ParameterError, match="corner"):
        approximate_curve(NurbsCurve(1, [0, 0, 0.5, 1, 1], [[0.0, 0], [1, 0], [1, 1]]), 1e-9)


def test_reconciled_sides() -> None:
    few, many = np.array([0.0, 0.52, 1.0]), np.array([0.0, 0.1, 0.2, 0.5, 1.0])
    assert reconciled(few, many).tolist() == many.tolist()  # 0.52 is 0.5: nearer than a quarter of its gap
    assert reconciled(many, np.array([0.0, 0.7, 1.0])).tolist() == [0.0, 0.1, 0.2, 0.5, 0.7, 1.0]
    assert reconciled(many, many).tolist() == many.tolist()
    assert reconciled(many, few, near=0.01).tolist() == [0.0, 0.1, 0.2, 0.5, 0.52, 1.0]
    turned = reconciled(1.0 - few[::-1], 1.0 - many[::-1])
    assert 1.0 - turned[::-1] == pytest.approx(reconciled(few, many))
