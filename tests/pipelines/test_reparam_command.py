"""`patchwright reparam`: files in and out, reports, kept faces, exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from reparam_shapes import crowded_bicubic, distance
from typer.testing import CliRunner

from patchwright.models import Assembly, NurbsSurface, Plane
from patchwright.models.assembly import Part
from patchwright.models.errors import ParameterError, UnsupportedFormat
from patchwright.models.io import read, write
from patchwright.models.triangulation import Triangulation
from patchwright.pipelines.cli import app
from patchwright.pipelines.progress import Terminal
from patchwright.pipelines.reparam import reparam_json, reparam_lines, run_reparam
from patchwright.reparam import parametrisation_defect


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two badly parametrized pieces that share a side, and a plane between them in the file."""
    path = tmp_path_factory.mktemp("reparam") / "model.step"
    left, right = crowded_bicubic().split("u", 0.4)
    nothing = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    plane = Plane([0, 0, -1], [0, 0, 1], u=(0.0, 1.0), v=(0.0, 1.0))
    parts = [Part(n, nothing, surface=s) for n, s in (("left", left), ("floor", plane), ("right", right))]
    write(path, Assembly(tuple(parts), unit="mm"))
    return path


def test_all_faces(model: Path, tmp_path: Path) -> None:
    out = tmp_path / "new" / "out.step"
    run = run_reparam(model, out, tolerance=1e-3, names=(), terminal=Terminal(quiet=True))
    assert run.complete
    assert [f.result is not None for f in run.faces] == [True, False, True]
    assert run.faces[1].kept.startswith("good as it is")
    assert set(run.files) >= {"out.step", "out-report.json"}
    report = json.loads((tmp_path / "new" / "out-report.json").read_text())
    assert report == reparam_json(run)
    old, new = read(model).parts, read(out).parts
    assert [p.name for p in new] == ["left", "floor", "right"]
    by_name = {p.name: p.surface for p in new}
    assert isinstance(by_name["floor"], Plane)
    for part, face in zip(old, report["faces"], strict=True):
        if part.name == "floor":
            continue
        surface = by_name[part.name]
        assert isinstance(surface, NurbsSurface)
        assert isinstance(part.surface, NurbsSurface)
        assert face["deviation"] <= 1e-3
        assert distance(surface, part.surface, 8) <= 1e-3
        assert parametrisation_defect(surface) == pytest.approx(face["defect after"], rel=1e-6)
        assert face["defect after"] < 0.1 * face["defect before"]
    # the shared side came out as one curve
    left, right = by_name["left"], by_name["right"]
    assert isinstance(left, NurbsSurface)
    assert isinstance(right, NurbsSurface)
    assert np.abs(left.boundary("u1").control_points - right.boundary("u0").control_points).max() < 1e-15
    text = "\n".join(reparam_lines(run))
    assert "2 of 3 faces" in text
    assert "(floor): good as it is" in text


def test_named_face_only(model: Path, tmp_path: Path) -> None:
    run = run_reparam(model, tmp_path / "out.igs", tolerance=1e-3, names=["right"], terminal=Terminal(quiet=True))
    assert [f.result is not None for f in run.faces] == [False, False, True]
    surfaces = [p.surface for p in read(tmp_path / "out.igs").parts]
    old = {p.name: p.surface for p in read(model).parts}["left"]
    assert isinstance(old, NurbsSurface)
    same = [s for s in surfaces if isinstance(s, NurbsSurface) and s.control_points.shape == old.control_points.shape]
    assert len(same) == 1
    assert same[0].control_points == pytest.approx(old.control_points, abs=1e-12)


def test_bad_input_is_refused_before_anything_is_written(model: Path, tmp_path: Path) -> None:
    quiet = Terminal(quiet=True)
    out = tmp_path / "out.step"
    with pytest.raises(ParameterError, match=r"no face named 'lefty'.*left"):
        run_reparam(model, out, tolerance=1e-3, names=["lefty"], terminal=quiet)
    with pytest.raises(ParameterError, match="tolerance must be a positive length"):
        run_reparam(model, out, tolerance=0.0, names=(), terminal=quiet)
    with pytest.raises(UnsupportedFormat, match="cannot hold surfaces"):
        run_reparam(model, tmp_path / "out.stl", tolerance=1e-3, names=(), terminal=quiet)
    mesh = tmp_path / "mesh.stl"
    write(mesh, Triangulation(np.eye(3), np.array([[0, 1, 2]])))
    with pytest.raises(ParameterError, match="no surfaces"):
        run_reparam(mesh, out, tolerance=1e-3, names=(), terminal=quiet)
    assert not out.exists()


def test_command_needs_an_output(model: Path) -> None:
    assert CliRunner().invoke(app, ["reparam", str(model)]).exit_code == 2
