"""`patchwright intersect` as a user runs it."""

import json
import subprocess
import sys

import numpy as np
import pytest

from patchwright.models import Cylinder, Plane
from patchwright.models.io import write


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


@pytest.mark.parametrize("suffix", ["stl", "nothing"])
def test_formats_that_hold_no_curves_are_refused(files, tmp_path, suffix):
    done = patchwright("intersect", *files, "-o", tmp_path / f"curves.{suffix}")
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) <= 3
    assert "Traceback" not in done.stderr
