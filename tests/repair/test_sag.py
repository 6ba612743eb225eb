"""How far CAD tessellations stray: on a sphere by a known height, poles or not; on planes not at all."""

from __future__ import annotations

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere
from oracles_cad_solids import stored

from patchwright.repair.cad.sag import sags


@pytest.mark.parametrize("radius", [1e-2, 5.0, 1e3])
def test_a_sphere_strays_by_what_its_middles_lack_of_the_radius(tmp_path, radius):
    ball = stored(tmp_path / "ball.step", BRepPrimAPI_MakeSphere(radius).Shape())
    lack = radius - np.linalg.norm(ball.parts[0].triangulation.corners.mean(axis=1), axis=1)
    (sag,) = sags(ball)
    assert sag == pytest.approx(np.percentile(lack, 99.0), rel=0.2)
    assert sags(ball, 100.0)[0] >= sag


def test_planes_do_not_stray(tmp_path):
    assert sags(stored(tmp_path / "box.step", BRepPrimAPI_MakeBox(3.0, 2.0, 1.0).Shape())).max() < 1e-14
