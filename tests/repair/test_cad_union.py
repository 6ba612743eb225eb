"""Overlapping CAD bodies: found however they overlap, united with known areas, left alone where they only touch."""

from __future__ import annotations

import numpy as np
import pytest
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from oracles_cad_solids import lofted_wing, stored

from patchwright.models.cad.seams import measure_seams
from patchwright.models.cad.status import brep_status
from patchwright.models.io import read, write
from patchwright.repair import diagnose, repair
from patchwright.repair.cad.bodies import closed_bodies
from patchwright.repair.cad.deadline import Deadline
from patchwright.repair.cad.face_steps import free_edges
from patchwright.repair.cad.union import united

BALL = 4.0


def box(size, at=(0.0, 0.0, 0.0)):
    return BRepPrimAPI_MakeBox(gp_Pnt(*at), *size).Shape()


def ball(radius, at=(0.0, 0.0, 0.0)):
    return BRepPrimAPI_MakeSphere(gp_Pnt(*at), radius).Shape()


def rod(radius, length, at):
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(*at), gp_Dir(0, 0, 1)), radius, length).Shape()


def joined(model):
    return united(model, diagnose(model), Deadline.after(600.0))


def area(model):
    return sum(part.triangulation.areas.sum() for part in model.parts)


@pytest.fixture
def model(tmp_path):
    return lambda *shapes: stored(tmp_path / "bodies.step", *shapes)


def test_half_a_ball_on_a_box(model):
    bodies = model(box((10, 10, 10)), ball(BALL, (10, 5, 5)))
    union = joined(bodies)
    assert len(closed_bodies(union.model)) == 1
    assert free_edges(union.model) == 0
    assert area(union.model) == pytest.approx(600.0 - np.pi * BALL**2 + 2 * np.pi * BALL**2, rel=2e-3)
    assert {entry.what for entry in union.entries} == {"bodies united", "surface inside other bodies dropped"}
    assert max(s.gap for s in measure_seams(union.model)) <= 1e-9 * bodies.diagonal


@pytest.mark.parametrize("shift", [2.5, 5.0])
def test_boxes_that_share_planes(model, shift):
    union = joined(model(box((10, 10, 10)), box((10, 10, 10), (shift, 0, 0))))
    assert area(union.model) == pytest.approx(2 * 100 + 4 * 10 * (10 + shift), rel=1e-12)
    assert len(closed_bodies(union.model)) == 1


def test_a_rod_through_a_box_leaves_its_middle_inside(model):
    union = joined(model(box((10, 10, 10)), rod(2.0, 30.0, (5, 5, -10))))
    outside = 600.0 - 2 * np.pi * 4.0 + 2 * np.pi * 4.0 + 2 * np.pi * 2.0 * 20.0
    assert area(union.model) == pytest.approx(outside, rel=2e-3)


def test_a_row_of_balls_and_a_body_apart(model):
    bodies = model(ball(5), ball(4, (6, 0, 0)), ball(3, (11, 0, 0)), box((1, 1, 1), (30, 0, 0)))
    union = joined(bodies)
    assert len(closed_bodies(union.model)) == 2
    caps = []
    for (r, x), (s, y) in (((5, 0), (4, 6)), ((4, 6), (3, 11))):
        plane = ((y - x) ** 2 + r * r - s * s) / (2 * (y - x))
        caps += [2 * np.pi * r * (r - plane), 2 * np.pi * s * (s - ((y - x) - plane))]
    assert area(union.model) == pytest.approx(4 * np.pi * (25 + 16 + 9) - sum(caps) + 6.0, rel=2e-3)
    names = [part.name for part in union.model.parts]
    assert set(names) == set(bodies.names)


def test_a_body_inside_another_is_told_and_dropped(model):
    bodies = model(box((10, 10, 10)), ball(2, (5, 5, 5)))
    (found,) = diagnose(bodies).of("overlap")
    assert "a body lies inside another" in found.message
    union = joined(bodies)
    assert len(union.model.parts) == 6
    assert area(union.model) == pytest.approx(600.0)


def slanted(radius, length, at):
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(*at), gp_Dir(1.0, 0.3, 0.2)), radius, length).Shape()


def ring():
    return BRepPrimAPI_MakeTorus(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 5.0, 1.5).Shape()


def fuselage():
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(-2.0, 0.0, 0.05), gp_Dir(1, 0, 0)), 0.36, 5.0).Shape()


CROSSING = {
    "rods": lambda: (rod(2.0, 20.0, (0, 0, -10)), slanted(1.2, 20.0, (-9, -3, -2))),
    "ring and rod": lambda: (ring(), slanted(1.0, 20.0, (-9, -3, -2))),
    "balls": lambda: (ball(5), ball(4, (6, 0, 0)), ball(3, (11, 0.5, 0))),
    "wing and fuselage": lambda: (fuselage(), lofted_wing()),
}


@pytest.mark.parametrize("name", CROSSING)
def test_bodies_meet_in_exact_curves_also_once_written(model, tmp_path, name):
    bodies = model(*CROSSING[name]())
    union = joined(bodies)
    assert union.made
    write(tmp_path / "united.step", union.model)
    again = read(tmp_path / "united.step")
    assert free_edges(again) == free_edges(union.model) == 0
    assert not set(brep_status(again).invalid)
    assert max(s.gap for s in measure_seams(again)) <= 1e-10 * bodies.diagonal


@pytest.mark.parametrize("at", [(10, 2, 2), (10, 0, 0), (10.001, 0, 0), (30, 0, 0)])
def test_bodies_that_touch_or_stand_apart_are_left(model, at):
    bodies = model(box((10, 10, 10)), box((5, 5, 5), at))
    assert not diagnose(bodies).of("overlap")
    assert joined(bodies).model is bodies


def test_repair_unites_and_says_so(model):
    bodies = model(box((10, 10, 10)), ball(BALL, (10, 5, 5)), rod(1.0, 8.0, (5, 5, 6)))
    result = repair(bodies)
    assert result.verdict == "repaired"
    assert "bodies united" in {entry.what for entry in result.ledger}
    assert {face.rung for face in result.faces} == {"keep", "re-trim"}
    assert result.figures["closed"]
    assert result.deviation is not None
    assert result.deviation.input_to_output.largest < 0.02, "what lies inside is not missed"
    assert not diagnose(result.to_assembly()).of("overlap")


def test_repair_unites_loose_faces_once_they_are_sewn(tmp_path):
    from oracles_cad_damage import faces_of

    loose = [*faces_of(box((10, 10, 10))), *faces_of(box((4, 4, 20), (3, 3, -5)))]
    result = repair(stored(tmp_path / "loose.step", *loose))
    assert result.verdict == "repaired"
    assert len(closed_bodies(result.to_assembly())) == 1
