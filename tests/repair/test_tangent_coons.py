"""Patches that take the tangent planes beside them: met to round-off, their sides kept, sharp edges left sharp."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from patchwright.models import Assembly, NurbsSurface
from patchwright.models.cad import measure_seams
from patchwright.models.io import read, write
from patchwright.models.samples.cube_sphere import cube_sphere_patches
from patchwright.repair import repair
from patchwright.repair.cad.tangent_coons import tangent_coons, worst_angle
from patchwright.repair.patches.coons_surface import coons_surface
from patchwright.repair.result import Verdict

ALL = ("u0", "u1", "v0", "v1")
QUADRATIC = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])


def saddle() -> NurbsSurface:
    """z = x^2 y^2 - x y^2 / 2 on the unit square: no Coons patch of its sides has its tangent planes."""
    x = np.array([0.0, 0.5, 1.0])
    square, plain = np.array([0.0, 0.0, 1.0]), x  # Bezier ordinates of t^2 and t
    height = np.outer(square, square) - 0.5 * np.outer(plain, square)
    net = np.stack([*np.meshgrid(x, x, indexing="ij"), height], axis=2)
    return NurbsSurface((2, 2), (QUADRATIC, QUADRATIC), net)


def beside(surface: NurbsSurface, sides=ALL):
    def along(side):
        def normals(t):
            at = np.full(len(t), float(side[1]))
            return surface.normal(*((at, t) if side[0] == "u" else (t, at)))

        return normals

    return {side: along(side) for side in sides}


def coons_of(surface: NurbsSurface) -> NurbsSurface:
    return coons_surface(*(surface.boundary(side) for side in ("v0", "v1", "u0", "u1")))


def test_tangent_planes_of_a_polynomial_surface_are_met_to_round_off_without_a_knot():
    true, plain = saddle(), coons_of(saddle())
    assert worst_angle(plain, beside(true)) > 5.0
    made, off = tangent_coons(plain, beside(true), 1e-6)
    assert off <= 1e-6
    assert made.control_points.shape == (4, 4, 3)
    raised = plain.elevated(1, 1).control_points
    for rows in (np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1]):
        assert np.abs(made.control_points[rows] - raised[rows]).max() <= 1e-15


@pytest.mark.parametrize("sides", [("u0",), ("u0", "v1")])
def test_only_the_sides_asked_for_are_met(sides):
    true, plain = saddle(), coons_of(saddle())
    made, off = tangent_coons(plain, beside(true, sides), 1e-6)
    assert off <= 1e-6
    assert worst_angle(made, beside(true, sides)) == off


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_rigid_motion_and_scale_move_the_patch_with_them(scale):
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()

    def moved(surface):
        return NurbsSurface(surface.degree, surface.knots, scale * surface.control_points @ turn.T + scale)

    true, plain = saddle(), coons_of(saddle())
    here, _ = tangent_coons(plain, beside(true), 1e-6)
    there, _ = tangent_coons(moved(plain), beside(moved(true)), 1e-6)
    assert np.abs(moved(here).control_points - there.control_points).max() <= 1e-10 * scale


def test_a_missing_patch_of_the_cube_sphere_meets_its_neighbours_with_few_control_points(tmp_path):
    faces = [s for body in cube_sphere_patches(0.0).bodies for s in body.surfaces]
    write(tmp_path / "five.step", Assembly.of(faces[1:]))
    result = repair(read(tmp_path / "five.step"))
    assert result.verdict == Verdict.INVENTED, result.problems
    write(tmp_path / "six.step", result.to_assembly())
    again = read(tmp_path / "six.step")
    seams = measure_seams(again)
    assert (again.topology.use_counts() == 2).all()
    assert max(seam.gap for seam in seams) <= 1e-12 * again.diagonal  # the sides stay rational and exact
    assert max(seam.angle for seam in seams) <= 0.1
    new = result.to_assembly().parts[-1].surface
    assert new.control_points.shape[:2] == faces[0].control_points.shape[:2]
    u = np.linspace(0.0, 1.0, 33)
    assert np.abs(np.linalg.norm(new.grid(u, u), axis=2) - 1.0).max() <= 0.05  # the bilinear patch: 0.19


def test_an_opening_with_sharp_edges_gets_no_tangents(tmp_path):
    # four upright walls with bent upper edges: nothing leaves their corners in the walls' tangent planes
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    walls = []
    for k in range(4):
        a, b = corners[k], corners[(k + 1) % 4]
        low = np.stack([a, 0.5 * (a + b), b])
        high = low + np.array([[0, 0, 1.0], [0, 0, 1.0 + 0.3 * (-1) ** k], [0, 0, 1.0]])
        walls.append(NurbsSurface((2, 1), (QUADRATIC, np.array([0.0, 0, 1, 1])), np.stack([low, high], axis=1)))
    write(tmp_path / "walls.step", Assembly.of(walls))
    result = repair(read(tmp_path / "walls.step"), openings="close")
    assert result.verdict == Verdict.INVENTED, result.problems
    reasons = [entry.reason for entry in result.ledger if "filled" in entry.what]
    assert any("the Coons patch of its 4 sides" in reason for reason in reasons)
    assert not any("tangent to" in reason for reason in reasons)
