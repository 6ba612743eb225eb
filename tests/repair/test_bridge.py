from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import Triangulation
from patchwright.repair.mender.bridge import borders_of, bridge, facing_pairs, inner_share


def plate_with_hole(sides: int) -> Triangulation:
    """A flat ring between a regular polygon of radius 1 and one of radius 2."""
    u = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    inner = np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)
    i, j = np.arange(sides), np.roll(np.arange(sides), -1)
    triangles = np.concatenate([np.stack([i, sides + i, sides + j], axis=1), np.stack([i, sides + j, j], axis=1)])
    return Triangulation(np.concatenate([inner, 2 * inner]), triangles)


@pytest.mark.parametrize("sides", [3, 4, 17, 64, 300])
def test_a_flat_hole_gets_its_exact_area(sides: int) -> None:
    ring = plate_with_hole(sides)
    borders = borders_of(ring)
    inner = int(np.argmin([border.size for border in borders]))
    made = bridge(ring, borders, [inner], [])
    exact = 0.5 * sides * np.sin(2 * np.pi / sides)
    assert made.bridges[0].area == pytest.approx(exact, rel=1e-12)
    assert len(made.bridges[0].triangles) == sides - 2
    assert (made.triangulation.area_vectors[:, 2] > 0).all()
    assert sorted(np.unique(shapes.edge_uses(made.triangulation)).tolist()) == [1, 2]
    assert int((shapes.edge_uses(made.triangulation) == 1).sum()) == sides


@pytest.mark.parametrize("gap", [0.01, 0.1, 0.5])
def test_two_hemispheres_become_a_capsule(gap: float) -> None:
    a, b = shapes.half(1, gap / 2), shapes.half(-1, -gap / 2)
    both = shapes.together(a, b)
    borders = borders_of(both)
    pairs = facing_pairs(borders)
    assert pairs == [(0, 1)]
    made = bridge(both, borders, [], pairs)
    n = 48
    exact = n / 2 * np.sin(2 * np.pi / n) * gap  # the prism over the faceted equator
    closed = shapes.together(shapes.half(1, 0.0), shapes.half(-1, 0.0)).volume
    assert made.triangulation.volume == pytest.approx(closed + exact, rel=1e-12)
    assert shapes.is_closed_manifold(made.triangulation)
    assert made.bridges[0].width == pytest.approx(gap, rel=1e-12)


def test_a_bridge_has_the_tags_of_the_rim_it_hangs_on() -> None:
    both = shapes.together(shapes.half(1, 0.05), shapes.half(-1, -0.05))
    borders = borders_of(both)
    made = bridge(both, borders, [], [(0, 1)])
    assert made.triangulation.tags is not None
    assert np.bincount(made.triangulation.tags[len(both) :]).tolist() == [48, 48]


def test_an_edge_that_is_there_already_is_not_used_again() -> None:
    # a square hole one of whose diagonals is an edge of the surface behind it
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, -1.0], [2, 2, 1]], dtype=float)
    triangles = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 2, 5]])
    surface = Triangulation(points, triangles)
    borders = borders_of(surface)
    square = next(k for k, border in enumerate(borders) if sorted(border.vertices.tolist()) == [0, 1, 2, 3])
    made = bridge(surface, borders, [square], [])
    rows = {tuple(sorted(row)) for row in made.bridges[0].triangles.tolist()}
    assert rows == {(0, 1, 3), (1, 2, 3)}


def test_the_ends_of_a_tube_do_not_face_each_other_and_are_no_holes() -> None:
    whole = shapes.together(shapes.half(1, 0.0))
    tube = whole.take(np.abs(whole.corners.mean(axis=1)[:, 2]) < 0.9).compact()
    borders = borders_of(tube)
    assert len(borders) == 2
    assert facing_pairs(borders) == []
    assert inner_share(borders[int(np.argmax([b.size for b in borders]))]) < 0.1


def test_turning_the_model_changes_nothing() -> None:
    ring = plate_with_hole(40)
    q, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    q *= np.linalg.det(q)
    turned = Triangulation(1e3 * ring.vertices @ q.T, ring.triangles)
    one = bridge(ring, borders_of(ring), [1], [])
    other = bridge(turned, borders_of(turned), [1], [])
    assert other.bridges[0].area == pytest.approx(1e6 * one.bridges[0].area, rel=1e-9)
