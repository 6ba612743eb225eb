"""Surfaces through a grid of points."""

import numpy as np
import pytest

from patchwright.models import ParameterError
from patchwright.models.interpolation import SCHEMES, interpolate, interpolate_surface

LINEAR = [n for n in sorted(SCHEMES) if SCHEMES[n].linear and n != "c2-cubic-periodic"]


def grid(n=7, m=8, seed=0):
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.cumsum(rng.uniform(0.6, 1, n)), np.cumsum(rng.uniform(0.6, 1, m)), indexing="ij")
    return np.stack((x, y, rng.normal(size=(n, m))), axis=-1)


@pytest.mark.parametrize("name", [n for n in LINEAR if not SCHEMES[n].fixed and n != "quadratic-midpoint"])
def test_every_linear_scheme_gives_a_surface_through_the_points(name):
    P = grid()
    u, v = np.linspace(0, 2, 7) ** 1.3, np.linspace(1, 3, 8)
    S = interpolate_surface(P, name, (u, v))
    np.testing.assert_allclose(S.grid(u, v), P, atol=1e-12)
    row = interpolate(P[:, 3], name, u)
    t = np.linspace(*row.domain, 50)
    np.testing.assert_allclose(S.grid(t, v)[:, 3], row(t), atol=1e-11)


def test_two_schemes_and_the_order_of_directions():
    P = grid()
    S = interpolate_surface(P, ("c2-cubic", "quadratic-maxima"))
    assert S.degree == (3, 2)
    T = interpolate_surface(P.swapaxes(0, 1), ("quadratic-maxima", "c2-cubic"))
    u, v = np.linspace(0, 1, 20), np.linspace(0, 1, 21)
    np.testing.assert_allclose(S.grid(u, v), T.grid(v, u).swapaxes(0, 1), atol=1e-12)


def test_bicubics_are_reproduced():
    u, v = np.linspace(0, 1, 6), np.linspace(0, 1, 7) ** 1.2

    def f(u, v):
        return np.stack((u + 0 * v, v + 0 * u, (u**3 - u) * (2 * v**3 - v**2)), axis=-1)

    S = interpolate_surface(f(u[:, None], v[None]), "c2-cubic", (u, v))
    a, b = np.linspace(0, 1, 33), np.linspace(0, 1, 31)
    np.testing.assert_allclose(S.grid(a, b), f(a[:, None], b[None]), atol=1e-13)


def test_a_pole_is_left_out_of_the_common_parameters():
    """A hemisphere by meridians: its last row is one point."""
    polar, turn = np.linspace(0.5 * np.pi, 0.0, 7)[:, None], np.linspace(0, np.pi, 9)[None]
    P = np.stack((np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar) + 0 * turn), axis=-1)
    P[-1] = [0.0, 0.0, 1.0]
    S = interpolate_surface(P, "c2-cubic")
    on = S.grid(np.linspace(0, 1, 40), np.linspace(0, 1, 40))
    assert np.abs(np.linalg.norm(on, axis=-1) - 1.0).max() < 2e-3
    assert np.ptp(on[-1], axis=0).max() < 1e-14


@pytest.mark.parametrize("name", [n for n in sorted(SCHEMES) if not SCHEMES[n].linear])
def test_schemes_that_are_not_linear_are_refused(name):
    with pytest.raises(ParameterError, match="not linear"):
        interpolate_surface(grid(), name)


def test_bad_grids_give_one_clear_error():
    P = grid()
    with pytest.raises(ParameterError, match="shape"):
        interpolate_surface(P[0])
    bad = P.copy()
    bad[2, 3, 1] = np.nan
    with pytest.raises(ParameterError, match=r"point \(2, 3\) is not finite"):
        interpolate_surface(bad)
    same = P.copy()
    same[4, 5] = same[4, 4]
    with pytest.raises(ParameterError, match="along v, points 4 and 5 of curve 4 coincide"):
        interpolate_surface(same)
    with pytest.raises(ParameterError, match="zero length"):
        interpolate_surface(np.broadcast_to(P[:1], P.shape))
    with pytest.raises(ParameterError, match="no abscissa"):
        interpolate_surface(P, "c2-cubic", "abscissa")
