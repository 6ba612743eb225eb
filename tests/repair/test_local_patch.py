"""Single patches over geometry that is known: exact shapes, gaps, crossings, thin skins, loose sheets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patchwright.models.assembly import Assembly, Part
from patchwright.models.curvature_jump import curvature_jump
from patchwright.models.errors import GeometryError, ParameterError
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples import cube, sphere, wavy_patch
from patchwright.models.triangulation import Triangulation, concatenate
from patchwright.pipelines.paper_patches import approximate_case, patch_cases
from patchwright.repair.patches.approximant import bicubic_approximant
from patchwright.repair.patches.local_patch import Status, approximate
from patchwright.repair.patches.patch_ground import PatchGround
from patchwright.repair.patches.patch_sides import Sides, edge_side, iso_side, laid, polyline, through
from patchwright.repair.patches.side_paths import intersection_side, path_along, section_side
from patchwright.repair.patches.tensor_fit import tensor_fit


def wavy() -> tuple[NurbsSurface, Assembly]:
    sample = wavy_patch()
    surface = sample.surfaces["patch"]["patch"]
    part = sample.assembly.parts[0]
    return surface, Assembly((Part("patch", part.triangulation, surface=surface),), source="wavy")


def iso_sides(surface: NurbsSurface, a: float = 0.1, b: float = 0.9) -> Sides:
    return Sides.of(
        iso_side(surface, "v", a, a, b), iso_side(surface, "u", b, a, b),
        iso_side(surface, "v", b, a, b), iso_side(surface, "u", a, a, b), 1e-9,
    )  # fmt: skip


def bent(points: np.ndarray) -> np.ndarray:
    x, y = points[..., 0], points[..., 1]
    return np.stack([x, y, 0.3 * x**3 - 0.2 * x * y + 0.1 * y**2], axis=-1)


def test_a_cubic_surface_is_reproduced_by_least_squares() -> None:
    u, v = np.linspace(0.0, 1.0, 17), np.linspace(0.0, 1.0, 21)
    grid = bent(np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1))
    made = tensor_fit(grid, u, v, np.array([0.0, 0.3, 1.0]), np.array([0.0, 0.5, 0.6, 1.0]))
    t = np.linspace(0.0, 1.0, 31)
    exact = bent(np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1))
    np.testing.assert_allclose(made.grid(t, t), exact, atol=1e-13)


def test_unknown_points_do_not_pull_on_the_data_beside_them() -> None:
    u = np.linspace(0.0, 1.0, 41)
    grid = bent(np.stack(np.meshgrid(u, u, indexing="ij"), axis=-1))
    known = np.ones((41, 41), dtype=bool)
    known[18:23, 10:30] = False
    spoilt = np.where(known[..., None], grid, np.add(grid, [0.0, 0.0, 0.02]))
    breaks = np.linspace(0.0, 1.0, 7)
    plain, relaxed = (tensor_fit(spoilt, u, u, breaks, breaks, k) for k in (None, known))
    off = [np.abs(s.grid(u, u) - grid)[known].max() for s in (plain, relaxed)]
    assert off[1] < 0.5 * off[0]


@pytest.mark.parametrize("form", ["c2", "c1"])
def test_the_error_falls_below_every_tolerance_on_the_true_surface(form: str) -> None:
    surface, model = wavy()
    sides, ground = iso_sides(surface), PatchGround.of(model)
    counts = []
    for tolerance in (1e-2, 1e-3, 1e-4, 1e-5):
        made = approximate(sides, ground, tolerance, form=form)
        assert made.status is Status.WITHIN
        assert made.misfit.largest <= tolerance
        t = np.linspace(0.0, 1.0, 83)  # none of them where the fit looked
        points = made.surface.grid(t, t).reshape(-1, 3)
        off = np.linalg.norm(surface.closest(points).points - points, axis=1)
        assert off.max() <= 2.0 * tolerance
        counts.append(made.control_points)
    assert counts == sorted(counts)


def test_few_knots_need_far_fewer_control_points_than_the_papers_uniform_refinement() -> None:
    surface, model = wavy()
    sides, ground = iso_sides(surface), PatchGround.of(model)
    ours = approximate(sides, ground, 1e-4)
    theirs = approximate(sides, ground, 1e-4, form="c1", twist="zero", refinement="uniform", parameters="uniform")
    assert ours.status is theirs.status is Status.WITHIN
    assert 9 * ours.control_points < theirs.control_points  # the C1 form alone costs nine times a C2 one of equal cells
    assert ours.curvature_jump < 1e-6 * theirs.curvature_jump


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**31))
def test_a_rigid_motion_and_a_scale_move_the_patch_with_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    scale, shift = 10.0 ** rng.uniform(-3, 3), rng.uniform(-2, 2, 3)
    surface, model = wavy()

    def move(points: np.ndarray) -> np.ndarray:
        return np.asarray(scale * (points @ turn.T + shift))

    body = model.parts[0].triangulation
    there = replace(surface, control_points=move(surface.control_points))
    moved = Assembly((Part("p", replace(body, vertices=move(body.vertices)), surface=there),))
    here = approximate(iso_sides(surface), model, 1e-3)
    other = approximate(iso_sides(there), moved, 1e-3 * scale)
    assert other.control_points == here.control_points
    t = np.linspace(0.0, 1.0, 9)
    np.testing.assert_allclose(other.surface.grid(t, t), move(here.surface.grid(t, t)), atol=1e-6 * scale)


def test_the_papers_gap_is_filled_near_the_unbroken_surface_and_said_to_be_invented() -> None:
    made = approximate_case(patch_cases()[1], "c2")
    assert made.patch.status is Status.WITHIN
    assert 0.1 < made.patch.invented < 0.2  # the gap is 0.12 wide of 0.8, and its cells are counted whole
    assert made.to_truth < 1e-3


def test_over_crossing_sheets_the_outermost_is_followed() -> None:
    case = patch_cases()[2]
    made = approximate_case(replace(case, hits="outermost"), "c1", "local")
    assert made.patch.misfit.largest < 1e-3 * case.model.diagonal
    points = made.patch.points.reshape(-1, 3)
    top = np.max([s(points[:, 0], points[:, 1])[:, 2] for s in case.truth], axis=0)  # both are graphs over (x, y)
    assert np.abs(points[:, 2] - top).max() < 1e-3 * case.model.diagonal


@pytest.mark.parametrize("turned", [False, True])
def test_a_loose_sheet_may_face_either_way(turned: bool) -> None:
    surface, model = wavy()
    body = model.parts[0].triangulation
    if turned:
        body = Triangulation(body.vertices, body.triangles[:, ::-1])
    made = approximate(iso_sides(surface), Triangulation(body.vertices, body.triangles), 1e-2)
    assert made.found.all()
    assert made.status is Status.WITHIN


def test_a_slit_in_a_thin_plate_is_a_gap_and_not_the_other_skin() -> None:
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 41), indexing="ij")
    index = np.arange(41 * 41).reshape(41, 41)
    a, b, c, d = (x.reshape(-1) for x in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    upper = Triangulation(np.stack([u, v, np.full_like(u, 0.02)], axis=-1).reshape(-1, 3), triangles)
    lower = Triangulation(np.stack([u, v, np.full_like(u, -0.02)], axis=-1).reshape(-1, 3), triangles[:, ::-1])
    rim = index[np.r_[0:41, [40] * 40, 40:-1:-1, [0] * 40], np.r_[[0] * 41, 1:41, [40] * 41, 39:-1:-1]]
    step = np.stack([rim, np.roll(rim, -1)], axis=1)
    step = step[step[:, 0] != step[:, 1]]
    n = 41 * 41
    wall = np.concatenate([
        np.stack([step[:, 0] + n, step[:, 1] + n, step[:, 1]], axis=1),
        np.stack([step[:, 0] + n, step[:, 1], step[:, 0]], axis=1),
    ])  # fmt: skip
    whole = concatenate([upper, lower])
    plate = Triangulation(whole.vertices, np.concatenate([whole.triangles, wall]))
    x = plate.corners.mean(axis=1)
    open_plate = plate.take(~((np.abs(x[:, 0] - 0.5) < 0.06) & (x[:, 2] > 0.019)))
    sides = Sides.of(*(through([p, q]) for p, q in zip(CORNERS, np.roll(CORNERS, -1, axis=0), strict=True)), 1e-9)
    made = approximate(sides, open_plate, 1e-3)
    assert np.abs(made.points[..., 2] - 0.02).max() < 1e-12
    assert 0.1 < made.invented < 0.3


CORNERS = np.array([[0.1, 0.1, 0.02], [0.9, 0.1, 0.02], [0.9, 0.9, 0.02], [0.1, 0.9, 0.02]])


def test_with_nothing_below_the_coons_patch_is_the_answer_and_says_so() -> None:
    corners = np.add(CORNERS, [0.0, 0.0, 50.0])
    sides = Sides.of(*(through([p, q]) for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True)), 1e-9)
    made = approximate(sides, sphere(1.0, cells=12).assembly, 1e-3)
    assert made.status is Status.NOTHING
    assert made.invented == 1.0
    assert np.abs(made.surface.grid(np.linspace(0, 1, 5), np.linspace(0, 1, 5))[..., 2] - 50.02).max() < 1e-12


def test_sides_may_run_either_way_and_must_meet() -> None:
    surface, _ = wavy()
    s = iso_sides(surface)
    turned = Sides.of(s.south.reversed, s.east, s.north, s.west.reversed, 1e-9)
    u = np.linspace(0.0, 1.0, 7)
    for a, b in zip(turned.rows(u, u), s.rows(u, u), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9)
    with pytest.raises(GeometryError, match="corner by"):
        Sides.of(s.south, s.east, s.north, through([[5.0, 5.0, 5.0], [6.0, 5.0, 5.0]]), 1e-3)


def test_a_section_is_carried_over_its_gaps_on_the_shorter_way() -> None:
    body = sphere(1.0, cells=48).assembly.triangulation
    middle = body.corners.mean(axis=1)
    angle = np.degrees(np.arctan2(middle[:, 1], middle[:, 0]))
    broken = body.take(~((np.abs(angle - 40.0) < 8.0) & (np.abs(middle[:, 2]) < 0.3)))
    side = section_side(broken, (0, 0, 0.05), (0, 0, 1), (1, 0, 0), (0, 1, 0))
    assert side.curve.length() == pytest.approx(0.5 * np.pi * np.sqrt(1 - 0.05**2), rel=5e-3)
    points = side.curve.control_points
    assert (points[:, 0] > -1e-9).all()
    assert (points[:, 1] > -1e-9).all()
    with pytest.raises(GeometryError, match="does not meet"):
        section_side(body, (0, 0, 3), (0, 0, 1), (1, 0, 0), (0, 1, 0))


def test_an_intersection_curve_is_a_side() -> None:
    first = sphere(1.0, cells=48).assembly.triangulation
    second = Triangulation(np.add(first.vertices, [1.0, 0.0, 0.0]), first.triangles)
    radius = np.sqrt(0.75)
    side = intersection_side(first, second, (0.5, radius, 0.0), (0.5, 0.0, radius))
    assert side.curve.length() == pytest.approx(0.5 * np.pi * radius, rel=1e-2)


def test_a_path_takes_the_pieces_and_leaps_the_gap() -> None:
    lines = [np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[1.2, 0, 0], [2, 0, 0]]), np.array([[0.0, 5, 0], [2, 5, 0]])]
    path = path_along(lines, (0.25, 0.1, 0), (1.75, -0.1, 0))
    np.testing.assert_allclose(path, [[0.25, 0, 0], [1, 0, 0], [1.2, 0, 0], [1.75, 0, 0]], atol=1e-12)
    with pytest.raises(GeometryError, match="same place"):
        path_along(lines, (0.5, 0, 0), (0.5, 0, 0))
    with pytest.raises(GeometryError, match="no length"):
        polyline(np.zeros((3, 3)))


def test_an_edge_needs_a_cad_model() -> None:
    with pytest.raises(GeometryError, match="has no edges"):
        edge_side(cube().assembly, (0, 0, 0), (1, 0, 0))


def test_straight_sides_are_laid_on_the_surface() -> None:
    surface, model = wavy()
    corners = surface(np.array([0.1, 0.9, 0.9, 0.1]), np.array([0.1, 0.1, 0.9, 0.9]))
    drawn = Sides.of(*(through(corners[[k, (k + 1) % 4]]) for k in range(4)), 1e-9)
    on = laid(drawn, PatchGround.of(model).under(drawn))
    for side in (on.south, on.east, on.north, on.west):
        points = side.at(np.linspace(0.0, 1.0, 50))
        assert np.linalg.norm(surface.closest(points).points - points, axis=1).max() < 1e-5


def test_a_c1_surface_jumps_in_curvature_by_what_its_second_derivatives_say() -> None:
    # z = x |x| / 2 between x = -1 and 1, as two parabolas: curvature -1 and 1 at x = 0, tangent (1, 0)
    net = np.zeros((5, 2, 3))
    net[:, :, 0] = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])[:, None]
    net[:, 1, 1] = 1.0
    net[:, :, 2] = np.array([-0.5, 0.0, 0.0, 0.0, 0.5])[:, None]
    surface = NurbsSurface((2, 1), ([-1, -1, -1, 0, 0, 1, 1, 1], [0, 0, 1, 1]), net)
    assert curvature_jump(surface) == pytest.approx(2.0, abs=1e-6)
    smooth = bicubic_approximant(
        np.stack([*np.meshgrid([0.0, 1, 2], [0.0, 1, 2], indexing="ij"), np.zeros((3, 3))], -1)
    )
    assert curvature_jump(smooth) < 1e-12


@pytest.mark.parametrize(
    ("options", "word"),
    [({"form": "c3"}, "form"), ({"twist": "x"}, "twist"), ({"hits": "first"}, "hits"), ({"offset": -1.0}, "offset"),
     ({"most": 2}, "at least"), ({"filling": "tar"}, "filling"), ({"refinement": "none"}, "refinement")],
)  # fmt: skip
def test_what_makes_no_sense_is_said(options: dict[str, object], word: str) -> None:
    surface, model = wavy()
    with pytest.raises(ParameterError, match=word):
        approximate(iso_sides(surface), model, 1e-3, **options)  # type: ignore[arg-type]
