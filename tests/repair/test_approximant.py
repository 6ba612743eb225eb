"""The paper's C1 bicubic approximant: interpolation, continuity, convergence, twists."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models.errors import ParameterError
from patchwright.repair.patches.approximant import TWISTS, bicubic_approximant


def wavy(u, v):
    return np.stack([u, v, 0.15 * np.sin(2 * np.pi * u) * np.cos(np.pi * v) + 0.1 * u * v], axis=-1)


def grid(m, n):
    return wavy(*np.meshgrid(np.linspace(0, 1, m + 1), np.linspace(0, 1, n + 1), indexing="ij"))


@pytest.mark.parametrize("twist", sorted(TWISTS))
def test_interpolates_its_points_and_is_c1_across_every_knot(twist):
    surface = bicubic_approximant(grid(6, 4), twist=twist)
    assert surface.control_points.shape == (19, 13, 3)
    assert np.allclose(surface.grid(np.linspace(0, 1, 7), np.linspace(0, 1, 5)), grid(6, 4), atol=1e-14)
    v = np.linspace(0, 1, 23)
    for knot in np.arange(1, 6) / 6:
        below, above = surface(knot - 1e-9, v, nu=(1, 0)), surface(knot + 1e-9, v, nu=(1, 0))
        assert np.abs(below - above).max() < 1e-6


def inner_error(m, twist):
    surface = bicubic_approximant(grid(m, m), twist=twist)
    t = np.linspace(0.25, 0.75, 101)
    exact = wavy(*np.meshgrid(t, t, indexing="ij"))
    return np.abs(surface.grid(t, t) - exact).max()


def test_bessel_and_adini_twists_converge_faster_than_zero_twists():
    rates = {t: np.log2(inner_error(16, t) / inner_error(32, t)) for t in TWISTS}
    assert rates["zero"] > 1.8  # the zero twist errs by x_uv h^2 / 16
    assert rates["bessel"] > 2.8
    assert rates["adini"] > 2.8


@pytest.mark.parametrize("twist", ["adini", "bessel"])
def test_a_biquadratic_is_reproduced_away_from_the_zero_twist(twist):
    u, v = np.meshgrid(np.array([0, 0.2, 0.5, 0.7, 1.0]), np.array([0, 0.4, 0.6, 1.0]), indexing="ij")
    points = np.stack([u, v, u * v], axis=-1)
    surface = bicubic_approximant(points, u=u[:, 0], v=v[0], twist=twist)
    t = np.linspace(0, 1, 31)
    uu, vv = np.meshgrid(t, t, indexing="ij")
    assert np.allclose(surface.grid(t, t), np.stack([uu, vv, uu * vv], axis=-1), atol=1e-13)


def test_bad_input_is_refused():
    with pytest.raises(ParameterError, match="at least 2 x 2"):
        bicubic_approximant(np.zeros((1, 4, 3)))
    with pytest.raises(ParameterError, match="increasing"):
        bicubic_approximant(grid(2, 2), u=np.array([0, 0.5, 0.5]))
    with pytest.raises(ParameterError, match="known are adini, bessel, zero"):
        bicubic_approximant(grid(2, 2), twist="ribbon")
