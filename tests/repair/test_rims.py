"""Gap, hole or opening: by what the surface does across the void, never by its width."""

from __future__ import annotations

import numpy as np
import pytest
from oracles_shells import blade, box, grid, hemisphere, merged, moved, soup, sphere, tube, without

from patchwright.models import Triangulation
from patchwright.models.io import read
from patchwright.repair.mender.rims import classify_rims


def kinds(t: Triangulation) -> list[str]:
    return sorted(rim.kind for rim in classify_rims(t))


@pytest.mark.parametrize("percent", [0.1, 1, 5, 10, 30])
def test_two_hemispheres_face_each_other_across_a_gap_of_any_width(percent: float) -> None:
    width = 2.0 * percent / 100.0
    rims = classify_rims(soup(hemisphere(True, width / 2), hemisphere(False, -width / 2)))
    assert [(rim.kind, rim.partner) for rim in rims] == [("gap", 1), ("gap", 0)]
    for rim in rims:
        assert rim.width == pytest.approx(width, rel=1e-9)
        assert rim.perimeter == pytest.approx(96 * np.sin(np.pi / 48), rel=1e-9)
        assert rim.planar < 1e-12


def test_the_gap_does_not_care_for_the_orientation_of_one_side() -> None:
    lower = hemisphere(False, -0.05)
    rims = classify_rims(soup(hemisphere(True, 0.05), Triangulation(lower.vertices, lower.triangles[:, ::-1])))
    assert [rim.kind for rim in rims] == ["gap", "gap"]


def test_hemispheres_pushed_into_each_other_overlap() -> None:
    rims = classify_rims(soup(hemisphere(True, -0.05), hemisphere(False, 0.05)))
    assert [(rim.kind, rim.overlaps) for rim in rims] == [("opening", 1), ("opening", 0)]
    assert rims[0].width == pytest.approx(0.1)


@pytest.mark.parametrize("length", [0.05, 0.5, 3.0, 30.0])
def test_a_tube_has_two_openings_however_short(length: float) -> None:
    assert kinds(tube(length)) == ["opening", "opening"]


@pytest.mark.parametrize("thickness", [0.12, 0.02, 0.002])
def test_the_ends_of_a_blade_are_openings_however_thin(thickness: float) -> None:
    assert kinds(blade(thickness)) == ["opening", "opening"]


@pytest.mark.parametrize("width", [0.01, 0.05, 0.2])
def test_a_slit_round_a_tube_is_a_gap_and_its_ends_stay_open(width: float) -> None:
    front, back = tube(3.0), tube(3.0)
    back = Triangulation(back.vertices + np.array([0, 0, 3.0 + width]), back.triangles)
    rims = classify_rims(soup(front, back))
    assert sorted(rim.kind for rim in rims) == ["gap", "gap", "opening", "opening"]
    assert [rim.width for rim in rims if rim.kind == "gap"] == pytest.approx([width, width])


def test_a_slit_in_a_plate_is_a_gap_with_itself() -> None:
    plate = grid(lambda u, v: np.stack([4 * u, v, 0 * u], -1), 40, 21)
    y = plate.corners[:, :, 1]
    x = plate.corners[:, :, 0]
    slit = (y.min(axis=1) > 9.5 / 21) & (y.max(axis=1) < 11.5 / 21) & (x.min(axis=1) > 0.95) & (x.max(axis=1) < 3.05)
    rims = classify_rims(without(plate, slit))
    inner = next(rim for rim in rims if rim.partner is not None)
    assert len(rims) == 2
    assert inner.kind == "gap"
    assert inner.partner == rims.index(inner)
    assert inner.width == pytest.approx(1 / 21, rel=0.3)
    assert next(rim for rim in rims if rim is not inner).kind == "opening"


def test_missing_triangles_are_holes() -> None:
    t = sphere(24)
    rims = classify_rims(without(t, np.array([100, 200, 300])))
    assert [rim.kind for rim in rims] == ["hole"] * 3
    assert all(len(rim.loop) == 3 for rim in rims)
    one = classify_rims(without(t, t.corners.mean(axis=1)[:, 0] > 0.93))
    assert [rim.kind for rim in one] == ["hole"]


def test_missing_corner_and_edge_of_a_box_are_holes() -> None:
    t = box()
    middle = t.corners.mean(axis=1)
    assert kinds(without(t, (middle > 0.66).sum(axis=1) == 3)) == ["hole"]
    strip = (middle[:, 0] > 0.8) & (middle[:, 1] > 0.8) & (np.abs(middle[:, 2] - 0.5) < 0.3)
    assert kinds(without(t, strip)) == ["hole"]


@pytest.mark.parametrize("cells", [1, 6])
def test_a_box_without_a_face_has_an_opening(cells: int) -> None:
    rims = classify_rims(box((cells,) * 6, skip=(1,)))
    assert [rim.kind for rim in rims] == ["opening"]
    assert rims[0].perimeter == pytest.approx(4.0)


def test_a_sheet_and_a_single_triangle_have_a_border() -> None:
    assert kinds(grid(lambda u, v: np.stack([u, v, 0.1 * np.sin(3 * u)], -1), 8, 8)) == ["opening"]
    assert kinds(Triangulation(np.eye(3), np.array([[0, 1, 2]]))) == ["opening"]
    assert classify_rims(sphere(12)) == ()


def test_saw_teeth_do_not_make_a_slit_of_a_tubes_end() -> None:
    t = tube(3.0, n=48, m=6)
    top = t.corners[:, :, 2].max(axis=1) > 2.99
    teeth = top & (np.isclose(t.corners[:, :, 2], 3.0).sum(axis=1) == 2)
    rims = classify_rims(without(t, teeth))
    assert len(rims) == 2
    assert [rim.kind for rim in rims] == ["opening", "opening"]


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_kinds_do_not_depend_on_size_and_place(scale: float) -> None:
    shells = [
        soup(hemisphere(True, 0.05), hemisphere(False, -0.05)),
        blade(0.02),
        without(sphere(24), np.array([5, 77])),
        box(skip=(0,)),
    ]
    for k, t in enumerate(shells):
        before, after = classify_rims(t), classify_rims(moved(t, scale, k))
        assert [rim.kind for rim in before] == [rim.kind for rim in after]
        assert [rim.width * scale for rim in before] == pytest.approx([rim.width for rim in after], rel=1e-6)


@pytest.mark.parametrize(
    ("name", "expected"), [("wigley_hull.stl.gz", ["opening"]), ("cgal_blade.off", ["opening", "opening"])]
)
def test_planned_openings_of_real_files(data, name: str, expected: list[str]) -> None:
    t = merged(read(data(name)).triangulation, 7)
    large = [rim.kind for rim in classify_rims(t) if rim.closed and rim.perimeter > 0.05 * t.diagonal]
    assert sorted(large) == expected
