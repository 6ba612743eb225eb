"""A clean model comes back as it is: the same triangles, bit for bit, in the same order, with verdict clean."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from patchwright.models import Assembly, Tolerance, Triangulation, samples
from patchwright.models.io import read
from patchwright.repair import Verdict, diagnose, repair
from patchwright.repair.mender.mend import KEPT, mend

SHAPES = {
    "sphere": samples.sphere,
    "ellipsoid": samples.ellipsoid,
    "torus": samples.torus,
    "capsule": samples.capsule,
    "cube": samples.cube,
}


def untouched(given: Triangulation, *, openings: int = 0) -> None:
    """Mending the triangulation changes nothing and says that it did nothing."""
    result = mend(given, Tolerance.of(given))
    assert (*result.problems, *result.dropped, *result.actions) == ()
    assert np.array_equal(result.triangulation.corners, given.corners)
    assert (result.origin == KEPT).all()
    assert np.array_equal(result.source, np.arange(len(given)))
    assert len(result.openings) == openings
    assert result.closed == (openings == 0)
    if given.tags is not None:
        assert result.triangulation.tags is not None
        assert np.array_equal(result.triangulation.tags, given.tags)


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e3])
@pytest.mark.parametrize("name", SHAPES)
def test_clean_samples_are_left_as_they_are(name: str, scale: float) -> None:
    given = SHAPES[name]().assembly.triangulation
    place = np.array([3.0, -1.0, 0.5]) * scale
    given = Triangulation(scale * given.vertices + place, given.triangles, tags=given.tags, tag_names=given.tag_names)
    given = Triangulation(*_merged(given), tags=given.tags, tag_names=given.tag_names)
    assert diagnose(given).clean
    untouched(given)


def _merged(given: Triangulation) -> tuple[np.ndarray, np.ndarray]:
    """Equal coordinates as one vertex, in the order they come first."""
    _, first, inverse = np.unique(given.vertices, axis=0, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))
    return given.vertices[np.sort(first)], rank[inverse.reshape(-1)][given.triangles]


@pytest.mark.parametrize("turns", [1, 5])
def test_the_order_of_triangles_and_corners_is_kept(turns: int) -> None:
    """Not only ordered input: triangles shuffled, each beginning with another corner."""
    ball = SHAPES["sphere"]().assembly.triangulation
    points, rows = _merged(ball)
    rng = np.random.default_rng(turns)
    rows = rows[rng.permutation(len(rows))]
    start = rng.integers(0, 3, len(rows))
    rows = np.take_along_axis(rows, (np.arange(3) + start[:, None]) % 3, axis=1)
    untouched(Triangulation(points, rows))


@pytest.mark.parametrize(("name", "openings"), [("dtc_hull.stl.gz", 0), ("cgal_blade.off", 2)])
def test_clean_files_and_files_with_openings_alone_are_left_as_they_are(
    data: Callable[[str], Path], name: str, openings: int
) -> None:
    model = read(data(name))
    assert {defect.kind for defect in diagnose(model).defects if defect.severity != "info"} <= {"opening"}
    untouched(model.triangulation, openings=openings)


def test_a_clean_model_is_repaired_to_itself_with_verdict_clean() -> None:
    ball = SHAPES["ellipsoid"]().assembly.triangulation
    given = Triangulation(*_merged(ball))
    result = repair(Assembly.of(given))
    assert result.verdict == "clean"
    assert np.array_equal(result.triangulation.corners, given.corners)


@pytest.mark.slow
def test_a_clean_file_is_repaired_to_itself_with_verdict_clean(data: Callable[[str], Path]) -> None:
    model = read(data("dtc_hull.stl.gz"))
    result = repair(model)
    assert result.verdict == "clean"
    assert np.array_equal(result.triangulation.corners, model.triangulation.corners)


def test_one_triangle_missing_is_not_clean() -> None:
    """The tests above can fail: without a triangle the mender acts and says so."""
    ball = SHAPES["sphere"]().assembly.triangulation
    given = Triangulation(*_merged(ball)).take(np.arange(1, len(ball)))
    result = mend(given, Tolerance.of(given))
    assert [action.kind for action in result.actions] == ["bridge"]
    assert len(result.triangulation) == len(ball)


def test_a_model_with_nothing_but_a_warning_is_called_clean_where_nothing_was_changed() -> None:
    ball = SHAPES["sphere"]().assembly.triangulation
    bowl = ball.take(ball.corners.mean(axis=1)[:, 2] < 0.0)
    found = diagnose(bowl)
    assert not found.clean
    assert {d.severity for d in found.defects} <= {"warning", "info"}
    repaired = repair(bowl)
    assert repaired.verdict == Verdict.CLEAN
    assert np.array_equal(repaired.triangulation.corners, bowl.corners)
