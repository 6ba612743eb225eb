"""The judge of the fuzz driver can say no: answers spoilt on purpose, and a handful of pairs as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fuzz_intersect import judged, pair, solved

from patchwright.models import NurbsCurve, Plane, Sphere, Torus, Triangulation
from patchwright.ssi import Intersection, intersect

BALL = Sphere((0.1, 0.0, 0.2), 1.0)
RING = Torus((0.4, 0.3, 0.0), (0.1, 0.2, 1.0), 1.0, 0.3)
CORNERS = np.array([[-2.0, -2, 0.1], [2, -2, 0.1], [2, 2, 0.1], [-2, 2, 0.1]])
PLATE = Triangulation(CORNERS, np.array([[0, 1, 2], [0, 2, 3]]))


def moved(curve: NurbsCurve, by: float) -> NurbsCurve:
    return NurbsCurve(curve.degree, curve.knots, curve.control_points + by, curve.weights)


@pytest.mark.parametrize("other", [RING, PLATE], ids=["surface", "mesh"])
def test_right_answers_pass_and_spoilt_ones_do_not(other: Torus | Triangulation) -> None:
    found = intersect(BALL, other)
    assert found.complete
    assert judged(BALL, other, found) == ""
    assert "changes sign" in judged(BALL, other, replace(found, curves=found.curves[1:], points=()))
    shifted = tuple(replace(c, curve=moved(c.curve, 1e-6)) for c in found.curves)
    assert "off" in judged(BALL, other, replace(found, curves=shifted))
    broken = tuple(replace(c, residual=np.nan) for c in found.curves)
    assert "not finite" in judged(BALL, other, replace(found, curves=broken))


def test_an_empty_answer_that_claims_to_be_complete_is_found_out() -> None:
    floor = Plane((0, 0, 0), (0, 0, 1), (1, 0, 0), (-2, 2), (-2, 2))
    for other in (floor, RING, PLATE):
        assert "nothing found" in judged(BALL, other, Intersection())
        assert judged(BALL, other, replace(Intersection(), unresolved=intersect(RING, PLATE).unresolved)) != ""


def test_pairs_come_back_the_same_from_their_numbers() -> None:
    for index in range(6):
        kinds, a, b = pair(7, index)
        again, c, d = pair(7, index)
        assert kinds == again
        for one, two in ((a, c), (b, d)):
            nets = [x.vertices if isinstance(x, Triangulation) else x.to_nurbs().control_points for x in (one, two)]
            assert np.array_equal(*nets)


@pytest.mark.parametrize("index", range(0, 40, 4))
def test_random_pairs(index: int) -> None:
    assert solved(11, index).state in ("right", "incomplete", "refused")
