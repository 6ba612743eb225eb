"""The flow domain: named or guessed, it sets no tolerance, bounds the fluid untouched, and stays on its planes."""

from __future__ import annotations

import numpy as np
import pytest
from oracles_shells import box, hemisphere, moved, soup, sphere, tube, without

from patchwright.models import Assembly, ParameterError, Part, Tolerance, Triangulation
from patchwright.repair import Domain, diagnose, plan_repair, repair
from patchwright.repair.ladder import fit_tolerance
from patchwright.repair.surroundings import surroundings


def placed(t: Triangulation, scale: float = 1.0, at: tuple[float, float, float] = (0, 0, 0)) -> Triangulation:
    return Triangulation(scale * t.vertices + np.array(at), t.triangles)


def assembly(**parts: Triangulation) -> Assembly:
    return Assembly(tuple(Part(name, t) for name, t in parts.items()))


def half(noise: float = 0.0) -> Triangulation:
    """The half y > 0 of a ball, its border off the plane by `noise`."""
    up = hemisphere(True, 0.0, 32)
    flat = np.abs(up.vertices[:, 2:]) < 1e-12
    turned = Triangulation(np.where(flat, up.vertices * [1, 1, 0], up.vertices)[:, [1, 2, 0]], up.triangles)
    move = noise * np.random.default_rng(0).normal(size=turned.vertices.shape)
    return Triangulation(turned.vertices + move, turned.triangles)


BALL, ROOM = sphere(24), placed(box(), 40.0, (-20, -20, -20))


@pytest.mark.parametrize("inward", [False, True])
def test_a_far_field_sets_no_tolerance_and_stays_as_it_came(inward: bool) -> None:
    room = Triangulation(ROOM.vertices, ROOM.triangles[:, ::-1]) if inward else ROOM
    model = assembly(body=without(BALL, np.array([40])), room=room)
    found = diagnose(model)
    (far,) = found.of("far-field")
    assert far.parts == ("room",)
    assert [d.kind for d in found.defects if d.severity == "error"] == ["gap"], "facing the fluid is not inside out"
    assert found.summary["diagonal"] == pytest.approx(BALL.diagonal)
    plan = plan_repair(model)
    assert [item.kind for item in plan.items] == ["bridge"]
    assert any("room taken for a far field" in reason for reason in plan.domain)


def test_the_repaired_model_holds_the_far_field_triangle_for_triangle() -> None:
    model = assembly(body=BALL, room=ROOM)
    result = repair(model)
    assert result.verdict == "clean"
    tags = result.triangulation.tags
    own = result.triangulation.take(tags == result.triangulation.tag_names.index("room"))
    assert np.array_equal(own.corners, ROOM.corners)
    assert all(face.origin == ("body",) for face in result.faces)
    assert any(e.parts == ("room",) and e.rung == "keep" for e in result.ledger)


def test_a_half_model_connected_with_its_symmetry_plane_is_no_far_field() -> None:
    from patchwright.models.samples.high_lift import dirty_high_lift

    model = dirty_high_lift(0).assembly
    around = surroundings(model)
    assert around.far_field == ("farfield", "symmetry")
    assert around.body(model).names == ("fuselage", "main", "flap")


@pytest.mark.parametrize("flip", [False, True])
def test_a_loose_scrap_of_a_large_surface_is_no_body_in_a_far_field(flip: bool) -> None:
    whole = sphere(48)
    near = np.linalg.norm(whole.corners.mean(axis=1) - 1.0 / np.sqrt(3.0), axis=1) < 0.15
    scrap = whole.take(near)
    scrap = Triangulation(scrap.vertices, scrap.triangles[:, ::-1] if flip else scrap.triangles).compact()
    rest = whole.take(~near).compact()
    # torn off along its border: as they lie, and with the scrap a little smaller
    for shrink in (1.0, 0.97):
        middle = scrap.vertices.mean(axis=0)
        loose = Triangulation(middle + shrink * (scrap.vertices - middle), scrap.triangles)
        offset = len(rest.vertices)
        both = Triangulation(
            np.concatenate([rest.vertices, loose.vertices]), np.concatenate([rest.triangles, loose.triangles + offset])
        )
        around = surroundings(Assembly.of(both))
        assert not around.aside.any()
        assert around.far_field == ()


