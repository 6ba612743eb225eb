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
