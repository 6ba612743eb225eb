from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import ParameterError, StructuredGrid
from patchwright.ssi.grid_triangles import grid_triangulation
from patchwright.ssi.mesh_mesh import intersect_meshes


def ball(n: int = 24, at: tuple[float, float, float] = (0, 0, 0), jitter: float = 0.0) -> StructuredGrid:
    """A unit sphere in two blocks, each half way round, collapsed at the poles."""
    blocks = []
    for k in range(2):
        u, v = np.meshgrid(
            np.linspace(k * np.pi, (k + 1) * np.pi, n), np.linspace(-np.pi / 2, np.pi / 2, n), indexing="ij"
        )
        points = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1) + np.array(at)
        points += np.random.default_rng(k).uniform(-jitter, jitter, points.shape)
        blocks.append(points[:, :, None])
    return StructuredGrid(tuple(blocks), ("east", "west"))


@pytest.mark.parametrize("jitter", [0.0, 1e-9])
def test_blocks_close_to_one_manifold(jitter: float) -> None:
    mesh = grid_triangulation(ball(jitter=jitter), tolerance=1e-8)
    assert shapes.is_closed_manifold(mesh)
    assert mesh.volume == pytest.approx(4 / 3 * np.pi, rel=0.02)
    assert mesh.tag_names == ("east", "west")
    assert mesh.areas.min() > 0.0


def test_without_tolerance_only_equal_nodes_merge() -> None:
    x, y = np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0], indexing="ij")
    left = np.stack([x, y, 0 * x], axis=-1)[:, :, None]
    mesh = grid_triangulation(
        StructuredGrid((left, left + np.array([2.0, 0, 0]), left + np.array([4.0 + 1e-12, 0, 0])))
    )
    assert len(mesh) == 12
    assert len(mesh.vertices) == 18 - 2


def test_a_grid_meets_a_mesh_in_the_right_circle() -> None:
    mesh = grid_triangulation(ball(80, (1.0, 0.01, 0.02)), tolerance=1e-12)
    found = intersect_meshes(mesh, shapes.sphere(5))
    d = np.sqrt(1 + 0.01**2 + 0.02**2)
    assert [c.closed for c in found.curves] == [True]
    assert found.length == pytest.approx(2 * np.pi * np.sqrt(1 - d * d / 4), rel=2e-3)


def test_volume_blocks_and_bad_tolerances_are_refused() -> None:
    with pytest.raises(ParameterError, match="not a surface"):
        grid_triangulation(StructuredGrid((np.zeros((3, 3, 3, 3)),)))
    with pytest.raises(ParameterError, match="tolerance"):
        grid_triangulation(ball(), tolerance=-1.0)
    assert len(grid_triangulation(StructuredGrid(()))) == 0
