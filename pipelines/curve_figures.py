"""The figures of `patchwright curves`: every scheme on one polygon, and those of both papers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.interpolation import SCHEMES, interpolate
from patchwright.models.interpolation.local_slopes import parabola_slopes
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.pipelines import c2gbp_tables, quadratic_tables
from patchwright.pipelines.c2gbp_tables import Errors
from patchwright.pipelines.charts import COLOURS, Chart, ChartSheet
from patchwright.pipelines.quadratic_tables import KnotTable, PolygonCase

POLYGON = np.array([[0.0, 0.0], [0.6, 1.0], [1.0, 1.1], [2.2, 0.2], [3.4, 0.9], [3.7, 0.3], [5.0, 1.2]])
"""Unequal steps, increasing x (the planar schemes ask for it), a sharp turn; what all schemes are shown on."""
SAMPLES = 400


def scheme_figure(folder: Path) -> ChartSheet:
    """schemes.png: every scheme on one polygon."""
    charts = []
    for name in SCHEMES:
        points = POLYGON if name != "c2-cubic-periodic" else np.concatenate((POLYGON, POLYGON[:1]))
        chart = Chart(name, equal=True, legend=False)
        chart.line(_line(interpolate(points, name)), name, COLOURS[0])
        chart.dots(points, "points", COLOURS[6], size=7.0)
        charts.append(chart)
    return ChartSheet(folder / "schemes.png", tuple(charts), 4, (460, 320))


def paper_figures(
    folder: Path, knots: tuple[KnotTable, ...], cases: tuple[PolygonCase, ...], errors: tuple[Errors, ...]
) -> list[ChartSheet]:
    """One sheet for each figure of the papers but Figure 1 of each, which only names things."""
    return [
        _joints(folder / "quadratic-figure-2.png"),
        _basis_maxima(folder / "quadratic-figure-3.png", knots[0]),
        *(_quadratic(folder / f"quadratic-figure-{4 + i}.png", case) for i, case in enumerate(cases)),
        _construction(folder / "c2gbp-figure-2.png", errors[0]),
        *(_comparison(folder / f"c2gbp-figure-{3 + i}.png", e) for i, e in enumerate(errors)),
        *(_error_curves(folder / f"c2gbp-figure-{6 + i}.png", e) for i, e in enumerate(errors)),
        *(_error_bars(folder / f"c2gbp-figure-{9 + i}.png", e) for i, e in enumerate(errors)),
    ]


def _line(curve: NurbsCurve) -> Array:
    return curve(np.linspace(*curve.domain, SAMPLES))


def _joints(path: Path) -> ChartSheet:
    """Figure 2: through a zigzag, a quadratic with its joints at the points must overshoot; by maxima it need not."""
    t = np.arange(7.0)
    P = np.stack((t, np.resize([0.0, 1.0], 7)), axis=1)
    slopes = [parabola_slopes(t, P)[0]]
    for chord in np.diff(P, axis=0):
        slopes.append(2.0 * chord - slopes[-1])
    inner = P[:-1] + np.array(slopes[:-1]) / 2.0
    knots = np.concatenate(([0.0], np.repeat(t, 2), [6.0]))
    ordinary = NurbsCurve(2, knots, np.concatenate((np.stack((P[:-1], inner), axis=1).reshape(-1, 2), P[-1:])))
    maxima = interpolate(P, "quadratic-maxima", "uniform")
    chart = Chart("a zigzag: quadratics with joints at the points and by maxima, beside the cubic", equal=True)
    chart.line(_line(ordinary), "joints at the points", COLOURS[2], width=3.0)
    chart.line(_line(maxima), "by maxima", COLOURS[1], width=4.0)
    chart.line(_line(interpolate(P, "c2-cubic-clamped", "uniform")), "cubic", COLOURS[0], width=1.5)
    chart.dots(maxima(maxima.breaks[1:-1]), "joints by maxima", COLOURS[1], size=7.0)
    chart.dots(P, "points", COLOURS[6], size=9.0)
    return ChartSheet(path, (chart,), 1, (1200, 500))


def _construction(path: Path, e: Errors) -> ChartSheet:
    """Figure 2: the inner points of C2GBP on problem 1."""
    chart = Chart("C2GBP on problem 1: the polygon of the data and the control polygon", labels=("x", "y"))
    nets = np.concatenate([piece.control_points for piece in e.curves[-1].bezier_pieces()])
    chart.line(e.problem.points, "data polygon", COLOURS[6], width=1.5, style="--")
    chart.line(nets, "control polygon", COLOURS[1], width=1.5)
    chart.line(_line(e.curves[-1]), "C2GBP", COLOURS[0], width=3.0)
    chart.dots(nets, "control points", COLOURS[1], size=7.0)
    chart.dots(e.problem.points, "data", COLOURS[6], size=9.0)
    return ChartSheet(path, (chart,), 1, (1200, 700))


def _basis_maxima(path: Path, table: KnotTable) -> ChartSheet:
    """Figure 3: sites and maxima of the basis functions of case 1."""
    T = table.found.knots
    count = len(T) - 3
    chart = Chart("basis functions of case 1, maximum-1, and their values at the sites", legend=False)
    basis = NurbsCurve(2, T, np.eye(count))
    t = np.linspace(*basis.domain, 4 * SAMPLES)
    values = basis(t)
    for i in range(count):
        on = values[:, i] > 0.0
        chart.line(np.stack((t[on], values[on, i]), axis=1), "", COLOURS[i % 5], width=1.5)
    sites = quadratic_tables.SITES
    at_sites = basis(sites)[np.arange(len(sites)), np.arange(1, len(sites) + 1)]
    chart.dots(np.stack((sites, at_sites), axis=1), "sites", COLOURS[6], size=8.0)
    return ChartSheet(path, (chart,), 1, (1200, 600))


def _quadratic(path: Path, case: PolygonCase) -> ChartSheet:
    """Figures 4 to 7: each quadratic over the cubic."""
    charts = []
    *quadratics, cubic = zip(quadratic_tables.METHODS, case.curves, case.energies, strict=True)
    for letter, ((name, *_), curve, energy) in zip("abcd", quadratics, strict=True):
        chart = Chart(f"({letter}) {name}, case {case.name}; energy x length {energy:.4g}", equal=True)
        chart.line(_line(curve), name, COLOURS[1], width=4.0)
        chart.line(_line(cubic[1]), "cubic", COLOURS[0], width=1.5)
        chart.dots(case.points, "points", COLOURS[6], size=8.0)
        charts.append(chart)
    return ChartSheet(path, tuple(charts), 2, (760, 520))


def _comparison(path: Path, e: Errors) -> ChartSheet:
    """Figures 3 to 5: the function and the six curves."""
    problem = e.problem
    x = np.linspace(problem.x[0], problem.x[-1], 4 * SAMPLES)
    truth = np.stack((x, problem.f(x)), axis=1)
    chart = Chart(f"problem {problem.name}", labels=("x", "y"))
    chart.line(truth, "function", COLOURS[6], width=3.0, style="--")
    for (name, *_), curve, colour in zip(c2gbp_tables.METHODS, e.curves, COLOURS, strict=False):
        chart.line(_line(curve), name, colour)
    chart.dots(problem.points, "data", COLOURS[6], size=9.0)
    return ChartSheet(path, (chart,), 1, (1200, 800))


def _error_curves(path: Path, e: Errors) -> ChartSheet:
    """Figures 6 to 8: the error along each curve, true and in the paper's measure."""
    problem, charts = e.problem, []
    breaks = problem.x
    steps = c2gbp_tables.PER_INTERVAL
    at = np.concatenate((np.linspace(breaks[:-1], breaks[1:], steps, endpoint=False).T.ravel(), breaks[-1:]))
    for kind in ("the paper's measure", "true distance"):
        chart = Chart(f"problem {problem.name}: absolute error, {kind}", labels=("x", "absolute error"))
        for (name, *_), curve, colour in zip(c2gbp_tables.METHODS, e.curves, COLOURS, strict=False):
            on = c2gbp_tables.samples(curve) if name in c2gbp_tables.PARAMETRIC else curve(at)
            x = at if kind.startswith("the paper") else on[:, 0]
            chart.line(np.stack((x, np.abs(problem.f(x) - on[:, 1])), axis=1), name, colour)
        charts.append(chart)
    return ChartSheet(path, tuple(charts), 2, (800, 600))


def _error_bars(path: Path, e: Errors) -> ChartSheet:
    """Figures 9 to 11: the errors as bars, printed and computed."""
    names = tuple(m[0] for m in c2gbp_tables.METHODS)
    charts = [
        Chart(f"problem {e.problem.name}: {measure}, {kind}", legend=False).bars(values[k], names, colour)
        for kind, values, colour in (("printed", e.printed, COLOURS[6]), ("computed", e.paper, COLOURS[0]))
        for k, measure in enumerate(("SSE", "MAE", "RMSE"))
    ]
    return ChartSheet(path, tuple(charts), 3, (560, 400))
