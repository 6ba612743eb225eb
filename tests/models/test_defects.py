"""Injected defects: labels say exactly what was done, seeds reproduce, labels survive later damage."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from patchwright.models import GeometryError, ParameterError, Triangulation
from patchwright.models.samples import (
    aircraft,
    capsule,
    crossing,
    damage,
    debris,
    degenerate,
    demo_aircraft,
    duplicated,
    eight_defects,
    flipped,
    missing_triangles,
    needles,
    poor_parametrisation,
    push_apart,
    slit,
    slotted_flap,
    sphere,
    t_junctions,
    torus,
    two_spheres,
    uneven_knots,
    unmerged,
    wavy_patch,
)

RANDOM = [missing_triangles, flipped, duplicated, t_junctions, needles, degenerate]


@pytest.fixture(scope="module")
def ball() -> Triangulation:
    return sphere().assembly.parts[0].triangulation


def uses(mesh: Triangulation, *, merge: bool = False) -> np.ndarray:
    """How often each undirected edge is used, after merging equal corners when asked."""
    triangles = mesh.triangles
    if merge:
        _, same = np.unique(np.round(mesh.vertices, 12) + 0.0, axis=0, return_inverse=True)
        triangles = same.reshape(-1)[triangles]
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)[1]


def free_length(mesh: Triangulation) -> float:
    edges = np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]])
    unique, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    a, b = mesh.vertices[unique[count == 1]].swapaxes(0, 1)
    return float(np.linalg.norm(b - a, axis=1).sum())


@pytest.mark.parametrize(
    "injector", [*RANDOM, partial(unmerged, radius=1e-3)], ids=lambda f: getattr(f, "__name__", "unmerged")
)
def test_seeds_reproduce(ball, injector):
    a, b, c = (injector(ball, seed=s) for s in (4, 4, 5))
    assert np.array_equal(a.triangulation.corners, b.triangulation.corners)
    assert [d.where.tolist() for d in a.defects] == [d.where.tolist() for d in b.defects]
    assert not np.array_equal(
        a.triangulation.corners[: len(c.triangulation)], c.triangulation.corners[: len(a.triangulation)]
    )


@pytest.mark.parametrize("share", [0.01, 0.1, 0.4])
def test_missing_triangles_are_labelled_to_the_last_area(ball, share):
    out = missing_triangles(ball, share, seed=2)
    assert len(ball) - len(out.triangulation) == round(share * len(ball))
    lost = ball.areas.sum() - out.triangulation.areas.sum()
    assert sum(d.area for d in out.defects) == pytest.approx(lost, rel=1e-12)
    assert {d.kind for d in out.defects} == {"gap"}
    # holes are apart: no label shares an edge with another, so there are fewer labels than triangles dropped
    assert len(out.defects) <= round(share * len(ball))
    assert sum(len(d.points) for d in out.defects) == 3 * round(share * len(ball))
    for d in out.defects:
        assert (d.points >= d.box[0]).all()
        assert (d.points <= d.box[1]).all()
        assert d.size == pytest.approx(np.linalg.norm(d.box[1] - d.box[0]))


def test_holes_joined_by_an_edge_are_one_label(ball):
    from patchwright.models.samples.defects import removed

    first = 400
    shared = [np.intersect1d(ball.triangles[first], t).size for t in ball.triangles]
    beside, touching = shared.index(2), shared.index(1)
    assert len(removed(ball, np.array([first, beside])).defects) == 1
    assert len(removed(ball, np.array([first, touching])).defects) == 2


@pytest.mark.parametrize("width", [1e-3, 0.02, 0.1])
def test_slit_has_plane_rims_and_exact_area(width):
    # along the ring of a torus a slit of width w about z = 0 cuts two bands; about y = 0 two tubes
    mesh = torus(cells=48).assembly.parts[0].triangulation
    out = slit(mesh, (0.0, 0.11, 0.0), (0.0, 1.0, 0.0), width)
    assert len(out.defects) == 2
    lost = mesh.areas.sum() - out.triangulation.areas.sum()
    assert sum(d.area for d in out.defects) == pytest.approx(lost, rel=1e-9)
    edges = np.concatenate([out.triangulation.triangles[:, k] for k in ([0, 1], [1, 2], [2, 0])])
    unique, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    rim = out.triangulation.vertices[unique[count == 1].reshape(-1)]
    assert np.abs(np.abs(rim[:, 1] - 0.11) - 0.5 * width).max() < 1e-15
    assert set(count) == {1, 2}
    assert all(d.size == width for d in out.defects)
    # the pieces keep the plane of their triangle
    same = np.einsum("ij,ij->i", out.triangulation.normals, mesh.normals[out.origin])
    assert same.min() > 1.0 - 1e-6


def test_slit_in_the_upper_skin_only_leaves_the_lower_one_whole():
    mesh = slotted_flap().assembly.parts[0].triangulation
    out = slit(mesh, (0.5, 0.0, 0.0), (1.0, 0.0, 0.0), 0.01, facing=(0.0, 0.0, 1.0))
    assert len(out.defects) == 1
    label = out.defects[0]
    assert label.box[0, 2] > 0.0
    assert label.area == pytest.approx(0.6 * 0.01, rel=0.01)
    assert set(uses(out.triangulation)) == {1, 2}
    assert free_length(out.triangulation) == pytest.approx(2.0 * 0.6 + 2.0 * 0.01, rel=0.01)


def test_slit_keeps_uv_on_the_surface():
    sample = wavy_patch()
    mesh = sample.assembly.parts[0].triangulation
    out = slit(mesh, (0.413, 0.0, 0.0), (1.0, 0.2, 0.0), 0.05).triangulation
    # x = u and y = v on this patch
    assert np.abs(out.uv - out.corners[..., :2]).max() < 1e-12


def test_slit_through_vertices_makes_no_slivers():
    mesh = wavy_patch(cells=10).assembly.parts[0].triangulation
    out = slit(mesh, (0.5, 0.0, 0.0), (1.0, 0.0, 0.0), 0.2)
    assert len(out.triangulation) == len(mesh) - 2 * 10 * 2
    assert out.defects[0].kind == "gap"


@pytest.mark.parametrize("distance", [0.02, 0.2, -0.1])
def test_pushed_hemispheres(ball, distance):
    out = push_apart(ball, (0.0, 0.0, 0.1), (0.0, 0.0, 1.0), distance)
    (label,) = out.defects
    assert label.kind == ("gap" if distance > 0.0 else "overlap")
    assert label.size == abs(distance)
    assert np.ptp(out.triangulation.bounds[:, 2]) == pytest.approx(2.0 + distance)
    assert out.triangulation.areas.sum() == pytest.approx(ball.areas.sum(), rel=1e-12)
    assert free_length(out.triangulation) * abs(distance) / 2.0 == pytest.approx(label.area, rel=1e-12)


def test_hemispheres_apart_are_the_capsule_without_its_wall(ball):
    apart = push_apart(ball, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.1).triangulation
    assert capsule(0.1).truth.distance(apart.vertices).max() < 1e-14


@pytest.mark.parametrize("radius", [0.0, 1e-4, 1e-2])
def test_unmerged_corners_fill_the_ball_of_the_jitter(ball, radius):
    out = unmerged(ball, radius, seed=1)
    mesh = out.triangulation
    assert len(mesh.vertices) == 3 * len(ball)
    assert (uses(mesh) == 1).all()
    move = np.linalg.norm(mesh.corners - ball.corners, axis=2).reshape(-1)
    assert move.max() <= radius * (1.0 + 1e-9)
    # even in the ball: the share within r / 2 is 1 / 8, the mean distance 3 / 4 r
    assert move.mean() == pytest.approx(0.75 * radius, rel=0.02)


def test_flipped_and_duplicated_are_what_their_labels_say(ball):
    out = flipped(ball, 0.05, seed=1)
    turned = np.concatenate([d.triangles for d in out.defects])
    against = np.einsum("ij,ij->i", out.triangulation.normals, ball.normals) < 0.0
    assert np.array_equal(np.sort(turned), np.flatnonzero(against))
    twice = duplicated(ball, 0.05, seed=1)
    keys = np.sort(twice.triangulation.triangles, axis=1)
    for d in twice.defects:
        assert np.array_equal(keys[d.triangles[0]], keys[d.triangles[1]])
    assert sum(d.area for d in twice.defects) == pytest.approx(twice.triangulation.areas.sum() - ball.areas.sum())


@pytest.mark.parametrize("offset", [0.0, 1e-3])
def test_t_junctions_lie_beside_an_unsplit_edge(ball, offset):
    out = t_junctions(ball, 0.02, offset=offset, seed=1)
    assert len(out.triangulation) == len(ball) + len(out.defects)
    for d in out.defects:
        a, b, _ = ball.corners[out.origin[d.triangles[0]]]
        assert np.linalg.norm(d.where - 0.5 * (a + b)) == pytest.approx(offset, abs=1e-15)
    if not offset:
        assert out.triangulation.volume == pytest.approx(ball.volume, rel=1e-12)
    assert (uses(out.triangulation) == 1).sum() == 3 * len(out.defects)


@pytest.mark.parametrize("aspect", [1e2, 1e5])
def test_needles_have_their_aspect(ball, aspect):
    out = needles(ball, 0.02, aspect=aspect, seed=1)
    for d in out.defects:
        corners = out.triangulation.corners[d.triangles[0]]
        lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
        assert lengths.max() / lengths.min() == pytest.approx(aspect, rel=0.02)
    assert out.triangulation.areas.sum() == pytest.approx(ball.areas.sum(), rel=1e-12)


def test_degenerate_triangles_have_no_area(ball):
    out = degenerate(ball, 0.02, seed=1)
    index = np.concatenate([d.triangles for d in out.defects])
    assert out.triangulation.areas[index].max() < 1e-15
    assert (out.origin[index] == -1).all()


@pytest.mark.parametrize("cells", [24, 48, 96])
def test_crossing_spheres_are_labelled_along_their_circle(cells):
    a, b = (p.triangulation for p in two_spheres(1.0, cells=cells).assembly.parts)
    (label,) = crossing(a, b).defects
    assert label.kind == "self-intersection"
    coarse = (np.pi / cells) ** 2
    assert label.size == pytest.approx(2.0 * np.pi * np.sqrt(0.75), rel=3.0 * coarse)
    assert np.abs(label.points[:, 0] - 0.5).max() < 2.0 * coarse


def test_crossing_refuses_bodies_that_do_not_meet(ball):
    away = Triangulation(ball.vertices + 5.0, ball.triangles)
    with pytest.raises(GeometryError, match="do not cross"):
        crossing(ball, away)
    hole = missing_triangles(ball, 0.01).triangulation
    with pytest.raises(GeometryError, match="not a closed manifold"):
        crossing(hole, away)
    assert debris(ball, away).defects[0].kind == "component"


def test_labels_follow_their_triangles_through_later_damage(ball):
    steps = (partial(flipped, share=0.05), partial(missing_triangles, share=0.3), partial(unmerged, radius=1e-6))
    out = damage(ball, steps, seed=7)
    assert out.origin.min() >= 0
    turned = np.einsum("ij,ij->i", out.triangulation.normals, ball.normals[out.origin]) < 0.0
    labelled = [d.triangles for d in out.defects if d.kind == "flipped"]
    assert np.array_equal(np.sort(np.concatenate(labelled)), np.flatnonzero(turned))
    again = damage(ball, steps, seed=7)
    assert np.array_equal(out.triangulation.corners, again.triangulation.corners)


def test_demo_aircraft_is_dirty_as_promised():
    demo = demo_aircraft(seed=1)
    assert demo.assembly.names == ("fuselage", "wing", "tail", "fin")
    mesh = demo.assembly.triangulation
    assert 45_000 < len(mesh) < 55_000
    assert (uses(mesh) == 1).all()
    ring = demo.defects[0]
    assert ring.kind == "gap"
    assert ring.size == pytest.approx(0.075)
    assert ring.area == pytest.approx(2.0 * np.pi * 0.54 * 0.075, rel=2e-3)
    clean = demo.sample.assembly.triangulation
    lost = sum(d.area for d in demo.defects if d.kind == "gap")
    before, after = clean.areas.sum(), clean.areas.sum() - lost
    assert mesh.areas.sum() == pytest.approx(after, rel=2e-3)
    assert (lost - ring.area) / before == pytest.approx(0.01, rel=0.1)
    # no other body reaches into the slit
    for part in demo.sample.assembly.parts[1:]:
        assert part.triangulation.bounds[0, 0] > ring.box[1, 0] + 0.1
    other = demo_aircraft(seed=2)
    assert not np.array_equal(mesh.vertices[:100], other.assembly.triangulation.vertices[:100])


def test_slit_of_one_named_body_only():
    mesh = aircraft(triangles=6_000).assembly.triangulation
    out = slit(mesh, (4.5, 0.0, 0.0), (1.0, 0.0, 0.0), 0.1, only=("fuselage",))
    for i in (1, 2, 3):
        assert np.array_equal(
            out.triangulation.take(out.triangulation.tags == i).areas, mesh.take(mesh.tags == i).areas
        )
    assert len(out.defects) == 1
    with pytest.raises(ParameterError, match="nacelle"):
        slit(mesh, (4.5, 0.0, 0.0), (1.0, 0.0, 0.0), 0.1, only=("nacelle",))
    with pytest.raises(ParameterError, match="positive width"):
        slit(mesh, (4.5, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0)


def test_eight_defects_are_what_they_claim():
    cases = eight_defects()
    assert list(cases) == ["gap1", "gap5", "gap10", "overlap5", "tjunc", "selfx", "missface", "flipdup"]
    for name, case in cases.items():
        count = uses(case.triangulation, merge=True)
        assert ((count == 1).sum() == 0) == case.closed, name
        assert case.volume > 0.0
    assert np.ptp(cases["gap10"].triangulation.bounds[:, 2]) == pytest.approx(2.2)
    assert np.ptp(cases["overlap5"].triangulation.bounds[:, 2]) == pytest.approx(1.9)
    assert len(cases["tjunc"].triangulation) == 2 * 2 * (64 + 25 + 9)
    assert cases["missface"].triangulation.areas.sum() == pytest.approx(5.0)
    assert cases["tjunc"].triangulation.volume == pytest.approx(1.0)


@pytest.mark.parametrize("ratio", [0.1, 5.0, 50.0])
@pytest.mark.parametrize(
    "surface", [wavy_patch().bodies[0].surfaces[0], torus().bodies[0].surfaces[0]], ids=["wavy", "torus"]
)
def test_poor_parametrisation_keeps_the_shape(surface, ratio):
    poor = poor_parametrisation(surface, ratio)
    assert poor.domain == surface.domain
    t = np.linspace(0.0, 1.0, 41)
    u = t / (t + ratio * (1.0 - t))
    assert np.abs(poor.grid(t, t) - surface.grid(u, u)).max() < 1e-13
    speed = [np.linalg.norm(poor(e, 0.5, nu=(1, 0))) / np.linalg.norm(surface(e, 0.5, nu=(1, 0))) for e in (0.0, 1.0)]
    v = 0.5 / (0.5 + ratio * 0.5)
    speed = [np.linalg.norm(poor(e, 0.5, nu=(1, 0))) / np.linalg.norm(surface(e, v, nu=(1, 0))) for e in (0.0, 1.0)]
    assert speed[1] / speed[0] == pytest.approx(ratio**2, rel=1e-9)


def test_uneven_knots_converge_to_the_shape_with_the_fourth_power():
    surface = wavy_patch().bodies[0].surfaces[0]
    t = np.linspace(0.0, 1.0, 61)

    def off(points: int) -> float:
        grid = uneven_knots(surface, points=points).grid(t, t)
        return float(np.abs(surface(np.clip(grid[..., 0], 0, 1), np.clip(grid[..., 1], 0, 1)) - grid).max())

    errors = [off(n) for n in (21, 41, 81)]
    assert errors[0] / errors[1] > 8.0
    assert errors[1] / errors[2] > 8.0
    assert errors[2] < 1e-5
