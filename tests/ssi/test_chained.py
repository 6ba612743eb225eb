"""Curves joined across seams: loops come back whole, on both surfaces, whatever the seam's place."""

import numpy as np
import pytest

from patchwright.models import Cylinder, Sphere, Torus
from patchwright.ssi import intersect
from patchwright.ssi.chained import chained
from patchwright.ssi.surface_surface import intersect_surfaces

TORUS = Torus([0, 0, 0], [0, 0, 1], 2.0, 0.5)
BALL = Sphere([2, 0.1, 0.2], 0.6)  # its curve crosses the torus' seam v = 0


def test_a_loop_over_a_seam_is_one_closed_curve():
    parted = intersect_surfaces(TORUS, BALL, 1e-10)
    assert len(parted.curves) > 1
    (whole,) = intersect(TORUS, BALL).curves
    assert whole.closed
    assert whole.curve.length() == pytest.approx(parted.length, rel=1e-12)


def test_both_parameter_curves_follow_the_joined_curve():
    (whole,) = intersect(TORUS, BALL).curves
    s = whole.curve.breaks
    t = (s[:-1, None] + np.diff(s)[:, None] * np.linspace(0.1, 0.9, 9)).reshape(-1)
    for uv, surface in ((whole.uv_a, TORUS), (whole.uv_b, BALL)):
        away = np.linalg.norm(surface(*uv(t).T) - whole.curve(t), axis=1)
        assert away.max() <= 1e-10 * 5.0


def test_joining_again_changes_nothing():
    once = chained(intersect_surfaces(TORUS, BALL, 1e-10), 1e-8)
    assert chained(once, 1e-8).curves == once.curves


def test_branch_points_keep_curves_apart():
    a, b = Cylinder([0, 0, -2], [0, 0, 1], 1.0, v=(0, 4)), Cylinder([-2, 0, 0], [1, 0, 0], 1.0, v=(0, 4))
    found = chained(intersect_surfaces(a, b, 1e-10), 1e-8)
    assert not any(c.closed for c in found.curves)
    assert sum(p.kind == "branch" for p in found.points) == 2
    assert found.length == pytest.approx(15.280791156, rel=1e-9)  # 8 sqrt(2) E(1/2), two ellipses
