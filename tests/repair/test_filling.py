"""Gap filling: exact on what the spline holds, no chasing of noise, and a defined result where data are too few."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models.errors import ParameterError
from patchwright.repair.patches.filling import METHODS, FillStatus, fill

SIDE = 41


def band(width):
    u, v = np.meshgrid(np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE), indexing="ij")
    return np.abs(u - 0.5 + 0.1 * (v - 0.5)) >= width / 2


def wavy():
    u, v = np.meshgrid(np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE), indexing="ij")
    return 0.15 * np.sin(2 * np.pi * u) * np.cos(np.pi * v) + 0.1 * u * v


def test_the_smooth_fill_reproduces_a_linear_offset():
    u, v = np.meshgrid(np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE), indexing="ij")
    offsets, found = 0.3 * u - 0.7 * v + 0.2, band(0.3)
    filled, status = fill(np.where(found, offsets, np.nan), found)
    assert status is FillStatus.FILLED
    assert np.allclose(filled, offsets, atol=1e-9)


@pytest.mark.parametrize("method", sorted(METHODS))
def test_the_error_grows_with_the_gap_and_known_points_are_kept(method):
    errors = []
    for width in (0.05, 0.1, 0.2, 0.3):
        found = band(width)
        filled, _ = fill(np.where(found, wavy(), 0.0), found, method=method)
        assert np.array_equal(filled[found], wavy()[found])
        errors.append(np.abs(filled - wavy())[~found].max())
    assert errors == sorted(errors)
    assert errors[1] < 0.005  # the paper's method at K = 8, design notes section 6


def test_the_smooth_fill_beats_the_paper_and_does_not_amplify_noise():
    found = band(0.2)
    rng = np.random.default_rng(0)
    clean, _ = fill(np.where(found, wavy(), 0.0), found)
    paper, _ = fill(np.where(found, wavy(), 0.0), found, method="hardy")
    assert np.abs(clean - wavy()).max() < 0.25 * np.abs(paper - wavy()).max()
    for noise in (1e-4, 1e-3):
        data = wavy() + noise * rng.standard_normal(wavy().shape)
        filled, _ = fill(np.where(found, data, 0.0), found, noise=noise)
        assert np.abs(filled - wavy())[~found].max() < np.abs(clean - wavy())[~found].max() + 10 * noise


def test_a_gap_at_the_border_is_filled_and_scaling_scales():
    found = np.ones((SIDE, SIDE), dtype=bool)
    found[:6] = False
    one, _ = fill(np.where(found, wavy(), 0.0), found)
    thousand, _ = fill(np.where(found, 1e3 * wavy(), 0.0), found)
    assert np.isfinite(one).all()
    assert np.allclose(thousand, 1e3 * one, rtol=1e-9, atol=1e-9)


def test_too_few_and_none_have_a_defined_result():
    found = np.zeros((5, 5), dtype=bool)
    filled, status = fill(np.full((5, 5), np.nan), found)
    assert status is FillStatus.NONE_FOUND
    assert not filled.any()
    found[1, 1] = found[3, 3] = True
    filled, status = fill(np.where(found, 2.0, np.nan), found)
    assert status is FillStatus.TOO_FEW
    assert np.array_equal(filled, np.full((5, 5), 2.0))
    found[2, 2] = True  # three, but on one line
    assert fill(np.where(found, 2.0, np.nan), found)[1] is FillStatus.TOO_FEW


def test_an_unknown_method_is_refused():
    with pytest.raises(ParameterError, match="known are hardy, smooth"):
        fill(np.zeros((3, 3)), np.zeros((3, 3), dtype=bool), method="guess")


def test_smooth_fill_stays_near_its_data():
    # a steep slope known in a corner only: the plane through it would reach 7 times the data's spread
    u = np.linspace(0.0, 1.0, 17)
    offsets = np.broadcast_to(u[:, None], (17, 17)).copy()
    found = np.zeros((17, 17), dtype=bool)
    found[:3, :3] = True
    filled, _ = fill(offsets, found)
    spread = float(np.ptp(offsets[found]))
    assert filled.max() <= offsets[found].max() + spread * (1.0 + 1e-12)
    assert np.array_equal(filled[found], offsets[found])
