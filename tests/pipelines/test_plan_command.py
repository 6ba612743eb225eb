"""`repair --dry-run`, `--plan`, `--reject` and the domain's options, as a user and a recipe give them."""

from __future__ import annotations

import json

import numpy as np
import pytest
from command_line import command
from oracles_shells import sphere, without

from patchwright.models import ParameterError
from patchwright.models.errors import CorruptFile
from patchwright.models.io import write
from patchwright.pipelines.domain_options import domain_of
from patchwright.pipelines.planning import load_plan, run_plan
from patchwright.pipelines.recipe import load_recipe, repair_recipe
from patchwright.repair import Domain

BALL = sphere(32)


@pytest.fixture
def holed(tmp_path):
    write(tmp_path / "ball.stl", without(BALL, np.array([40, 400])))
    return tmp_path / "ball.stl"


def test_a_dry_run_lists_items_and_writes_nothing_but_the_plan(holed, monkeypatch, capfd) -> None:
    plan = holed.with_name("plan.json")
    code, out, _ = command(monkeypatch, capfd, "repair", holed, "--dry-run", "--write-plan", plan)
    assert code == 0
    assert out.count("bridge-") == 2
    assert sorted(p.name for p in holed.parent.iterdir()) == ["ball.stl", "plan.json"]
    code, out, _ = command(monkeypatch, capfd, "repair", holed, "--dry-run", "--json")
    assert json.loads(out) == json.loads(plan.read_text())


def test_rejections_are_carried_into_the_next_dry_run(holed) -> None:
    file = holed.with_name("plan.json")
    made = run_plan(repair_recipe(holed, None), write=file)
    again = run_plan(repair_recipe(holed, None, plan=file, reject=(made.items[0].id,)))
    assert [item.accepted for item in again.items] == [False, True]
    assert load_plan(file, (made.items[1].id,)).rejected[0].id == made.items[1].id


def test_what_cannot_be_planned_is_told(holed, monkeypatch, capfd) -> None:
    file = holed.with_name("plan.json")
    run_plan(repair_recipe(holed, None), write=file)
    with pytest.raises(ParameterError, match="has no item nope"):
        load_plan(file, ("nope",))
    with pytest.raises(CorruptFile, match="no such plan"):
        load_plan(holed.with_name("none.json"))
    for words in (
        ("--write-plan", file),
        ("--reject", "x"),
        ("--plan", holed),
        ("--symmetry", "w"),
        ("--farfield", "hull"),
        ("--fluid", "1,2"),
        ("--opening", "1,2"),
        ("--gap", "keep"),
        ("--gap", "hull=keep"),
        ("--gap", "part=maybe"),
        ("--part-tolerance", "part=thin"),
        ("--part-tolerance", "part=-1"),
        ("--part-tolerance", "hull=1"),
    ):
        code, _, err = command(monkeypatch, capfd, "repair", holed, *words, "-o", holed.with_name("out"))
        assert code == 2, words
        assert "Traceback" not in err
    assert not holed.with_name("out").exists()


def test_a_recipe_holds_domain_and_plan(holed) -> None:
    recipe = holed.with_name("recipe.toml")
    text = 'source = "ball.stl"\nplan = "plan.json"\n[domain]\nsymmetry = "y"\ngaps.flap = "keep"\n'
    recipe.write_text(text + '[[stage]]\nname = "repair"\n')
    loaded = load_recipe(recipe)
    assert loaded.domain == Domain(symmetry=("y",), gaps={"flap": "keep"})
    assert loaded.plan == holed.with_name("plan.json")
    recipe.write_text('source = "ball.stl"\n[domain]\nfarfield = "x"\n[[stage]]\nname = "repair"\n')
    with pytest.raises(ParameterError, match=r"recipe\.toml: a domain has no farfield"):
        load_recipe(recipe)


def test_the_command_line_tells_the_whole_domain() -> None:
    made = domain_of(["room", ""], ["y"], "1,2,3", ["0,0,1", "0,0,-1"], ["flap=keep", "a=b=close"], ["a=b=1e-3"])
    assert made == Domain(
        far_field=("room",),
        symmetry=("y",),
        fluid=(1.0, 2.0, 3.0),
        openings=((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)),
        gaps={"flap": "keep", "a=b": "close"},
        tolerances={"a=b": 1e-3},
    )
    assert domain_of(None, None, None, None, None) is None
    assert domain_of([""], None, None, None, None) == Domain(far_field=())


def test_check_takes_the_domain_too(holed, monkeypatch, capfd) -> None:
    half = BALL.take(BALL.corners.mean(axis=1)[:, 2] > 0).compact()
    write(holed, half)
    assert command(monkeypatch, capfd, "check", holed, "--quiet")[0] == 1
    code, out, _ = command(monkeypatch, capfd, "check", holed, "--symmetry", "z", "--quiet")
    assert code == 0
    assert "z = 0 is a symmetry plane" in out
