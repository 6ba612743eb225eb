"""A displaced face that borders an opening of the file: put back where edges tell, never called repaired otherwise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracles_cad_damage import centre, faces_of, rounded_box, shifted, turned, written

from patchwright.models.cad import surface_difference
from patchwright.models.cad.connectivity import components
from patchwright.models.io import read
from patchwright.repair import diagnose, repair
from patchwright.repair.cad.draft import Draft, Limits
from patchwright.repair.cad.realign import realign
from patchwright.repair.checks.cad_loose import loose_beside
from patchwright.repair.result import Rung, Verdict

FACES = faces_of(rounded_box())
CENTRES = np.array([[c.X(), c.Y(), c.Z()] for c in map(centre, FACES)])
TOP = int(CENTRES[:, 2].argmax())
WALL = int(CENTRES[:, 0].argmin())
AROUND = [k for k, c in enumerate(CENTRES) if c[0] < 1.0 and c[1] < 1.0 and k != WALL]
SHIFT = np.array([0.03, -0.04, 0.02])


def open_box(path, damaged):
    """The box without its top and one rounded edge, so that two of the wall's four edges are the opening's."""
    kept = [k for k in range(len(FACES)) if k not in (TOP, *AROUND)]
    faces = [damaged(FACES[k]) if k == WALL else FACES[k] for k in kept]
    return written(path, faces, {kept.index(WALL)}), kept.index(WALL)


def test_the_opening_takes_half_of_the_walls_border():
    assert len(AROUND) == 1


@pytest.mark.parametrize("factor", [0.1, 1.0, 3.0])
def test_a_displaced_wall_at_an_opening_is_put_back(tmp_path, factor):
    path, wall = open_box(tmp_path / "damaged.step", lambda face: shifted(face, factor * SHIFT))
    good = read(open_box(tmp_path / "good.step", lambda face: face)[0])
    result = repair(read(path))
    assert result.verdict is Verdict.REPAIRED
    assert result.faces[wall].rung is Rung.REALIGN
    assert result.faces[wall].deviation == pytest.approx(factor * np.linalg.norm(SHIFT), rel=1e-9)
    after = result.to_assembly()
    off = [min(surface_difference(a.surface, b.surface) for b in good.parts) for a in after.parts]
    assert max(off) <= 1e-12 * good.diagonal
    assert len(components(after.topology)) == 1


def test_a_turned_wall_at_an_opening_is_put_back(tmp_path):
    path, _ = open_box(tmp_path / "damaged.step", lambda face: turned(face, (0.0, 0.6, 0.8), 0.01))
    model = read(path)
    _, changes = realign(Draft(model, model.topology), Limits.of(model.diagonal))
    assert len(changes) == 1


def test_a_wall_in_place_is_not_moved(tmp_path):
    path, _ = open_box(tmp_path / "good.step", lambda face: face)
    model = read(path)
    assert not realign(Draft(model, model.topology), Limits.of(model.diagonal))[1]


def beside(path):
    model = read(path)
    topology = model.topology
    counts = topology.use_counts()
    free = [
        (f, use) for f, loops in enumerate(topology.loops) for loop in loops for use in loop if counts[use.edge] == 1
    ]
    piece = np.zeros(len(topology.loops), dtype=np.int64)
    for number, faces in enumerate(components(topology)):
        piece[faces] = number
    return model, loose_beside(topology, free, piece, 0.05 * model.diagonal)


def test_a_loose_wall_is_told_with_its_place_and_width(tmp_path):
    path, wall = open_box(tmp_path / "damaged.step", lambda face: shifted(face, SHIFT))
    model, found = beside(path)
    assert len(found) == 1
    assert wall in found[0].faces
    assert found[0].length == pytest.approx(4.0 + 4.0, rel=0.2)  # an upright edge of 4 and a lower one of 4
    assert 0.02 <= found[0].width <= found[0].widest <= np.linalg.norm(SHIFT) * (1.0 + 1e-9)
    gaps = [defect for defect in diagnose(model).of("gap") if model.parts[wall].name in defect.parts]
    assert gaps
    assert gaps[0].severity == "error"


@pytest.mark.parametrize("far", [0.06, 0.5])
def test_a_wall_farther_away_than_its_edges_allow_is_none(tmp_path, far):
    away = shifted(FACES[WALL], np.array([-far * 100.0, 0.0, 0.0]))
    path, _ = open_box(tmp_path / "away.step", lambda face: away)
    assert not beside(path)[1]


def test_one_piece_has_nothing_beside_it(tmp_path):
    kept = [face for k, face in enumerate(FACES) if k not in (TOP, *AROUND)]
    assert not beside(written(tmp_path / "good.step", kept, set()))[1]


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_unit_does_not_matter(tmp_path, scale):
    path, _ = open_box(tmp_path / "damaged.step", lambda face: shifted(face, SHIFT))
    model, found = beside(path)
    topology = model.topology
    counts = topology.use_counts()
    curves = tuple(replace(c, control_points=scale * c.control_points) for c in topology.curves)
    larger = replace(topology, curves=curves, vertices=scale * topology.vertices)
    free = [(f, use) for f, loops in enumerate(larger.loops) for loop in loops for use in loop if counts[use.edge] == 1]
    piece = np.zeros(len(larger.loops), dtype=np.int64)
    for number, faces in enumerate(components(larger)):
        piece[faces] = number
    (other,) = loose_beside(larger, free, piece, 0.05 * scale * model.diagonal)
    assert other.edges == found[0].edges
    assert other.widest == pytest.approx(scale * found[0].widest, rel=1e-9)
