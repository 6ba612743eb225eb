"""`patchwright curves`: every interpolation scheme with its claims, and the papers' tables and figures."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import Any

from patchwright.models.interpolation import SCHEMES
from patchwright.pipelines.c2gbp_tables import Errors, error_tables
from patchwright.pipelines.curve_figures import paper_figures, scheme_figure
from patchwright.pipelines.curve_tables import c2gbp_json, c2gbp_lines, quadratic_json, quadratic_lines
from patchwright.pipelines.outputs import prepare_folder
from patchwright.pipelines.progress import Terminal
from patchwright.pipelines.quadratic_tables import KnotTable, PolygonCase, energy_table, knot_tables


@dataclass(frozen=True, slots=True, eq=False)
class PaperTables:
    """All tables of both papers, computed."""

    knots: tuple[KnotTable, ...]
    cases: tuple[PolygonCase, ...]
    errors: tuple[Errors, ...]


@dataclass(frozen=True, slots=True, eq=False)
class CurvesRun:
    """What the command found and wrote."""

    tables: PaperTables | None
    files: tuple[str, ...]
    notes: tuple[str, ...]


def run_curves(output: Path | None, *, paper_tables: bool, terminal: Terminal) -> CurvesRun:
    """Compute the tables where asked, and draw and write where a folder is named."""
    with terminal.stage("curves") as report:
        tables = None
        if paper_tables:
            report("tables of both papers", 0.1)
            tables = PaperTables(knot_tables(), energy_table(), error_tables())
        if output is None:
            return CurvesRun(tables, (), ())
        prepare_folder(output)
        report("drawing", 0.5)
        from patchwright.pipelines.charts import draw_charts

        sheets = [scheme_figure(output)]
        if tables is not None:
            sheets += paper_figures(output, tables.knots, tables.cases, tables.errors)
        sentence = draw_charts(sheets)
        (output / "curves.json").write_text(json.dumps(curves_json(tables), indent=1, allow_nan=False) + "\n")
    names = tuple(s.path.name for s in sheets if s.path.exists())
    return CurvesRun(tables, (*names, "curves.json"), () if sentence is None else (sentence,))


def curves_lines(run: CurvesRun) -> list[str]:
    """The report as text."""
    lines = [
        f"{'scheme':<20}{'exact degree':>13}{'continuity':>11}{'reach':>7}{'monotone':>10}{'dimension':>10}  source"
    ]
    for name, s in SCHEMES.items():
        degree = "none" if s.exact_degree is None else str(s.exact_degree)
        reach = "all" if s.reach is None else str(s.reach)
        dimension = "any" if s.dimension is None else str(s.dimension)
        lines.append(
            f"{name:<20}{degree:>13}{f'C{s.continuity}':>11}{reach:>7}{'yes' if s.monotone else 'no':>10}"
            f"{dimension:>10}  {s.source}"
        )
    if run.tables is not None:
        lines += ["", *quadratic_lines(run.tables.knots, run.tables.cases), "", *c2gbp_lines(run.tables.errors)]
    if run.files:
        lines += ["", *wrap("written: " + ", ".join(run.files), 120, subsequent_indent="  ", break_on_hyphens=False)]
    return lines + list(run.notes)


def curves_json(tables: PaperTables | None) -> dict[str, Any]:
    """The report as data."""
    out: dict[str, Any] = {
        "schemes": {
            name: {
                "exact degree": s.exact_degree, "continuity": s.continuity, "reach": s.reach, "local": s.local,
                "interpolates": s.interpolates, "monotone": s.monotone, "dimension": s.dimension,
                "linear": s.linear, "least points": s.least, "parameters": s.parameters, "options": s.options,
                "source": s.source,
            }
            for name, s in SCHEMES.items()
        }
    }  # fmt: skip
    if tables is not None:
        out["quadratic by maxima"] = quadratic_json(tables.knots, tables.cases)
        out["c2gbp"] = c2gbp_json(tables.errors)
    return out
