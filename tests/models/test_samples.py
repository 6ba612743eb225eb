"""Samples: closed, oriented bodies, exact truth, unions, invariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patchwright.models import GeometryError, ParameterError, Triangulation
from patchwright.models.samples import (
    Sample,
    aircraft,
    blade,
    capsule,
    car,
    cube,
    cube_sphere_patches,
    ellipsoid,
    slotted_flap,
    sphere,
    torus,
    two_spheres,
    wavy_patch,
)

CLOSED = {
    "aircraft": aircraft,
    "car": car,
    "slotted flap": slotted_flap,
    "sphere": sphere,
    "ellipsoid": ellipsoid,
    "torus": torus,
    "capsule": capsule,
    "cube": cube,
    "two spheres": two_spheres,
    "cube sphere": cube_sphere_patches,
}


@pytest.fixture(scope="module")
def plane() -> Sample:
    return aircraft()


def edge_uses(mesh: Triangulation) -> tuple[np.ndarray, bool]:
    """Uses of each undirected edge, and whether no directed edge occurs twice."""
    directed = np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]])
    _, uses = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    return uses, len(np.unique(directed, axis=0)) == len(directed)


@pytest.mark.parametrize("make", CLOSED.values(), ids=CLOSED)
def test_bodies_are_closed_manifold_and_outward(make):
    for part in make().assembly.parts:
        mesh = part.triangulation
        uses, oriented = edge_uses(mesh)
        assert (uses == 2).all(), part.name
        assert oriented
        assert mesh.volume > 0.0
        assert len(np.unique(mesh.triangles)) == len(mesh.vertices)
        assert len(mesh.vertices) - len(uses) + len(mesh) == (0 if part.name == "torus" else 2)
        assert mesh.areas.min() > 1e-12 * mesh.diagonal**2


@pytest.mark.parametrize("make", [*CLOSED.values(), blade, wavy_patch], ids=[*CLOSED, "blade", "wavy patch"])
def test_uv_of_every_corner_gives_its_vertex(make):
    sample = make()
    for body, part in zip(sample.bodies, sample.assembly.parts, strict=True):
        whole = body.tessellate()
        for i, surface in enumerate(body.surfaces):
            mine = whole.take(whole.tags == i)
            points = surface(mine.uv[..., 0], mine.uv[..., 1])
            assert np.abs(points - mine.corners).max() < 1e-10 * part.triangulation.diagonal


@pytest.mark.parametrize(("make", "rims"), [(blade, 2), (wavy_patch, 1)])
def test_open_samples_have_their_rims_and_no_volume(make, rims):
    sample = make()
    mesh = sample.assembly.parts[0].triangulation
    uses, oriented = edge_uses(mesh)
    assert set(uses) == {1, 2}
    assert oriented
    assert len(mesh.vertices) - len(uses) + len(mesh) == 2 - rims
    with pytest.raises(GeometryError, match="no volume"):
        _ = sample.truth.volume


def test_aircraft_has_the_promised_size_names_and_proportions(plane):
    assert plane.assembly.names == ("fuselage", "wing", "tail", "fin")
    assert abs(len(plane.assembly.triangulation) - 50_000) < 1_500
    fuselage, wing, tail, fin = (p.triangulation.bounds for p in plane.assembly.parts)
    assert np.ptp(fuselage[:, 0]) == pytest.approx(10.0, abs=1e-9)
    assert np.ptp(wing[:, 1]) > 2.5 * np.ptp(tail[:, 1])
    assert fin[1, 2] > 3.0 * fuselage[1, 2]
    # every body overlaps the fuselage: the union is one piece and smaller than the sum
    assert plane.truth.volume < 0.99 * sum(p.triangulation.volume for p in plane.assembly.parts)


@pytest.mark.parametrize("triangles", [5_000, 20_000])
def test_aircraft_triangle_count_follows_the_request(triangles):
    assert len(aircraft(triangles=triangles).assembly.triangulation) == pytest.approx(triangles, rel=0.08)


def test_wing_sides_meet_with_a_common_tangent_in_front_and_an_angle_behind(plane):
    upper, lower = (plane.surfaces["wing"][name] for name in ("upper", "lower"))
    span = np.linspace(*upper.domain[1], 23)
    for xi, smooth in ((0.0, True), (1.0, False)):
        a, b = upper(xi, span), lower(span, xi)
        assert np.abs(a - b).max() < 1e-14 * 10.0
        du, dv = upper(xi, span, nu=(1, 0)), upper(xi, span, nu=(0, 1))
        eu, ev = lower(span, xi, nu=(1, 0)), lower(span, xi, nu=(0, 1))
        m, n = np.cross(du, dv), np.cross(eu, ev)
        cos = np.einsum("ij,ij->i", m, n) / np.linalg.norm(m, axis=1) / np.linalg.norm(n, axis=1)
        assert (cos > 1.0 - 1e-12).all() if smooth else (cos < 0.0).all()


def test_tessellation_converges_at_second_order_in_volume():
    exact = 4.0 / 3.0 * np.pi
    body = sphere().bodies[0]
    errors = [exact - body.tessellate(density=d).volume for d in (1.0, 2.0, 4.0)]
    assert np.all(np.array(errors) > 0.0)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.02)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.02)


@pytest.mark.parametrize("chord", [1e-3, 1e-4, 1e-5])
def test_chord_bound_holds_between_the_lines(chord):
    body = ellipsoid().bodies[0]
    fine = body.tessellate(chord=chord)
    centre = fine.uv.mean(axis=1)
    on = body.surfaces[0](centre[:, 0], centre[:, 1])
    off = np.abs(np.einsum("ij,ij->i", on - fine.corners.mean(axis=1), fine.normals))
    assert 0.05 * chord < off.max() < chord


@pytest.mark.parametrize("make", [sphere, torus, capsule, cube_sphere_patches], ids=lambda m: m.__name__)
def test_patches_lie_on_the_closed_form_and_meshed_truth_agrees_with_it(make):
    sample = make()
    sampled = replace(sample.truth, chord=2e-4).sample(4_000, seed=3)
    assert sample.truth.distance(sampled.points).max() < 1e-14 * sample.assembly.diagonal
    meshed = replace(sample.truth, chord=2e-4, exact_distance=None, exact_volume=None, exact_area=None)
    rng = np.random.default_rng(0)
    probes = sampled.points + 0.2 * rng.uniform(-1.0, 1.0, (4_000, 1)) * sampled.normals
    error = np.abs(meshed.distance(probes) - sample.truth.distance(probes))
    # one Newton step squares the facet's error; beside a seam of the surface it stops there
    assert np.quantile(error, 0.98) < 1e-8
    assert error.max() < 0.05 * meshed.chord * sample.assembly.diagonal
    assert meshed.volume == pytest.approx(sample.truth.volume, rel=1e-6)
    assert meshed.area == pytest.approx(sample.truth.area, rel=1e-3)


def test_cube_distance_is_exact_outside_and_inside():
    points = np.array([[0.5, 0.5, 2.0], [2.0, 2.0, 2.0], [0.5, 0.5, 0.4], [1.0, 0.3, 0.2]])
    assert np.allclose(cube().truth.distance(points), [1.0, np.sqrt(3.0), 0.4, 0.0], atol=1e-15)


@pytest.mark.parametrize("apart", [0.3, 1.0, 1.7])
def test_union_volume_and_distance_of_two_spheres(apart):
    exact = two_spheres(apart).truth
    meshed = replace(exact, exact_volume=None, exact_area=None, chord=1e-4)
    assert meshed.volume == pytest.approx(exact.volume, rel=2e-6)
    assert meshed.area == pytest.approx(exact.area, rel=1e-3)
    sampled = meshed.sample(3_000, seed=1)
    centres = np.array([[0.0, 0.0, 0.0], [apart, 0.0, 0.0]])
    radius = np.linalg.norm(sampled.points[:, None] - centres, axis=2)
    # every point is on its own sphere, and inside the other one by no more than the chord allows
    assert np.abs(radius[np.arange(3_000), sampled.body] - 1.0).max() < 1e-14
    assert radius.min() > 1.0 - 1e-3
    assert np.bincount(sampled.body) == pytest.approx([1_500, 1_500], abs=120)
    outside = sampled.points + 0.3 * sampled.normals
    known = np.linalg.norm(outside[:, None] - centres, axis=2).min(axis=1) - 1.0
    free = known > 0.0  # near the waist a lifted point may be inside the other sphere
    assert free.sum() > 2_000
    assert np.abs(meshed.distance(outside[free]) - known[free]).max() < 1e-5


def test_distance_inside_the_union_stops_at_the_waist():
    meshed = replace(two_spheres(1.0).truth, chord=1e-4)
    # from the middle of the lens the nearest outer point is the waist circle, not the hidden caps half a radius away
    waist = meshed.distance(np.array([[0.5, 0.0, 0.0]]))[0]
    assert waist == pytest.approx(np.sqrt(0.75), abs=2.0 * meshed.chord * 4.0)


def test_aircraft_truth(plane):
    truth = plane.truth
    coarse = replace(truth, chord=1e-4)
    assert coarse.volume == pytest.approx(truth.volume, rel=1e-4)
    sampled = truth.sample(20_000, seed=5)
    assert np.linalg.norm(sampled.normals, axis=1) == pytest.approx(1.0, abs=1e-14)
    off = truth.distance(sampled.points) / plane.assembly.diagonal
    assert np.quantile(off, 0.99) < 1e-7
    assert off.max() < 2.0 * truth.chord
    assert set(sampled.body) == {0, 1, 2, 3}
    h = 1e-3
    lifted = truth.distance(sampled.points + h * sampled.normals)
    assert lifted.max() < h + 1e-6 * plane.assembly.diagonal
    assert np.quantile(np.abs(lifted - h), 0.9) < 1e-9  # the rest are beside a wing root or an edge
    # hidden points are no part of the truth: the wing's centre section is half a radius below the fuselage's axis
    assert truth.distance(np.array([[4.0, 0.0, -0.34]]))[0] > 0.15


def test_distance_moves_with_the_shape():
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    scale, shift = 3.0, np.array([5.0, -2.0, 1.0])
    here = replace(two_spheres().truth, chord=1e-4)
    bodies = tuple(b.moved(lambda points: scale * points @ turn.T + shift) for b in here.bodies)
    there = replace(here, bodies=bodies)
    probes = np.random.default_rng(2).uniform(-1.5, 2.5, (500, 3))
    error = there.distance(scale * probes @ turn.T + shift) - scale * here.distance(probes)
    assert np.abs(error).max() < 1e-5
    assert np.median(np.abs(error)) < 1e-9


def test_samples_are_reproducible_and_seeds_matter():
    truth = replace(ellipsoid().truth, chord=1e-3)
    a, b, c = (truth.sample(100, seed=s).points for s in (1, 1, 2))
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)


def test_points_are_spread_by_area():
    sampled = replace(cube().truth).sample(60_000, seed=0)
    side = np.argmax(np.abs(sampled.normals), axis=1) * 2 + (sampled.normals.sum(axis=1) > 0.0)
    counts = np.bincount(side)
    assert ((counts - 10_000) ** 2 / 10_000).sum() < 20.5  # chi-square, 5 degrees of freedom, 0.1 %


def test_slot_has_its_width():
    from patchwright.models.tree import Tree

    for slot in (0.01, 0.015, 0.03):
        main, flap = slotted_flap(slot=slot).truth.fine
        width = Tree.of(main).closest(np.array(flap.vertices)).distance.min()
        assert slot - 1e-5 < width < slot + 5e-5


def test_cube_sphere_patches_stay_on_the_sphere_and_leave_the_gap():
    whole, apart = cube_sphere_patches(), cube_sphere_patches(0.1)
    assert len(apart.bodies) == 6
    for body in apart.bodies:
        points = body.surfaces[0].grid(np.linspace(*body.surfaces[0].domain[0], 9), np.linspace(0.05, 0.95, 9))
        assert np.abs(np.linalg.norm(points, axis=-1) - 1.0).max() < 1e-14
    lost = whole.assembly.triangulation.areas.sum() - apart.assembly.triangulation.areas.sum()
    assert 0.12 < lost / (4.0 * np.pi) < 0.19  # below 1 - 0.9^2: the parameter runs slower along the edges
    with pytest.raises(ParameterError, match="gap"):
        cube_sphere_patches(1.0)


def test_wavy_patch_interpolates_its_formula():
    surface = wavy_patch(points=13).bodies[0].surfaces[0]
    t = np.linspace(0.0, 1.0, 13)
    grid = surface.grid(t, t)
    x, y = np.meshgrid(t, t, indexing="ij")
    formula = 0.15 * np.sin(2 * np.pi * x) * np.cos(np.pi * y) + 0.1 * x * y
    assert np.abs(grid - np.stack([x, y, formula], axis=-1)).max() < 1e-14


def test_faces_carry_surface_uv_and_body(plane):
    faces = plane.faces
    assert faces.is_cad
    assert faces.names[:3] == ("fuselage/skin", "wing/upper", "wing/lower")
    assert {p.body for p in faces.parts} == {"fuselage", "wing", "tail", "fin"}
    for part in faces.parts:
        uv = part.triangulation.uv
        assert uv is not None
        assert np.abs(part.surface(uv[..., 0], uv[..., 1]) - part.triangulation.corners).max() < 1e-9