def test_named_far_field_of_any_size_is_no_part_of_the_body() -> None:
    model = assembly(body=BALL, room=placed(box(), 3.0, (-1.5, -1.5, -1.5)))
    assert surroundings(model).far_field == (), "too near to be guessed"
    around = surroundings(model, Domain(far_field=("room",)))
    assert around.body(model).names == ("body",)
    assert Tolerance.of(around.body_size(model)).fit == pytest.approx(1e-4 * BALL.diagonal)
    assert not surroundings(assembly(body=BALL, room=ROOM), Domain(far_field=())).aside.any(), "told that there is none"


def test_bodies_round_the_fluid_point_are_kept() -> None:
    """The inner ball would lie inside the outer body and go; with the fluid between them both bound it."""
    model = assembly(ball=BALL, vessel=placed(box(), 4.0, (-2, -2, -2)))
    assert any(item.kind == "inner surface" for item in plan_repair(model).items)
    fluid = Domain(fluid=(1.5, 1.5, 1.5))
    assert plan_repair(model, domain=fluid).items == ()
    assert surroundings(model, fluid).body(model).names == ("ball",)
    outside = Domain(fluid=(9.0, 0.0, 0.0))
    assert not surroundings(model, outside).aside.any()


def test_symmetry_nodes_are_zero_exactly_through_mending_and_patches() -> None:
    noisy = half(1e-5)
    assert np.abs(noisy.vertices[np.abs(noisy.vertices[:, 1]) < 1e-3, 1]).max() > 0.0
    result = repair(noisy, domain=Domain(symmetry=("y",)))
    assert result.verdict == "repaired"
    assert result.grid is not None
    grid = np.concatenate([np.asarray(block).reshape(-1, 3) for block in result.grid.blocks])
    for points in (result.triangulation.vertices, grid):
        near = np.abs(points[:, 1]) < 1e-3
        assert near.sum() >= 32
        assert (points[near, 1] == 0.0).all()
    # the patches' border rows themselves, sampled elsewhere than the grid
    t = np.linspace(0.0, 1.0, 37)
    sides = ((t, 0.0 * t), (t, 1 + 0.0 * t), (0.0 * t, t), (1 + 0.0 * t, t))
    borders = [s(u, v)[:, 1] for s in result.network.surfaces() for u, v in sides]
    on = [y for y in borders if np.abs(y).max() < 1e-3]
    assert on
    assert all((y == 0.0).all() for y in on)


def test_the_opening_on_a_symmetry_plane_is_planned() -> None:
    assert [d.severity for d in diagnose(half()).of("opening")] == ["warning"]
    found = diagnose(half(), domain=Domain(symmetry=("y",)))
    assert found.clean
    assert "symmetry plane y = 0" in found.of("opening")[0].message
    kinds = [item.kind for item in plan_repair(half(), openings="close", domain=Domain(symmetry=("y",))).items]
    assert kinds == []
    assert [item.kind for item in plan_repair(half(), openings="close").items] == ["close"]


def test_planned_openings_stay_open_when_the_others_are_closed() -> None:
    pipe = tube(3.0)
    inlet = Domain(openings=((0.0, 0.0, 0.1),))
    assert [d.severity for d in diagnose(pipe, domain=inlet).of("opening")] == ["warning", "info"]
    (item,) = plan_repair(pipe, openings="close", domain=inlet).items
    assert item.where == pytest.approx((0, 0, 3))


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_gaps_of_a_part_are_kept_as_told(scale: float) -> None:
    model = assembly(nose=placed(hemisphere(True, 0.05), scale), tail=placed(hemisphere(False, -0.05), scale))
    assert [item.kind for item in plan_repair(model).items] == ["bridge"]
    keep = Domain(gaps={"tail": "keep"})
    assert plan_repair(model, domain=keep).items == ()
    assert [d.severity for d in diagnose(model, domain=keep).of("gap")] == ["info"]


