"""The front of `intersect`: every kind of input, trims, numbering, and points where three surfaces meet."""

import numpy as np
import pytest

from patchwright.models import Assembly, Cylinder, NurbsCurve, Part, Plane, Sphere, Triangulation
from patchwright.models.errors import ParameterError
from patchwright.ssi import intersect

NOTHING = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
FLOOR = Plane([0, 0, 0], [0, 0, 1], xdir=[1, 0, 0], u=(-3, 3), v=(-3, 3))
WALL = Plane([0, 0, 0], [0, 1, 0], xdir=[1, 0, 0], u=(-3, 3), v=(-3, 3))
SIDE = Plane([0.5, 0, 0], [1, 0, 0], xdir=[0, 1, 0], u=(-3, 3), v=(-3, 3))


def circle(radius, clockwise=False):
    """A circle about the origin of the (u, v) plane, from four exact arcs."""
    corner = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]], dtype=float)
    weights = np.array([1, np.sqrt(0.5)] * 4 + [1.0])
    knots = np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4], dtype=float)
    curve = NurbsCurve(2, knots, radius * corner, weights)
    return curve.reversed() if clockwise else curve


def square(half):
    return tuple(
        NurbsCurve(1, [0, 0, 1, 1], half * np.array([a, b], dtype=float))
        for a, b in (((-1, -1), (1, -1)), ((1, -1), (1, 1)), ((1, 1), (-1, 1)), ((-1, 1), (-1, -1)))
    )


def test_three_planes_meet_in_one_point():
    found = intersect(FLOOR, WALL, SIDE)
    crossings = [p for p in found.points if p.kind == "crossing"]
    assert len(crossings) == 1
    assert crossings[0].surfaces == (0, 1, 2)
    assert np.allclose(crossings[0].point, [0.5, 0.0, 0.0], atol=1e-12)
    assert sorted(c.surfaces for c in found.curves) == [(0, 1), (0, 2), (1, 2)]


def test_a_sphere_on_two_planes_gives_two_triple_points():
    found = intersect(FLOOR, WALL, Sphere([0, 0, 0], 1.25))
    places = sorted(p.point[0] for p in found.points if p.kind == "crossing")
    assert places == pytest.approx([-1.25, 1.25], abs=1e-12)


def test_trims_cut_a_line_at_square_and_hole():
    face = Part("floor", NOTHING, FLOOR, trims=(square(2.0), (circle(1.0, clockwise=True),)))
    found = intersect(face, WALL)
    ends = sorted(sorted(c.curve(np.array(c.curve.domain))[:, 0]) for c in found.curves)
    assert np.concatenate(ends) == pytest.approx([-2.0, -1.0, 1.0, 2.0], abs=1e-10)


def test_trims_leave_one_arc_of_a_loop_whole_where_the_loop_begins():
    # the circle of radius 1 begins at u = 0, inside the strip |v| < 1/2 that is kept
    strip = tuple(
        NurbsCurve(1, [0, 0, 1, 1], np.array([a, b]))
        for a, b in (
            ((-3.0, -0.5), (3.0, -0.5)),
            ((3.0, -0.5), (3.0, 0.5)),
            ((3.0, 0.5), (-3.0, 0.5)),
            ((-3.0, 0.5), (-3.0, -0.5)),
        )
    )
    tube = Cylinder([0, 0, -1], [0, 0, 1], 1.0, xdir=[1, 0, 0], v=(0, 2))
    found = intersect(Part("floor", NOTHING, FLOOR, trims=(strip,)), tube)
    lengths = [c.curve.length() for c in found.curves]
    assert lengths == pytest.approx([np.pi / 3, np.pi / 3], rel=1e-9)  # 2 asin(1/2) each
    assert not any(c.closed for c in found.curves)


def sheet(half, at=(0.0, 0.0, 0.0)):
    """A square of two triangles in the plane of the floor."""
    corners = np.array(at) + half * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    return Triangulation(corners, np.array([[0, 1, 2], [0, 2, 3]]))


HOLE = np.pi * 0.25
OVERLAPS = {
    "inside": (sheet(0.25, (0.7, 0.7, 0)), [0.25]),
    "the face itself": (sheet(1.0), [4.0 - HOLE]),
    "beyond the face": (sheet(1.4), [4.0 - HOLE]),
    "round the hole": (sheet(0.75), [2.25 - HOLE]),
    "across a corner": (sheet(0.5, (1.0, 1.0, 0)), [0.25]),
    "in the hole": (sheet(0.3), []),
    "outside": (sheet(0.5, (2.2, 0, 0)), []),
    "beside": (sheet(0.5, (1.5, 0, 0)), []),  # a common side, no area
}


