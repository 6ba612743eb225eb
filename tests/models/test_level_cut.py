from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patchwright.models import Triangulation
from patchwright.models.adjacency import Adjacency
from patchwright.models.level_cut import level_cut
from patchwright.models.samples import torus


@pytest.fixture
def ring() -> Triangulation:
    return torus(cells=24).assembly.triangulation


@pytest.mark.parametrize("level", [-0.7, 0.0, 0.31])
def test_the_pieces_cover_the_surface_and_meet_edge_to_edge(ring: Triangulation, level: float) -> None:
    height = ring.vertices @ np.array([0.6, -0.3, 0.74]) - level
    step = level_cut(ring, height)
    pieces = step.triangulation
    assert (Adjacency.of(pieces).use_count == 2).all()
    areas = np.bincount(step.origin, pieces.areas, minlength=len(ring))
    assert np.allclose(areas, ring.areas, rtol=1e-12)
    assert np.einsum("ij,ij->i", pieces.normals, ring.normals[step.origin]).min() > 1.0 - 1e-9
    # a linear function's level is a plane: no piece reaches past it, new vertices are on it
    now = pieces.vertices @ np.array([0.6, -0.3, 0.74]) - level
    assert np.abs(now[len(ring.vertices) :]).max() < 1e-15
    assert (now[pieces.triangles] * step.side[:, None]).min() > -1e-15


def test_uv_and_tags_follow(ring: Triangulation) -> None:
    tagged = replace(ring, tags=np.arange(len(ring)) % 3, tag_names=("a", "b", "c"))
    assert ring.uv is not None
    step = level_cut(tagged, ring.vertices[:, 0])
    pieces = step.triangulation
    assert pieces.tags is not None
    assert pieces.uv is not None
    assert (pieces.tags == step.origin % 3).all()
    # uv of a piece's corner is linear in its triangle: the middle of all pieces' uv by area is that of the triangle
    mean = np.stack(
        [np.bincount(step.origin, pieces.areas * pieces.uv.mean(axis=1)[:, k]) / ring.areas for k in range(2)], axis=1
    )
    assert np.abs(mean - ring.uv.mean(axis=1)).max() < 1e-12


def test_a_level_through_vertices_or_past_everything_splits_as_little_as_it_can(ring: Triangulation) -> None:
    assert level_cut(ring, np.ones(len(ring.vertices))).triangulation is ring
    square = Triangulation(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    assert len(level_cut(square, np.array([0.0, 1.0, 0.0, -1.0])).triangulation) == 2  # along the shared edge
    assert len(level_cut(square, np.array([1.0, 0.0, -1.0, 0.0])).triangulation) == 4  # across it, through two corners
    only = level_cut(square, np.array([1.0, 0.0, -1.0, 0.0]), only=np.array([True, False]))
    assert only.origin.tolist() == [1, 0, 0]
