"""Tables 1-3 of Fadhel and Omar, Geometric piecewise cubic Bezier interpolating polynomial, beside the printed ones.

The paper compares six curves through five points of a known function, 100 samples to an interval. For curves y(x) the
samples are at equal x. For parametric curves it takes f at equal x and y(t) at equal t, although x(t) is not uniform:
that measure reproduces its column for Pollock's curve, so it is computed here as the paper's, beside the true distance
f(x(t)) - y(t).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.interpolation import interpolated
from patchwright.models.nurbs_curve import NurbsCurve

PER_INTERVAL = 100


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """A test function with the abscissae of its data."""

    name: str
    f: Callable[[Array], Array]
    x: Array

    @property
    def points(self) -> Array:
        """(5, 2) the data."""
        return np.stack((self.x, self.f(self.x)), axis=1)


PROBLEMS = (
    Problem("1: sin x", np.sin, np.array([-3.5, -1.5, 0.9, 4.2, 7.0])),
    Problem(
        "2: (x^3 - 2)/(abs(x^3) + 1)",
        lambda x: (x**3 - 2.0) / (np.abs(x**3) + 1.0),
        np.array([-2.52, -1.13, -0.12, 1.23, 4.84]),
    ),
    Problem("3: sinh(5x/2)", lambda x: np.sinh(2.5 * x), np.array([-2.72, -1.13, 0.62, 3.73, 6.91])),
)
METHODS: tuple[tuple[str, str, str | None, dict[str, Any]], ...] = (
    ("Spline", "c2-cubic", "abscissa", {}),
    ("Pchip", "pchip", "abscissa", {}),
    ("mAkima", "modified-akima", "abscissa", {}),
    ("Ball", "rational-ball", None, {"alpha": 4.0, "beta": 0.25, "gamma": 1.5}),
    ("Pollock", "pollock", None, {}),
    ("C2GBP", "c2gbp", None, {}),
)
PARAMETRIC = ("Pollock", "C2GBP")
PRINTED = np.array(
    [
        [[30.1732, 22.3251, 21.4038, 16.4903, 18.8969, 0.9798],
         [0.1438, 0.0500, 0.0220, 0.0753, 0.0430, 0.0030],
         [4.5673, 3.2846, 3.4321, 2.8704, 3.3622, 0.7389]],
        [[400.5244, 13.3164, 9.2046, 20.3031, 13.5424, 2.8842],
         [0.5216, 0.1207, 0.1030, 0.1377, 0.1283, 0.0688],
         [10.4459, 2.4161, 2.0618, 2.7570, 2.5692, 1.3780]],
        [[1.9909e15, 2.3463e15, 2.6544e15, 2.5843e15, 3.2945e15, 7.1770e14],
         [1.0663e6, 9.8778e5, 1.0557e6, 1.2654e6, 1.4839e6, 4.9519e5],
         [2.1352e7, 1.9780e7, 2.1139e7, 2.5340e7, 2.9716e7, 9.9161e6]],
    ]
)  # fmt: skip
"""[problem, SSE | MAE | RMSE, method] as printed."""

REASONS = {
    "Spline": "the not-a-knot spline, though the paper calls it natural.",
    "Pchip": "Fritsch and Butland's slopes.",
    "mAkima": "Moler's slopes.",
    "Ball": (
        "the paper gives neither formula nor shape parameters; of 650 choices of alpha, beta, gamma and slopes in this "
        "family, alpha = 4, beta = 1/4, gamma = 3/2 with arithmetic means comes closest, and none meets the column."
    ),
    "Pollock": "the natural cubic at equal parameter steps, measured as the paper does it.",
    "C2GBP": (
        "the literal construction; no C2 cubic at equal parameter steps has an SSE below 13.684, 6.6631 and 2.6642e14 "
        "(least squares over its two free end slopes), so the printed 0.9798 and 2.8842 are not those of a C2 curve; "
        "problem 3 is met to 2e-5 and 5e-5, not to the last digit."
    ),
}
MEASURES = (
    "MAE is mean |e| on problems 2 and 3 only.",
    "The printed RMSE is MAE times sqrt(401) on problems 2 and 3, and no definition gives it on problem 1; the true "
    "one, sqrt(SSE / 401), is computed here.",
)


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """One problem: every method's curve and its errors."""

    problem: Problem
    curves: tuple[NurbsCurve, ...]
    paper: Array
    """(3, 6) SSE, MAE and RMSE in the paper's measure."""
    true: Array
    """(3, 6) the same of f(x(t)) - y(t)."""
    printed: Array
    jumps: Array
    """(2,) the largest jumps of the first and of the second derivative of C2GBP at its inner points, relative to the
    largest derivative there."""
    notes: tuple[str, ...]
    """What a method had to leave."""

    @property
    def reproduced(self) -> Array:
        """(3, 6) bool: within one unit of the last printed place, so rounded or cut."""
        power = np.floor(np.log10(self.printed))
        unit = 1e-4 * 10.0 ** np.where(power >= 5.0, power, 0.0)  # four decimals; large figures have an exponent
        return np.asarray(np.abs(self.paper - self.printed) <= unit)


def error_tables() -> tuple[Errors, ...]:
    """Tables 1, 2 and 3."""
    return tuple(_errors(problem, printed) for problem, printed in zip(PROBLEMS, PRINTED, strict=True))


def samples(curve: NurbsCurve) -> Array:
    """(401, 2) points of the curve, PER_INTERVAL steps in each of its spans."""
    breaks = curve.breaks
    t = np.concatenate((np.linspace(breaks[:-1], breaks[1:], PER_INTERVAL, endpoint=False).T.ravel(), breaks[-1:]))
    return curve(t)


def _errors(problem: Problem, printed: Array) -> Errors:
    points, x, f = problem.points, problem.x, problem.f
    # the spline lacks the knots at its second and last but one point, so all curves of x are sampled at the same x
    at = np.concatenate((np.linspace(x[:-1], x[1:], PER_INTERVAL, endpoint=False).T.ravel(), x[-1:]))
    curves, paper, true, notes = [], [], [], []
    for name, scheme, parameters, options in METHODS:
        made = interpolated(points, scheme, parameters, **options)
        curve = made.curve
        notes += [f"{name}: {note}" for note in made.notes]
        on = samples(curve) if name in PARAMETRIC else curve(at)
        curves.append(curve)
        paper.append(_measures(f(at) - on[:, 1]))
        true.append(_measures(f(on[:, 0]) - on[:, 1]))
    jumps = derivative_jumps(curves[-1])
    return Errors(problem, tuple(curves), np.array(paper).T, np.array(true).T, printed, jumps, tuple(notes))


def derivative_jumps(curve: NurbsCurve) -> Array:
    """(2,) the largest jumps of the first and second derivatives at inner breaks, relative to the largest there."""
    pieces = curve.bezier_pieces()
    out = []
    for order in (1, 2):
        before = np.array([p(p.domain[1], order) for p in pieces[:-1]])
        after = np.array([p(p.domain[0], order) for p in pieces[1:]])
        size = max(np.linalg.norm(before, axis=1).max(), np.linalg.norm(after, axis=1).max())
        out.append(np.linalg.norm(after - before, axis=1).max() / size)
    return np.array(out)


def _measures(e: Array) -> tuple[float, float, float]:
    sse = float(e @ e)
    return sse, float(np.abs(e).mean()), float(np.sqrt(sse / len(e)))
