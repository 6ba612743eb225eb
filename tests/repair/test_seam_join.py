"""Seams of free edges: T-junctions, crude trims moved to where surfaces cross, nodes, sides, what must stay apart."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from patchwright.models import Assembly, Cylinder, NurbsCurve, NurbsSurface, Part, Plane, Sphere, Topology
from patchwright.models.arrays import Array
from patchwright.models.cad import measure_seams, surface_difference
from patchwright.models.interpolation import interpolate, interpolate_surface
from patchwright.models.topology import EdgeUse
from patchwright.models.triangulation import Triangulation
from patchwright.repair.cad.draft import Draft, Limits
from patchwright.repair.cad.face_sides import one_sided
from patchwright.repair.cad.meeting import on_all, on_both
from patchwright.repair.cad.pcurves import below, fitted
from patchwright.repair.cad.seam_join import COARSE, FINE, join_seams
from patchwright.repair.cad.seam_pieces import cut, seams
from patchwright.repair.cad.side_strip import strip_sides
from patchwright.repair.checks.bare_faces import completed

LIMITS = Limits.of(2.0, math.inf)


def bilinear(corners) -> NurbsSurface:
    """The bilinear surface of corners (0,0), (1,0), (1,1), (0,1)."""
    a, b, c, d = np.array(corners, dtype=float)
    knots = np.array([0.0, 0.0, 1.0, 1.0])
    return NurbsSurface((1, 1), (knots, knots), np.array([[a, d], [b, c]]))


def rectangle(x0, x1, y0, y1, z=0.0) -> NurbsSurface:
    return bilinear([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)])


def drafted(surfaces) -> Draft:
    """Faces on whole surfaces, each with four edges of its own."""
    model = completed(Assembly.of(surfaces))
    return Draft(model, model.topology)


def gaps(draft: Draft) -> Array:
    model = replace(draft.assembly, topology=draft.topology, native=None)
    return np.array([seam.gap for seam in measure_seams(model)])


def junction(gap: float = 0.0, tilt: float = 0.0) -> list[NurbsSurface]:
    """One rectangle beside three; `gap` (negative: overlap) between them, `tilt` lifts the far edge of the three."""
    ys = [0.0, 0.2, 0.7, 1.0]
    far = [bilinear([(gap, a, 0), (1, a, tilt), (1, b, tilt), (gap, b, 0)]) for a, b in pairwise(ys)]
    return [rectangle(-1.0, 0.0, 0.0, 1.0), *far]


def test_one_edge_against_three_is_cut_at_their_corners():
    draft = drafted(junction())
    whole = cut(draft, 1e-6)
    (long,) = [some for some in whole.pieces.values() if len(some) == 3]
    assert [piece.t1 for piece in long] == pytest.approx([0.2, 0.7, 1.0], abs=1e-12)
    found = seams(draft, whole, 1e-6, LIMITS)
    # three with the long edge, two between the three
    assert sorted(seam.faces for seam in found) == [(0, 1), (0, 2), (0, 3), (1, 2), (2, 3)]


def test_division_points_of_one_face_are_taken_out_again():
    # the second face has its border cut in four for no reason: one seam of the whole border results
    draft = drafted([rectangle(-1.0, 0.0, 0.0, 1.0), rectangle(0.0, 1.0, 0.0, 1.0)])
    topology = draft.topology
    loop, rows = topology.loops[1][0], []
    curves, ends, vertices = list(topology.curves), topology.ends.tolist(), topology.vertices.tolist()
    for use in loop:
        if np.abs(topology.curves[use.edge].control_points[:, 0]).max() > 0.0:
            rows.append(use)
            continue
        t0, t1 = topology.curves[use.edge].domain
        stops = t0 + (t1 - t0) * np.array([0.0, 0.15, 0.4, 0.9, 1.0])
        first, last = topology.ends[use.edge].tolist()
        corners = [first, *range(len(vertices), len(vertices) + 3), last]
        vertices += topology.curves[use.edge](stops[1:-1]).tolist()
        parts = []
        for k in range(4):
            parts.append(EdgeUse(len(curves), use.reversed, use.pcurve.restricted(stops[k], stops[k + 1])))
            curves.append(topology.curves[use.edge].restricted(stops[k], stops[k + 1]))
            ends.append(corners[k : k + 2])
        rows += parts[::-1] if use.reversed else parts
    cut_up = Topology(np.array(vertices), tuple(curves), np.array(ends), (topology.loops[0], (tuple(rows),)))
    joined, changes = join_seams(replace(draft, topology=cut_up), LIMITS)
    assert len(changes) == 1
    counts = joined.topology.use_counts()
    assert np.bincount(counts).tolist() == [0, 6, 1]


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("tilt", [0.0, 0.3])
@pytest.mark.parametrize("share", [0.0, 1e-5, 5e-4])
def test_t_junctions_close_and_surfaces_stay(share, tilt, scale):
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    shift = rng.normal(size=3)

    def moved(surface):
        return replace(surface, control_points=scale * (surface.control_points @ turn.T + shift))

    surfaces = [moved(s) for s in junction(-share, tilt)]
    draft = drafted(surfaces)
    joined, _ = join_seams(draft, Limits.of(2.0 * scale), (*FINE, *COARSE))
    assert (joined.topology.use_counts() == 1).sum() == 8
    assert (joined.topology.use_counts() == 2).sum() == 5
    # the tilted faces cross the plane beside their edges: the crossing is on both
    assert gaps(joined).max() <= 1e-9 * 2.0 * scale
    assert max(surface_difference(s, joined.surface(i)) for i, s in enumerate(surfaces)) == 0.0


@pytest.mark.parametrize("height", [5e-5, 5e-4])
def test_parallel_sheets_near_each_other_are_left_alone(height):
    draft = drafted([rectangle(0, 1, 0, 1), rectangle(0, 1, 0, 1, height)])
    joined, changes = join_seams(draft, LIMITS, (*FINE, *COARSE))
    assert changes == ()
    assert joined is draft


def tube_and_lid(chords: int) -> Draft:
    """Half a cylinder of radius and height 1, and a lid whose border is a polygon on the circle."""
    cylinder = Cylinder((0, 0, 0), (0, 0, 1), 1.0, u=(0.0, np.pi), v=(0.0, 1.0))
    lid = Plane((0, 0, 1), (0, 0, 1), u=(-1.0, 1.0), v=(0.0, 1.0))
    angles = np.linspace(0.0, np.pi, chords + 1)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    vertices = [(*p, 1.0) for p in ring] + [(1, 0, 0), (-1, 0, 0), (1, 0, 1), (-1, 0, 1)]
    n = chords + 1
    curves, ends, lid_loop = [], [], []

    def straight(a, b):
        return NurbsCurve(1, np.array([0.0, 0.0, 1.0, 1.0]), np.array([a, b], dtype=float))

    for k in range(chords):
        curves.append(straight(vertices[k], vertices[k + 1]))
        ends.append((k, k + 1))
        lid_loop.append(EdgeUse(k, False, straight(ring[k], ring[k + 1])))
    curves.append(straight(vertices[chords], vertices[0]))
    ends.append((chords, 0))
    lid_loop.append(EdgeUse(chords, False, straight(ring[-1], ring[0])))
    arc = cylinder.to_nurbs()
    first = len(curves)
    curves += [arc.boundary("v0"), straight((-1, 0, 0), (-1, 0, 1)), arc.boundary("v1"), straight((1, 0, 0), (1, 0, 1))]
    ends += [(n, n + 1), (n + 1, n + 3), (n + 2, n + 3), (n, n + 2)]
    uv = [below(cylinder, c, 1e-10, near=np.array([0.0, 0.0])).pcurve for c in curves[first:]]
    wall = [EdgeUse(first + k, k > 1, pcurve) for k, pcurve in enumerate(uv)]
    topology = Topology(np.array(vertices), tuple(curves), np.array(ends), ((tuple(wall),), (tuple(lid_loop),)))
    nothing = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    model = Assembly((Part("wall", nothing, cylinder), Part("lid", nothing, lid)), "mm", "", topology)
    return Draft(model, topology)


@pytest.mark.parametrize("chords", [80, 400])
def test_a_polygon_on_a_circle_becomes_the_circle(chords):
    draft = tube_and_lid(chords)
    sagitta = 1.0 - np.cos(0.5 * np.pi / chords)
    joined, changes = join_seams(draft, Limits.of(3.0), (*FINE, *COARSE))
    assert (joined.topology.use_counts() == 2).sum() == 1
    edge = int(np.flatnonzero(joined.topology.use_counts() == 2)[0])
    curve = joined.topology.curves[edge]
    points = curve(np.linspace(*curve.domain, 1001))
    assert np.abs(np.hypot(points[:, 0], points[:, 1]) - 1.0).max() <= 1e-9
    assert np.abs(points[:, 2] - 1.0).max() <= 1e-9
    assert max(change.largest_move for change in changes) == pytest.approx(sagitta, rel=0.05)


def test_points_where_surfaces_meet():
    planes = [Plane((1, 2, 3), axis) for axis in np.eye(3)]
    assert on_all(planes, [], np.array([1.1, 1.9, 3.2]), LIMITS) == pytest.approx([1, 2, 3], abs=1e-12)
    # a cylinder that touches a plane leaves the way along the line of touch, and nearly the way across, free
    touching = [Plane((0, 0, 1), (0, 0, 1)), Cylinder((0, 0, 0), (1, 0, 0), 1.0)]
    spot = on_all(touching, [], np.array([0.3, 1e-4, 1.0]), LIMITS)
    assert spot[0] == pytest.approx(0.3, abs=1e-12)
    assert abs(spot[2] - 1.0) <= 1e-8
    # Viviani's sphere and cylinder: y^2 = x - x^2, z^2 = 1 - x
    start = np.array([[0.52, 0.49, 0.7]])
    found = on_both(
        Sphere((0, 0, 0), 1.0), Cylinder((0.5, 0, 0), (0, 0, 1), 0.5), start, np.array([[1.0, 0.0, 0.0]]), LIMITS
    )
    assert found is not None
    x, y, z = found[0]
    assert [x, y**2, z**2] == pytest.approx([0.52, 0.52 - 0.52**2, 0.48], abs=1e-10)
    # parallel planes do not cross
    assert on_both(Plane((0, 0, 0), (0, 0, 1)), Plane((0, 0, 1e-3), (0, 0, 1)), start, start, LIMITS) is None


def test_pcurves_from_poles_and_on_parallelograms():
    sphere = Sphere((0, 0, 0), 1.0)
    angle = np.linspace(0.5 * np.pi, 0.1, 40)
    meridian = np.stack([np.cos(angle) * np.cos(2.0), np.cos(angle) * np.sin(2.0), np.sin(angle)], axis=1)
    curve = interpolate(meridian, "c2-cubic")
    found = below(sphere, curve, 1e-6)
    assert found.residual <= 2e-6
    u = found.pcurve(np.linspace(*found.pcurve.domain, 50))[:, 0]
    assert np.abs(np.angle(np.exp(1j * (u - 2.0)))).max() <= 1e-5
    skew = bilinear([(1, 1, 1), (3, 1, 2), (3, 4, 3), (1, 4, 2)])
    points = skew(np.array([0.1, 0.8, 0.9, 0.3]), np.array([0.2, 0.1, 0.7, 0.9]))
    exact = below(skew, NurbsCurve(3, np.repeat([0.0, 1.0], 4), points), 1e-12)
    assert exact.pcurve.degree == 3
    assert exact.residual <= 1e-14
    assert exact.pcurve.control_points == pytest.approx(
        np.array([[0.1, 0.2], [0.8, 0.1], [0.9, 0.7], [0.3, 0.9]]), abs=1e-14
    )


@pytest.mark.parametrize("apart", [2e-16, 1e-13])
def test_knots_apart_by_round_off_are_one_corner(apart):
    # two corners at 0.5 and a last range as short as round-off
    stops = np.array([0.0, 0.5, 0.5 + apart, 1.0 - apart, 1.0])
    bent = NurbsCurve(1, np.array([0.0, *stops, 1.0]), np.array([[0, 0], [1, 0], [1, 0], [1, 1], [1, 1]], dtype=float))
    found = fitted(bent, bent, 1e-9)
    t = np.linspace(0.0, 1.0, 101)
    assert np.abs(found(t) - bent(t)).max() <= 1e-9
    assert found.domain == (0.0, 1.0)


def test_faces_are_turned_to_one_side():
    draft, _ = join_seams(drafted(junction(tilt=0.3)), LIMITS)
    topology = draft.topology
    rng = np.random.default_rng(0)
    for _ in range(5):
        mixed = replace(topology, flipped=tuple(bool(x) for x in rng.integers(0, 2, len(topology.loops))))
        same = one_sided(mixed)
        assert len(set(same.flipped)) == 1  # all surfaces look up, so all are flipped or none
        assert sum(a != b for a, b in zip(mixed.flipped, same.flipped, strict=True)) <= len(topology.loops) // 2


def wave(a: Array, b: Array) -> Array:
    return np.stack([a, b, 0.15 * np.sin(3 * a + 1) * np.cos(2 * b) + 0.1 * a * b], axis=2)


def sheet(u, v) -> NurbsSurface:
    return interpolate_surface(wave(*np.meshgrid(np.linspace(*u, 9), np.linspace(*v, 9), indexing="ij")), "c2-cubic")


@pytest.mark.parametrize("gap", [1e-5, 1e-3, 1e-2])
def test_a_side_moves_onto_the_two_faces_along_it(gap):
    surfaces = [
        sheet((0.0, 1.0 - gap / 2), (0, 1)),
        sheet((1.0 + gap / 2, 2.0), (0, 0.45)),
        sheet((1.0 + gap / 2, 2.0), (0.45, 1)),
    ]
    draft = drafted(surfaces)
    limits = Limits.of(draft.assembly.diagonal)
    moved, changes = strip_sides(draft, limits)
    assert (moved.topology.use_counts() == 2).sum() == 3
    assert gaps(moved).max() <= 1e-6 * limits.diagonal
    assert max(change.largest_move for change in changes) <= 2.0 * gap + 2e-5
    # beyond five gap widths from the seam the first face is what it was
    u, v = np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 41)
    was, now = surfaces[0].grid(u, v), moved.surface(0).grid(u, v)
    far = was[..., 0] < 1.0 - 6.0 * max(gap, 2e-5)
    assert np.abs(was - now)[far].max() <= 1e-12


@pytest.mark.parametrize(
    ("name", "faces", "free"),
    [("oneram6.igs", 7, 0), ("t4mec.stp", 12, 51), pytest.param("k1_loose_shells.stp", 52, 0, marks=pytest.mark.slow)],
)
def test_real_files_close_on_their_surfaces(data, tmp_path, name, faces, free):
    from oracles_cad_damage import loosest, read_shape

    from patchwright.models.io import read, write
    from patchwright.repair import repair

    before = read(data(name))
    result = repair(before)
    after = {part.name: part.surface for part in result.to_assembly().parts}
    changed = [surface_difference(p.surface, after[p.name]) for p in before.parts]
    assert len(after) == faces
    assert max(changed) <= 1e-12 * before.diagonal
    write(tmp_path / "healed.step", result.to_assembly())
    again = read(tmp_path / "healed.step")
    assert result.figures["free edges"] == free
    assert max(s.gap for s in measure_seams(again)) <= 1e-6 * again.diagonal
    assert loosest(read_shape(tmp_path / "healed.step")) <= 1e-6 * again.diagonal
