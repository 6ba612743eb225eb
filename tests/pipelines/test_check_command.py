"""`patchwright check`: which files, what makes it fail, and the baseline that lets only new defects fail."""

from __future__ import annotations

import json

import numpy as np
import pytest
from command_line import command
from oracles_shells import box, moved, sphere, without

from patchwright.models import ParameterError, Triangulation
from patchwright.models.errors import CorruptFile
from patchwright.models.io import write
from patchwright.pipelines.check import FailOn, checked_json, files_of, run_check
from patchwright.pipelines.summary import checked_lines


def failing(path, fail_on: str = "warning", **options) -> list[str]:
    (result,) = run_check([str(path)], fail_on=FailOn.of(fail_on), **options)
    return [d.kind for d in result.failing]


def test_folders_and_globs_name_readable_files_once(tmp_path) -> None:
    (tmp_path / "in").mkdir()
    for name in ("b.stl", "a.off", "in/c.OBJ", "in/readme.txt"):
        (tmp_path / name).touch()
    inside = [p.relative_to(tmp_path).as_posix() for p in files_of([str(tmp_path)])]
    assert inside == ["a.off", "b.stl", "in/c.OBJ"]
    assert [p.name for p in files_of([f"{tmp_path}/*.stl", f"{tmp_path}/**/*"])] == ["b.stl", "a.off", "c.OBJ"]
    assert [p.name for p in files_of([str(tmp_path / "missing.stl")])] == ["missing.stl"], "left to the reader to tell"
    for nothing in (f"{tmp_path}/*.step", tmp_path / "empty"):
        (tmp_path / "empty").mkdir(exist_ok=True)
        with pytest.raises(ParameterError, match="known"):
            files_of([str(nothing)])


def test_what_fails_is_the_users_choice(tmp_path) -> None:
    path = tmp_path / "tube.stl"
    write(path, box(skip=(1,)))
    assert failing(path) == ["opening"]
    assert failing(path, "error") == []
    assert failing(path, "never") == []
    assert failing(path, "gap,needle") == []
    assert failing(path, "gap,opening") == ["opening"]
    for wrong in ("bogus", "gap,bogus", ""):
        with pytest.raises(ParameterError, match="fail-on"):
            FailOn.of(wrong)


def test_baseline_lets_only_new_defects_fail(tmp_path) -> None:
    """Known holes stay known in a mesh with other triangles and order; a new hole fails, a closed one is counted."""
    path, known = tmp_path / "ball.stl", tmp_path / "known.json"
    ball = sphere(32)
    write(path, without(ball, np.array([40, 400])))
    assert failing(path, write=known) == []
    assert failing(path) == ["gap", "gap"]
    assert failing(path, baseline=known) == []
    rng = np.random.default_rng(0)
    noise = 1e-6 * rng.normal(size=ball.vertices.shape)
    changed = Triangulation(ball.vertices + noise, ball.triangles)
    write(path, without(changed, np.array([40, 400])).take(rng.permutation(len(ball) - 2)))
    assert failing(path, baseline=known) == []
    write(path, without(changed, np.array([40, 400, 700])))
    (result,) = run_check([str(path)], fail_on=FailOn.of("error"), baseline=known)
    (fresh,) = result.failing
    assert fresh.where == pytest.approx(ball.corners[700].mean(axis=0), abs=0.05)
    assert (len(result.known), result.gone) == (2, 0)
    assert "1 new that count, 2 known, 0 gone" in "\n".join(checked_lines(result))
    assert checked_json(result)["failing"] == [fresh.id]
    write(path, without(ball, np.array([40])))
    (result,) = run_check([str(path)], fail_on=FailOn.of("error"), baseline=known)
    assert (len(result.failing), result.gone) == (0, 1)


def test_a_larger_hole_at_a_known_place_is_new(tmp_path) -> None:
    path, known = tmp_path / "ball.stl", tmp_path / "known.json"
    ball = sphere(32)
    away = np.linalg.norm(ball.corners.mean(axis=1) - [1.0, 0, 0], axis=1)
    write(path, without(ball, away < 0.15))
    failing(path, write=known)
    write(path, without(ball, away < 0.4))
    assert failing(path, baseline=known) == ["gap"]


def test_baselines_are_found_from_any_folder(tmp_path, monkeypatch) -> None:
    (tmp_path / "a").mkdir()
    write(tmp_path / "a" / "tube.stl", box(skip=(1,)))
    failing(tmp_path / "a" / "tube.stl", write=tmp_path / "known.json")
    monkeypatch.chdir(tmp_path / "a")
    assert failing("tube.stl", baseline=tmp_path / "known.json") == []


@pytest.mark.parametrize("text", [None, "no json", "[]", '{"patchwright_baseline": 9, "files": {}}', '{"files": {}}'])
def test_a_file_that_is_no_baseline_is_told(tmp_path, text) -> None:
    write(tmp_path / "cube.stl", box())
    if text is not None:
        (tmp_path / "known.json").write_text(text)
    with pytest.raises(CorruptFile, match=r"known\.json.*--write-baseline"):
        failing(tmp_path / "cube.stl", baseline=tmp_path / "known.json")


def test_an_unreadable_file_does_not_hide_the_others(tmp_path, monkeypatch, capfd) -> None:
    write(tmp_path / "tube.stl", moved(box(skip=(1,)), 1.0, 3))
    (tmp_path / "bad.stl").write_text("dear reader\n")
    code, out, err = command(monkeypatch, capfd, "check", tmp_path, "--json")
    assert code == 2
    told = {entry["file"].rsplit("/", 1)[-1]: entry for entry in json.loads(out)}
    assert "error" in told["bad.stl"]
    assert told["tube.stl"]["failed"] is True
    assert "bad.stl" in err
    with pytest.raises(ParameterError, match="no baseline is written"):
        run_check([str(tmp_path)], fail_on=FailOn.of("never"), write=tmp_path / "known.json")
    assert not (tmp_path / "known.json").exists()


def test_text_tells_counts_and_the_free_edge_curve(tmp_path, monkeypatch, capfd) -> None:
    ball = sphere(24)
    rng = np.random.default_rng(1)
    torn = ball.corners.reshape(-1, 3) + 1e-8 * rng.normal(size=(3 * len(ball), 3))
    path = tmp_path / "torn.ply"
    write(path, Triangulation(torn, np.arange(len(torn)).reshape(-1, 3)))
    code, out, _ = command(monkeypatch, capfd, "check", path)
    assert code == 1
    assert f"{3 * len(ball)} open edges" in out
    assert f"{3 * len(ball)} of {3 * len(ball)} free edges are cracks of round-off" in out
    assert command(monkeypatch, capfd, "check", path, "--fail-on", "never")[0] == 0
    assert command(monkeypatch, capfd, "check", path, "--fail-on", "bogus")[0] == 2
