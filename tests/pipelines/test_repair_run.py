"""A whole repair of a small dirty model: the files, what an independent reader makes of them, and the report."""

from __future__ import annotations

import json

import numpy as np
import pytest

from patchwright.models import Tolerance, Triangulation
from patchwright.models.io import read, write
from patchwright.models.samples import damage, missing_triangles, sphere, unmerged
from patchwright.pipelines.recipe import repair_recipe
from patchwright.pipelines.run import run
from patchwright.repair import Verdict, repair
from patchwright.repair.mesh_route import CHORD
from patchwright.repair.patches.tessellation import tessellation_within

FILES = ("repaired.step", "repaired.igs", "repaired.stl", "grid.xyz", "report.html", "report.json")


def dirty_sphere(seed=3):
    clean = sphere().bodies[0].tessellate(density=4.0)  # facets no higher than the fit tolerance
    plain = Triangulation(clean.vertices, clean.triangles)

    def holes(t, *, seed):
        return missing_triangles(t, share=0.01, seed=seed)

    def soup(t, *, seed):
        return unmerged(t, radius=1e-4, seed=seed)

    return plain, damage(plain, [holes, soup], seed=seed).triangulation


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    write(folder / "dirty.stl", dirty_sphere()[1])
    return run(repair_recipe(folder / "dirty.stl", folder / "out"))


def test_every_file_of_the_contract_is_written_and_nothing_else_is_left(study):
    names = {p.name for p in study.folder.iterdir()}
    assert set(FILES) <= names
    assert not [n for n in names if n.startswith(".") or n.endswith(".tmp")]
    assert set(study.files) == names


def test_the_verdict_names_the_invented_surface(study):
    assert study.repaired.verdict is Verdict.INVENTED
    assert 0.0 < study.repaired.invented < 0.05
    assert any(e.what == "bridge" and e.where is not None for e in study.repaired.ledger)


def test_the_step_file_is_one_closed_shell_with_exact_seams(study):
    from patchwright.models.cad.seams import measure_seams

    shell = read(study.folder / "repaired.step")
    assert (shell.topology.use_counts() == 2).all()
    seams = measure_seams(shell)
    assert max(s.gap for s in seams) <= 1e-9 * shell.diagonal
    assert max(s.tolerance for s in seams) <= max(1e-6 * shell.diagonal, 1e-7)


def test_the_patches_are_the_sphere(study):
    network = study.repaired.network
    radius = np.linalg.norm(network.nets.sample(9), axis=-1).reshape(-1)
    true = np.linalg.norm(dirty_sphere()[0].vertices, axis=1).mean()
    assert np.percentile(np.abs(radius / true - 1), 99) < 1e-3
    assert study.repaired.deviation.coverage > 0.99


def test_the_stl_is_closed_and_keeps_what_was_good(study):
    body = read(study.folder / "repaired.stl").triangulation
    edges = np.sort(np.stack([body.triangles, np.roll(body.triangles, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert body.volume == pytest.approx(dirty_sphere()[0].volume, rel=3e-3)


def test_the_grid_is_read_back_with_its_marks(study):
    from patchwright.models.io import read_grid

    grid = read_grid(study.folder / "grid.xyz")
    cells = sum((b.shape[0] - 1) * (b.shape[1] - 1) for b in grid.blocks)
    assert cells == 64 * len(study.repaired.network)
    assert len(grid.blocks) == study.repaired.figures["grid blocks"]
    assert grid.bounds == pytest.approx(study.repaired.grid.bounds)


def test_the_report_tells_the_same_as_the_result(study):
    told = json.loads((study.folder / "report.json").read_text())
    assert told["verdict"] == study.repaired.verdict.value
    assert len(told["seams"]) == len(study.repaired.seams)
    assert {s["stage"] for s in told["stages"]} >= {"read", "diagnose", "repair", "write"}
    page = (study.folder / "report.html").read_text()
    assert told["verdict"] in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "https://" not in page


def test_a_clean_model_comes_back_identical():
    clean, _ = dirty_sphere()
    repaired = repair(clean)
    assert repaired.verdict is Verdict.CLEAN
    assert np.array_equal(repaired.triangulation.vertices, clean.vertices)
    assert np.array_equal(repaired.triangulation.triangles, clean.triangles)
    assert repaired.invented == 0.0


def test_scope_all_gives_the_patches_own_triangles_within_the_fit_tolerance():
    clean, _ = dirty_sphere()
    repaired = repair(clean, scope="all")
    body = tessellation_within(repaired.network, CHORD * Tolerance.of(clean).fit)
    assert np.array_equal(repaired.triangulation.vertices, body.vertices)
    assert np.array_equal(repaired.triangulation.triangles, body.triangles)
    fit = Tolerance.of(clean).fit
    assert repaired.deviation.output_to_input.p99 <= fit
    assert repaired.deviation.input_to_output.p99 <= fit


def test_a_given_layout_is_used():
    from quad_shapes import sphere_layout

    clean, _ = dirty_sphere()
    radius = float(np.linalg.norm(clean.vertices, axis=1).max())
    repaired = repair(clean, layout=sphere_layout(2, radius))
    assert len(repaired.network) == 24
    assert len(repaired.faces) == 6  # a ball from a cube: the quads of each side are a block


def test_the_layout_written_gives_the_same_patches_again(study):
    from patchwright.repair.layout.layout_file import load_layout

    layout = load_layout(study.folder / "layout.json")
    again = repair(read(study.source), layout=layout)
    assert again.network is not None
    np.testing.assert_allclose(again.network.points(4), study.repaired.network.points(4), rtol=0, atol=1e-9)
