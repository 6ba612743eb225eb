"""`patchwright intersect` as a user runs it."""

import json
import subprocess
import sys

import numpy as np
import pytest

from patchwright.models import Assembly, Cylinder, ParameterError, Part, Plane, StructuredGrid, Triangulation
from patchwright.models.io import write
from patchwright.pipelines.units import in_one_unit


def patchwright(*words):
    command = [sys.executable, "-m", "patchwright.pipelines.cli", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)


@pytest.fixture
def files(tmp_path):
    tube, floor = tmp_path / "tube.step", tmp_path / "floor.step"
    write(tube, Cylinder([0, 0, -1], [0, 0, 1], 2.0, v=(0, 2)), unit="mm")
    write(floor, Plane([0, 0, 0.25], [0, 0, 1], u=(-3, 3), v=(-3, 3)), unit="mm")
    return tube, floor


def test_curves_report_and_picture_are_written(files, tmp_path):
    out = tmp_path / "out" / "curves.step"
    done = patchwright("intersect", *files, "-o", out, "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["complete"]
    assert told["length"] == pytest.approx(4.0 * np.pi, rel=1e-9)
    assert [c["closed"] for c in told["curves"]] == [True]
    assert max(told["curves"][0]["residual on each surface"]) < 1e-9
    assert out.exists()
    assert json.loads(out.with_name("curves-report.json").read_text())["length"] == told["length"]


def test_a_report_alone_and_no_intersection(files, tmp_path):
    high = tmp_path / "high.step"
    write(high, Plane([0, 0, 9], [0, 0, 1], u=(-3, 3), v=(-3, 3)), unit="mm")
    out = tmp_path / "none.json"
    assert patchwright("intersect", files[0], high, "-o", out).returncode == 0
    assert json.loads(out.read_text())["curves"] == []


def test_a_missing_file_is_told_before_others_are_read(files, tmp_path):
    done = patchwright("intersect", tmp_path / "no.step", *files, "-o", tmp_path / "curves.step")
    assert done.returncode == 2
    assert done.stderr.strip().splitlines() == [
        f"patchwright: {tmp_path / 'no.step'}: there is no such file; check the path"
    ]
    assert not (tmp_path / "curves.step").exists()


def test_three_inputs_say_which_two_meet(files, tmp_path):
    wall = tmp_path / "wall.step"
    write(wall, Plane([0, 0, 0], [0, 1, 0], xdir=[1, 0, 0], u=(-3, 3), v=(-3, 3)), unit="mm")
    done = patchwright("intersect", *files, wall)
    assert done.returncode == 0, done.stderr
    told = done.stdout.splitlines()
    assert sum("tube.step" in line and "floor.step" in line and "transversal" in line for line in told[1:]) == 1
    # the wall cuts the tube in two rulings that meet the circle on the floor
    crossings = [line for line in told if line.strip().startswith("crossing")]
    assert len(crossings) == 2
    assert all(name in line for line in crossings for name in ("tube.step", "floor.step", "wall.step"))


def test_a_mesh_without_a_unit_is_said_to_be_in_the_others_or_scaled(files, tmp_path):
    """A tube in millimetres and a plate as STL, in millimetres and in metres."""
    corners = np.array([[-3.0, -3, 0.25], [3, -3, 0.25], [3, 3, 0.25], [-3, 3, 0.25]])
    told = []
    for scale, words in ((1.0, ()), (1e-3, ("--unit", "m"))):
        plate = tmp_path / "plate.stl"
        write(plate, Triangulation(scale * corners, np.array([[0, 1, 2], [0, 2, 3]])))
        done = patchwright("intersect", files[0], plate, "--json", *words)
        assert done.returncode == 0, done.stderr
        told.append(json.loads(done.stdout))
    assert "is taken to be in mm" in told[0]["notes"][0]
    assert "scaled by 1000" in told[1]["notes"][0]
    for one in told:
        assert one["length"] == pytest.approx(4.0 * np.pi, rel=1e-6)  # binary STL holds single precision


def test_units_that_differ_or_are_unknown_are_refused():
    nothing = Triangulation(np.zeros((1, 3)), np.zeros((0, 3), dtype=int))
    inputs = [Assembly((Part(name, nothing),), unit=unit) for name, unit in (("a", "mm"), ("b", "in"))]
    with pytest.raises(ParameterError, match=r"a is in mm and b in in"):
        in_one_unit(inputs, ["a", "b"], None)
    with pytest.raises(ParameterError, match="known are mm"):
        in_one_unit(inputs, ["a", "b"], "parsec")


@pytest.mark.parametrize("suffix", ["stl", "nothing"])
def test_formats_that_hold_no_curves_are_refused(files, tmp_path, suffix):
    done = patchwright("intersect", *files, "-o", tmp_path / f"curves.{suffix}")
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1  # before anything is read
    assert "known for curves are STEP" in done.stderr


def test_volumes_and_bad_tolerances_are_refused_by_name(files, tmp_path):
    volume = tmp_path / "volume.p3d"
    write(volume, StructuredGrid((np.random.default_rng(0).normal(size=(3, 3, 3, 3)),)))
    done = patchwright("intersect", volume, files[0])
    assert done.returncode == 2
    assert "volume.p3d: block 0 of (3, 3, 3) nodes is not a surface" in done.stderr
    done = patchwright("intersect", *files, "--tolerance", "0")
    assert done.returncode == 2
    assert done.stderr.strip() == "patchwright: the tolerance must be a positive length, got 0.0"
