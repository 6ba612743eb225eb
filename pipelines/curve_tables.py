"""The papers' tables as text and as data, every computed figure beside the printed one."""

from __future__ import annotations

from textwrap import wrap
from typing import Any

import numpy as np

from patchwright.pipelines import c2gbp_tables, quadratic_tables
from patchwright.pipelines.c2gbp_tables import Errors
from patchwright.pipelines.quadratic_tables import KnotTable, PolygonCase

NAMES = {"repeated": "maximum-1", "stepped": "maximum-2"}
WIDTH = 120
QUADRATIC_VERDICT = (
    "Tables 1 and 2 are reproduced to within 1.0e-3: the minimum found is lower than that of the printed knots, which",
    "were not fully converged. Lower values of F exist only with coincident knots, where the curve is C0.",
    "Table 3 is not reproduced in figures: the points of the test cases are not printed, and the energy depends on the",
    "size. On polygons with the printed parameters (1, 4) and on two others its order is: maxima below midpoints, near",
    "the cubic. Energies here are times the polygon's length, so free of the unit. The four were chosen to show that",
    "order; it is no general rule: on 60 random polygons of 5 to 14 points the maxima had the lower energy on 45 %.",
    "Table 4 is not comparable: other machines and programs.",
)


def quadratic_lines(knots: tuple[KnotTable, ...], cases: tuple[PolygonCase, ...]) -> list[str]:
    """Tables 1 to 4 of Cheng, Wang and Barsky."""
    lines = ["Quadratic B-spline interpolation at basis maxima (Cheng, Wang, Barsky 2001)"]
    for number, table in enumerate(knots, start=1):
        printed, middles = (
            quadratic_tables.PRINTED_KNOTS[table.ends],
            quadratic_tables.PRINTED_MIDPOINTS[table.ends],
        )
        lines += [
            "",
            f"Table {number}: {NAMES[table.ends]}; F = {table.found.F:.4e} (printed knots: {table.printed_F:.4e})",
            f"  {table.found.meeting.value}",
            f"{'i':>3}{'t_i':>12}{'printed':>12}{'difference':>12}{'s_i':>12}{'midpoint':>12}{'printed':>12}",
        ]
        for i, t in enumerate(table.knots):
            row = f"{i:>3}{t:>12.6f}{printed[i]:>12.6f}{t - printed[i]:>12.1e}"
            if i < len(middles):
                row += f"{quadratic_tables.SITES[i]:>12.6f}{table.midpoints[i]:>12.6f}{middles[i]:>12.6f}"
            lines.append(row)
    head = "".join(f"{m[0]:>13}" for m in quadratic_tables.METHODS)
    lines += ["", f"{'Table 3: strain energy times length':<42}{head}"]
    for i, case in enumerate(cases):
        lines.append(f"{case.name:<42}" + "".join(f"{e:>13.5g}" for e in case.energies))
        if i < len(quadratic_tables.PRINTED_ENERGIES):
            printed_row = quadratic_tables.PRINTED_ENERGIES[i]
            lines.append(f"{'  printed, of other points':<42}" + "".join(f"{e:>13.6f}" for e in printed_row))
    lines += ["", f"{'Table 4: milliseconds':<42}{head}"]
    for i, case in enumerate(cases):
        lines.append(f"{case.name:<42}" + "".join(f"{1e3 * e:>13.2f}" for e in case.seconds))
        if i < len(quadratic_tables.PRINTED_SECONDS):
            printed_row = quadratic_tables.PRINTED_SECONDS[i]
            lines.append(f"{'  printed (HP 735)':<42}" + "".join(f"{1e3 * e:>13.0f}" for e in printed_row))
    lines += ["", *QUADRATIC_VERDICT, "What is left of the condition (3.2) in the four cases:"]
    for case in cases:
        lines += _wrapped(f"{case.name}:", "  ")
        lines += [line for note in case.notes if note.startswith("Max") for line in _wrapped(note, "    ")]
    return lines


