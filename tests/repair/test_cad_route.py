"""CAD models through `repair`: resurfaced on their true surfaces, refused with the way out named."""

from __future__ import annotations

import numpy as np
import pytest
from oracles_cad import cube_sphere, network

from patchwright.models import Assembly, Triangulation
from patchwright.models.io import read, write
from patchwright.repair import repair
from patchwright.repair.result import Verdict


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """Six sewn faces that are nearly a sphere of radius 10, read back from STEP with their tessellation."""
    path = tmp_path_factory.mktemp("cad") / "ball.step"
    write(path, cube_sphere())
    return read(path)


@pytest.fixture(scope="module")
def resurfaced(ball):
    return repair(ball, scope="all", tolerance=1e-3 * ball.diagonal)


def from_faces(ball, points):
    """Distance of points from the ball's faces, by the NURBS surfaces' own search."""
    return np.min([part.surface.closest(points).distance for part in ball.parts], axis=0)


def test_everything_is_resurfaced_within_the_tolerance_and_the_ledger_says_on_what(ball, resurfaced):
    assert resurfaced.verdict == Verdict.REPAIRED
    assert resurfaced.deviation.coverage > 0.995
    (entry,) = [e for e in resurfaced.ledger if "true surfaces" in e.what]
    assert entry.count == 6


def test_the_patches_are_nearer_to_the_faces_than_their_triangles_are(ball, resurfaced):
    # though the tolerance asked for is five times the deflection of the tessellation
    centres = ball.triangulation.corners.mean(axis=1)
    facets = np.median(from_faces(ball, centres[::7]))
    patches = from_faces(ball, resurfaced.network.points(6).reshape(-1, 3)[::7])
    assert np.median(patches) < facets


def test_the_stated_deviation_is_that_from_the_faces(ball, resurfaced):
    # the patches' tessellation adds up to a quarter of the tolerance to what it is measured on
    true = np.percentile(from_faces(ball, resurfaced.network.points(6).reshape(-1, 3)[::7]), 99)
    assert abs(resurfaced.deviation.output_to_input.p99 - true) <= 0.3 * resurfaced.deviation.output_to_input.tolerance


def test_a_gap_is_refused_and_the_way_out_is_named(tmp_path):
    nets = [part.surface.control_points.copy() for part in cube_sphere().parts]
    nets[4] *= 1.2  # one face of six lifted off the others, farther than a seam that came open
    write(tmp_path / "gap.step", network(nets))
    result = repair(read(tmp_path / "gap.step"))
    assert result.verdict == Verdict.REFUSED
    (problem,) = result.problems
    assert problem.kind == "gap"
    assert "--scope all" in problem.message


def test_a_triangulation_is_not_taken_for_cad():
    flat = Triangulation(np.eye(3), np.array([[0, 1, 2]]))
    assert not Assembly.of(flat).is_cad
