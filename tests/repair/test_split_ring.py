"""Rings with five corners or more, filled about a centre: exact sides, smooth spokes, no graph needed."""

from __future__ import annotations

import numpy as np
import pytest
from oracles_cad_damage import written
from oracles_cad_solids import pierced_tube

from patchwright.models.cad import brep_status, measure_seams, surface_difference
from patchwright.models.cad.editing import with_cut
from patchwright.models.io import read, write
from patchwright.repair import repair
from patchwright.repair.result import Verdict


def opened(path, corners: int, span: float):
    """A tube of radius 1 with a hole of so many corners that goes `span` degrees round it."""
    angle = 2.0 * np.pi * np.arange(corners) / corners + 0.1
    ring = np.stack([np.pi + 0.5 * np.radians(span) * np.cos(angle), 2.0 + 1.2 * np.sin(angle)], axis=1)
    return read(written(path, [pierced_tube(ring)], set()))


@pytest.mark.parametrize(("corners", "span"), [(5, 200.0), pytest.param(6, 180.0, marks=pytest.mark.slow), (6, 240.0)])
def test_a_ring_that_is_no_graph_is_filled_by_one_patch_per_corner(tmp_path, corners, span):
    before = opened(tmp_path / "tube.step", corners, span)
    result = repair(before, openings="close")
    assert result.verdict == Verdict.INVENTED, result.problems
    write(tmp_path / "closed.step", result.to_assembly())
    after = read(tmp_path / "closed.step")
    assert (after.topology.use_counts() == 2).all()
    assert brep_status(after).invalid == ()
    seams = measure_seams(after)
    assert max(seam.gap for seam in seams) <= 1e-9 * after.diagonal
    assert surface_difference(before.parts[0].surface, result.to_assembly().parts[0].surface) <= 1e-12
    new = [part for part in after.parts if part.name.startswith("fill")]
    assert len(new) == corners
    # the tube is smooth there, so seams round and between the patches are; the true wall is within a quarter radius
    fills = {k for k, part in enumerate(after.parts) if part in new}
    assert max(seam.angle for seam in seams if fills & set(seam.faces)) <= 2.5
    for part in new:
        assert np.abs(np.hypot(*part.triangulation.vertices.T[:2]) - 1.0).max() <= 0.25


def test_an_edge_cut_in_two_leaves_loops_and_surface_where_they_were(tmp_path):
    model = opened(tmp_path / "tube.step", 5, 100.0)
    edge = int(np.flatnonzero(model.topology.use_counts() == 1)[-1])
    t0, t1 = model.topology.curves[edge].domain
    cut, (first, second) = with_cut(model.topology, edge, 0.3 * t0 + 0.7 * t1)
    assert cut.use_counts()[edge] == 0
    assert cut.use_counts()[[first, second]].tolist() == [1, 1]
    assert cut.ends[first, 1] == cut.ends[second, 0]
    surface = model.parts[0].surface
    for use in (use for loop in cut.loops[0] for use in loop if use.edge in (first, second)):
        curve = cut.curves[use.edge]
        t = np.linspace(*curve.domain, 9)
        assert np.abs(surface(*use.pcurve(t).T) - curve(t)).max() <= 1e-8
