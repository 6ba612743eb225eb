"""Deviation part by part: known offsets come out per part, both ways; what is new or gone is told."""

from __future__ import annotations

import numpy as np
import pytest
from oracles_shells import box, sphere

from patchwright.models import Tolerance, Triangulation
from patchwright.models.triangulation import concatenate
from patchwright.repair.regions import regions


def tagged(**parts: Triangulation) -> Triangulation:
    return concatenate(
        [
            Triangulation(t.vertices, t.triangles, tags=np.zeros(len(t), dtype=int), tag_names=(name,))
            for name, t in parts.items()
        ]
    )


@pytest.mark.parametrize("offset", [0.0, 1e-6, 1e-3])
def test_each_part_has_its_own_distance_and_tolerance(offset: float) -> None:
    cube, ball = box(), Triangulation(sphere(16).vertices + np.array([5, 0, 0]), sphere(16).triangles)
    moved = Triangulation(cube.vertices + np.array([0, 0, offset]), cube.triangles)
    limits = Tolerance(1e-9, 1e-4, parts=(("cube", 1.0),))
    found = {r.name: r for r in regions(tagged(cube=cube, ball=ball), tagged(cube=moved, ball=ball), limits)}
    for way in (found["ball"].input_to_output, found["ball"].output_to_input):
        assert way.largest == pytest.approx(0.0, abs=1e-14)
    # the faces across the shift stray by it, the ones along it by less
    assert found["cube"].input_to_output.largest == pytest.approx(offset, rel=1e-9, abs=1e-15)
    assert found["cube"].input_to_output.coverage == 1.0, "within its own tolerance"
    assert found["cube"].input_to_output.tolerance == 1
    assert found["cube"].area == pytest.approx(6.0)


def test_what_is_new_and_what_is_gone() -> None:
    cube, ball = box(), sphere(16)
    new, gone = sorted(regions(tagged(cube=cube), tagged(ball=ball), Tolerance(1e-9, 1e-4)), key=lambda r: r.name)
    assert (new.name, new.input_to_output, new.area) == ("ball", None, 0.0)
    assert (gone.name, gone.output_to_input) == ("cube", None)


def test_what_lies_inside_another_part_is_not_missed() -> None:
    cube, ball = box(), Triangulation(0.25 * sphere(32).vertices + np.array([1.0, 0.5, 0.5]), sphere(32).triangles)
    both, limits = tagged(cube=cube, ball=ball), Tolerance(1e-9, 1e-4)
    outside = ball.corners.mean(axis=1)[:, 0] > 1.0
    united = tagged(cube=cube, ball=ball.take(outside).compact())
    found = {r.name: r for r in regions(both, united, limits)}
    assert found["ball"].enclosed == pytest.approx(0.5, abs=0.02)
    assert found["ball"].input_to_output is not None
    assert found["ball"].input_to_output.largest <= 1e-4 + 0.25 * np.pi / 32, "but for triangles across the border"
    assert found["cube"].enclosed == 0.0
    # a part that bulges out of the input is no enclosed part
    grown = tagged(cube=Triangulation(1.1 * cube.vertices - 0.05, cube.triangles))
    (bulged,) = regions(tagged(cube=cube), grown, limits)
    assert bulged.enclosed == 0.0
    assert bulged.input_to_output is not None
    assert bulged.input_to_output.largest == pytest.approx(0.05, rel=1e-6)


def test_a_part_inside_another_is_enclosed_altogether() -> None:
    cube, ball = box(), Triangulation(0.25 * sphere(16).vertices + 0.5, sphere(16).triangles)
    found = {r.name: r for r in regions(tagged(cube=cube, ball=ball), tagged(cube=cube), Tolerance(1e-9, 1e-4))}
    assert found["ball"].enclosed == 1.0
    assert (found["ball"].input_to_output, found["ball"].output_to_input) == (None, None)