def c2gbp_lines(errors: tuple[Errors, ...]) -> list[str]:
    """Tables 1 to 3 of Fadhel and Omar."""
    names = [m[0] for m in c2gbp_tables.METHODS]
    lines = ["Geometric piecewise cubic Bezier (Fadhel, Omar); * marks figures reproduced to the last printed place"]
    for number, e in enumerate(errors, start=1):
        lines += [
            "",
            f"{f'Table {number}, problem {e.problem.name}':<44}" + "".join(f"{n:>11} " for n in names).rstrip(),
        ]
        for k, measure in enumerate(("SSE", "MAE", "RMSE")):
            rows = (
                ("printed", e.printed[k], np.zeros(len(names), dtype=bool)),
                ("computed, the paper's measure", e.paper[k], e.reproduced[k]),
                ("true, f(x(t)) - y(t)", e.true[k], np.zeros(len(names), dtype=bool)),
            )
            for label, values, good in rows:
                cells = "".join(f"{_figure(v):>11}{'*' if g else ' '}" for v, g in zip(values, good, strict=True))
                lines.append(f"  {measure + ': ' + label:<42}{cells}".rstrip())
        lines.append(
            f"  C2GBP at inner points: jump of the first derivative {e.jumps[0]:.1e}, of the second {e.jumps[1]:.1e} "
            "of the largest there: C1, not C2"
        )
        lines += [f"  {note}" for note in e.notes]
    lines.append("")
    reasons = [f"{name}: {c2gbp_tables.REASONS[name]}" for name in names]
    return lines + [line for said in (*reasons, *c2gbp_tables.MEASURES) for line in _wrapped(said, "")]


def _figure(value: float) -> str:
    """As the paper prints it: large figures with an exponent."""
    return f"{value:.4e}" if value >= 1e5 else f"{value:.6g}"


def _wrapped(text: str, margin: str) -> list[str]:
    return wrap(text, WIDTH, initial_indent=margin, subsequent_indent=margin + "  ")


def quadratic_json(knots: tuple[KnotTable, ...], cases: tuple[PolygonCase, ...]) -> dict[str, Any]:
    """As `quadratic_lines`."""
    methods = [m[0] for m in quadratic_tables.METHODS]
    return {
        "sites": quadratic_tables.SITES.tolist(),
        "knots": {
            NAMES[t.ends]: {
                "knots": t.knots.tolist(), "printed": quadratic_tables.PRINTED_KNOTS[t.ends].tolist(),
                "F": t.found.F, "F of the printed knots": t.printed_F, "largest difference": t.farthest,
                "meeting": t.found.meeting.value,
            }
            for t in knots
        },
        "cases": [
            {
                "name": c.name, "points": c.points.tolist(), "notes": c.notes,
                "strain energy times length": dict(zip(methods, c.energies.tolist(), strict=True)),
                "seconds": dict(zip(methods, c.seconds.tolist(), strict=True)),
            }
            for c in cases
        ],
        "verdict": " ".join(QUADRATIC_VERDICT),
    }  # fmt: skip


def c2gbp_json(errors: tuple[Errors, ...]) -> list[dict[str, Any]]:
    """As `c2gbp_lines`."""
    out = []
    for e in errors:
        methods = {}
        for k, (name, *_) in enumerate(c2gbp_tables.METHODS):
            methods[name] = {
                measure: {
                    "printed": float(e.printed[row, k]), "computed": float(e.paper[row, k]),
                    "true": float(e.true[row, k]), "reproduced": bool(e.reproduced[row, k]),
                }
                for row, measure in enumerate(("SSE", "MAE", "RMSE"))
            } | {"reason": c2gbp_tables.REASONS[name]}  # fmt: skip
        out.append(
            {
                "problem": e.problem.name, "methods": methods, "notes": e.notes,
                "jumps of C2GBP": {"first derivative": float(e.jumps[0]), "second derivative": float(e.jumps[1])},
            }
        )  # fmt: skip
    return out
