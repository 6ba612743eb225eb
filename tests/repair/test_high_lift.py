"""A half model with everything a flap setting brings: the slot is no gap, the symmetry plane no opening to close."""

from __future__ import annotations

import numpy as np
import oracles_high_lift as oracle
import pytest

from patchwright.models.adjacency import Adjacency
from patchwright.models.samples.high_lift import dirty_high_lift, high_lift, surroundings
from patchwright.models.tree import Tree
from patchwright.models.triangulation import concatenate
from patchwright.models.winding import winding_number
from patchwright.repair import repair


def test_the_clean_half_model_is_closed_and_its_border_in_the_plane() -> None:
    parts = {part.name: part.triangulation for part in high_lift().assembly.parts}
    assert all((Adjacency.of(parts[name]).use_count == 2).all() for name in oracle.WING)
    rim = Adjacency.of(parts["fuselage"])
    assert (parts["fuselage"].vertices[np.unique(rim.edges[rim.free]), 1] == 0.0).all()
    around = surroundings(parts["fuselage"])
    points = np.concatenate([part.triangulation.vertices for part in around] + [parts["fuselage"].vertices])
    whole = concatenate([parts["fuselage"], *(part.triangulation for part in around)])
    assert len(np.unique(points, axis=0)) - 3 * len(whole) // 2 + len(whole) == 2  # one closed sphere-like surface
    near = Tree.of(parts["main"]).closest(parts["flap"].vertices).distance.min()
    assert near == pytest.approx(0.015, rel=0.05)


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.slow) for s in range(1, 10))])
def test_a_dirty_half_model_keeps_slot_line_and_symmetry(seed: int) -> None:
    dirty = dirty_high_lift(seed)
    parts = {part.name: part.triangulation for part in dirty.sample.assembly.parts}
    truth = concatenate(list(parts.values()))
    assert oracle.located(dirty) == 1.0
    result = repair(dirty.assembly, domain=oracle.DOMAIN)
    assert result.verdict == "repaired with invented surface"
    assert oracle.false_changes(dirty, result.ledger) == 0
    body = result.triangulation
    craft = body.take(np.isin(body.tags, [body.tag_names.index(n) for n in parts])).compact()
    assert (np.abs(winding_number(oracle.mirrored(craft), oracle.slot_points(parts))) < 0.5).all()
    # every point lies on the skin it belongs to: the wing is 0.03 diagonals thick, and where two neighbouring triangles
    # are missing the other diagonal between them may be taken, off by the height of a facet
    middles = np.concatenate([craft.vertices, craft.corners.mean(axis=1)])
    assert Tree.of(truth).closest(middles).distance.max() < 1e-3 * truth.diagonal
    line, exact = oracle.edges_between(craft, ("fuselage",), oracle.WING), oracle.segments(parts)
    assert oracle.to_segments(exact.reshape(-1, 3), line).max() < 1e-6 * truth.diagonal
    assert oracle.to_segments(line.reshape(-1, 3), exact).max() < 1e-6 * truth.diagonal
    rim = Adjacency.of(craft)
    assert (craft.vertices[np.unique(rim.edges[rim.free]), 1] == 0.0).all()
    assert result.network is not None
    layout, edges = result.network.layout, result.network.edges
    free = np.bincount(layout.quad_edges.reshape(-1), minlength=len(layout.edges)) == 1
    assert free.any()
    assert (edges.controls[np.repeat(free, np.diff(edges.offsets)), 1] == 0.0).all()
