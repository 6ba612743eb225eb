"""Faces that a CAD file holds twice: one stays; what only lies near, or over a part, is no copy."""

from __future__ import annotations

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere
from oracles_cad_damage import (
    ROUNDED_VOLUME,
    cut_back,
    faces_of,
    read_shape,
    reversed_face,
    rounded_box,
    shifted,
    solid_volume,
    with_own_edges,
    written,
)

from patchwright.models.io import read, write
from patchwright.repair import repair
from patchwright.repair.cad.copies import without_copies
from patchwright.repair.result import Rung, Verdict

FACES = faces_of(rounded_box())


@pytest.mark.parametrize("copied", [with_own_edges, lambda face: reversed_face(with_own_edges(face))])
def test_copies_are_dropped_and_the_solid_is_closed(tmp_path, copied):
    faces = [*FACES, *(copied(FACES[k]) for k in (0, 3, 8))]
    result = repair(read(written(tmp_path / "twice.step", faces, {10, 11, 12})))
    assert result.verdict == Verdict.REPAIRED, result.problems
    dropped = [e for e in result.ledger if e.rung == Rung.DROP]
    assert len(dropped) == 3
    assert all(e.where is not None and e.area > 0.0 for e in dropped)
    write(tmp_path / "once.step", result.to_assembly())
    assert solid_volume(read_shape(tmp_path / "once.step")) == pytest.approx(ROUNDED_VOLUME, rel=1e-9)


def test_of_two_copies_the_one_that_shares_its_edges_stays(tmp_path):
    model = read(written(tmp_path / "twice.step", [with_own_edges(FACES[0]), *FACES], {0}))
    shared = [
        sum(int(model.topology.use_counts()[use.edge] > 1) for loop in loops for use in loop)
        for loops in model.topology.loops
    ]
    once, entries = without_copies(model)
    assert entries[0].parts == (model.names[int(np.argmin(shared))],)
    assert (once.topology.use_counts() == 2).all()


def test_faces_near_each_other_and_smaller_ones_are_no_copies(tmp_path):
    near = shifted(with_own_edges(FACES[0]), (1e-3, 0.0, 0.0))
    for other in (near, cut_back(FACES[0], 1e-3)):
        model = read(written(tmp_path / "near.step", [*FACES, other], {10}))
        once, entries = without_copies(model)
        assert once is model
        assert entries == ()


def test_a_copy_of_a_cap_with_a_pole_is_found(tmp_path):
    # points of a dome come in any order round it: their angles are compared within one turn
    ball = faces_of(BRepPrimAPI_MakeSphere(2.0).Shape())
    model = read(written(tmp_path / "balls.step", [*ball, *(with_own_edges(face) for face in ball)], {1}))
    once, entries = without_copies(model)
    assert len(entries) == len(once.parts) == 1
