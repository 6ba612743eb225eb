"""Injected defects on several shapes: the right kind, place and number, and nothing else; clean shapes give nothing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import partial

import dirty_shapes as shapes
import numpy as np
import pytest
from oracles_shells import box, moved, sphere, tube

from patchwright.models import Assembly, Part, Triangulation, samples
from patchwright.models.samples import Damaged
from patchwright.repair import diagnose

SHAPES = {
    name: getattr(samples, name)().assembly.triangulation
    for name in ("sphere", "ellipsoid", "torus", "cube", "blade", "car")
}
OPENINGS = {"blade": 2}  # the blade's ends


def placed(t: Triangulation, scale: float = 1.0, at: tuple[float, float, float] = (0, 0, 0)) -> Triangulation:
    return Triangulation(scale * t.vertices + np.array(at), t.triangles)


def assembly(**parts: Triangulation) -> Assembly:
    return Assembly(tuple(Part(name, t) for name, t in parts.items()))


def check(damaged: Damaged, shape: str, *also: str) -> None:
    """Every label has a defect of its kind near it, there are no more of that kind, and no other kinds but `also`."""
    found = diagnose(damaged.triangulation)
    got = Counter(d.kind for d in found.defects if d.severity != "info")
    if OPENINGS.get(shape) and "opening" not in {i.kind for i in damaged.defects}:
        got -= Counter(opening=OPENINGS[shape])
    wanted = Counter(i.kind for i in damaged.defects)
    assert set(got) - set(also) == set(wanted), got
    for kind, count in wanted.items():
        defects = found.of(kind)
        # neighbouring labels may be one region, and rims of one ring may be two
        assert 1 <= len(defects) <= max(count, 2)
        for label in (i for i in damaged.defects if i.kind == kind):
            reach = 1e-3 * damaged.triangulation.diagonal
            low, high = label.box
            assert any((d.box[0] <= high + reach).all() and (d.box[1] >= low - reach).all() for d in defects)


INJECTORS: dict[str, Callable[..., Damaged]] = {
    "missing": partial(samples.missing_triangles, share=0.003),
    "flipped": partial(samples.flipped, share=0.01),
    "duplicated": partial(samples.duplicated, share=0.01),
    "degenerate": partial(samples.degenerate, share=0.01),
    "t-junctions": partial(samples.t_junctions, share=0.005),
}


@pytest.mark.parametrize("shape", ["sphere", "torus", "cube", "blade"])
@pytest.mark.parametrize("name", INJECTORS)
def test_scattered_defects_are_found_with_their_number_and_place(name: str, shape: str) -> None:
    if (name, shape) == ("missing", "blade"):
        pytest.skip("a triangle missing at the border changes the opening")
    for seed in (0, 1):
        check(INJECTORS[name](SHAPES[shape], seed=seed), shape)


@pytest.mark.parametrize("shape", ["sphere", "torus", "cube"])
def test_needles_come_with_the_t_junctions_their_splits_leave(shape: str) -> None:
    check(samples.needles(SHAPES[shape], 0.005, seed=2), shape, "t-junction", "gap")


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("share", [0.002, 0.02])
def test_a_slit_is_one_gap_of_its_width_and_no_t_junction(shape: str, share: float) -> None:
    t = SHAPES[shape]
    low, high = t.bounds
    axis = int(np.argmax(high - low))
    damaged = samples.slit(t, 0.5 * (low + high) + 0.013 * (high - low), np.eye(3)[axis], share * t.diagonal)
    check(damaged, shape, "needle")
    widths = [d.size for d in diagnose(damaged.triangulation).of("gap")]
    # straight across on a surface that is not parallel to the axis is farther by its slope
    assert all(0.99 <= w / (share * t.diagonal) < 1.6 for w in widths)


@pytest.mark.parametrize("shape", SHAPES)
def test_halves_pushed_into_each_other_are_overlaps_and_nothing_else(shape: str) -> None:
    t = SHAPES[shape]
    low, high = t.bounds
    axis = int(np.argmax(high - low))
    middle = 0.5 * (low + high) + 0.013 * (high - low)
    check(samples.push_apart(t, middle, np.eye(3)[axis], -0.01 * t.diagonal), shape)


@pytest.mark.parametrize("offset", [1e-7, 1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_a_second_layer_is_an_overlap_of_both_parts(offset: float, scale: float) -> None:
    ball = placed(sphere(24), scale)
    cap = ball.take(ball.corners.mean(axis=1)[:, 2] > 0.5 * scale).compact()
    found = diagnose(assembly(skin=ball, patch=placed(cap, 1.0 + offset)))
    (layer,) = found.of("overlap")
    assert (layer.severity, layer.parts, layer.count) == ("error", ("skin", "patch"), 2 * len(cap))
    assert layer.box[0, 2] == pytest.approx(cap.vertices[:, 2].min(), abs=0.01 * scale)
    assert not diagnose(assembly(skin=ball, pod=placed(ball, 1.0, (3 * scale, 0, 0)))).of("overlap")


def test_bodies_that_touch_or_all_but_touch_are_told_from_slots() -> None:
    cube = box()
    touching = diagnose(assembly(a=cube, b=placed(cube, 0.5, (1, 0.21, 0.17))))
    (contact,) = touching.of("overlap")
    assert (contact.severity, contact.parts) == ("warning", ("a", "b"))
    assert contact.where[0] == pytest.approx(1.0)
    near = diagnose(assembly(a=cube, b=placed(cube, 1.0, (1.0001, 0.0, 0.0))))
    (gap,) = near.of("gap")
    assert gap.severity == "warning"
    assert gap.size == pytest.approx(1e-4, rel=1e-3)
    assert diagnose(assembly(a=cube, b=placed(cube, 1.0, (1.01, 0.0, 0.0)))).clean
    assert diagnose(samples.slotted_flap().assembly).clean, "a flap's slot is no gap"
    plate = Triangulation(cube.vertices * [1, 1, 1e-4], cube.triangles)
    assert {d.kind for d in diagnose(plate).defects} <= {"thin", "needle"}, "one body's own skins are thin, no layers"


@pytest.mark.parametrize("gap", [0.01, 0.05, 0.09])
def test_an_end_that_all_but_reaches_another_part_is_a_gap_of_its_width(gap: float) -> None:
    plate = Triangulation(box().vertices * [6, 6, 1] + [-3, -3, -1 - gap], box().triangles)
    found = diagnose(assembly(tube=tube(3.0), plate=plate))
    (defect,) = found.of("gap")
    assert (defect.severity, defect.parts) == ("error", ("tube", "plate"))
    assert defect.size == pytest.approx(gap, rel=1e-6)
    assert [d.where[2] for d in found.of("opening")] == pytest.approx([3.0])
    far = Triangulation(plate.vertices - [0, 0, 0.5], plate.triangles)
    assert not diagnose(assembly(tube=tube(3.0), plate=far)).of("gap")


def test_crossings_come_with_their_curves() -> None:
    """Two unit spheres a distance apart cross in a circle of known place and length."""
    ball = sphere(48)
    offset = np.array([1.0, 0.03, 0.02])
    (overlap,) = diagnose(assembly(a=ball, b=placed(ball, 1.0, tuple(offset)))).of("overlap")
    half = 0.5 * np.linalg.norm(offset)
    length = sum(np.linalg.norm(np.diff(c, axis=0), axis=1).sum() for c in overlap.curves)
    assert length == pytest.approx(2 * np.pi * np.sqrt(1 - half**2), rel=5e-3)
    points = np.concatenate(overlap.curves)
    assert np.abs((points - 0.5 * offset) @ offset / np.linalg.norm(offset)).max() < 5e-3
    assert "curve" in overlap.message
    assert overlap.to_json()["curves"][0][0] == overlap.curves[0][0].tolist()


def test_a_body_through_itself_has_a_curve_of_its_own() -> None:
    ball = sphere(48)
    pushed = ball.vertices.copy()
    pushed[pushed[:, 2] > 0.9, 2] -= 2.2
    (crossing,) = diagnose(Triangulation(pushed, ball.triangles)).of("self-intersection")
    assert len(crossing.curves) == 1
    assert np.array_equal(crossing.curves[0][0], crossing.curves[0][-1]), "closed"
    assert not diagnose(ball).of("self-intersection")


def test_loose_pieces_are_components_with_their_place() -> None:
    scrap = placed(box((1,) * 6, skip=(0, 1, 2)), 0.02, (2, 0, 0))
    damaged = samples.debris(sphere(32), scrap)
    (stray,) = [d for d in diagnose(damaged.triangulation).of("component") if d.severity == "warning"]
    assert stray.where == pytest.approx(scrap.corners.mean(axis=(0, 1)), abs=0.02)


@pytest.mark.parametrize("shape", ["sphere", "ellipsoid", "torus", "cube", "car", "capsule"])
def test_clean_shapes_give_nothing_wherever_they_lie(shape: str) -> None:
    t = getattr(samples, shape)().assembly.triangulation
    for k, scale in enumerate((1e-3, 1.0, 1e3)):
        assert diagnose(moved(t, scale, k)).defects == ()


def test_an_open_sheet_gives_its_border_only() -> None:
    found = diagnose(samples.wavy_patch().assembly)
    assert [(d.kind, d.severity) for d in found.defects] == [("opening", "warning")]


@pytest.mark.parametrize("scale", [1e-3, 1e3])
@pytest.mark.parametrize("fits", [0.5, 1.5, 4.0, 20.0])
def test_the_clearance_between_two_bodies_is_told_with_its_width(fits: float, scale: float) -> None:
    one = shapes.box((1, 1, 1))
    width = fits * 1e-4 * np.sqrt(6.0)  # of the diagonal of both
    other = Triangulation(one.vertices + np.array([1.0 + width, 0.0, 0.0]), one.triangles)
    parts = [Part(n, Triangulation(scale * t.vertices, t.triangles)) for n, t in (("left", one), ("right", other))]
    found = diagnose(Assembly(tuple(parts))).of("gap")
    assert len(found) == (fits <= 10.0)
    for gap in found:
        assert gap.size == pytest.approx(scale * width, rel=1e-6)
        assert gap.parts == ("left", "right")
        assert gap.severity == ("warning" if fits <= 2.0 else "info")
        assert np.allclose(gap.where, scale * np.array([0.5, 0.0, 0.0]), atol=scale * width)


@pytest.mark.parametrize("thickness", [1e-4, 1e-2])
def test_thin_parts_of_a_thick_model_are_found_with_their_place(thickness: float) -> None:
    # a fin of few triangles beside a ball of many
    fin = shapes.box((0.3, 0.2, thickness))
    fin = Triangulation(fin.vertices + np.array([2.0, 0.0, 0.0]), fin.triangles)
    found = diagnose(Assembly((Part("ball", shapes.sphere(5)), Part("fin", fin)))).of("thin")
    assert len(found) == (thickness < 1e-3)
    for thin in found:
        assert thin.parts == ("fin",)
        assert np.linalg.norm(thin.where - [2.0, 0.0, 0.0]) < 0.1
        assert thin.count > 20
