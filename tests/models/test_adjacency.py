"""Adjacency against counting by hand and against a dictionary of edges."""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patchwright.models.adjacency import Adjacency
from patchwright.models.triangulation import Triangulation

TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


def over(triangles, count=None) -> Triangulation:
    """Triangles over as many vertices as they need; adjacency looks at numbers only."""
    triangles = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
    return Triangulation(np.zeros((count or (triangles.max(initial=-1) + 1), 3)), triangles)


def grid(n: int, m: int) -> np.ndarray:
    """Triangles of an n by m grid of squares, counter-clockwise, vertex i (m + 1) + j."""
    i, j = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    a, b, c, d = i * (m + 1) + j, (i + 1) * (m + 1) + j, (i + 1) * (m + 1) + j + 1, i * (m + 1) + j + 1
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def test_tetrahedron_has_six_edges_each_with_two_triangles():
    found = Adjacency.of(over(TETRAHEDRON))
    assert found.edges.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
    assert (found.use_count == 2).all()
    assert not found.free.any()
    assert not found.non_manifold.any()
    assert not found.inconsistent.any()
    assert (np.sort(found.neighbours, axis=1) == [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]).all()
    assert len(found.boundary_loops()) == 0


def test_turning_one_triangle_makes_its_three_edges_inconsistent():
    turned = [TETRAHEDRON[0][::-1], *TETRAHEDRON[1:]]
    found = Adjacency.of(over(turned))
    assert found.edges[found.inconsistent].tolist() == [[0, 1], [0, 2], [1, 2]]
    assert (found.neighbours >= 0).all()


def test_grid_obeys_euler_and_has_one_loop_in_winding_direction():
    n, m = 7, 4
    found = Adjacency.of(over(grid(n, m)))
    assert (n + 1) * (m + 1) - len(found.edges) + 2 * n * m == 1
    (loop,) = found.boundary_loops()
    assert len(loop) == 2 * (n + m)
    x, y = np.divmod(loop, m + 1)
    assert np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) == 2 * n * m  # counter-clockwise like the triangles


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(*[st.integers(0, 9)] * 3), max_size=40))
def test_agrees_with_a_dictionary_of_edges(triangles):
    found = Adjacency.of(over(triangles, 10))
    sides = defaultdict(list)
    for t, corners in enumerate(triangles):
        for k in range(3):
            a, b = corners[k], corners[(k + 1) % 3]
            sides[min(a, b), max(a, b)].append((t, k, a < b))
    assert [tuple(e) for e in found.edges] == sorted(sides)
    offsets, around = found.edge_triangles
    for e, (edge, use) in enumerate(sorted(sides.items())):
        proper = edge[0] != edge[1]
        assert around[offsets[e] : offsets[e + 1]].tolist() == [t for t, _, _ in use]
        assert found.use_count[e] == len(use)
        assert found.free[e] == (proper and len(use) == 1)
        assert found.non_manifold[e] == (proper and len(use) > 2)
        assert found.inconsistent[e] == (proper and len(use) == 2 and use[0][2] == use[1][2])
        for t, k, _ in use:
            assert found.triangle_edges[t, k] == e
            others = [s for s, _, _ in use if s != t]
            expected = others[0] if proper and len(use) == 2 and others else -1
            assert found.neighbours[t, k] == expected


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(*[st.integers(0, 11)] * 3), max_size=30))
def test_loops_use_every_free_edge_once_and_no_vertex_twice(triangles):
    found = Adjacency.of(over(triangles, 12))
    loops = found.boundary_loops()
    used = []
    for loop, closed in zip(loops, loops.closed, strict=True):
        assert len(set(loop.tolist())) == len(loop)
        chain = [*loop, loop[0]] if closed else list(loop)
        used += [tuple(sorted(map(int, pair))) for pair in pairwise(chain)]
    assert sorted(used) == [tuple(e) for e in found.edges[found.free].tolist()]
    degree = np.bincount(found.edges[found.free].ravel(), minlength=12)
    assert np.count_nonzero(~loops.closed) == np.count_nonzero(degree % 2) / 2


def test_loops_follow_the_winding_wherever_it_is_consistent():
    keep = np.delete(np.arange(2 * 49), [16, 17, 40])
    triangulation = over(grid(7, 7)[keep])
    found = Adjacency.of(triangulation)
    directed = {(int(t[k]), int(t[(k + 1) % 3])) for t in triangulation.triangles for k in range(3)}
    loops = found.boundary_loops()
    assert len(loops) >= 3
    assert loops.closed.all()
    for loop in loops:
        assert all((int(a), int(b)) in directed for a, b in zip(loop, np.roll(loop, -1), strict=True))


def test_a_bow_tie_is_split_into_two_loops():
    loops = Adjacency.of(over([[0, 1, 2], [0, 3, 4]])).boundary_loops()
    assert sorted(sorted(loop.tolist()) for loop in loops) == [[0, 1, 2], [0, 3, 4]]


def test_a_boundary_with_reversed_triangles_still_closes():
    triangles = grid(3, 3)
    triangles[[0, 4, 13]] = triangles[[0, 4, 13]][:, ::-1]
    loops = Adjacency.of(over(triangles)).boundary_loops()
    assert len(loops) == 1
    assert loops.closed.tolist() == [True]
    assert len(loops[0]) == 12


def test_chains_end_where_a_non_manifold_edge_ends():
    loops = Adjacency.of(over([[0, 1, 2], [0, 1, 3], [0, 1, 4]])).boundary_loops()
    assert len(loops) == 2
    assert loops.closed.sum() == 1
    (open_chain,) = (loop for loop, closed in zip(loops, loops.closed, strict=True) if not closed)
    assert {int(open_chain[0]), int(open_chain[-1])} == {0, 1}


def test_components_are_numbered_by_their_first_triangle_and_joined_by_non_manifold_edges():
    triangles = [[0, 1, 2], [5, 6, 7], [1, 0, 3], [0, 1, 4], [7, 8, 9]]
    assert Adjacency.of(over(triangles)).components().tolist() == [0, 1, 0, 0, 2]


def test_renumbering_triangles_and_vertices_changes_names_only():
    rng = np.random.default_rng(3)
    triangles = grid(9, 6)
    vertex, order = rng.permutation(triangles.max() + 1), rng.permutation(len(triangles))
    a, b = Adjacency.of(over(triangles)), Adjacency.of(over(vertex[triangles][order]))
    assert {tuple(sorted(e)) for e in vertex[a.edges].tolist()} == {tuple(e) for e in b.edges.tolist()}
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    renamed = np.where(a.neighbours >= 0, place[a.neighbours], -1)
    assert (renamed[order] == b.neighbours).all()


def test_nothing_has_no_edges():
    found = Adjacency.of(over([]))
    assert found.edges.shape == (0, 2)
    assert found.components().shape == (0,)
    assert len(found.boundary_loops()) == 0


def test_the_arrays_cannot_be_written_to():
    found = Adjacency.of(over(TETRAHEDRON))
    with pytest.raises(ValueError, match="read-only"):
        found.edges[0, 0] = 5
