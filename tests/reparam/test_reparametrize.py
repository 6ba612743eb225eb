"""`reparametrize`: within the tolerance, at even speed, without folds; neighbours stay joined."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from reparam_shapes import clustered_wing, crowded_bicubic, distance, normal_turns, octant, size

from patchwright.models import Cylinder, NurbsSurface, Plane
from patchwright.models.errors import ParameterError
from patchwright.models.knots import bezier_knots
from patchwright.models.samples import poor_parametrisation
from patchwright.reparam import parametrisation_defect, reparametrize

SHAPES: dict[str, Callable[[], NurbsSurface]] = {
    "crowded": crowded_bicubic,
    "wing": clustered_wing,
    "octant": octant,
}


@pytest.mark.parametrize(
    ("name", "share"),
    [("crowded", 1e-3), ("wing", 1e-3), ("octant", 1e-3), ("octant", 1e-5)]
    + [
        pytest.param(name, share, marks=pytest.mark.slow)
        for name, share in (("crowded", 1e-4), ("wing", 1e-4), ("octant", 1e-4), ("crowded", 1e-5), ("wing", 1e-5))
    ],
)
def test_within_the_tolerance_at_even_speed_without_folds(name: str, share: float) -> None:
    old = SHAPES[name]()
    tolerance = share * size(old)
    made = reparametrize(old, tolerance)
    # the fit looked at 5 samples a cell and direction, the deviation at 20; this searches the old surface anew
    assert distance(made.surface, old, 8) <= tolerance
    assert made.deviation <= tolerance
    assert made.converged
    assert made.least_sine > 0.1
    assert normal_turns(made.surface)[0] > 0.0
    before, after = parametrisation_defect(old), parametrisation_defect(made.surface)
    assert (made.defect_before, made.defect_after) == pytest.approx((before, after))
    assert after < 0.1 * before
    assert made.control_points_after == made.surface.control_points.shape[:2]


def test_fewer_points_for_a_wider_tolerance() -> None:
    counts = [np.prod(reparametrize(octant(), tolerance).control_points_after) for tolerance in (1e-2, 1e-3, 1e-5)]
    assert counts[0] < counts[1] < counts[2]
    # cubic interpolation: a hundredth of the error for 100^(1/4) = 3.2 times the knots a direction
    assert counts[2] < 3.2**2 * 1.5 * counts[1]


def test_even_speed_whatever_map_it_was_run_through_by() -> None:
    # poor_parametrisation keeps the shape, so that both surfaces have the same chord-length lines
    good, bad = (reparametrize(s, 1e-5).surface for s in (octant(), poor_parametrisation(octant(), 8.0)))
    t = np.linspace(0.0, 1.0, 21)
    assert np.abs(good.grid(t, t) - bad.grid(t, t)).max() < 2e-4


@pytest.mark.parametrize(("scale", "place"), [(1e-3, 1.0), (1e3, 100.0)])
def test_result_follows_scale_and_motion(scale: float, place: float) -> None:
    old, away = crowded_bicubic(), place * np.array([5.0, -3.0, 1.0])
    turn = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    moved = NurbsSurface(old.degree, old.knots, scale * (old.control_points @ turn.T + away))
    a, b = reparametrize(old, 5e-3), reparametrize(moved, 5e-3 * scale)
    t = np.linspace(0.0, 1.0, 15)
    back = (b.surface.grid(t, t) / scale - away) @ turn
    # the sites are the same ones; points 500 sizes away come with 1e-13 of round-off
    assert b.control_points_after == a.control_points_after
    assert np.abs(back - a.surface.grid(t, t)).max() < 1e-11
    assert b.defect_after == pytest.approx(a.defect_after, abs=1e-9)


def test_boundary_runs_at_the_speed_of_its_arc() -> None:
    made = reparametrize(octant(), 1e-5).surface
    angle = np.arctan2(*made(np.linspace(0, 1, 34), 0.0)[:, [1, 0]].T)
    assert np.abs(angle - np.linspace(0, np.pi / 2, 34)).max() < 1e-5


def test_pole_stays_one_point() -> None:
    made = reparametrize(octant(), 1e-5).surface
    assert np.ptp(made.control_points[:, -1], axis=0).max() == 0.0


def test_good_surface_is_left_as_it_is() -> None:
    sheet = Plane([0, 0, 0], [0, 0, 1], u=(0.0, 3.0), v=(0.0, 1.0))
    made = reparametrize(sheet, 1e-6)
    assert made.deviation == 0.0
    assert made.control_points_before == made.control_points_after == (2, 2)
    assert "left as it is" in made.notes[0]


def test_poor_plane_needs_no_more_than_one_span() -> None:
    sheet = poor_parametrisation(Plane([0, 0, 0], [0, 0, 1], u=(0.0, 3.0), v=(0.0, 1.0)).to_nurbs(), 10.0)
    made = reparametrize(sheet, 1e-5)
    assert made.defect_before > 5.0
    assert made.defect_after < 1e-2
    assert made.control_points_after == (4, 4)


def test_corner_lines_become_knots_of_full_multiplicity() -> None:
    x, z = np.array([0.0, 0.2, 0.7, 1.0]), np.array([0.0, 0.5, 0.1, 0.4])
    net = np.stack(np.broadcast_arrays(x[:, None], np.array([0.0, 1.0]), z[:, None] * np.array([1.0, 0.5])), axis=-1)
    folded_sheet = NurbsSurface((1, 1), ([0, 0, 1 / 3, 2 / 3, 1, 1], [0, 0, 1, 1]), net)
    made = reparametrize(folded_sheet, 1e-9)
    assert made.converged
    assert made.control_points_after == (10, 4)  # three blocks of one span: the corners are met exactly
    assert distance(made.surface, folded_sheet, 20) < 1e-12


def test_closed_surface_stays_closed() -> None:
    made = reparametrize(Cylinder([0, 0, 0], [0, 0, 1], 2.0, v=(0.0, 5.0)).to_nurbs(), 1e-4)
    assert made.converged
    net = made.surface.control_points
    assert (net[0] == net[-1]).all()


def test_neighbours_keep_one_boundary_curve() -> None:
    whole = crowded_bicubic()
    left, right = whole.split("u", 0.4)
    turned = right.reversed("u").reversed("v")  # runs the other way round: the shared side is its last, backwards
    made = reparametrize([left, turned], 1e-3)
    assert all(m.converged for m in made)
    mine, its = made[0].surface.boundary("u1"), made[1].surface.boundary("u1")
    assert (mine.control_points == its.control_points[::-1]).all()
    assert mine.knots == pytest.approx(1.0 - its.knots[::-1], abs=1e-15)


def test_ring_of_neighbours_shares_all_corners() -> None:
    pieces = [p for half in crowded_bicubic().split("u", 0.4) for p in half.split("v", 0.7)]
    made = [m.surface for m in reparametrize(pieces, 1e-2)]
    corners = [made[0].control_points[-1, -1], made[1].control_points[-1, 0]]
    corners += [made[2].control_points[0, -1], made[3].control_points[0, 0]]
    assert all((c == corners[0]).all() for c in corners)
    for a, b, one, other in ((0, 1, "v1", "v0"), (2, 3, "v1", "v0"), (0, 2, "u1", "u0"), (1, 3, "u1", "u0")):
        assert (made[a].boundary(one).control_points == made[b].boundary(other).control_points).all()  # type: ignore[arg-type]


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan, np.inf, "1", None])
def test_bad_tolerance(tolerance: float) -> None:
    with pytest.raises(ParameterError, match="tolerance must be a positive length"):
        reparametrize(octant(), tolerance)


def test_bad_surfaces() -> None:
    with pytest.raises(ParameterError, match="unbounded"):
        reparametrize(Plane([0, 0, 0], [0, 0, 1]), 1e-3)
    with pytest.raises(ParameterError, match="no surface"):
        reparametrize([], 1e-3)
    with pytest.raises(ParameterError, match="give a surface"):
        reparametrize(np.zeros((3, 3)), 1e-3)  # type: ignore[call-overload]
    flat = (bezier_knots(1), bezier_knots(1))
    with pytest.raises(ParameterError, match="single point"):
        reparametrize(NurbsSurface((1, 1), flat, np.ones((2, 2, 3))), 1e-3)
    line = np.zeros((2, 2, 3))
    line[1, :, 0] = 1.0
    with pytest.raises(ParameterError, match="a curve, not a surface"):
        reparametrize(NurbsSurface((1, 1), flat, line), 1e-3)
