"""The mathematics healing rests on: curves and surfaces carried on, moved rigidly, moved at a border; pcurves."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models import Cone, Cylinder, NurbsCurve, NurbsSurface, Plane, Sphere, Torus
from patchwright.models.boundary_strip import Border, border_space, through, with_borders
from patchwright.models.cad.editing import compacted, in_chains, welded
from patchwright.models.errors import ParameterError
from patchwright.models.extension import curve_on, surface_on
from patchwright.models.knots import greville
from patchwright.models.rigid_motion import RigidMotion
from patchwright.models.samples.cube_sphere import cube_sphere_patches
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.cad.pcurves import below, spline

RNG = np.random.default_rng(3)
KNOTS = np.array([0.0, 0, 0, 0, 0.3, 0.7, 1, 1, 1, 1])
PATCH = next(iter(cube_sphere_patches(0.1).bodies[0].surfaces))
SURFACES = [
    Plane([1, 2, 3], [1, 1, 2], u=(-1, 1), v=(0, 2)),
    Cylinder([1, 0, 0], [0, 1, 1], 0.7, u=(0.2, 1.4), v=(0, 2)),
    Cone([0, 0, 1], [1, 0, 1], 0.3, 1.0, u=(0.2, 1.4), v=(0, 1)),
    Sphere([1, 1, 0], 2.0, u=(0.2, 1.4), v=(-0.5, 0.5)),
    Torus([0, 1, 0], [0, 1, 2], 3.0, 1.0, u=(0.2, 1.4), v=(0.3, 1.5)),
    PATCH,
]


@pytest.mark.parametrize("room", [0.01, 0.5])
def test_a_polynomial_is_carried_on_as_itself(room):
    # one cubic polynomial, written with inner knots
    points = RNG.normal(size=(4, 3))
    whole = NurbsCurve(3, np.repeat([-1.0, 2.0], 4), points)
    piece = whole.insert_knots([0.2, 0.6]).restricted(0.0, 1.0)
    longer = curve_on(piece, -room, 1.0 + room)
    t = np.linspace(-room, 1.0 + room, 41)
    assert np.abs(longer(t) - whole(t)).max() <= 1e-13
    shorter = curve_on(piece, 0.3, 0.9)
    assert np.abs(shorter(np.linspace(0.3, 0.9, 9)) - whole(np.linspace(0.3, 0.9, 9))).max() <= 1e-14
    with pytest.raises(ParameterError, match="no range"):
        curve_on(piece, 1.0, 0.5)


def test_a_sphere_patch_is_carried_on_on_the_sphere():
    (u0, u1), (v0, v1) = PATCH.domain
    wide = surface_on(PATCH, (u0 - 0.05, u1 + 0.05), (v0, v1 + 0.05))
    points = wide.grid(np.linspace(u0 - 0.05, u1 + 0.05, 31), np.linspace(v0, v1 + 0.05, 31))
    assert np.abs(np.linalg.norm(points, axis=2) - 1.0).max() <= 1e-12
    inside = np.linspace(u0, u1, 9), np.linspace(v0, v1, 9)
    assert np.abs(wide.grid(*inside) - PATCH.grid(*inside)).max() <= 1e-13


@pytest.mark.parametrize("surface", SURFACES, ids=lambda s: type(s).__name__)
def test_a_moved_surface_is_the_moved_points(surface):
    motion = RigidMotion.of(np.array([0.3, -0.2, 0.5]), np.array([1.0, 0, 2]), np.array([0.1, 0.2, 0.3]))
    (u0, u1), (v0, v1) = surface.domain
    u, v = np.linspace(u0, u1, 7)[:, None], np.linspace(v0, v1, 7)
    moved = motion.surface(surface)
    assert np.abs(moved(u, v) - motion(surface(u, v))).max() <= 1e-14 * 30
    assert moved.domain == surface.domain


@pytest.mark.parametrize("depth", [0.05, 0.2, 0.4])
def test_only_the_strip_changes_and_its_border_is_the_target(depth):
    space = border_space(PATCH, "u0", np.zeros(0))
    rail = greville(space.degree, space.knots)
    target = through(space, space(rail) + 0.02 * np.sin(9.0 * rail)[:, None] * np.array([0.0, 0.0, 1.0]))
    ends = through(space, space(rail))
    assert np.abs(ends.control_points - space.control_points).max() <= 1e-13
    moved = with_borders(PATCH, {"u0": Border(target, depth)})
    t = np.linspace(*target.domain, 33)
    assert np.abs(moved.boundary("u0")(t) - target(t)).max() <= 1e-14
    (u0, u1), v = PATCH.domain[0], np.linspace(*PATCH.domain[1], 17)
    beyond = np.linspace(u0 + depth, u1, 33)
    assert np.abs(moved.grid(beyond, v) - PATCH.grid(beyond, v)).max() <= 1e-12
    within = np.linspace(u0, u0 + 0.5 * depth, 9)
    assert np.abs(moved.grid(within, v) - PATCH.grid(within, v)).max() >= 1e-3


def test_two_borders_that_meet_move_together_and_must_agree():
    shift = np.array([0.0, 0.0, 0.01])
    borders = {}
    for side in ("u0", "v0"):
        space = border_space(PATCH, side, np.array([0.4]))
        borders[side] = Border(through(space, space(greville(space.degree, space.knots)) + shift), 0.2)
    moved = with_borders(PATCH, borders)
    for side, border in borders.items():
        t = np.linspace(*border.target.domain, 33)
        assert np.abs(moved.boundary(side)(t) - border.target(t)).max() <= 1e-14
    one = borders["u0"].target
    apart = NurbsCurve(one.degree, one.knots, one.control_points + np.array([0.0, 0.0, 0.01]), one.weights)
    with pytest.raises(ParameterError, match="corner"):
        with_borders(PATCH, {**borders, "u0": Border(apart, 0.2)})


def test_the_fold_free_strip_keeps_the_tangent_plane_of_a_plane():
    # a border of a flat patch moved within its plane: the patch stays flat and does not fold
    x, y = np.meshgrid(np.linspace(0, 1, 6), np.linspace(0, 1, 6), indexing="ij")
    flat = NurbsSurface((3, 3), (KNOTS, KNOTS), np.stack([x, y, 0 * x], axis=2))
    space = border_space(flat, "u1", np.zeros(0))
    target = through(space, space(greville(3, space.knots)) + np.array([0.05, 0.0, 0.0]))
    moved = with_borders(flat, {"u1": Border(target, 0.3)})
    t = np.linspace(0, 1, 41)
    normal = np.cross(moved.grid(t, t, (1, 0)), moved.grid(t, t, (0, 1)))
    assert np.abs(normal[..., :2]).max() <= 1e-12
    assert normal[..., 2].min() > 0.0


@pytest.mark.parametrize("accuracy", [1e-6, 1e-9, 1e-11])
def test_a_pcurve_is_as_near_as_asked(accuracy):
    torus = Torus([0, 0, 0], [0, 0, 1], 3.0, 1.0)
    t = np.linspace(0.0, 1.0, 60)
    curve = spline(t, torus(1.0 + t, 0.5 + t**2))
    exact = below(torus, curve, accuracy)
    assert exact.residual <= max(accuracy, 1e-8)  # the curve itself strays from the torus by its own interpolation


def test_pcurves_of_lines_and_circles_are_straight():
    cylinder = Cylinder([0, 0, 0], [0, 0, 1], 2.0, u=(0.0, 1.0), v=(0.0, 1.0))
    ruling = NurbsCurve(1, np.array([0.0, 0, 1, 1]), cylinder(np.array([0.5, 0.5]), np.array([0.0, 1.0])))
    longer = curve_on(ruling, -2.0, 3.0)
    found = below(cylinder, longer, 1e-12)
    assert found.pcurve.degree == 1
    assert found.residual <= 1e-14
    assert found.surface.domain[1] == pytest.approx((-2.0, 3.0))


def triangle(vertices, loops_ends):
    line = NurbsCurve(1, np.array([0.0, 0, 1, 1]), np.array([[0.0, 0, 0], [1, 0, 0]]))
    flat = NurbsCurve(1, np.array([0.0, 0, 1, 1]), np.array([[0.0, 0], [1, 0]]))
    uses = tuple(EdgeUse(i, False, flat) for i in range(len(loops_ends)))
    return Topology(np.array(vertices), (line,) * len(loops_ends), np.array(loops_ends), ((uses,),))


def test_loops_close_after_near_corners_became_one():
    near = [[0.0, 0, 0], [1, 0, 0], [1, 1e-9, 0], [0, 1, 0], [0, 1e-9, 0]]
    torn = triangle(near, [[0, 1], [2, 3], [3, 4]])
    assert in_chains(list(torn.loops[0][0]), torn.ends) is None
    joined = compacted(welded(torn, 1e-8))
    assert len(joined.vertices) == 3
    (chain,) = in_chains(list(joined.loops[0][0]), joined.ends)
    assert len(chain) == 3
