from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import Tolerance, Triangulation
from patchwright.models.adjacency import Adjacency
from patchwright.models.tree import Tree
from patchwright.models.winding import winding_number
from patchwright.repair.mender.crossings import crossing_pairs
from patchwright.repair.mender.mend import BRIDGED, CUT, KEPT, mend
from patchwright.repair.mender.wrap import wrap


def klein_bottle(n: int = 24) -> Triangulation:
    """The figure-eight immersion: closed, one-sided, through itself along a circle; no outside to orient it by."""
    u, v = (np.arange(k) * 2.0 * np.pi / k for k in (2 * n, n))
    u, v = np.meshgrid(u, v, indexing="ij")
    r = 2.0 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    points = np.stack(
        [r * np.cos(u), r * np.sin(u), np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)], axis=-1
    )
    i, j = np.meshgrid(np.arange(2 * n), np.arange(n), indexing="ij")

    def at(i: np.ndarray, j: np.ndarray) -> np.ndarray:
        turned = i >= 2 * n  # once round u, v comes back as -v
        return (i % (2 * n)) * n + np.where(turned, -j, j) % n

    a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
    rows = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).reshape(-1, 3)
    return Triangulation(points.reshape(-1, 3), rows)


def test_a_one_sided_body_is_wrapped_and_a_good_one_beside_it_stays() -> None:
    bottle, ball = klein_bottle(), shapes.sphere(3, at=(0.0, 0.0, 6.0))
    assert (shapes.edge_uses(bottle) == 2).all()
    both = shapes.together(bottle, ball)
    tolerance = Tolerance.of(both)
    result = mend(both, tolerance)
    body = result.triangulation
    assert result.problems == ()
    assert shapes.is_closed_manifold(body)
    assert len(crossing_pairs(body, 1e-9 * body.diagonal)) == 0
    (action,) = [action for action in result.actions if action.kind == "wrap"]
    assert action.rung == "resurface"
    # the ball is as it was, every triangle
    assert (result.origin == KEPT).sum() == len(ball)
    assert np.array_equal(body.corners[result.origin == KEPT], ball.corners)
    # what does not count as invented lies on the input, and the label gives the area of what does
    centres = body.corners.mean(axis=1)
    assert Tree.of(bottle).closest(centres[result.origin == CUT]).distance.max() <= tolerance.fit
    invented = float(body.areas[result.origin == BRIDGED].sum())
    assert action.area == pytest.approx(invented, rel=0.05)
    # what of the bottle sticks out of the wrap does so by less than half a cell: flat triangles on a bent surface
    points = bottle.vertices
    outside = winding_number(body, points) < 0.5
    assert Tree.of(body).closest(points[outside]).distance.max(initial=0.0) <= 0.5 * action.tolerance


def test_a_wrap_never_passes_through_itself() -> None:
    """Two plates a third of a cell apart: drawn all the way back, the walls between them would cross."""
    rng = np.random.default_rng(1)
    plates = shapes.together(shapes.box((1, 1, 0.01)), shapes.box((1, 1, 0.01), at=(0.1, 0.05, 0.02)))
    rough = Triangulation(plates.vertices + rng.normal(0.0, 2e-3, plates.vertices.shape), plates.triangles)
    body = wrap(rough, 0.06, leave=1e-5).triangulation
    assert len(crossing_pairs(body, 1e-9 * body.diagonal)) == 0
    assert (Adjacency.of(body).use_count == 2).all()
