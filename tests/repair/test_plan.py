"""Plans: what would be done, with ids that survive re-ordering; rejected items are left; revisions are compared."""

from __future__ import annotations

import json

import numpy as np
import pytest
from oracles_cad_damage import faces_of, pulled_back, rounded_box, written
from oracles_shells import box, sphere, tube, without

from patchwright.models import Assembly, Cylinder, NurbsSurface, Triangulation
from patchwright.models.errors import CorruptFile
from patchwright.models.io import read, write
from patchwright.models.samples.cube_sphere import cube_sphere_patches
from patchwright.repair import Plan, plan_repair, repair
from patchwright.repair.ladder import _task
from patchwright.repair.mender.mend import mend
from patchwright.repair.mesh_route import mending_ledger
from patchwright.repair.plan import compared
from patchwright.repair.result import Rung, Verdict

BALL = sphere(32)
HOLES = (40, 400, 700)


def holed(which: tuple[int, ...] = HOLES, noise: float = 0.0) -> Triangulation:
    move = noise * np.random.default_rng(0).normal(size=BALL.vertices.shape)
    return without(Triangulation(BALL.vertices + move, BALL.triangles), np.array(which))


def edited(plan: Plan, *rejected: str) -> Plan:
    """The plan as a reviewer hands it back."""
    table = json.loads(json.dumps(plan.to_json(), allow_nan=False))
    for item in table["items"]:
        item["accepted"] = item["id"] not in rejected
    return Plan.from_json(table)


def replayed(model: Triangulation, plan: Plan, openings: str = "keep"):
    task = _task(model, "least", openings, None, None, plan, None, lambda label, share: None)
    return mend(model, task.limits, openings=openings, decisions=task.decisions)


def at(k: int) -> np.ndarray:
    return BALL.corners[k].mean(axis=0)


def test_a_plan_lists_the_changes_with_places_and_changes_nothing() -> None:
    plan = plan_repair(holed())
    assert [(item.kind, item.rung, item.optional) for item in plan.items] == [("bridge", "bridge", True)] * 3
    for k in HOLES:
        assert min(np.linalg.norm(np.array(item.where) - at(k)) for item in plan.items) < 0.05
    assert plan_repair(BALL).items == ()


def test_ids_survive_re_ordering() -> None:
    t = holed()
    rng = np.random.default_rng(1)
    points = rng.permutation(len(t.vertices))
    shuffled = Triangulation(t.vertices[points], np.argsort(points)[t.triangles][rng.permutation(len(t))])
    assert {item.id for item in plan_repair(t).items} == {item.id for item in plan_repair(shuffled).items}


def test_a_plan_comes_back_from_json_as_it_was() -> None:
    plan = plan_repair(holed())
    again = edited(plan)
    assert again.items == plan.items
    assert again.diagonal == plan.diagonal


@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_a_rejected_bridge_stays_open_also_in_a_revised_model(noise: float) -> None:
    plan = plan_repair(holed())
    item = min(plan.items, key=lambda i: float(np.linalg.norm(np.array(i.where) - at(400))))
    mended = replayed(holed(noise=noise), edited(plan, item.id))
    (rim,) = mended.openings
    assert np.linalg.norm(rim.mean(axis=0) - at(400)) < 0.05
    assert not mended.problems
    missing, unplanned = compared(plan, mending_ledger(mended), BALL.diagonal)
    assert missing == unplanned == (), "left out as decided is not missing"


def test_what_a_revision_changes_is_told() -> None:
    plan = plan_repair(holed())
    mended = replayed(holed((40, 400, 900)), plan)
    missing, unplanned = compared(plan, mending_ledger(mended), BALL.diagonal)
    assert [np.linalg.norm(np.array(i.where) - at(700)) < 0.05 for i in missing] == [True]
    assert [np.linalg.norm(np.array(e.where) - at(900)) < 0.05 for e in unplanned] == [True]


def test_one_of_two_closings_can_be_rejected() -> None:
    pipe = tube(3.0)
    plan = plan_repair(pipe, openings="close")
    assert [item.kind for item in plan.items] == ["close", "close"]
    top = max(plan.items, key=lambda i: i.where[2])
    mended = replayed(pipe, edited(plan, top.id), "close")
    (rim,) = mended.openings
    assert rim[:, 2] == pytest.approx(3.0)
    assert not mended.closed


def test_a_scrap_can_be_kept() -> None:
    corners = np.array([[3.0, 0, 0], [3.01, 0, 0], [3.0, 0.01, 0], [3.01, 0.01, 0]])
    scrap = Triangulation(corners, [[0, 1, 2], [2, 1, 3]])
    model = Triangulation(
        np.concatenate([BALL.vertices, scrap.vertices]),
        np.concatenate([BALL.triangles, scrap.triangles + len(BALL.vertices)]),
    )
    plan = plan_repair(model)
    (item,) = plan.items
    assert (item.kind, item.optional) == ("stray triangles", True)
    assert len(replayed(model, plan).triangulation) == len(BALL)
    assert len(replayed(model, edited(plan, item.id)).triangulation) == len(BALL) + 2


