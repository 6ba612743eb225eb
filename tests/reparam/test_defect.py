"""The defect measure against closed forms, and four-sided regions of trimmed faces."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models import NurbsCurve, NurbsSurface, ParameterError, Plane
from patchwright.models.assembly import Part
from patchwright.models.knots import bezier_knots
from patchwright.models.triangulation import Triangulation
from patchwright.reparam import face_region, parametrisation_defect, reparametrize

NOTHING = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
SHEET = Plane([0, 0, 0], [0, 0, 1], u=(0.0, 4.0), v=(0.0, 4.0))


def squared(power: int) -> NurbsSurface:
    """(u^power, v, 0) on the unit square."""
    net = np.zeros((power + 1, 2, 3))
    net[-1, :, 0], net[:, 1, 1] = 1.0, 1.0
    return NurbsSurface((power, 1), (bezier_knots(power), bezier_knots(1)), net)


@pytest.mark.parametrize("power", [2, 3, 5])
def test_defect_of_powers(power: int) -> None:
    # the last of 33 steps has the share 1 - (32 / 33)^power where 1 / 33 is due
    assert parametrisation_defect(squared(power)) == pytest.approx(33 * (1 - (32 / 33) ** power) - 1, rel=1e-12)


def test_defect_does_not_see_place_size_order_or_even_boxes() -> None:
    bad = squared(3)
    moved = NurbsSurface(bad.degree, bad.knots, 1e3 * bad.control_points[..., ::-1] + 7.0)
    assert parametrisation_defect(moved) == pytest.approx(parametrisation_defect(bad), rel=1e-9)
    assert parametrisation_defect(bad.transposed()) == pytest.approx(parametrisation_defect(bad), rel=1e-12)
    assert parametrisation_defect(SHEET) < 1e-12
    # u^2 from a to b: steps 1 / 33 have shares from 2 a / (a + b) to 2 b / (a + b), less half a step
    a, b = 0.5, 0.8
    expected = (b * b - (b - (b - a) / 33) ** 2) / (b * b - a * a) * 33 - 1
    assert parametrisation_defect(squared(2), ((a, b), (0.0, 1.0))) == pytest.approx(expected, rel=1e-12)


def trimmed(corners: list[list[float]], bend: float = 0.0) -> Part:
    """A sheet between straight edges, the first bent aside."""
    at = np.array(corners, dtype=float)
    edges = []
    for k, (a, b) in enumerate(zip(at, np.roll(at, -1, axis=0), strict=True)):
        middle = 0.5 * (a + b) + np.array([0.0, bend if k == 0 else 0.0])
        edges.append(NurbsCurve(2, bezier_knots(2), np.array([a, middle, b])))
    return Part("sheet", NOTHING, SHEET, trims=(tuple(edges),))


def test_trimmed_face_runs_between_its_own_sides() -> None:
    part = trimmed([[1, 1], [3, 1], [3.5, 3], [0.5, 2]], bend=0.5)
    region = face_region(part)
    assert not region.whole
    south, north, west, east = region.sides
    ends = np.array([0.0, 1.0])
    assert south.points(ends)[:, :2] == pytest.approx(np.array([[1, 1], [3, 1]]), abs=1e-9)
    assert north.points(ends)[:, :2] == pytest.approx(np.array([[0.5, 2], [3.5, 3]]), abs=1e-9)
    assert west.points(ends)[:, :2] == pytest.approx(np.array([[1, 1], [0.5, 2]]), abs=1e-9)
    assert east.points(ends)[:, :2] == pytest.approx(np.array([[3, 1], [3.5, 3]]), abs=1e-9)
    made = reparametrize(region, 1e-3)
    assert made.converged
    assert np.abs(made.surface.control_points[..., 2]).max() < 1e-12  # still in the plane
    south_y = made.surface(0.5, 0.0)[1]
    assert south_y == pytest.approx(1.25, abs=2e-3)  # the middle of the parabola


def test_orientation_and_collinear_joints_do_not_matter() -> None:
    corners: list[list[float]] = [[1, 1], [3, 1], [3, 3], [1, 3]]
    joint = [*corners[:1], [2.0, 1.0], *corners[1:]]
    for loop in (corners, corners[::-1], joint):
        south = face_region(trimmed(loop)).sides[0].points(np.array([0.0, 0.5, 1.0]))
        assert south[:, :2] == pytest.approx(np.array([[1, 1], [2, 1], [3, 1]]), abs=1e-9)


def test_faces_that_have_not_four_sides() -> None:
    with pytest.raises(ParameterError, match="sheet: has 3 sides"):
        face_region(trimmed([[1, 1], [3, 1], [2, 3]]))
    with pytest.raises(ParameterError, match="5 corners"):
        face_region(trimmed([[1, 1], [3, 1], [3.5, 2], [2, 3.5], [0.5, 2]]))
    with pytest.raises(ParameterError, match="fewer than four corners"):
        face_region(trimmed([[1, 1], [2, 1], [3, 1], [2, 3]]))
    holed = trimmed([[1, 1], [3, 1], [3, 3], [1, 3]])
    holes = Part("sheet", NOTHING, SHEET, trims=(holed.trims[0], holed.trims[0]))  # type: ignore[index]
    with pytest.raises(ParameterError, match="has 1 holes"):
        face_region(holes)
    with pytest.raises(ParameterError, match="no surface"):
        face_region(Part("mesh", Triangulation(np.eye(3), np.array([[0, 1, 2]]))))
