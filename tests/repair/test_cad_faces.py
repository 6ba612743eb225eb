"""CAD faces that are bad or missing: trims drawn anew, loops turned, faces replaced, gaps bridged; time limits kept."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from oracles_cad import cube_sphere
from oracles_cad_damage import ROUNDED_VOLUME, SIZES, faces_of, rounded_box, written

from patchwright.models import Assembly, NurbsCurve, NurbsSurface, Plane
from patchwright.models.cad import brep_status, measure_seams, surface_difference
from patchwright.models.cad.editing import compacted, with_loops
from patchwright.models.errors import ParameterError
from patchwright.models.io import read, write
from patchwright.repair import repair
from patchwright.repair.cad.deadline import Deadline
from patchwright.repair.cad.draft import Draft, Limits
from patchwright.repair.cad.height_surface import Frame, Rim, height_surface
from patchwright.repair.cad.retrace import retrace
from patchwright.repair.cad.turned_loops import turned_loops
from patchwright.repair.patches.coons_surface import coons_surface
from patchwright.repair.result import Rung, Verdict

DIAGONAL = float(np.linalg.norm(SIZES))


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """Six sewn faces that are nearly a sphere of radius 10."""
    path = tmp_path_factory.mktemp("faces") / "ball.step"
    write(path, cube_sphere())
    return read(path)


@pytest.fixture(scope="module")
def box(tmp_path_factory):
    """A solid of six planes and four cylinders."""
    return read(written(tmp_path_factory.mktemp("faces") / "box.step", faces_of(rounded_box()), set()))


def limits_of(model):
    return Limits.of(model.diagonal)


def with_pcurve(model: Assembly, face: int, change) -> Assembly:
    """The model whose first edge of a face has another pcurve there."""
    loops = [list(loop) for loop in model.topology.loops[face]]
    use = loops[0][0]
    loops[0][0] = replace(use, pcurve=change(use.pcurve))
    topology = with_loops(model.topology, {face: tuple(tuple(loop) for loop in loops)})
    return replace(model, topology=topology, native=None)


def bent(share: float):
    """A pcurve of degree 2 that leaves the straight one by a share of its length half-way."""

    def change(pcurve: NurbsCurve) -> NurbsCurve:
        t = np.linspace(*pcurve.domain, 3)
        points = pcurve(t)
        along = points[2] - points[0]
        points[1] -= 2.0 * share * np.array([-along[1], along[0]])
        return NurbsCurve(2, np.repeat(pcurve.domain, 3), points)

    return change


def without(model: Assembly, face: int) -> Assembly:
    """The model without one of its faces."""
    keep = [i for i in range(len(model.parts)) if i != face]
    topology = replace(
        model.topology,
        loops=tuple(model.topology.loops[i] for i in keep),
        flipped=tuple(model.topology.flipped[i] for i in keep),
    )
    return replace(model, parts=tuple(model.parts[i] for i in keep), topology=compacted(topology), native=None)


def identical(before, after) -> bool:
    made = {part.name: part.surface for part in after.parts}
    return all(surface_difference(p.surface, made[p.name]) <= 1e-12 for p in before.parts)


@pytest.mark.parametrize("share", [1e-3, 3e-3, 1e-2])
@pytest.mark.parametrize("face", [0, 4])
def test_a_corrupt_pcurve_is_drawn_anew_on_the_same_surface(box, face, share):
    bad = with_pcurve(box, face, bent(share))
    assert max(s.gap for s in measure_seams(bad)) > 1e-4 * DIAGONAL
    result = repair(bad)
    assert result.verdict == Verdict.REPAIRED, result.problems
    after = result.to_assembly()
    assert identical(box, after)
    assert max(s.gap for s in measure_seams(after)) <= 1e-6 * DIAGONAL
    assert brep_status(after).invalid == ()
    (entry,) = [e for e in result.ledger if e.what == "trims drawn anew"]
    assert entry.parts == (box.parts[face].name,)
    # the trim had come away by the bend, square to an edge no longer than the box
    assert 0.0 < entry.largest_move <= 10.0 * share


def test_a_good_model_has_no_trim_drawn_anew(box, ball):
    for model in (box, ball):
        draft, changes, failed = retrace(Draft(model, model.topology), limits_of(model))
        assert (changes, failed) == ((), ())
        assert draft.topology is model.topology


@pytest.mark.parametrize("face", [1, 5])
def test_a_reversed_wire_is_turned_back(box, face):
    loops = {
        face: tuple(tuple(replace(u, reversed=not u.reversed) for u in loop[::-1]) for loop in box.topology.loops[face])
    }
    bad = replace(box, topology=with_loops(box.topology, loops), native=None)
    draft, changes = turned_loops(Draft(bad, bad.topology), limits_of(bad), ())
    assert [c.faces for c in changes] == [(face,)]
    for was, now in zip(box.topology.loops[face], draft.topology.loops[face], strict=True):
        assert {(u.edge, u.reversed) for u in was} == {(u.edge, u.reversed) for u in now}


def test_a_face_turned_inside_out_is_turned_back(box):
    flipped = tuple(flip != (i == 3) for i, flip in enumerate(box.topology.flipped))
    bad = replace(box, topology=replace(box.topology, flipped=flipped), native=None)
    draft, changes = turned_loops(Draft(bad, bad.topology), limits_of(bad), ())
    assert [c.faces for c in changes] == [(3,)]
    assert draft.topology.flipped == box.topology.flipped
    assert turned_loops(Draft(box, box.topology), limits_of(box), ())[1] == ()


def test_a_missing_face_of_a_ball_is_bridged_on_its_own_edges(ball, tmp_path):
    write(tmp_path / "hole.step", without(ball, 2))
    before = read(tmp_path / "hole.step")
    result = repair(before)
    assert result.verdict == Verdict.INVENTED, result.problems
    after = result.to_assembly()
    assert identical(before, after)
    new = result.faces[-1]
    assert (new.rung, new.invented) == (Rung.BRIDGE, 1.0)
    assert result.invented == pytest.approx(new.area / sum(face.area for face in result.faces))
    (entry,) = [e for e in result.ledger if e.what == "bridge"]
    assert entry.area == pytest.approx(new.area)
    write(tmp_path / "whole.step", after)
    again = read(tmp_path / "whole.step")
    assert (again.topology.use_counts() == 2).all()
    assert max(s.gap for s in measure_seams(again)) <= 1e-9 * again.diagonal
    assert again.names == after.names
    # a Coons patch of four quarter arcs is flatter than the sphere: less volume, but not less than the chord's
    assert 0.9 < again.triangulation.volume / ball.triangulation.volume < 1.0


def test_a_face_that_passes_through_itself_is_replaced_and_its_neighbours_stay(ball, tmp_path):
    surface = ball.parts[1].surface
    net = surface.control_points.copy()
    net[1:-1, 1:-1] = net[1:-1, 1:-1][::-1]  # its borders stay where they are
    folded = NurbsSurface(surface.degree, surface.knots, net)
    parts = [replace(p, surface=folded, native=None) if i == 1 else p for i, p in enumerate(ball.parts)]
    write(tmp_path / "folded.step", replace(ball, parts=tuple(parts), native=None))
    before = read(tmp_path / "folded.step")
    result = repair(before)
    assert result.verdict == Verdict.INVENTED, result.problems
    after = result.to_assembly()
    assert [
        surface_difference(a.surface, b.surface) <= 1e-12 for a, b in zip(before.parts, after.parts, strict=True)
    ] == [i != 1 for i in range(6)]
    assert (result.faces[1].rung, result.faces[1].invented) == (Rung.BRIDGE, 1.0)
    assert [face.invented for face in result.faces].count(0.0) == 5
    assert max(s.gap for s in measure_seams(after)) <= 1e-9 * after.diagonal
    assert 0.9 < after.triangulation.volume / ball.triangulation.volume < 1.0


def test_a_bent_opening_is_filled_when_asked_and_planar_ones_by_planes(box, tmp_path):
    cylinder = next(i for i, p in enumerate(box.parts) if not isinstance(p.surface, Plane))
    write(tmp_path / "open.step", without(box, cylinder))
    result = repair(read(tmp_path / "open.step"), openings="close")
    assert result.verdict == Verdict.INVENTED, result.problems
    after = result.to_assembly()
    assert (after.topology.use_counts() == 2).all()
    # four sides, two of them arcs: the Coons patch is the cylinder itself
    assert after.triangulation.volume == pytest.approx(ROUNDED_VOLUME, rel=1e-3)


def test_a_deadline_counts_work_and_not_waiting():
    deadline = Deadline.after(0.2)
    time.sleep(0.3)
    assert not deadline.passed
    assert deadline.left(60.0, 0.0) > 0.1
    end = time.thread_time() + 0.25
    while time.thread_time() < end:
        pass
    assert deadline.passed
    assert deadline.left(60.0) == 5.0  # what a call that is begun at all is given
    waited = Deadline.after(0.01)
    time.sleep(0.05)
    assert waited.passed  # the clock is an outer stop


def test_what_is_not_begun_in_time_is_told_with_its_place(box):
    bad = with_pcurve(box, 0, bent(1e-2))
    started = time.monotonic()
    result = repair(bad, time_limit=1e-9)
    assert time.monotonic() - started < 60.0
    assert result.verdict == Verdict.REFUSED
    told = [e for e in result.ledger if "time" in e.reason or "time" in e.what]
    assert told
    assert all(e.where is not None for e in told)
    with pytest.raises(ParameterError, match="time limit"):
        repair(box, time_limit=0.0)


def test_a_coons_surface_has_its_curves_as_borders_and_reproduces_bilinear_ones():
    rng = np.random.default_rng(3)
    knots = np.array([0.0, 0.0, 0.0, 0.4, 1.0, 1.0, 1.0])
    corners = np.array([[0.0, 0, 0], [3, 0, 1], [3, 2, 0], [0, 2, 2]])

    def curve(a, b, degree=2, knots=knots):
        points = a + np.linspace(0, 1, len(knots) - degree - 1)[:, None] * (b - a)
        points[1:-1] += 0.3 * rng.normal(size=points[1:-1].shape)
        return NurbsCurve(degree, knots, points)

    south, east = curve(corners[0], corners[1]), curve(corners[1], corners[2], 1, np.array([0.0, 0.0, 1.0, 1.0]))
    north = curve(corners[3], corners[2], 3, np.repeat([0.0, 1.0], 4))
    west = curve(corners[0], corners[3])
    made = coons_surface(south, north, west, east)
    t = np.linspace(0.0, 1.0, 33)
    one = np.ones_like(t)
    for u, v, wanted in ((t, 0 * one, south), (t, one, north), (0 * one, t, west), (one, t, east)):
        assert np.abs(made(u, v) - wanted(t)).max() <= 1e-13
    u, v = np.meshgrid(t, t, indexing="ij")
    blend = (
        (1 - v)[..., None] * south(u) + v[..., None] * north(u) + (1 - u)[..., None] * west(v) + u[..., None] * east(v)
        - ((1 - u) * (1 - v))[..., None] * corners[0] - (u * (1 - v))[..., None] * corners[1]
        - (u * v)[..., None] * corners[2] - ((1 - u) * v)[..., None] * corners[3]
    )  # fmt: skip
    assert np.abs(made(u, v) - blend).max() <= 1e-12
    with pytest.raises(ParameterError, match="corner"):
        coons_surface(south, north, west.reversed(), east)


def test_a_height_surface_is_exact_for_planes_and_paraboloids_and_nears_its_rim_as_it_is_refined():
    a = np.linspace(0.0, 2.0 * np.pi, 97)[:-1]
    ring = np.stack([2.0 * np.cos(a), (1.0 + 0.2 * np.cos(3 * a)) * np.sin(a), np.zeros_like(a)], axis=1)
    unknown = np.full(len(a), np.nan)
    tilted = ring + np.outer(0.3 * ring[:, 0] - 0.1 * ring[:, 1], [0, 0, 1])
    frame = Frame(np.zeros(3), np.eye(3))
    surface, off = height_surface(frame, Rim(tilted, np.zeros((len(a), 2)), unknown), 1e-9)
    assert off <= 1e-9
    u, v = np.linspace(-1, 1, 7), np.linspace(-0.5, 0.5, 7)
    flat = surface.grid(u, v)
    assert np.abs(flat[..., 2] - (0.3 * u[:, None] - 0.1 * v[None])).max() <= 1e-6
    wavy = ring + np.outer(0.2 * np.sin(2.0 * a), [0, 0, 1])
    coarse = height_surface(frame, Rim(wavy, np.zeros((len(a), 2)), unknown), 1.0)
    fine = height_surface(frame, Rim(wavy, np.zeros((len(a), 2)), unknown), 1e-7)
    assert isinstance(fine[0], NurbsSurface)
    assert fine[1] <= min(1e-6, coarse[1])