def test_one_of_two_caps_of_a_cad_model_can_be_rejected(tmp_path) -> None:
    write(tmp_path / "pipe.step", Assembly.of(Cylinder((0, 0, 0), (0, 0, 1), 1.0, v=(0.0, 2.0))))
    pipe = read(tmp_path / "pipe.step")
    plan = plan_repair(pipe, openings="close")
    assert [(item.rung, item.optional) for item in plan.items] == [("bridge", True)] * 2
    top = max(plan.items, key=lambda i: i.where[2])
    result = repair(pipe, openings="close", plan=edited(plan, top.id))
    left = [e for e in result.ledger if e.what.endswith("left out")]
    assert [(e.where[2], e.reason) for e in left] == [(pytest.approx(2.0), "the plan rejects it")]
    assert result.figures["openings kept"] == 1
    assert not any("not met" in e.what or "beside" in e.what for e in result.ledger)


def test_what_later_steps_stand_on_cannot_be_rejected() -> None:
    turned = Triangulation(BALL.vertices, BALL.triangles[:, ::-1])
    plan = plan_repair(turned)
    (item,) = plan.items
    assert (item.kind, item.optional) == ("orient", False)
    with pytest.raises(CorruptFile, match=f"{item.id}.*cannot be rejected"):
        edited(plan, item.id)


def test_a_plan_says_why_a_repair_would_be_refused() -> None:
    sheet = box((4,) * 6, skip=(1, 2, 3, 4, 5))
    assert [p.kind for p in plan_repair(sheet, openings="close").problems] == ["sheet"]


@pytest.mark.parametrize(
    "table", [None, [], {}, {"patchwright_plan": 9, "items": []}, {"patchwright_plan": 1, "items": [{}]}]
)
def test_what_is_no_plan_is_told(table: object) -> None:
    with pytest.raises(CorruptFile, match="is no plan of patchwright"):
        Plan.from_json(table)


def apart(tmp_path):
    """The box of 10 x 6 x 4 whose top and one side were cut back along one edge each."""
    faces = [pulled_back(f, 0.05, 1) if k in (0, 3) else f for k, f in enumerate(faces_of(rounded_box()))]
    return read(written(tmp_path / "pulled.step", faces, {0, 3}))


def test_one_of_two_trims_of_a_cad_model_can_be_rejected(tmp_path) -> None:
    model = apart(tmp_path)
    plan = plan_repair(model)
    trims = [item for item in plan.items if item.rung == Rung.CUT.value]
    assert len(trims) == 2
    assert all(item.optional and item.size > 0.0 for item in trims)
    result = repair(model, plan=edited(plan, trims[0].id))
    assert result.verdict == Verdict.REPAIRED, result.problems
    left = [e for e in result.ledger if e.what.endswith("left out")]
    assert [(e.parts, e.reason) for e in left] == [(trims[0].parts, "the plan rejects it")]
    done = [e.parts for e in result.ledger if e.rung == Rung.CUT]
    assert done == [trims[1].parts]
    assert not result.figures["closed"]
    assert any(e.what == "gap left" and set(e.parts) & set(trims[0].parts) for e in result.ledger)
    assert not any("not met" in e.what or "beside" in e.what for e in result.ledger)


def test_seams_can_be_rejected_and_no_other_rung_takes_their_place(tmp_path) -> None:
    write(tmp_path / "sphere.step", Assembly.of([s for b in cube_sphere_patches(0.01).bodies for s in b.surfaces]))
    model = read(tmp_path / "sphere.step")
    plan = plan_repair(model)
    assert len(plan.items) == 12
    assert all(item.optional for item in plan.items)
    result = repair(model, plan=edited(plan, *(item.id for item in plan.items)))
    after = result.to_assembly()
    assert result.verdict == Verdict.CLEAN
    for old, new in zip(model.parts, after.parts, strict=True):
        assert np.array_equal(old.surface.control_points, new.surface.control_points)
    assert sum(e.what.endswith("left out") for e in result.ledger) == 12
    assert any(e.what == "gap left" for e in result.ledger)


def test_a_boundary_strip_can_be_rejected(tmp_path) -> None:
    # two curved sheets side by side, one a little higher: their borders neither cross nor touch
    knots = np.array([0.0, 0, 0, 1, 1, 1])
    x = np.array([0.0, 0.5, 1.0])
    net = np.stack([*np.meshgrid(x, x, indexing="ij"), 0.1 * np.outer(x - x**2, np.ones(3))], axis=2)
    beside = net + np.array([0.0, 1.0, 0.002])
    write(tmp_path / "sheets.step", Assembly.of([NurbsSurface((2, 2), (knots, knots), one) for one in (net, beside)]))
    model = read(tmp_path / "sheets.step")
    plan = plan_repair(model)
    (item,) = plan.items
    assert (item.rung, item.optional) == (Rung.STRIP.value, True)
    result = repair(model, plan=edited(plan, item.id))
    left = [e for e in result.ledger if e.what.endswith("left out")]
    assert [(e.parts, e.reason) for e in left] == [(item.parts, "the plan rejects it")]
    for old, new in zip(model.parts, result.to_assembly().parts, strict=True):
        assert np.array_equal(old.surface.control_points, new.surface.control_points)
