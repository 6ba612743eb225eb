from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import ParameterError, Tolerance, Triangulation
from patchwright.models.adjacency import Adjacency
from patchwright.models.samples import DefectCase, eight_defects
from patchwright.models.tree import Tree
from patchwright.repair.mender.crossings import crossing_pairs
from patchwright.repair.mender.mend import BRIDGED, CUT, KEPT, Mended, mend


def mended(dirty: Triangulation, openings: str = "close") -> Mended:
    return mend(dirty, Tolerance.of(dirty), openings=openings)  # type: ignore[arg-type]


def grid(origin: list[float], a: list[float], b: list[float], n: int) -> Triangulation:
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    points = np.array(origin) + (i[..., None] * np.array(a) + j[..., None] * np.array(b)) / n
    k = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1)
    rows = np.concatenate([np.stack([k, k + n + 1, k + n + 2], 1), np.stack([k, k + n + 2, k + 1], 1)])
    return Triangulation(points.reshape(-1, 3), rows)


CAPSULE = shapes.together(shapes.half(1, 0.0), shapes.half(-1, 0.0)).volume


@cache
def cases(shape: str, size: float, seed: int) -> dict[str, DefectCase]:
    return eight_defects(shape, size=size, place=(3.0 * size, -size, 0.5 * size), seed=seed)


@pytest.mark.parametrize("name", ["gap1", "gap5", "gap10", "overlap5", "tjunc", "selfx", "missface", "flipdup"])
@pytest.mark.parametrize(("shape", "size", "seed"), [("sphere", 1.0, 0), ("ellipsoid", 1e3, 1), ("torus", 1e-3, 2),
                                                     ("blade", 1.0, 3)])  # fmt: skip
def test_eight_defects_are_mended_with_one_parameter_set(shape: str, size: float, seed: int, name: str) -> None:
    case = cases(shape, size, seed)[name]
    dirty = case.triangulation
    result = mended(dirty, "close" if name == "missface" else "keep")
    body = result.triangulation
    assert result.closed
    assert result.problems == ()
    assert (shapes.edge_uses(body) == 2).all()
    assert (shapes.directed_uses(body) == 1).all()
    adjacency = Adjacency.of(body)
    assert adjacency.components().max() == 0
    assert len(np.unique(body.triangles)) - len(adjacency.edges) + len(body) == case.euler
    assert len(crossing_pairs(body, 1e-12 * body.diagonal)) == 0
    assert body.volume == pytest.approx(case.volume, rel=3e-3)
    # what was undamaged is where it was
    points = np.concatenate([case.kept.vertices, case.kept.corners.mean(axis=1)])
    assert Tree.of(body).closest(points).distance.max() <= 1e-4 * dirty.diagonal
    kept = result.origin == KEPT
    assert kept.mean() > 0.5
    given = np.sort(dirty.corners[result.source[kept]].reshape(-1, 9), axis=1)
    assert np.abs(given - np.sort(body.corners[kept].reshape(-1, 9), axis=1)).max() <= 1e-12 * dirty.diagonal
    assert (result.source[result.origin == BRIDGED] == -1).all()
    assert (result.source[result.origin != BRIDGED] >= 0).all()
    assert (result.origin == BRIDGED).any() == (name in {"gap1", "gap5", "gap10", "missface"}) or name == "overlap5"


@pytest.mark.parametrize("depth", [0.02, 0.05, 0.1])
def test_sheets_that_run_past_each_other_are_trimmed_where_they_cross(depth: float) -> None:
    """Two hemispheres pushed into each other cross in the mirror plane: nothing is invented, the lens volume goes."""
    result = mended(shapes.together(shapes.half(1, -depth), shapes.half(-1, depth)), "keep")
    assert result.closed
    assert not (result.origin == BRIDGED).any()
    assert [action.kind for action in result.actions if action.rung == "re-trim"] == ["trim"]
    assert any(drop.what == "overlapping rims" for drop in result.dropped)
    slice_ = 2.0 * np.pi * (depth - depth**3 / 3.0)  # of the unit ball between -depth and depth
    whole = 4.0 / 3.0 * np.pi
    assert result.triangulation.volume == pytest.approx((whole - slice_) * CAPSULE / whole, rel=1e-3)


@pytest.mark.parametrize("offset", [1e-3, 1e-2])
def test_sheets_that_run_past_each_other_without_crossing_are_cut_back_and_bridged(offset: float) -> None:
    """A tube that ends inside a slightly wider one: the step between them is all that is invented."""
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    parts = []
    for radius, low, high in ((1.0, -3.0, 0.1), (1.0 + offset, -0.1, 3.0)):
        angle = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
        z = np.linspace(low, high, 32)
        points = np.stack(
            [radius * np.cos(angle) + 0 * z[:, None], radius * np.sin(angle) + 0 * z[:, None], z[:, None] + 0 * angle],
            2,
        )
        k = np.arange(31)[:, None] * 64
        i, j = np.arange(64), np.roll(np.arange(64), -1)
        a, b, c, d = k + i, k + j, k + 64 + j, k + 64 + i
        rows = np.stack([np.stack([a, b, c], 2), np.stack([a, c, d], 2)], 2).reshape(-1, 3)
        parts.append(Triangulation(points.reshape(-1, 3) @ turn.T, rows))
    result = mended(shapes.together(*parts), "keep")
    assert result.problems == ()
    assert len(result.openings) == 2
    assert Adjacency.of(result.triangulation).components().max() == 0
    invented = result.triangulation.areas[result.origin == BRIDGED].sum()
    strip = 2.0 * np.pi * np.hypot(max(0.1 * 0.2, 2.0 * offset), offset)
    assert 0.0 < invented <= 1.1 * strip
    assert shapes.directed_uses(result.triangulation).max() == 1


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


def shrunk(whole: Triangulation, inset: float) -> Triangulation:
    """Every triangle by itself, its corners drawn towards its middle: six copies stand round a point in a ring."""
    middle = whole.corners.mean(axis=1, keepdims=True)
    share = 2.0 * inset / np.sqrt(whole.areas)[:, None, None]
    corners = middle + (whole.corners - middle) * (1.0 - share)
    return Triangulation(corners.reshape(-1, 3), np.arange(3 * len(whole)).reshape(-1, 3))


@pytest.mark.parametrize("inset", [1e-5, 1e-4])
def test_triangles_drawn_apart_within_the_tolerance_are_welded(inset: float) -> None:
    whole = shapes.sphere(2)
    dirty = shrunk(whole, inset)
    result = mend(dirty, Tolerance.of(dirty))
    assert result.closed
    assert not result.problems
    assert len(result.triangulation.vertices) == len(whole.vertices)
    assert np.array_equal(result.source, np.arange(len(whole)))


@pytest.mark.parametrize("how", ["jitter", "shrunk"])
@pytest.mark.parametrize("scatter", [4e-4, 3e-3])
def test_scatter_beyond_the_tolerance_is_refused_with_the_tolerance_it_takes(how: str, scatter: float) -> None:
    whole = shapes.sphere(3)
    dirty = shapes.soup(whole, 2.0 * scatter) if how == "jitter" else shrunk(whole, scatter)
    tolerance = Tolerance.of(dirty)
    result = mend(dirty, tolerance)
    assert [problem.kind for problem in result.problems] == ["scatter"]
    needed = float(result.problems[0].message.split("a tolerance of ")[1].split()[0])
    assert needed > tolerance.fit
    again = mend(dirty, Tolerance.of(dirty, fit=needed))
    assert again.closed
    assert not again.problems
    assert len(again.triangulation) == len(whole)
