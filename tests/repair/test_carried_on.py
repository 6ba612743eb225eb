"""NURBS faces that end short of their neighbours reach them on their own polynomials, exactly."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models import Assembly, NurbsSurface
from patchwright.models.cad import measure_seams
from patchwright.models.io import read, write
from patchwright.repair import repair
from patchwright.repair.result import Rung, Verdict

ENDS = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
BULGE = 0.3
VOLUME = 8.0 + 6 * BULGE * 16 / 9  # of the cube, and of the six bulges: 4 * (2/3)^2 each per unit of height


def bulged_cube() -> list[NurbsSurface]:
    """The cube [-1, 1]^3 with h = BULGE (1 - x^2)(1 - y^2) over each face: biquadratic, with straight sharp edges."""
    faces = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            n = sign * np.eye(3)[axis]
            a, b = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            a, b = (b, a) if sign < 0.0 else (a, b)
            x = np.array([-1.0, 0.0, 1.0])
            net = n + x[:, None, None] * a + x[None, :, None] * b
            net[1, 1] += 4.0 * BULGE * n  # 1 - x^2 has the Bezier ordinates 0, 2, 0
            faces.append(NurbsSurface((2, 2), (ENDS, ENDS), net))
    return faces


@pytest.mark.parametrize("share", [1e-3, 1e-2])
@pytest.mark.parametrize("which", [(0,), (0, 2), (0, 1, 2, 3, 4, 5)])
def test_faces_cut_back_in_their_parameters_are_carried_on_to_their_true_edges(tmp_path, which, share):
    kept = (share, 1.0 - share)
    faces = [f.restricted(kept, kept) if k in which else f for k, f in enumerate(bulged_cube())]
    write(tmp_path / "short.step", Assembly.of(faces))
    result = repair(read(tmp_path / "short.step"))
    assert result.verdict == Verdict.REPAIRED, result.problems
    write(tmp_path / "healed.step", result.to_assembly())
    again = read(tmp_path / "healed.step")
    assert (again.topology.use_counts() == 2).all()
    assert max(seam.gap for seam in measure_seams(again)) <= 1e-9 * again.diagonal
    carried = [e for e in result.ledger if e.what == "surface carried on to its neighbours"]
    assert {e.parts[0] for e in carried} == {f"part{k + 1}" for k in which}
    assert all(e.rung == Rung.CUT for e in carried)
    # parameters stay, so each surface is the undamaged one at its own parameters
    at = np.random.default_rng(1).uniform(0.1, 0.9, (2, 20))
    for part, true in zip(result.to_assembly().parts, bulged_cube(), strict=True):
        assert np.abs(part.surface(*at) - true(*at)).max() <= 1e-12
    assert np.abs(np.abs(again.topology.vertices) - 1.0).max() <= 1e-9
    assert again.triangulation.volume == pytest.approx(VOLUME, rel=1e-3)


def test_a_face_with_no_neighbour_keeps_its_surface_bit_for_bit(tmp_path):
    faces = bulged_cube()[:1]
    write(tmp_path / "alone.step", Assembly.of(faces))
    before = read(tmp_path / "alone.step")
    after = repair(before).to_assembly()
    assert np.array_equal(after.parts[0].surface.control_points, before.parts[0].surface.control_points)
