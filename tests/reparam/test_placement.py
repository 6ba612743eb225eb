"""Placing inner points: both solvers find one minimum of E, stay in the domain, never fold."""

from __future__ import annotations

import numpy as np
import pytest
from reparam_shapes import crowded_bicubic, octant

from patchwright.models import NurbsSurface
from patchwright.models.errors import ParameterError
from patchwright.models.knots import bezier_knots
from patchwright.reparam.folds import corner_areas
from patchwright.reparam.penalty import penalty, residuals, step_shares
from patchwright.reparam.placement import Status, place
from patchwright.reparam.placement_queue import place_by_queue
from patchwright.reparam.region import Region
from patchwright.reparam.start_grid import start_grid


def grid(surface: NurbsSurface, count: int) -> tuple[np.ndarray, np.ndarray]:
    x = np.linspace(0.0, 1.0, count + 1)
    return start_grid(*(side.uv(x) for side in Region.of_surface(surface).sides)), x


@pytest.mark.parametrize("count", [5, 8, 12])
def test_queue_and_newton_agree(count: int) -> None:
    surface = crowded_bicubic()
    uv, x = grid(surface, count)
    fast, queue = place(surface, uv, x, x), place_by_queue(surface, uv, x, x)
    assert fast.status is queue.status is Status.CONVERGED
    assert np.abs(fast.uv - queue.uv).max() < 1e-6
    assert fast.penalty < 1e-20
    assert queue.penalty < 1e-14


def test_they_agree_where_the_penalty_cannot_vanish() -> None:
    # steps that do not suit the sides: the border is held at equal arcs, the parameters ask for others
    surface = crowded_bicubic()
    uv, x = grid(surface, 5)
    s = x**1.2
    fast, queue = place(surface, uv, s, s), place_by_queue(surface, uv, s, s, still=1e-9)
    assert fast.penalty == pytest.approx(queue.penalty, abs=1e-6)
    assert fast.penalty <= queue.penalty * (1.0 + 1e-6)


def test_both_stay_upright_and_inside() -> None:
    surface = crowded_bicubic()
    uv, x = grid(surface, 10)
    for placed in (place(surface, uv, x, x), place_by_queue(surface, uv, x, x, most=2000)):
        assert (corner_areas(placed.uv) > 0.0).all()
        assert placed.uv.min() >= 0.0
        assert placed.uv.max() <= 1.0
        assert (placed.uv[0] == uv[0]).all()
        assert placed.penalty < penalty(surface(uv[..., 0], uv[..., 1]), x, x)


def test_octant_has_its_latitudes_and_longitudes() -> None:
    surface = octant()
    x = np.linspace(0.0, 1.0, 12)
    sides = Region.of_surface(surface).sides
    south, west = sides[0].uv(x), sides[2].uv(x)
    # the pole has no lengths of its own: give it the longitudes of the south side
    uv = start_grid(south, south + np.array([0.0, 1.0]), west, west + np.array([1.0, 0.0]))
    placed = place(surface, uv, x, x)
    points = surface(placed.uv[..., 0], placed.uv[..., 1])
    angle = x * np.pi / 2
    exact = np.stack(
        np.broadcast_arrays(
            np.cos(angle)[:, None] * np.cos(angle), np.sin(angle)[:, None] * np.cos(angle), np.sin(angle)
        ),
        axis=-1,
    )
    assert np.abs(points - exact).max() < 1e-8


def test_residual_slopes_are_derivatives() -> None:
    rng = np.random.default_rng(1)
    points, share = rng.normal(size=(5, 1, 3)), step_shares(np.array([0.0, 1.0, 1.5, 3.0, 4.0]))
    base = residuals(points, share, 1.0)
    for k in range(5):
        for c in range(3):
            moved = points.copy()
            moved[k, 0, c] += 1e-6
            change = (residuals(moved, share, 1.0).r - base.r)[:, 0] / 1e-6
            exact = [base.slopes[k - i, i, 0, c] if 0 <= k - i <= 2 else 0.0 for i in range(3)]
            assert change == pytest.approx(exact, abs=1e-5)


def test_curved_sides_start_without_folds_or_say_so() -> None:
    t = np.linspace(0.0, 1.0, 21)
    bump = 0.6 * np.sin(np.pi * t)
    south, north = np.stack((t, bump), axis=1), np.stack((t, 1.0 + 0.2 * bump), axis=1)
    west, east = np.stack((0.0 * t, t), axis=1), np.stack((1.0 + 0.0 * t, t), axis=1)
    assert (corner_areas(start_grid(south, north, west, east)) > 0.0).all()
    crossing = np.stack((t, 2.0 * bump), axis=1)
    with pytest.raises(ParameterError, match="without folds"):
        start_grid(crossing, np.stack((t, 1.0 + 0.0 * t), axis=1), west, east)
    with pytest.raises(ParameterError, match="clockwise"):
        start_grid(north, south, west[::-1], east[::-1])


def test_sheet_of_parallel_lines_is_exact() -> None:
    net = np.zeros((3, 2, 3))
    net[:, :, 0] = np.array([0.0, 0.9, 1.0])[:, None]
    net[:, :, 1] = np.array([0.0, 1.0])
    surface = NurbsSurface((2, 1), (bezier_knots(2), bezier_knots(1)), net)
    uv, x = grid(surface, 7)
    placed = place(surface, uv, x, x)
    assert surface(placed.uv[..., 0], placed.uv[..., 1])[..., 0] == pytest.approx(np.broadcast_to(x[:, None], (8, 8)))
