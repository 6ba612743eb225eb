from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import ParameterError, Triangulation
from patchwright.repair.mender.wrap import wrap


@pytest.mark.parametrize("cell", [0.2, 0.1, 0.05])
def test_the_wrap_of_a_sphere_converges(cell: float) -> None:
    whole = shapes.sphere(5)
    wrapped = wrap(whole, cell)
    assert shapes.is_closed_manifold(wrapped.triangulation)
    # five hundredths of the offset stay; the chords cut off at most cell^2 / 8 of the radius' height
    assert wrapped.triangulation.volume == pytest.approx(4 / 3 * np.pi, rel=3 * 0.05 * cell + 3 * cell**2 / 4 + 2e-3)


def test_soup_with_missing_triangles_and_overlap_becomes_one_body() -> None:
    both = shapes.together(shapes.sphere(4), shapes.sphere(4, at=(1.0, 0.03, 0.02)))
    lost = np.random.default_rng(0).random(len(both)) < 0.02
    dirty = shapes.soup(both.take(~lost), 1e-3)
    wrapped = wrap(dirty, 0.12)
    assert shapes.is_closed_manifold(wrapped.triangulation)
    used = np.unique(wrapped.triangulation.triangles)
    assert len(used) - len(wrapped.triangulation) // 2 == 2  # Euler: one sphere
    exact = 8 / 3 * np.pi - np.pi * 5 * 1.0**2 / 12
    assert wrapped.triangulation.volume == pytest.approx(exact, rel=0.04)
    assert wrapped.triangulation.tags is not None
    assert set(np.unique(wrapped.triangulation.tags)) == {0, 1}


def test_moving_by_whole_cells_changes_nothing() -> None:
    whole = shapes.sphere(3)
    moved = Triangulation(whole.vertices + 0.25 * np.array([4.0, -8.0, 16.0]), whole.triangles)
    assert len(wrap(whole, 0.25).triangulation) == len(wrap(moved, 0.25).triangulation)


def test_what_cannot_be_wrapped_is_refused() -> None:
    with pytest.raises(ParameterError, match="positive length"):
        wrap(shapes.sphere(1), 0.0)
    with pytest.raises(ParameterError, match="larger one"):
        wrap(shapes.sphere(1), 1e-3)
    with pytest.raises(ParameterError, match="no triangles"):
        wrap(Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)), 0.1)