def test_parts_have_fit_tolerances_of_their_own() -> None:
    fine = sphere(96)  # facets 5e-4 high
    model = assembly(wing=fine, pod=placed(fine, 1.0, (3, 0, 0)))
    limits = fit_tolerance(model, surroundings(model, Domain(tolerances={"pod": 3e-2})), 1e-2)
    assert (limits.fit, limits.tightest, limits.given) == (1e-2, 1e-2, True)
    assert limits.of_tags(("wing", "pod"), np.array([1, 0, 1])).tolist() == [3e-2, 1e-2, 3e-2]
    assert limits.careful.fit == 1e-2
    tight = fit_tolerance(model, surroundings(model, Domain(tolerances={"pod": 3e-3})), 1e-2)
    assert (tight.fit, tight.careful.fit, tight.careful.gap) == (1e-2, 3e-3, tight.gap), "no part is moved by more"
    result = repair(model, tolerance=1.5e-3, domain=Domain(tolerances={"pod": 3e-2}))
    assert result.network is not None
    tags = result.network.layout.tags
    for tag, (name, limit) in enumerate((("wing", 1.5e-3), ("pod", 3e-2))):
        assert result.network.deviation[tags == tag].max() <= limit
        assert [r.input_to_output.tolerance for r in result.regions if r.name == name and r.input_to_output] == [limit]
    points = [int((np.asarray(result.network.nets.cells)[tags == tag] + 3).prod(axis=1).sum()) for tag in (0, 1)]
    assert points[1] < 0.8 * points[0]
    assert result.deviation is not None
    assert result.deviation.coverage > 0.999


def test_mixed_units_are_suspected_and_rivets_are_not() -> None:
    wing, pod = placed(BALL, 1.0, (3, 0, 0)), placed(BALL, 0.5, (3, 0, 1.2))
    assert not diagnose(assembly(wing=wing, pod=pod)).of("unit")
    (unit,) = diagnose(assembly(wing=wing, pod=placed(pod, 1e3))).of("unit")
    assert unit.severity == "warning"
    assert "pod" in unit.parts
    (unit,) = diagnose(assembly(wing=wing, pod=placed(pod, 1e-3))).of("unit")
    assert "pod" in unit.parts
    third = placed(BALL, 0.7, (4, 1, 0))
    (unit,) = diagnose(assembly(wing=wing, tail=third, pod=placed(pod, 1e-3))).of("unit")
    assert unit.parts == ("pod",)
    rivet = placed(BALL, 1e-3, (3, 0, 1.0))
    assert not diagnose(assembly(wing=wing, rivet=rivet)).of("unit")


@pytest.mark.parametrize(
    ("domain", "words"),
    [
        (Domain(far_field=("hull",)), r"far field: no part is called 'hull'; the parts are body"),
        (Domain(symmetry=("w",)), r"neither x, y, z nor a part"),
        (Domain(symmetry=("body",)), r"does not lie in a coordinate plane"),
        (Domain(gaps={"hull": "keep"}), r"gap policy: no part"),
        (Domain(tolerances={"hull": 1.0}), r"tolerance: no part"),
        (Domain(far_field=("body",)), r"no body is left"),
    ],
)
def test_a_domain_that_names_what_is_not_there_is_told(domain: Domain, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        repair(assembly(body=BALL), domain=domain)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"farfield": "box"}, "has no farfield"),
        ({"gaps": {"flap": "maybe"}}, "must be one of close, keep"),
        ({"tolerances": {"flap": -1}}, "positive length"),
        ({"fluid": [0, 1]}, "three coordinates"),
        ({"fluid": [0, 1, float("nan")]}, "finite"),
        ({"symmetry": 3}, "list of names"),
        ({"gaps": 3}, "a table"),
        ({"openings": [[0, 1]]}, "three coordinates"),
    ],
)
def test_tables_without_meaning_are_told(table: dict[str, object], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        Domain.from_table(table)


def test_a_recipe_table_gives_the_same_domain() -> None:
    table = {"far_field": "box", "symmetry": ["y"], "fluid": [0, 1, 2], "gaps": {"flap": "keep"}}
    assert Domain.from_table(table) == Domain(("box",), ("y",), (0.0, 1.0, 2.0), gaps={"flap": "keep"})


def test_guesses_do_not_depend_on_place_and_scale() -> None:
    for k, scale in enumerate((1e-3, 1.0, 1e3)):
        model = moved(soup(BALL, ROOM), scale, k)
        assert surroundings(Assembly.of(model)).aside.sum() == len(ROOM)
