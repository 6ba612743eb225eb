"""Faces that cross, overlap or fold, and faces that came bare; solids from the kernel give nothing."""

from __future__ import annotations

import numpy as np
import pytest
from oracles_cad import cube_sphere

from patchwright.models import Assembly, Cylinder, NurbsSurface, Plane, Sphere, Torus, samples
from patchwright.models.io import read, write
from patchwright.repair import diagnose

LINE = np.array([0.0, 0.0, 1.0, 1.0])


def extruded(profile: list[tuple[float, float]]) -> NurbsSurface:
    """A Bezier curve in x, z drawn along y."""
    points = np.array([[x, 0.0, z] for x, z in profile])
    knots = np.repeat([0.0, 1.0], len(points))
    return NurbsSurface(
        (len(points) - 1, 1), (knots, LINE), np.stack([points, points + np.array([0.0, 1.0, 0.0])], axis=1)
    )


@pytest.mark.parametrize("surface", [Sphere((0, 0, 0), 2.0), Torus((1, 2, 3), (0, 0, 1), 2.0, 0.5)])
def test_bare_closed_surfaces_are_clean(surface: object) -> None:
    found = diagnose(Assembly.of(surface))
    assert found.defects == ()
    assert found.summary["watertight"]


def test_a_bare_cylinder_is_open_at_its_ends_only() -> None:
    found = diagnose(Assembly.of(Cylinder((0, 0, 0), (0, 0, 1), 1.0, v=(0.0, 2.0))))
    assert [d.kind for d in found.defects] == ["opening", "opening"]
    assert sorted(d.where[2] for d in found.defects) == pytest.approx([0.0, 2.0], abs=1e-9)


@pytest.mark.parametrize("gap", [0.0, 0.001, 0.01, 0.1])
def test_patches_drawn_back_are_told_by_their_gap(gap: float) -> None:
    """Six patches of the unit sphere, bare: unsewn where they meet, apart by the gap otherwise."""
    patches = samples.cube_sphere_patches(gap)
    surfaces = [surface for body in patches.bodies for surface in body.surfaces]
    found = diagnose(Assembly.of(surfaces))
    errors = [d for d in found.defects if d.severity == "error"]
    assert {d.kind for d in errors} == ({"gap"} if gap else {"open-edge"})
    assert sum(d.count for d in errors) == 24
    if gap:
        # the patch's parameter speed at its sides' middle is 4/3
        assert max(d.size for d in errors) == pytest.approx(4 / 3 * gap, rel=0.05)
    curve = {row["share"]: row["free_edges"] for row in found.summary["free_edges_by_tolerance"]}
    assert curve[1e-6] == (0 if gap == 0.0 else 24)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_overlapping_bodies_come_with_their_curve(scale: float) -> None:
    found = diagnose(Assembly.of([Sphere((0, 0, 0), scale), Sphere((scale, 0, 0), scale)]))
    (overlap,) = found.of("overlap")
    assert overlap.parts == ("part1", "part2")
    length = sum(np.linalg.norm(np.diff(c, axis=0), axis=1).sum() for c in overlap.curves)
    assert length == pytest.approx(2 * np.pi * np.sqrt(0.75) * scale, rel=0.01)
    assert not diagnose(Assembly.of([Sphere((0, 0, 0), scale), Sphere((2.1 * scale, 0, 0), scale)])).of("overlap")


def test_a_surface_through_itself_and_one_that_folds() -> None:
    loop = diagnose(Assembly.of(extruded([(0, 0), (3, 2), (-2, 2), (1, 0)])))
    (crossing,) = loop.of("self-intersection")
    assert crossing.where[0] == pytest.approx(0.5, abs=0.02), "the profile is symmetric about x = 1/2"
    fold = diagnose(Assembly.of(extruded([(0, 0), (1, 0), (0.1, 0)])))
    (folded,) = [d for d in fold.of("parametrisation") if d.severity == "error"]
    # x = 2t(1 - t) + 0.1 t^2 turns at t = 1/1.9
    assert folded.where[0] == pytest.approx(1 / 1.9, abs=0.01)
    bend = diagnose(Assembly.of(extruded([(0, 0), (1, 0.05), (0.1, 0.1)])))
    assert not [d for d in bend.of("parametrisation", "self-intersection") if d.severity == "error"], "a narrow bend"
    plain = diagnose(Assembly.of(Plane((0, 0, 0), (0, 0, 1), u=(0, 2), v=(0, 3))))
    assert [d.kind for d in plain.defects] == ["opening"]


def test_a_solid_through_step_gives_nothing(tmp_path) -> None:
    write(tmp_path / "ball.step", cube_sphere())
    found = diagnose(read(tmp_path / "ball.step"))
    assert found.clean
    assert found.summary["watertight"]
    assert found.summary["invalid_faces"] == 0
    assert found.summary["largest_vertex_tolerance"] <= 1e-6 * found.summary["diagonal"]


@pytest.mark.parametrize("name", ["featuretype.step", "nacelle.stp", "turbine_part.stp", "fuselage_patches.stp"])
def test_no_crossing_and_no_fold_in_files_that_have_none(data, name: str) -> None:
    found = diagnose(read(data(name)))
    assert not [d for d in found.of("overlap", "self-intersection", "parametrisation") if d.severity == "error"]


@pytest.mark.slow
def test_invalid_faces_come_with_what_the_kernel_blames(data) -> None:
    with pytest.warns(UserWarning, match="could not be tessellated"):
        found = diagnose(read(data("b1_invalid_faces.stp")))
    assert [("wires" in d.message, d.severity) for d in found.of("invalid-face")] == [(True, "error")] * 2
    assert found.summary["largest_vertex_tolerance"] > 1e-3 * found.summary["diagonal"]
