"""`patchwright approximate`, and a list of patches as a layout of `repair`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import command

from patchwright.models.io import read, write
from patchwright.models.samples import sphere


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ball") / "ball.stl"
    write(path, sphere(1.0, cells=64).assembly.triangulation)
    return path


def face(axis: int, sign: float) -> list[list[float]]:
    """The corners of one face of the cube in the unit sphere, counter-clockwise from outside."""
    out = []
    for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        point = [0.0, 0.0, 0.0]
        point[axis], point[(axis + 1) % 3], point[(axis + 2) % 3] = sign, a * sign, b
        out.append([float(x / np.sqrt(3.0)) for x in point])
    return out


def cube_list(folder: Path) -> Path:
    lines = ["tolerance = 0.005"]
    for axis in range(3):
        for sign in (-1.0, 1.0):
            lines += ["[[patch]]", f"corners = {face(axis, sign)}"]
    path = folder / "cube.toml"
    path.write_text("\n".join(lines))
    return path


def test_a_patch_of_many_kinds_of_sides(ball: Path, tmp_path: Path, monkeypatch, capfd) -> None:
    (tmp_path / "p.toml").write_text(
        """
tolerance = 0.005
[[patch]]
name = "quarter"
south = { section = { point = [0, 0, -0.4], normal = [0, 0, 1] }, from = [0.9, 0, -0.4], to = [0, 0.9, -0.4] }
north = { section = { point = [0, 0, 0.4], normal = [0, 0, 1] }, from = [0.9, 0, 0.4], to = [0, 0.9, 0.4] }
west = { points = [[0.917, 0, -0.4], [0.917, 0, 0.4]], laid = true }
east = { points = [[0, 0.917, -0.4], [0, 1, 0], [0, 0.917, 0.4]], scheme = "bessel" }
"""
    )
    listed, output = tmp_path / "p.toml", tmp_path / "out" / "q.step"
    code, out, err = command(monkeypatch, capfd, "approximate", ball, "--patches", listed, "-o", output, "--json")
    assert code == 0, err
    told = json.loads(out)["patches"][0]
    assert told["name"] == "quarter"
    assert told["largest distance"] <= 0.005
    assert told["sides"]["south"] == "plane section"
    assert "laid" in told["sides"]["west"]
    surface = read(tmp_path / "out" / "q.step").parts[0].surface
    assert surface is not None
    t = np.linspace(0.0, 1.0, 20)
    radius = np.linalg.norm(surface(t[:, None], t[None]), axis=-1)
    assert np.abs(radius - 1.0).max() < 0.02
    assert json.loads((tmp_path / "out" / "q-report.json").read_text())["converged"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "at least one"),
        ("[[patch]]\nsouth = { points = [[0,0,1],[1,0,0]] }", "has no east"),
        ("[[patch]]\ncorner = []", "did you mean 'corners'"),
        ("[[patch]]\ncorners = [[0,0,1]]", "four points"),
        ("tolerance = -1\n[[patch]]\ncorners = [[0,0,1]]", "positive length"),
        ("[[patch]", "TOML"),
        ("[[patch]]\nsouth={edge={from=[0,0,1],to=[1,0,0]}}\neast={points=[[1,0,0],[1,1,0]]}\nnorth={points=[[0,1,0],"
         "[1,1,0]]}\nwest={points=[[0,0,0],[0,1,0]]}", "no edges"),
    ],
)  # fmt: skip
def test_a_bad_list_is_one_sentence(ball: Path, tmp_path: Path, monkeypatch, capfd, text: str, words: str) -> None:
    listed, output = tmp_path / "bad.toml", tmp_path / "x.step"
    listed.write_text(text)
    code, _, err = command(monkeypatch, capfd, "approximate", ball, "--patches", listed, "-o", output)
    assert code == 2
    assert words in err
    assert "Traceback" not in err
    assert not (tmp_path / "x.step").exists()


def test_a_list_of_patches_is_a_layout(ball: Path, tmp_path: Path, monkeypatch, capfd) -> None:
    listed, folder = cube_list(tmp_path), tmp_path / "r"
    words = ("repair", ball, "--scope", "all", "--layout", listed, "--tolerance", "0.01", "-o", folder, "-q")
    code, out, err = command(monkeypatch, capfd, *words)
    assert code == 0, out + err
    assert len(json.loads((folder / "report.json").read_text())["faces"]) == 6