@pytest.mark.parametrize("case", OVERLAPS)
def test_overlaps_are_cut_back_to_the_trims(case):
    """A mesh square in the plane of a face: the square of half-side 1 less a hole of radius 1/2."""
    mesh, area = OVERLAPS[case]
    face = Part("floor", NOTHING, FLOOR, trims=(square(1.0), (circle(0.5, clockwise=True),)))
    for found in (intersect(face, mesh), intersect(mesh, face)):
        assert found.complete
        assert [o.area for o in found.overlaps] == pytest.approx(area, rel=1e-12)
    for overlap in found.overlaps:
        for piece in overlap.boundary:
            assert np.abs(piece.curve(np.linspace(*piece.curve.domain, 9))[:, 2]).max() == 0.0


def test_an_overlap_cut_in_two():
    strip = Part("strip", NOTHING, FLOOR, trims=(square(1.0), (circle(0.5, clockwise=True),)))
    bar = Triangulation(
        np.array([[-2.0, -0.1, 0], [2, -0.1, 0], [2, 0.1, 0], [-2, 0.1, 0]]), np.array([[0, 1, 2], [0, 2, 3]])
    )
    found = intersect(strip, bar)
    # the bar less what the hole takes: 2 times the integral of sqrt(1/4 - y^2) over |y| < 1/10
    y = 0.1
    taken = 2.0 * (y * np.sqrt(0.25 - y * y) + 0.25 * np.arcsin(2.0 * y))
    assert found.complete
    assert [o.area for o in found.overlaps] == pytest.approx([0.2 - 0.5 * taken] * 2, rel=1e-12)


def test_contacts_outside_the_trims_are_dropped():
    face = Part("floor", NOTHING, FLOOR, trims=(square(1.0),))
    inside, outside = Sphere([0.5, 0.5, 1.0], 1.0), Sphere([1.5, 0.5, 1.0], 1.0)
    assert [p.kind for p in intersect(face, inside).points] == ["touch"]
    assert not intersect(face, outside).points


def test_parts_of_one_assembly_meet_only_when_it_is_alone():
    pair = Assembly((Part("floor", NOTHING, FLOOR), Part("wall", NOTHING, WALL)))
    assert [c.surfaces for c in intersect(pair).curves] == [(0, 1)]
    assert [c.surfaces for c in intersect(pair, SIDE).curves] == [(0, 2), (1, 2)]


def test_meshes_and_surfaces_mix():
    vertices = np.array([[-1.0, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]])
    sheet = Triangulation(vertices, np.array([[0, 1, 2], [0, 2, 3]]))
    for found in (intersect(FLOOR, sheet), intersect(sheet, FLOOR)):
        assert found.length == pytest.approx(2.0, rel=1e-9)
    assert intersect(FLOOR, sheet).curves[0].uv_a is not None
    assert intersect(sheet, FLOOR).curves[0].uv_a is None


def test_unbounded_surfaces_are_clipped_to_a_mesh():
    corners = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (0.0, 1.0)])
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    rows = [row for a, b, c, d in quads for row in ([a, b, c], [a, c, d])]
    box = Triangulation(corners, np.array(rows))
    for found in (intersect(box, Plane([0, 0, 0.25], [0, 0, 1])), intersect(Plane([0, 0, 0.25], [0, 0, 1]), box)):
        assert found.complete
        assert found.length == pytest.approx(8.0, rel=1e-14)
    tube = intersect(box, Cylinder([0.1, 0, 0.2], [0, 0, 1], 0.5))
    assert tube.complete
    assert [c.closed for c in tube.curves] == [True, True]
    assert tube.length == pytest.approx(2 * np.pi, rel=1e-9)  # two circles of radius 1/2


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan])
def test_a_tolerance_that_is_no_length_is_refused(bad):
    with pytest.raises(ParameterError, match="positive length"):
        intersect(FLOOR, WALL, tolerance=bad)


def test_what_cannot_meet_is_refused():
    with pytest.raises(ParameterError, match="input 2"):
        intersect(FLOOR, 3.0)
    with pytest.raises(ParameterError, match="no triangles"):
        intersect(FLOOR, NOTHING)
