"""Faces made of blocks: the same points as the patches, edges that run with their pcurves, no crease inside a face."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from quad_shapes import assert_rectangles, layout_from_quads, sheet, sphere_layout, torus_layout

from patchwright.models import Assembly
from patchwright.models.assembly import Part
from patchwright.models.io import read, write
from patchwright.models.triangulation import Triangulation
from patchwright.repair.layout.block_cuts import cut_along, cut_apart
from patchwright.repair.layout.blocks import find_blocks, single_blocks
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.block_faces import JOINT, block_faces
from patchwright.repair.patches.edge_curves import EdgeCurves
from patchwright.repair.patches.joins import seam_angles, side_normals
from patchwright.repair.patches.network import PatchNetwork
from patchwright.repair.patches.patch_nets import PatchNets, coons_nets, sides


def network_on(layout: QuadLayout, *, seed: int = 0, bumps: float = 0.0) -> PatchNetwork:
    """Coons patches of straight sides with different pieces, their inner control points moved at random."""
    rng = np.random.default_rng(seed)
    cells = 2 ** rng.integers(0, 3, len(layout.edges))
    groups = []
    for count in np.unique(cells):
        which = np.flatnonzero(cells == count)
        knots = np.concatenate([np.zeros(3), np.arange(count + 1) / count, np.ones(3)])
        share = np.stack([knots[1:-3], knots[2:-2], knots[3:-1]]).mean(axis=0)[None, :, None]
        a, b = (layout.vertices[layout.edges[which, k]][:, None] for k in (0, 1))
        groups.append((which, (1 - share) * a + share * b))
    edges = EdgeCurves.pack(cells, groups)
    own = cells[layout.quad_edges]
    pieces = np.stack([own[:, [0, 2]].max(axis=1), own[:, [1, 3]].max(axis=1)], axis=1)
    patches = []
    for m, n in np.unique(pieces, axis=0).tolist():
        which = np.flatnonzero((pieces == (m, n)).all(axis=1))
        nets = coons_nets(*sides(layout, edges, which, (m, n)))
        nets[:, 1:-1, 1:-1, 2] += bumps * rng.standard_normal((len(which), m + 1, n + 1))
        patches.append((which, nets))
    count = len(layout.quads)
    return PatchNetwork(
        layout, edges, PatchNets.pack(pieces, patches), np.zeros((count, 8, 8), dtype=bool), np.zeros(count)
    )


def assert_faces(network: PatchNetwork, made) -> None:
    """Loops close, every pcurve runs with its edge, and no face uses an edge twice."""
    t = np.linspace(0.0, 1.0, 7)
    assert len(made) == len(made.topology.loops) == made.face.max() + 1
    for surface, (loop,) in zip(made.surfaces, made.topology.loops, strict=True):
        assert len({use.edge for use in loop}) == len(loop)
        corners = []
        for use in loop:
            uv = use.pcurve(t)
            assert np.allclose(surface(uv[:, 0], uv[:, 1]), made.topology.curves[use.edge](t), atol=1e-13)
            corners.append(uv[[-1, 0]] if use.reversed else uv[[0, -1]])
        assert all(np.array_equal(a[1], b[0]) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
    ends = np.array([[curve(0.0), curve(1.0)] for curve in made.topology.curves])
    assert np.allclose(ends, made.topology.vertices[made.topology.ends], atol=1e-13)
    # the surfaces hold the patches' own points: each inner point of a patch lies on its face
    near = {f: s.grid(*(np.linspace(0, 1, 400),) * 2).reshape(-1, 3) for f, s in enumerate(made.surfaces[:3])}
    for patch in np.flatnonzero(made.face < 3)[:6]:
        middle = network.surfaces()[patch](0.5, 0.5)
        assert np.linalg.norm(near[made.face[patch]] - middle, axis=1).min() < 0.02


def area(surfaces) -> float:
    total = 0.0
    for surface in surfaces:
        for u0, u1 in zip(np.unique(surface.knots[0])[:-1], np.unique(surface.knots[0])[1:], strict=True):
            for v0, v1 in zip(np.unique(surface.knots[1])[:-1], np.unique(surface.knots[1])[1:], strict=True):
                x, w = np.polynomial.legendre.leggauss(6)
                u, v = u0 + (u1 - u0) * (x + 1) / 2, v0 + (v1 - v0) * (x + 1) / 2
                du, dv = surface.grid(u, v, nu=(1, 0)), surface.grid(u, v, nu=(0, 1))
                size = np.linalg.norm(np.cross(du, dv), axis=-1)
                total += float((w[:, None] * w * size).sum() * (u1 - u0) * (v1 - v0) / 4)
    return total


def test_a_flat_sheet_is_one_face_with_all_its_area():
    layout = sheet(5, 3)
    network = network_on(layout)
    made = block_faces(network, find_blocks(layout))
    assert len(made) == 1
    assert made.topology.use_counts().tolist() == [1] * 4  # the sides run through the patches' corners
    assert_faces(network, made)
    assert area(made.surfaces) == pytest.approx(15.0, abs=1e-12)
    # knots follow lengths, so a flat sheet of unit quads is as evenly parametrised as can be
    assert np.allclose(made.surfaces[0](np.array([0.2, 0.5]), np.array([0.5, 0.5]))[:, 0] % 5 % 1, [0.0, 0.5], atol=1)
    speed = np.linalg.norm(made.surfaces[0].grid(*(np.linspace(0.01, 0.99, 9),) * 2, nu=(1, 0)), axis=-1)
    assert speed.min() > 2.9


@settings(max_examples=25, deadline=None)
@given(st.sets(st.tuples(st.integers(0, 5), st.integers(0, 4)), max_size=8), st.integers(0, 99))
def test_any_sheet_with_holes_keeps_its_area_and_its_rims(holes, seed):
    layout = sheet(6, 5, holes=tuple(holes))
    network = network_on(layout, seed=seed, bumps=1e-3)
    made = block_faces(network, find_blocks(layout))
    assert_faces(network, made)
    counts = made.topology.use_counts()
    rim = sum(curve.length() for curve, count in zip(made.topology.curves, counts, strict=True) if count == 1)
    assert rim == pytest.approx(layout.boundary.sum(), rel=1e-9)  # all edges of the sheet are one long
    assert counts.max(initial=1) <= 2
    assert area(made.surfaces) == pytest.approx(area(network.surfaces()), rel=1e-9)


def test_a_ring_that_meets_itself_is_cut_apart():
    layout = torus_layout(6, 5)
    blocks = cut_apart(layout, find_blocks(layout))
    assert_rectangles(layout, blocks)
    assert sorted(blocks.shape.prod(axis=1).tolist()) == [6, 6, 9, 9]
    network = network_on(layout)
    made = block_faces(network, find_blocks(layout))
    assert_faces(network, made)
    assert (made.topology.use_counts() == 2).all()


def test_patches_that_turn_against_each_other_are_different_faces():
    layout = sheet(6, 4)
    bent = layout.vertices.copy()
    bent[:, 2] = np.tan(np.radians(3.0 * JOINT)) * np.maximum(bent[:, 0] - 2.0, 0.0)
    layout = layout_from_quads(bent, layout.quads, lambda a, b: bent[[a, b]])
    made = block_faces(network_on(layout), find_blocks(layout))
    assert len(made) == 2
    assert_faces(network_on(layout), made)
    assert sorted(np.bincount(made.face).tolist()) == [8, 16]


@pytest.mark.parametrize("edge", range(0, 40, 7))
def test_a_line_with_one_border_is_a_border_from_side_to_side(edge):
    layout = sphere_layout(4)
    border = np.zeros(len(layout.edges), dtype=bool)
    border[edge] = True
    before = find_blocks(layout)
    after = cut_along(layout, before, border)
    assert_rectangles(layout, after)
    assert len(after) == len(before) + (0 if before.wall[edge] else 1)
    assert after.wall[edge]


def test_no_face_has_a_seam_inside_that_is_rougher_than_a_joint():
    layout = sheet(6, 5, holes=((2, 2),))
    network = network_on(layout, seed=3, bumps=0.02)
    made = block_faces(network, find_blocks(layout))
    one, two = layout.edge_quads.T
    inside = (two >= 0) & (made.face[one] == made.face[two])
    angle = seam_angles(layout, side_normals(layout, network.nets))
    assert (angle > JOINT).any()
    assert not (angle[inside] > JOINT).any()


def test_an_edge_ends_where_it_turns_where_faces_change_and_where_it_gets_sharp():
    layout = sheet(4, 1)
    straight = block_faces(network_on(layout), find_blocks(layout))
    assert len(straight.topology.curves) == 4
    bent = layout.vertices.copy()
    bent[layout.vertices[:, 1] == 0] -= np.array([0.0, 0.1, 0.0]) * (
        layout.vertices[layout.vertices[:, 1] == 0, :1] == 2
    )
    layout = layout_from_quads(bent, layout.quads, lambda a, b: bent[[a, b]])
    turned = block_faces(network_on(layout), find_blocks(layout))
    assert len(turned) == 1
    assert len(turned.topology.curves) == 4 + 3  # at the moved vertex and at both neighbours on its side
    sharp = sheet(4, 2)
    middle = (sharp.vertices[sharp.edges][:, :, 1] == 1).all(axis=1)
    some = middle & (sharp.vertices[sharp.edges][:, :, 0] <= 2).all(axis=1)
    sharp = replace(sharp, sharp=some)
    made = block_faces(network_on(sharp), cut_along(sharp, find_blocks(sharp), middle))
    assert_faces(network_on(sharp), made)
    assert (made.topology.use_counts() == 2).sum() == 2


def test_single_blocks_are_the_patches_themselves():
    layout = sphere_layout(2)
    network = network_on(layout)
    made = block_faces(network, single_blocks(layout))
    assert made.face.tolist() == list(range(24))
    for own, patch in zip(made.surfaces, network.surfaces(), strict=True):
        assert np.array_equal(own.control_points, patch.control_points)
        assert all(np.array_equal(a, b) for a, b in zip(own.knots, patch.knots, strict=True))


def test_the_faces_come_back_from_step_closed_with_exact_seams(tmp_path):
    layout = sphere_layout(3)
    made = block_faces(network_on(layout), single_blocks(layout)), block_faces(network_on(layout), find_blocks(layout))
    nothing = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    for faces in made:
        parts = tuple(Part(f"face-{i}", nothing, surface=s, body="ball") for i, s in enumerate(faces.surfaces))
        write(tmp_path / "ball.step", Assembly(parts, topology=faces.topology))
        back = read(tmp_path / "ball.step")
        assert len(back.parts) == len(faces)
        assert back.topology is not None
        assert (back.topology.use_counts() == 2).all()
