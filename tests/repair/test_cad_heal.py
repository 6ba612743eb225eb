"""Damaged CAD solids healed with the least change: closed, untouched faces identical, judged by the re-read file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeSphere
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from oracles_cad_damage import (
    ROUNDED_VOLUME,
    SIZES,
    centre,
    cut_back,
    faces_of,
    loosest,
    pulled_back,
    read_shape,
    ring_of,
    rounded_box,
    shifted,
    shrunk,
    solid_volume,
    turned,
    written,
)

from patchwright.models import Assembly, Plane
from patchwright.models.cad import measure_seams, surface_difference
from patchwright.models.interpolation import interpolate_surface
from patchwright.models.io import read, write
from patchwright.models.samples.cube_sphere import cube_sphere_patches
from patchwright.repair import repair
from patchwright.repair.result import Rung, Verdict

DIAGONAL = float(np.linalg.norm(SIZES))
FACES = faces_of(rounded_box())
PULLED = {0, 3, 8}


def healed(path, tmp_path):
    """The repaired model and its written file, read again."""
    result = repair(read(path))
    assert result.verdict == Verdict.REPAIRED, result.problems
    write(tmp_path / "healed.step", result.to_assembly())
    return result, read(tmp_path / "healed.step")


def is_sound(again: Assembly, path) -> None:
    """One closed body whose seams are closed on the surfaces and not in tolerances."""
    diagonal = again.diagonal
    assert (again.topology.use_counts() == 2).all()
    assert len({part.body for part in again.parts}) == 1
    assert max(s.gap for s in measure_seams(again)) <= 1e-6 * diagonal
    assert loosest(read_shape(path)) <= max(1e-6 * diagonal, 1e-7)


def identical(result, before) -> list[str]:
    """Names of the faces whose surfaces are those of the input to 1e-12."""
    after = {part.name: part.surface for part in result.to_assembly().parts}
    assert sorted(after) == sorted(before.names)
    return [p.name for p in before.parts if surface_difference(p.surface, after[p.name]) <= 1e-12]


def volume(again: Assembly) -> float:
    return again.triangulation.volume


@pytest.mark.parametrize("share", [pytest.param(1e-3, marks=pytest.mark.slow), 1e-2])
def test_faces_with_pulled_back_trims_are_trimmed_again_and_every_surface_stays(tmp_path, share):
    # planes on opposite sides and a cylinder between others, so that no corner is lost on both its faces
    faces = [pulled_back(f, share * DIAGONAL, 1) if k in PULLED else f for k, f in enumerate(FACES)]
    path = written(tmp_path / "pulled.step", faces, PULLED)
    before = read(path)
    result, again = healed(path, tmp_path)
    is_sound(again, tmp_path / "healed.step")
    assert len(identical(result, before)) == len(FACES)
    assert sum(face.rung == Rung.CUT for face in result.faces) == 3
    assert volume(again) == pytest.approx(ROUNDED_VOLUME, rel=1e-3)


@pytest.mark.parametrize("face", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in (4, 6))])
def test_a_shifted_face_is_put_back_exactly_and_nothing_else_changes(tmp_path, face):
    rng = np.random.default_rng(face)
    vector = rng.normal(size=3)
    vector *= 0.005 * DIAGONAL / np.linalg.norm(vector)
    faces = [shifted(f, vector) if k == face else f for k, f in enumerate(FACES)]
    path = written(tmp_path / "shifted.step", faces, {face})
    before = read(path)
    result, again = healed(path, tmp_path)
    is_sound(again, tmp_path / "healed.step")
    assert len(identical(result, before)) >= len(FACES) - 1
    assert volume(again) == pytest.approx(ROUNDED_VOLUME, rel=1e-3)
    (change,) = [e for e in result.ledger if e.rung in (Rung.REALIGN, Rung.CUT)]
    assert change.largest_move <= 0.005 * DIAGONAL * (1 + 1e-9)
    bounds = np.stack([again.bounds[0], again.bounds[1]])
    assert np.abs(bounds - [np.zeros(3), SIZES]).max() <= 1e-9


def test_three_turned_faces_are_put_back(tmp_path):
    rng = np.random.default_rng(5)
    faces = [turned(f, rng.normal(size=3), 0.01) if k in (1, 4, 7) else f for k, f in enumerate(FACES)]
    path = written(tmp_path / "turned.step", faces, {1, 4, 7})
    before = read(path)
    result, again = healed(path, tmp_path)
    is_sound(again, tmp_path / "healed.step")
    assert len(identical(result, before)) >= len(FACES) - 3
    assert volume(again) == pytest.approx(ROUNDED_VOLUME, rel=1e-3)


@pytest.mark.parametrize("apart", [1e-3, -1e-3])
def test_a_cylinder_whose_caps_are_apart_is_one_valid_solid(tmp_path, apart):
    height = 3.0
    faces = faces_of(BRepPrimAPI_MakeCylinder(1.0, height).Shape())
    side = [np.sign(round(centre(face).Z() - 0.5 * height, 6)) for face in faces]
    lift = apart * np.sqrt(4.0 + 4.0 + height**2)
    moved = [shifted(face, (0, 0, s * lift)) if s else face for face, s in zip(faces, side, strict=True)]
    result, again = healed(written(tmp_path / "caps.step", moved, set(np.flatnonzero(side).tolist())), tmp_path)
    is_sound(again, tmp_path / "healed.step")
    assert max(s.gap for s in measure_seams(again)) <= 1e-9 * again.diagonal
    assert solid_volume(read_shape(tmp_path / "healed.step")) == pytest.approx(height * np.pi, rel=1e-9)
    assert [e.largest_move for e in result.ledger if e.rung == Rung.REALIGN] == pytest.approx(2 * [abs(lift)], rel=1e-6)


@pytest.mark.parametrize("face", [0, 3, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 2, 4, 5))])
def test_a_box_with_one_face_tilted_is_one_valid_solid(tmp_path, face):
    faces = faces_of(BRepPrimAPI_MakeBox(*SIZES).Shape())
    # about an axis in the face, so that it leaves its neighbours, and about an oblique one
    for axis in (np.eye(3)[(face // 2 + 1) % 3], np.array([1.0, 2.0, 3.0])):
        tilted = [turned(f, axis, 0.005) if k == face else f for k, f in enumerate(faces)]
        _, again = healed(written(tmp_path / "tilted.step", tilted, {face}), tmp_path)
        is_sound(again, tmp_path / "healed.step")
        assert max(s.gap for s in measure_seams(again)) <= 1e-9 * again.diagonal
        assert solid_volume(read_shape(tmp_path / "healed.step")) == pytest.approx(np.prod(SIZES), rel=1e-9)
        assert np.abs(again.bounds - [np.zeros(3), SIZES]).max() <= 1e-9


def test_a_face_turned_within_reach_of_its_neighbours_is_put_back_and_not_trimmed_where_it_is(data, tmp_path):
    # a face among its neighbours: what is free on the undamaged part is all that may be free
    shape = faces_of(read_shape(data("featuretype.step")))
    ring = ring_of(shape, 20)
    faces = [shape[k] for k in ring]
    whole = read(written(tmp_path / "whole.step", faces, set()))
    at = ring.index(20)
    faces[at] = turned(faces[at], (0.02, -0.98, -0.19), 0.005)
    _, again = healed(written(tmp_path / "turned.step", faces, {at}), tmp_path)
    assert (again.topology.use_counts() == 1).sum() == (whole.topology.use_counts() == 1).sum()
    assert max(s.gap for s in measure_seams(again)) <= 1e-9 * again.diagonal


def test_a_face_that_fits_nowhere_is_trimmed_where_it_crosses_its_neighbours(tmp_path):
    # the top, lifted and narrower by one width all round, so that no similarity lays its border onto the hole's
    lift = 0.003 * DIAGONAL
    top = max(range(len(FACES)), key=lambda k: centre(FACES[k]).Z())
    faces = [shifted(cut_back(f, 0.02), (0, 0, lift)) if k == top else f for k, f in enumerate(FACES)]
    path = written(tmp_path / "lifted.step", faces, {top})
    before = read(path)
    result, again = healed(path, tmp_path)
    is_sound(again, tmp_path / "healed.step")
    assert len(identical(result, before)) == len(FACES)
    assert again.bounds[1, 2] == pytest.approx(SIZES[2] + lift, abs=1e-9)
    assert volume(again) == pytest.approx(ROUNDED_VOLUME * (SIZES[2] + lift) / SIZES[2], rel=1e-3)


@pytest.mark.parametrize("share", [1e-3, pytest.param(1e-2, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "damage", [lambda face, by: cut_back(face, by * DIAGONAL), lambda face, by: shrunk(face, 1 - by)]
)
def test_neighbouring_faces_smaller_on_all_sides_reach_each_other_again(tmp_path, damage, share):
    # the top, a side and the rounded edge between two sides: planes and a cylinder that touch, cross, share corners
    which = {5, 0, 6}
    faces = [damage(f, share) if k in which else f for k, f in enumerate(FACES)]
    before = read(written(tmp_path / "smaller.step", faces, which))
    result, again = healed(tmp_path / "smaller.step", tmp_path)
    is_sound(again, tmp_path / "healed.step")
    assert len(identical(result, before)) >= len(FACES) - 1  # a cylinder scaled is another cylinder
    assert solid_volume(read_shape(tmp_path / "healed.step")) == pytest.approx(ROUNDED_VOLUME, rel=1e-9)


def test_a_face_lifted_and_shrunk_is_put_back_where_all_its_border_fits(tmp_path):
    top = max(range(len(FACES)), key=lambda k: centre(FACES[k]).Z())
    faces = [shifted(shrunk(f, 0.995), (0, 0, 0.04)) if k == top else f for k, f in enumerate(FACES)]
    result, again = healed(written(tmp_path / "lifted.step", faces, {top}), tmp_path)
    is_sound(again, tmp_path / "healed.step")
    assert solid_volume(read_shape(tmp_path / "healed.step")) == pytest.approx(ROUNDED_VOLUME, rel=1e-9)
    (change,) = [e for e in result.ledger if e.rung == Rung.REALIGN]
    assert "change of size by 1.00503" in change.reason  # 1 / 0.995


def test_a_gap_hidden_in_tolerances_is_taken_apart_and_closed(tmp_path):
    # the faces share their edges, but one surface is not where its edges are
    write_box = written(tmp_path / "box.step", FACES, set())
    model = read(write_box)
    at = next(i for i, p in enumerate(model.parts) if isinstance(p.surface, Plane) and abs(p.surface.normal[2]) > 0.9)
    plane = model.parts[at].surface
    lifted = Plane(plane.origin + 0.004 * DIAGONAL * plane.normal, plane.normal, plane.xdir, plane.u, plane.v)
    parts = [replace(p, surface=lifted, native=None) if i == at else p for i, p in enumerate(model.parts)]
    write(tmp_path / "hidden.step", replace(model, parts=tuple(parts), native=None))
    before = read(tmp_path / "hidden.step")
    assert (before.topology.use_counts() == 2).all()
    assert max(s.gap for s in measure_seams(before)) == pytest.approx(0.004 * DIAGONAL, rel=1e-6)
    result, again = healed(tmp_path / "hidden.step", tmp_path)
    is_sound(again, tmp_path / "healed.step")
    assert len(identical(result, before)) >= len(FACES) - 1


def test_two_sheets_side_by_side_are_not_laid_onto_each_other(tmp_path):
    wall = [FACES[0], shifted(FACES[0], np.array([0.05, 0.05, 0.05]))]
    before = read(written(tmp_path / "sheets.step", wall, {1}))
    result = repair(before)
    if result.faces:
        after = result.to_assembly()
        assert [surface_difference(a.surface, b.surface) for a, b in zip(before.parts, after.parts, strict=True)] == [
            0.0,
            0.0,
        ]


def test_a_sound_solid_comes_back_clean_and_identical(tmp_path):
    before = read(written(tmp_path / "box.step", FACES, set()))
    result = repair(before)
    assert result.verdict == Verdict.CLEAN
    after = result.to_assembly().parts
    assert max(surface_difference(a.surface, b.surface) for a, b in zip(before.parts, after, strict=True)) == 0.0


def bicubic_sphere(gap: float, count: int = 9):
    """Six bicubic patches nearly on the unit sphere, neighbours a share `gap` of a patch apart."""
    tangent = np.tan(np.linspace(-1.0, 1.0, count) * (1.0 - gap) * np.pi / 4.0)
    a, b = np.meshgrid(tangent, tangent, indexing="ij")
    one = np.ones_like(a)
    grids = [
        np.stack(f, axis=2) for f in ((one, a, b), (-one, b, a), (b, one, a), (a, -one, b), (a, b, one), (b, a, -one))
    ]
    return [interpolate_surface(g / np.linalg.norm(g, axis=2, keepdims=True), "c2-cubic") for g in grids]


@pytest.mark.parametrize(
    ("gap", "patches"),
    [
        (0.1, bicubic_sphere),
        pytest.param(0.001, bicubic_sphere, marks=pytest.mark.slow),
        pytest.param(
            0.05, lambda gap: [s for b in cube_sphere_patches(gap).bodies for s in b.surfaces], marks=pytest.mark.slow
        ),
    ],
)
def test_patches_that_miss_each_other_meet_on_their_surfaces(tmp_path, gap, patches):
    surfaces = patches(gap)
    write(tmp_path / "apart.step", Assembly.of(surfaces))
    before = read(tmp_path / "apart.step")
    result, again = healed(tmp_path / "apart.step", tmp_path)
    assert (again.topology.use_counts() == 2).all()
    assert max(s.gap for s in measure_seams(again)) <= 1e-9 * again.diagonal
    assert loosest(read_shape(tmp_path / "healed.step")) <= max(1e-6 * again.diagonal, 1e-7)
    assert all(face.rung == Rung.STRIP for face in result.faces)
    share = np.linspace(0.05, 0.95, 19)
    width = 0.5 * np.pi * gap
    for old, new in zip(before.parts, again.parts, strict=True):
        (u0, u1), (v0, v1) = old.surface.domain
        u, v = u0 + share * (u1 - u0), v0 + share * (v1 - v0)
        was, now = old.surface.grid(u, v), new.surface.grid(u, v)
        sides = [c(np.linspace(*c.domain, 99)) for c in map(old.surface.boundary, ("u0", "u1", "v0", "v1"))]
        away = np.linalg.norm(was[:, :, None] - np.concatenate(sides)[None, None], axis=3).min(axis=2)
        far = away > 5.0 * width
        assert np.abs(was - now)[far].max(initial=0.0) <= 1e-12
        # the sphere is followed: nearer than the chord across the gap, whose height is width^2 / 8
        off = [np.abs(np.linalg.norm(points, axis=2) - 1.0).max() for points in (was, now)]
        assert off[1] <= off[0] + width**2 / 8.0


@pytest.mark.slow
@pytest.mark.parametrize("share", [1e-3, 1e-2])
@pytest.mark.parametrize(
    ("damage", "which"),
    [
        (lambda face, size, rng: shifted(face, size * unit(rng)), (17, 22, 80)),
        (lambda face, size, rng: shifted(face, size * unit(rng)), (0, 30, 78)),
        (lambda face, size, rng: turned(face, unit(rng), size / 30.0), (20, 24, 85)),
        (lambda face, size, rng: pulled_back(face, size), (17, 50, 84)),
    ],
    ids=["shifted large", "shifted small", "turned", "pulled back"],
)
def test_a_real_part_with_three_damaged_faces_is_whole_again(data, tmp_path, damage, which, share):
    whole = read(data("featuretype.step"))
    rng, size = np.random.default_rng(sum(which)), share * whole.diagonal
    shape = faces_of(read_shape(data("featuretype.step")))
    faces = [damage(f, size, rng) if k in which else f for k, f in enumerate(shape)]
    path = written(tmp_path / "damaged.step", faces, set(which))
    before = read(path)
    result, again = healed(path, tmp_path)
    is_sound(again, tmp_path / "healed.step")
    assert len(identical(result, before)) >= len(shape) - 3
    assert sum(face.rung in (Rung.KEEP, Rung.WELD) for face in result.faces) >= 90
    assert again.triangulation.volume == pytest.approx(whole.triangulation.volume, rel=1e-4)


def unit(rng):
    """A random direction."""
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def test_a_displaced_half_of_a_hole_is_put_back_and_the_other_half_not_grown_over_its_place(data, tmp_path):
    # both halves lie on one cylinder, so the rest of the hole's rim lies on the surface of the half that stayed
    faces = faces_of(read_shape(data("featuretype.step")))
    faces[68] = shifted(faces[68], (0.3, 0.2, 0.25))
    before = read(written(tmp_path / "half.step", faces, {68}))
    result, again = healed(tmp_path / "half.step", tmp_path)
    is_sound(again, tmp_path / "healed.step")
    assert len(identical(result, before)) >= len(faces) - 1


def test_a_displaced_cap_with_a_pole_is_put_back(tmp_path):
    # half a ball on a tube: the pole is an edge without length that no neighbour answers
    radius, height = 1.0, 2.0
    tube = faces_of(BRepPrimAPI_MakeCylinder(radius, height).Shape())
    open_tube = [face for face in tube if centre(face).Z() < height - 1e-6]
    up = gp_Ax2(gp_Pnt(0, 0, height), gp_Dir(0, 0, 1))
    ball = faces_of(BRepPrimAPI_MakeSphere(up, radius, 0.0, 0.5 * np.pi).Shape())
    cap = max(ball, key=lambda face: centre(face).Z())
    path = written(tmp_path / "cap.step", [*open_tube, shifted(cap, (0.01, -0.005, 0.02))], {len(open_tube)})
    result, _ = healed(path, tmp_path)
    assert solid_volume(read_shape(tmp_path / "healed.step")) == pytest.approx(
        np.pi * radius**2 * height + 2 / 3 * np.pi * radius**3, rel=1e-9
    )
    assert [e.rung for e in result.ledger if e.rung == Rung.REALIGN] == [Rung.REALIGN]
