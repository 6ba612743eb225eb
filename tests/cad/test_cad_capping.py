"""Planar openings capped by planes on their own edges: volume, sharing, holes, kept faces, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from oracles_cad import network

from patchwright.models import Plane, Tolerance
from patchwright.models.cad.capping import cap, free_loops, reason_against
from patchwright.models.cad.seams import measure_seams
from patchwright.models.errors import GeometryError, ParameterError
from patchwright.models.io import read, write
from patchwright.repair import repair
from patchwright.repair.result import Verdict

FLAT = 1e-9


def tube(radius=1.0, inward=False, warp=0.0, tilt=0.0, sides=4, count=7):
    """Nets of patches round the z axis from z = 0 to z = 3; `tilt` slants the upper rim, `warp` makes it wavy."""
    step = count - 1
    u = np.arange(sides * step) * (2 * np.pi / (sides * step))
    v = np.linspace(0.0, 1.0, count)
    ring = radius * np.stack([np.cos(u), np.sin(u)], axis=1)
    top = 3.0 + tilt * ring[:, 0] + warp * np.cos(2 * u)
    grid = np.concatenate([np.broadcast_to(ring[:, None], (len(u), count, 2)), (v * top[:, None])[..., None]], axis=2)
    grid = np.concatenate([grid, grid[:1]])
    nets = [np.ascontiguousarray(grid[i * step : (i + 1) * step + 1]) for i in range(sides)]
    return [np.ascontiguousarray(n[:, ::-1]) for n in nets] if inward else nets


def enclosed(nets):
    """Area of the z = 0 section of a tube's true curves (dense polygon)."""
    ring = np.concatenate([p.surface.grid(np.linspace(0, 1, 2001), [0.0])[:-1, 0] for p in network(nets).parts])
    x, y = ring[:, 0], ring[:, 1]
    return 0.5 * abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def test_an_open_tube_becomes_a_solid_of_known_volume():
    nets = tube()
    model = network(nets)
    loops = free_loops(model)
    assert [reason_against(loop, FLAT) for loop in loops] == ["", ""]
    made = cap(model, loops, FLAT)
    assert made.caps == (4, 5)
    assert made.surface_change.max() == 0.0
    assert (made.assembly.topology.use_counts() == 2).all()
    assert max(s.gap for s in measure_seams(made.assembly)) < 1e-14
    assert made.assembly.triangulation.volume == pytest.approx(3.0 * enclosed(nets), rel=1e-3)
    for i in made.caps:
        end = made.assembly.parts[i].triangulation
        assert np.allclose(end.normals, [0, 0, 1.0 if end.vertices[0, 2] > 1.5 else -1.0], atol=1e-12)


def test_a_slanted_end_is_planar_too():
    model = network(tube(tilt=0.4))
    made = cap(model, free_loops(model), FLAT)
    assert made.assembly.triangulation.volume == pytest.approx(3.0 * enclosed(tube()), rel=1e-3)


def test_a_thick_pipe_gets_rings_not_discs():
    model = network([*tube(1.0), *tube(0.6, inward=True)])
    made = cap(model, free_loops(model), FLAT)
    assert len(made.caps) == 2
    assert [len(made.assembly.topology.loops[i]) for i in made.caps] == [2, 2]
    wall = enclosed(tube(1.0)) - enclosed(tube(0.6))
    assert made.assembly.triangulation.volume == pytest.approx(3.0 * wall, rel=2e-3)


def test_two_pipes_side_by_side_get_a_disc_each():
    away = [net + np.array([5.0, 0.0, 0.0]) for net in tube()]
    made = cap(model := network([*tube(), *away]), free_loops(model), FLAT)
    assert len(made.caps) == 4
    assert made.assembly.triangulation.volume == pytest.approx(6.0 * enclosed(tube()), rel=1e-3)


def test_a_wavy_rim_is_refused_with_its_height():
    model = network(tube(warp=0.05))
    reasons = [reason_against(loop, FLAT) for loop in free_loops(model)]
    assert sorted(bool(r) for r in reasons) == [False, True]
    (loop,) = [one for one in free_loops(model) if reason_against(one, FLAT)]
    assert loop.flatness == pytest.approx(0.05, rel=0.1)
    with pytest.raises(GeometryError, match="not planar"):
        cap(model, (loop,), FLAT)


def test_a_chain_that_is_no_ring_is_refused():
    model = network(tube())
    ends = model.topology.ends.copy()
    (first, *_) = free_loops(model)
    edge = first.steps[0][0]
    vertices = np.concatenate([model.topology.vertices, model.topology.vertices[ends[edge, :1]]])
    ends[edge, 0] = len(vertices) - 1  # a corner that only looks shared
    from dataclasses import replace

    torn = replace(model, topology=replace(model.topology, vertices=vertices, ends=ends))
    assert any("closed ring" in reason_against(loop, FLAT) for loop in free_loops(torn))
    with pytest.raises(ParameterError, match="sew"):
        free_loops(replace(model, topology=None))


def test_repair_closes_planar_openings_and_the_file_holds_a_solid(tmp_path):
    write(tmp_path / "tube.step", network(tube()))
    model = read(tmp_path / "tube.step")
    result = repair(model, openings="close")
    assert result.verdict == Verdict.INVENTED
    assert result.figures["closed"]
    assert result.figures["openings kept"] == 0
    discs = 2.0 * enclosed(tube())
    total = result.triangulation.areas.sum()
    assert result.invented == pytest.approx(discs / total, rel=1e-2)
    assert result.triangulation.volume == pytest.approx(3.0 * enclosed(tube()), rel=1e-3)
    assert [f.origin for f in result.faces[:4]] == [(n,) for n in model.names]
    assert result.deviation.coverage == 1.0
    write(tmp_path / "closed.step", result.to_assembly())
    again = read(tmp_path / "closed.step")
    assert (again.topology.use_counts() == 2).all()
    assert len(again.parts) == 6


def test_repair_fills_a_wavy_opening_by_a_bent_face_and_the_flat_one_by_a_plane(tmp_path):
    write(tmp_path / "wavy.step", network(tube(warp=0.1)))
    model = read(tmp_path / "wavy.step")
    result = repair(model, openings="close", tolerance=Tolerance.of(model))
    assert result.verdict == Verdict.INVENTED
    after = result.to_assembly()
    assert (after.topology.use_counts() == 2).all()
    assert max(s.gap for s in measure_seams(after)) <= 1e-6 * model.diagonal
    assert sum(isinstance(part.surface, Plane) for part in after.parts) == 1
    # a quarter turn takes the wave cos 2u to its negative, so a fill that treats all sides alike adds no volume
    assert after.triangulation.volume == pytest.approx(3.0 * enclosed(tube()), rel=1e-3)
