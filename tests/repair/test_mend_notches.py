"""Slits that run into a symmetry plane are closed up to it; what is meant to be open there stays so."""

from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import Assembly, Part, Tolerance, Triangulation
from patchwright.models.adjacency import Adjacency
from patchwright.models.level_cut import level_cut
from patchwright.models.samples.high_lift import half_fuselage
from patchwright.models.samples.sample import Sample
from patchwright.repair import Domain, repair
from patchwright.repair.decisions import Decisions
from patchwright.repair.mender.mend import mend
from patchwright.repair.mender.mended import Mended
from patchwright.repair.surroundings import surroundings

AT = 0.6  # where the slits are, in the cylindrical middle


def fuselage() -> Triangulation:
    return Sample.of("half", (half_fuselage(),)).assembly.parts[0].triangulation


def slitted(body: Triangulation, width: float, lowest: float = -1.0) -> Triangulation:
    """Without the band round x = AT, above a height z only."""
    for side in (-0.5, 0.5):
        body = level_cut(body, body.vertices[:, 0] - AT - side * width, None).triangulation
    middle = body.corners.mean(axis=1)
    return body.take(~((np.abs(middle[:, 0] - AT) < 0.5 * width) & (middle[:, 2] > lowest))).compact()


def mended(body: Triangulation, axis: str = "y") -> Mended:
    model = Assembly((Part("half", body),))
    around = surroundings(model, Domain(symmetry=(axis,)))
    tolerance = Tolerance.of(model)
    return mend(body, tolerance, decisions=Decisions(around, body.diagonal, tolerance.gap))


def border(body: Triangulation, axis: int = 1) -> tuple[int, float]:
    """How many loops bound it, and how far they are off the plane."""
    adjacency = Adjacency.of(body)
    points = body.vertices[np.unique(adjacency.edges[adjacency.free])]
    return len(adjacency.boundary_loops()), float(np.abs(points[:, axis]).max(initial=0.0))


@pytest.mark.parametrize("width", [1e-3, 1e-2, 5e-2])
@pytest.mark.parametrize("lowest", [-1.0, -0.1, 0.0, 0.2])
def test_a_slit_from_the_plane_is_closed_up_to_it(width: float, lowest: float) -> None:
    whole = fuselage()
    dirty = slitted(whole, width, lowest)
    assert border(dirty)[1] > 0.1
    result = mended(dirty)
    assert border(result.triangulation) == (1, 0.0)
    assert Adjacency.of(result.triangulation).components().max() == 0
    assert not result.problems
    # a strip of chords over a band of the width: its sides bend by the square of that
    assert result.triangulation.areas.sum() == pytest.approx(whole.areas.sum(), rel=width**2)


@pytest.mark.parametrize("turn", [[2, 0, 1], [1, 2, 0]])
def test_the_axes_may_be_named_otherwise(turn: list[int]) -> None:
    dirty = slitted(fuselage(), 0.01)
    body = Triangulation(1e3 * dirty.vertices[:, turn], dirty.triangles)
    axis = turn.index(1)
    assert border(mended(body, "xyz"[axis]).triangulation, axis) == (1, 0.0)


def test_a_wide_mouth_is_meant() -> None:
    dirty = slitted(fuselage(), 0.3, 0.0)
    result = mended(dirty)
    assert np.array_equal(result.triangulation.corners, dirty.corners)


def test_an_open_trailing_edge_at_the_plane_is_no_slit() -> None:
    # half a thin box whose side x = 1 is missing: two skins that both end there
    box = shapes.box((1.0, 1.0, 0.01))
    box = Triangulation(box.vertices - box.bounds[0], box.triangles)
    middle = box.corners.mean(axis=1)
    dirty = box.take((middle[:, 1] > 0.0) & (middle[:, 0] < 1.0)).compact()
    assert border(dirty)[1] == 1.0
    result = mended(dirty)
    assert np.array_equal(result.triangulation.corners, dirty.corners)


def test_patches_over_a_closed_slit_end_on_the_plane_exactly() -> None:
    model = Assembly((Part("half", slitted(fuselage(), 0.01)),))
    result = repair(model, domain=Domain(symmetry=("y",)))
    assert border(result.triangulation) == (1, 0.0)
    assert result.network is not None
    layout, edges = result.network.layout, result.network.edges
    free = np.bincount(layout.quad_edges.reshape(-1), minlength=len(layout.edges)) == 1
    assert (edges.controls[np.repeat(free, np.diff(edges.offsets)), 1] == 0.0).all()
