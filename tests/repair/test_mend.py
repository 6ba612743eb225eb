from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import ParameterError, Tolerance, Triangulation
from patchwright.repair.mend import BRIDGED, CUT, KEPT, Mended, mend


def mended(dirty: Triangulation, openings: str = "close") -> Mended:
    return mend(dirty, Tolerance.of(dirty), openings=openings)  # type: ignore[arg-type]


def grid(origin: list[float], a: list[float], b: list[float], n: int) -> Triangulation:
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    points = np.array(origin) + (i[..., None] * np.array(a) + j[..., None] * np.array(b)) / n
    k = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1)
    rows = np.concatenate([np.stack([k, k + n + 1, k + n + 2], 1), np.stack([k, k + n + 2, k + 1], 1)])
    return Triangulation(points.reshape(-1, 3), rows)


def cube(counts: list[int]) -> Triangulation:
    x, y, z = np.eye(3).tolist()
    sides = [([0, 0, 0], y, x), ([0, 0, 1], x, y), ([0, 0, 0], x, z), ([0, 1, 0], z, x), ([0, 0, 0], z, y),
             ([1, 0, 0], y, z)]  # fmt: skip
    return shapes.together(*[grid(*side, n) for side, n in zip(sides, counts, strict=True) if n])  # type: ignore[arg-type]


def flipped_and_doubled() -> Triangulation:
    whole, rng = shapes.sphere(3), np.random.default_rng(0)
    rows = np.where(rng.random((len(whole), 1)) < 0.4, whole.triangles[:, ::-1], whole.triangles)
    return Triangulation(whole.vertices, np.concatenate([rows, rows[rng.random(len(rows)) < 0.1]]))


CAPSULE = shapes.together(shapes.half(1, 0.0), shapes.half(-1, 0.0)).volume
PRISM = 24 * np.sin(2 * np.pi / 48)
EIGHT = {
    "gap1": (shapes.together(shapes.half(1, 0.01), shapes.half(-1, -0.01)), CAPSULE + 0.02 * PRISM),
    "gap5": (shapes.together(shapes.half(1, 0.05), shapes.half(-1, -0.05)), CAPSULE + 0.1 * PRISM),
    "gap10": (shapes.together(shapes.half(1, 0.1), shapes.half(-1, -0.1)), CAPSULE + 0.2 * PRISM),
    "overlap5": (shapes.together(shapes.half(1, -0.05), shapes.half(-1, 0.05)), CAPSULE - 0.1 * PRISM),
    "tjunc": (cube([8, 8, 5, 5, 3, 3]), 1.0),
    "selfx": (shapes.together(shapes.sphere(4), shapes.sphere(4, at=(1.0, 0.03, 0.02))), None),
    "missface": (cube([6, 0, 6, 6, 6, 6]), 1.0),
    "flipdup": (flipped_and_doubled(), shapes.sphere(3).volume),
}


@pytest.mark.parametrize("name", EIGHT)
def test_eight_defects_are_closed_with_one_parameter_set(name: str) -> None:
    dirty, volume = EIGHT[name]
    if volume is None:
        d = np.sqrt(1.0 + 0.03**2 + 0.02**2)
        share = 1.0 - (4 + d) * (2 - d) ** 2 / 32  # union of two spheres over both
        volume = 2 * shapes.sphere(4).volume * share
    result = mended(Triangulation(dirty.vertices, dirty.triangles))
    assert result.closed
    assert result.problems == ()
    assert shapes.is_closed_manifold(result.triangulation)
    assert result.triangulation.volume == pytest.approx(volume, rel=3e-3)
    # kept triangles are where they were, but for welding
    kept = result.origin == KEPT
    given = np.sort(dirty.corners[result.source[kept]].reshape(-1, 9), axis=1)
    now = np.sort(result.triangulation.corners[kept].reshape(-1, 9), axis=1)
    assert np.abs(given - now).max() <= Tolerance.of(dirty).fit
    assert (result.source[result.origin == BRIDGED] == -1).all()


def test_a_clean_body_comes_back_to_the_last_bit() -> None:
    whole = shapes.soup(shapes.sphere(4))
    result = mended(whole, "keep")
    assert np.array_equal(result.triangulation.corners, whole.corners)
    assert (result.origin == KEPT).all()
    assert np.array_equal(result.source, np.arange(len(whole)))
    assert result.dropped == ()


def dirty_dumbbell(jitter: float) -> tuple[Triangulation, float]:
    """Three overlapping bodies as one unmerged soup with a slit all round and one triangle in a hundred missing."""
    a, b = shapes.sphere(4), shapes.sphere(4, at=(3.0, 0.01, 0.02))
    bar = shapes.box((3.0, 0.5, 0.5), at=(1.5, 0.03, 0.01))
    whole = shapes.together(a, b, bar)
    middle = whole.corners.mean(axis=1)
    slit = (np.asarray(whole.tags) == 0) & (middle[:, 0] > -0.45) & (middle[:, 0] < -0.35)
    lost = np.random.default_rng(3).random(len(whole)) < 0.01
    clean = mended(whole, "keep").triangulation.volume
    return shapes.soup(whole.take(~(slit | lost)), jitter), clean


