"""`patchwright curves`: the papers' tables, computed beside the printed figures, and the command as a user runs it."""

import json
import subprocess
import sys

import numpy as np
import pytest

from patchwright.models.interpolation import SCHEMES
from patchwright.pipelines import c2gbp_tables, quadratic_tables
from patchwright.pipelines.c2gbp_tables import error_tables
from patchwright.pipelines.curve_figures import paper_figures
from patchwright.pipelines.curves import PaperTables, curves_json
from patchwright.pipelines.quadratic_tables import energy_table, knot_tables

METHODS = [m[0] for m in c2gbp_tables.METHODS]


def patchwright(*words):
    command = [sys.executable, "-m", "patchwright.pipelines.cli", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)


@pytest.fixture(scope="module")
def tables():
    return PaperTables(knot_tables(), energy_table(), error_tables())


def test_tables_1_and_2_of_the_quadratic_paper(tables):
    for table, printed_F in zip(tables.knots, (3.3122e-4, 3.3126e-4), strict=True):
        assert table.farthest <= 1e-3
        assert table.found.F <= 3.302e-4 < table.printed_F
        assert table.printed_F == pytest.approx(printed_F, rel=1e-4)
        assert np.abs(table.midpoints - quadratic_tables.PRINTED_MIDPOINTS[table.ends]).max() <= 1e-3


def test_the_printed_midpoints_are_those_of_the_printed_knots():
    """So the midpoint method of the paper uses the knots of the maxima, not knots of its own."""
    for ends, printed in quadratic_tables.PRINTED_MIDPOINTS.items():
        t = quadratic_tables.PRINTED_KNOTS[ends]
        np.testing.assert_allclose((t[:-1] + t[1:]) / 2, printed, atol=1.5e-6)


def test_table_3_energies_on_four_polygons_are_below_the_midpoints_and_near_the_cubics(tables):
    assert len(tables.cases) == 4
    for case in tables.cases:
        maxima, midpoints, cubic = case.energies[:2], case.energies[2:4], case.energies[4]
        assert (maxima <= midpoints).all()
        assert (maxima <= 1.3 * cubic).all()
    for case, parameters in ((tables.cases[0], 0.5), (tables.cases[3], 1.0)):
        from patchwright.models.interpolation import parametrize

        printed = quadratic_tables.SITES if parameters == 0.5 else [0, 1 / 6, 1 / 3, 2 / 3, 5 / 6, 1]
        np.testing.assert_allclose(parametrize(case.points, parameters), printed, atol=1e-12)
    assert any("coincident knots" in note for note in tables.cases[3].notes)


def test_c2gbp_tables_what_is_reproduced_and_what_is_not(tables):
    """SSE: all but Ball and C2GBP, on all problems; MAE: the same on problems 2 and 3 only; RMSE: never."""
    for number, e in enumerate(tables.errors, start=1):
        sse, mae, rmse = (dict(zip(METHODS, row, strict=True)) for row in e.reproduced)
        for name in ("Spline", "Pchip", "mAkima", "Pollock"):
            assert sse[name]
            assert mae[name] == (number > 1)
        assert not sse["Ball"]
        assert not sse["C2GBP"]
        assert not any(rmse.values())
    third = tables.errors[2]
    assert third.paper[0, 5] == pytest.approx(7.1770e14, rel=3e-5)
    assert third.paper[1, 5] == pytest.approx(4.9519e5, rel=6e-5)


def test_the_printed_rmse_is_the_mae_times_the_root_of_401_on_problems_2_and_3(tables):
    for e in tables.errors[1:]:
        np.testing.assert_allclose(e.printed[2], e.printed[1] * np.sqrt(401), rtol=6e-3)
    first = tables.errors[0]
    assert (np.abs(first.printed[2] / (first.printed[1] * np.sqrt(401)) - 1) > 0.1).all()


def test_no_c2_cubic_at_equal_steps_reaches_the_printed_errors_of_c2gbp():
    """Least squares over the two free end slopes: a lower bound for every C2 curve in the paper's measure."""
    from patchwright.models.interpolation import interpolate

    for problem, bound in zip(c2gbp_tables.PROBLEMS, (13.684, 6.6631, 2.6642e14), strict=True):
        x = problem.x
        at = np.concatenate((np.linspace(x[:-1], x[1:], 100, endpoint=False).T.ravel(), x[-1:]))
        y = problem.points[:, 1:]
        s = np.linspace(0, 1, 5)

        def samples(first, last, y=y, s=s):
            curve = interpolate(y, "c2-cubic-clamped", s, start_tangent=[first], end_tangent=[last])
            return curve(np.linspace(0, 1, 401))[:, 0]

        base = samples(0.0, 0.0)
        size = np.abs(y).max()
        A = np.stack((samples(size, 0.0) - base, samples(0.0, size) - base), axis=1)
        rest = problem.f(at) - base
        least = rest - A @ np.linalg.lstsq(A, rest, rcond=None)[0]
        assert least @ least == pytest.approx(bound, rel=1e-4)


def test_the_measured_continuity_of_c2gbp_is_c1(tables):
    for e in tables.errors:
        assert e.jumps[0] <= 1e-14
        assert e.jumps[1] >= 1e-4


def test_there_is_a_sheet_for_every_figure_with_data(tables, tmp_path):
    sheets = paper_figures(tmp_path, tables.knots, tables.cases, tables.errors)
    names = {s.path.name for s in sheets}
    assert names == {f"quadratic-figure-{i}.png" for i in range(2, 8)} | {f"c2gbp-figure-{i}.png" for i in range(2, 12)}
    for sheet in sheets:
        for chart in sheet.charts:
            assert chart.layers
            assert all(np.isfinite(points).all() for points in chart.arrays)


def test_the_report_is_valid_json_and_names_every_scheme(tables):
    told = json.loads(json.dumps(curves_json(tables), allow_nan=False))
    assert set(told["schemes"]) == set(SCHEMES)
    assert len(told["c2gbp"]) == 3
    assert told["quadratic by maxima"]["knots"]["maximum-1"]["F"] <= 3.302e-4


def test_the_command_prints_the_tables(tmp_path):
    done = patchwright("curves", "--paper-tables")
    assert done.returncode == 0, done.stderr
    assert max(map(len, done.stdout.splitlines())) <= 125
    for words in ("Table 4: milliseconds", "Table 3, problem 3", "C1, not C2", "not comparable", "quadratic-maxima"):
        assert words in done.stdout


def test_the_command_draws_the_schemes(tmp_path):
    out = tmp_path / "out"
    done = patchwright("curves", "-o", out, "--json")
    assert done.returncode == 0, done.stderr
    assert set(json.loads(done.stdout)["schemes"]) == set(SCHEMES)
    assert (out / "schemes.png").stat().st_size > 10_000
    assert json.loads((out / "curves.json").read_text())["schemes"]


@pytest.mark.slow
def test_the_command_draws_every_figure_of_the_papers(tmp_path):
    done = patchwright("curves", "--paper-tables", "-o", tmp_path)
    assert done.returncode == 0, done.stderr
    assert len(list(tmp_path.glob("*.png"))) == 17


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    done = patchwright("curves", "-o", blocked / "out")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
