"""Blocks: rectangles of quads whose borders stop at T-junctions, and grids that agree across them bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from quad_shapes import Marks, SphereTarget, assert_rectangles, layout_from_quads, sheet, sphere_layout, torus_layout

from patchwright.models.errors import GeometryError
from patchwright.models.tolerance import Tolerance
from patchwright.repair.layout.blocks import find_blocks, smallest_corner
from patchwright.repair.patches.block_grid import block_grid
from patchwright.repair.patches.patch_fit import Target
from patchwright.repair.patches.resurface import resurface


@pytest.mark.parametrize("n", [1, 2, 5])
def test_a_blown_up_cube_is_six_blocks(n):
    layout = sphere_layout(n)
    blocks = find_blocks(layout)
    assert blocks.shape.tolist() == [[n, n]] * 6
    assert_rectangles(layout, blocks)
    assert smallest_corner(sphere_layout(1), find_blocks(sphere_layout(1))) == pytest.approx(90.0)


def test_rings_are_cut_open():
    tube = find_blocks(sheet(7, 3, bend=True))
    assert sorted(map(sorted, tube.shape.tolist())) == [[3, 7]]
    assert sorted(map(sorted, find_blocks(torus_layout(6, 5)).shape.tolist())) == [[5, 6]]


def test_a_hole_makes_t_junctions_and_whole_faces_cost_more_blocks():
    layout = sheet(9, 7, holes=((2, 2), (6, 4)))
    few, whole = find_blocks(layout), find_blocks(layout, full_faces=True)
    assert_rectangles(layout, few)
    assert_rectangles(layout, whole)
    assert len(few) < len(whole) == 5 * 5 - 2  # the lines of both holes' sides run through


@settings(max_examples=40, deadline=None)
@given(st.sets(st.tuples(st.integers(0, 5), st.integers(0, 4)), max_size=9), st.booleans())
def test_any_sheet_with_holes_falls_into_rectangles(holes, full_faces):
    layout = sheet(6, 5, holes=tuple(holes))
    assert_rectangles(layout, find_blocks(layout, full_faces=full_faces))


def test_numbering_does_not_change_how_many_blocks_there_are():
    layout = sheet(9, 7, holes=((2, 2), (6, 4)))
    order = np.random.default_rng(0).permutation(len(layout))
    turned = np.roll(layout.quads[order], 1, axis=1)
    other = layout_from_quads(layout.vertices, turned, lambda a, b: layout.vertices[[a, b]])
    assert_rectangles(other, find_blocks(other))
    assert sorted(map(sorted, find_blocks(layout, full_faces=True).shape.tolist())) == sorted(
        map(sorted, find_blocks(other, full_faces=True).shape.tolist())
    )


def test_the_grid_holds_every_node_of_the_patches_with_the_blocks_own_directions():
    layout = sphere_layout(3)
    target = SphereTarget()
    network = resurface(layout, Target(target, Marks(target)), Tolerance(1e-9, 1e-3))
    blocks = find_blocks(layout)
    grid = block_grid(network, blocks, 4)
    assert [b.shape for b in grid.blocks] == [(13, 13, 1, 3)] * 6
    nodes = np.concatenate([b.reshape(-1, 3) for b in grid.blocks])
    assert len(np.unique(nodes, axis=0)) == len(np.unique(network.points(4).reshape(-1, 3), axis=0))
    for block in grid.blocks:
        step_u, step_v = np.diff(block[:, :-1, 0], axis=0), np.diff(block[:-1, :, 0], axis=1)
        outward = (np.cross(step_u, step_v) * block[:-1, :-1, 0]).sum(axis=-1)
        assert (outward > 0.0).all()
        assert np.linalg.norm(step_u, axis=-1).max() < 0.2  # neighbours in the block are neighbours on the sphere


def test_three_quads_on_an_edge_are_refused():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 1], [0, 0, 1], [1, -1, 0], [0, -1, 0.0]])
    quads = np.array([[0, 1, 2, 3], [1, 0, 5, 4], [1, 0, 7, 6]])
    layout = layout_from_quads(vertices, quads, lambda a, b: vertices[[a, b]])
    with pytest.raises(GeometryError, match="share the edge at"):
        find_blocks(layout)