@pytest.mark.parametrize("tagged", [True, False])
@pytest.mark.parametrize("jitter", [0.0, 3e-4])
def test_slit_missing_triangles_jitter_and_overlap_at_once(jitter: float, tagged: bool) -> None:
    dirty, volume = dirty_dumbbell(jitter)
    if not tagged:
        dirty = Triangulation(dirty.vertices, dirty.triangles)
    result = mended(dirty, "keep")
    assert result.closed
    assert shapes.is_closed_manifold(result.triangulation)
    assert result.triangulation.volume == pytest.approx(volume, rel=3e-3)
    assert result.noise == pytest.approx(jitter / np.sqrt(3.0), rel=0.05, abs=1e-12)
    assert {action.kind for action in result.actions} >= {"weld", "bridge", "unite"}
    assert any(drop.what == "inner surface" for drop in result.dropped)
    if tagged:
        assert {name for drop in result.dropped for name in drop.parts} >= {"part0", "part2"}
        assert result.triangulation.tags is not None
        made = result.source >= 0
        assert np.array_equal(result.triangulation.tags[made], np.asarray(dirty.tags)[result.source[made]])
    assert (np.bincount(result.origin, minlength=3)[[CUT, BRIDGED]] > 0).all()


def test_openings_are_kept_and_closed_on_request() -> None:
    tube = shapes.half(1, 0.0)
    kept = mended(tube, "keep")
    assert not kept.closed
    assert [len(rim) for rim in kept.openings] == [48]
    assert (kept.origin == KEPT).all()
    closed = mended(tube, "close")
    assert closed.closed
    assert closed.openings == ()
    assert closed.triangulation.volume == pytest.approx(CAPSULE / 2, rel=1e-9)


def test_a_flat_sheet_stays_a_sheet() -> None:
    sheet = grid([0, 0, 0], [1, 0, 0], [0, 1, 0], 5)
    result = mended(sheet, "keep")
    assert len(result.triangulation) == len(sheet)
    assert len(result.openings) == 1
    refused = mended(sheet, "close")
    assert [problem.kind for problem in refused.problems] == ["sheet"]


def test_a_body_that_runs_through_itself_is_untangled() -> None:
    # a tube bent so that its end enters its own side: two spheres joined by an inner tunnel
    a, b = shapes.sphere(4), shapes.sphere(4, radius=0.6, at=(1.2, 0.013, 0.007))
    inner_a = int(np.argmin(np.linalg.norm(a.corners.mean(axis=1) - [0.8, 0.2, 0.0], axis=1)))
    inner_b = int(np.argmin(np.linalg.norm(b.corners.mean(axis=1) - [0.75, -0.2, 0.0], axis=1)))
    both = shapes.together(a, b)
    union = mended(both, "keep").triangulation.volume
    p, q = both.triangles[inner_a], both.triangles[len(a) + inner_b]
    rows = np.delete(both.triangles, [inner_a, len(a) + inner_b], axis=0)
    tunnel = [[p[k], p[(k + 1) % 3], q[-k % 3]] for k in range(3)]
    tunnel += [[p[(k + 1) % 3], q[(-k - 1) % 3], q[-k % 3]] for k in range(3)]
    tangled = Triangulation(both.vertices, np.concatenate([rows, tunnel]))
    assert (shapes.edge_uses(tangled) == 2).all()
    result = mended(tangled, "keep")
    assert result.closed
    assert result.triangulation.volume == pytest.approx(union, rel=1e-12)


@pytest.mark.parametrize("count", [0, 1])
def test_next_to_nothing_is_no_exception(count: int) -> None:
    few = Triangulation(np.eye(3), np.array([[0, 1, 2]])[:count])
    result = mended(few)
    assert not result.closed
    assert len(result.problems) >= 1


def test_a_word_that_means_nothing_is_refused() -> None:
    with pytest.raises(ParameterError, match="maybe"):
        mended(shapes.sphere(1), "maybe")


def read(path: Path) -> Triangulation:
    from patchwright.models import concatenate
    from patchwright.models.io import read as read_file

    return concatenate([part.triangulation for part in read_file(path).parts])


@pytest.mark.parametrize(
    ("name", "rims", "volume"),
    [("boeing.off", [], 210.569), ("featuretype.stl", [], 11.6277), ("three_plugs.a.tri", [], 215717.5),
     ("c172_wing.stl", [57], None), ("cgal_blade.off", [120, 120], None), ("wigley_hull.stl.gz", [392], None)],
)  # fmt: skip
def test_real_files(data: Callable[[str], Path], name: str, rims: list[int], volume: float | None) -> None:
    dirty = read(data(name))
    result = mended(dirty, "keep")
    assert result.problems == ()
    assert [len(rim) for rim in result.openings] == rims
    assert result.closed == (not rims)
    assert (shapes.directed_uses(result.triangulation) == 1).all()
    assert not (result.origin == BRIDGED).any()
    if volume is not None:
        assert result.triangulation.volume == pytest.approx(volume, rel=1e-5)


def test_a_rudder_tessellated_patch_by_patch(data: Callable[[str], Path]) -> None:
    dirty = read(data("dtc_rudder.stl.gz"))
    result = mended(dirty, "keep")
    assert result.problems == ()
    assert len(result.openings) == 1  # its upper end
    assert (shapes.directed_uses(result.triangulation) == 1).all()
    areas = result.triangulation.areas
    assert areas[result.origin == BRIDGED].sum() < 2e-3 * areas.sum()
    assert max(action.largest_move for action in result.actions) <= Tolerance.of(dirty).fit
