"""Curves joined across seams: loops come back whole, on both surfaces, whatever the seam's place."""

import numpy as np
import pytest

from patchwright.models import Cylinder, NurbsCurve, Sphere, Torus
from patchwright.ssi import Intersection, IntersectionCurve, intersect
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


def test_many_shuffled_arcs_make_one_loop():
    rng = np.random.default_rng(4)
    t = np.linspace(0.0, 2 * np.pi, 801)
    points = np.stack([np.cos(t), np.sin(t), 0.1 * np.sin(3 * t)], axis=1)
    slope = np.stack([-np.sin(t), np.cos(t), 0.3 * np.cos(3 * t)], axis=1)
    arcs = []
    for k in rng.permutation(800):
        h = t[k + 1] - t[k]
        net = [points[k], points[k] + h / 3 * slope[k], points[k + 1] - h / 3 * slope[k + 1], points[k + 1]]
        curve = NurbsCurve(3, [0, 0, 0, 0, h, h, h, h], np.array(net))
        curve = curve.reversed() if rng.random() < 0.5 else curve
        arcs.append(IntersectionCurve(curve, None, None, curve(np.array([0.0, h])), "transversal", False, 0.0))
    (whole,) = chained(Intersection(tuple(arcs)), 1e-9).curves
    assert whole.closed
    assert whole.curve.length() == pytest.approx(sum(a.curve.length() for a in arcs), rel=1e-12)
    assert len(whole.points) == 801
    along = np.unwrap(np.arctan2(whole.points[:, 1], whole.points[:, 0]))
    assert (np.diff(along) > 0.0).all() or (np.diff(along) < 0.0).all()


def test_branch_points_keep_curves_apart():
    a, b = Cylinder([0, 0, -2], [0, 0, 1], 1.0, v=(0, 4)), Cylinder([-2, 0, 0], [1, 0, 0], 1.0, v=(0, 4))
    found = chained(intersect_surfaces(a, b, 1e-10), 1e-8)
    assert not any(c.closed for c in found.curves)
    assert sum(p.kind == "branch" for p in found.points) == 2
    assert found.length == pytest.approx(15.280791156, rel=1e-9)  # 8 sqrt(2) E(1/2), two ellipses
