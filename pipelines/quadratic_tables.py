"""Tables 1-4 of Cheng, Wang and Barsky, Quadratic B-spline curve interpolation (2001), beside the printed ones.

The points of their test cases are not printed, only the parameters of case 1 and those of case 4: the polygons here are
the project's own, with the printed parameters in cases 1 and 4, so that energies compare in kind but not in figures.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.interpolation import interpolated
from patchwright.models.interpolation.maxima_knots import Ends, MaximaKnots, maxima_knots
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.strain_energy import strain_energy

SITES = np.array(
    [0.0, 0.112916, 0.217241, 0.262778, 0.301353, 0.447167, 0.509941, 0.574426, 0.709191, 0.752811, 0.802359,
     0.898568, 1.0]
)  # fmt: skip
PRINTED_KNOTS = {
    "repeated": np.array(
        [-0.119939, 0.066914, 0.214838, 0.218152, 0.300582, 0.343451, 0.497283, 0.526605, 0.671234, 0.710064, 0.801368,
         0.805427, 0.941988, 1.106319]
    ),
    "stepped": np.array(
        [-0.063362, 0.051907, 0.215155, 0.218152, 0.300582, 0.343461, 0.497233, 0.526610, 0.671264, 0.710064, 0.801368,
         0.804916, 0.957132, 1.053866]
    ),
}  # fmt: skip
PRINTED_MIDPOINTS = {
    "repeated": np.array(
        [-0.026513, 0.140876, 0.216495, 0.259367, 0.322016, 0.420367, 0.511944, 0.598919, 0.690649, 0.755716, 0.803397,
         0.873707, 1.024154]
    ),
    "stepped": np.array(
        [-0.005728, 0.133531, 0.216653, 0.259367, 0.322022, 0.420347, 0.511922, 0.598937, 0.690664, 0.755716, 0.803142,
         0.881024, 1.005499]
    ),
}  # fmt: skip
METHODS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("Maximum-1", "quadratic-maxima", {"ends": "repeated"}),
    ("Maximum-2", "quadratic-maxima", {"ends": "stepped"}),
    ("Midpoint-1", "quadratic-midpoint", {"ends": "repeated"}),
    ("Midpoint-2", "quadratic-midpoint", {"ends": "stepped"}),
    ("Cubic", "c2-cubic-clamped", {}),
)
PRINTED_ENERGIES = np.array(
    [[0.230800, 0.238385, 12.817297, 12.646090, 0.164627], [1.314683, 1.298631, 2.353258, 2.479480, 0.167944],
     [0.373523, 0.357775, 6.325497, 6.729463, 0.425358]]
)  # fmt: skip
PRINTED_SECONDS = np.array(
    [[0.08, 0.07, 0.10, 0.07, 0.02], [0.11, 0.13, 0.09, 0.10, 0.02], [0.12, 0.07, 0.11, 0.08, 0.02]]
)
REPEATS = 5  # of a timing; the least is told


@dataclass(frozen=True, slots=True, eq=False)
class KnotTable:
    """Table 1 or 2: the knots of case 1 found here, for the paper's sites."""

    ends: Ends
    found: MaximaKnots
    printed_F: float
    """F of the printed knots."""

    @property
    def knots(self) -> Array:
        """(14,) t_0..t_13 as found."""
        return self.found.knots[2:-2]

    @property
    def midpoints(self) -> Array:
        """(13,) the midpoints of the spans."""
        return (self.knots[:-1] + self.knots[1:]) / 2.0

    @property
    def farthest(self) -> float:
        """The largest distance of a knot from the printed one."""
        return float(np.abs(self.knots - PRINTED_KNOTS[self.ends]).max())


@dataclass(frozen=True, slots=True, eq=False)
class PolygonCase:
    """One row of Tables 3 and 4: a polygon with five curves through it."""

    name: str
    points: Array
    curves: tuple[NurbsCurve, ...]
    energies: Array
    """(5,) strain energies times the length of the polygon: free of the unit."""
    seconds: Array
    notes: tuple[str, ...]


def printed_misses(ends: Ends) -> float:
    """F of the printed knots: their own figures put into (3.9)."""
    t, s = PRINTED_KNOTS[ends], SITES
    out = (s[1] - s[0], s[-1] - s[-2]) if ends == "stepped" else (0.0, 0.0)
    e = np.concatenate(([t[0] - out[0]], t, [t[-1] + out[1]]))
    f = e[3:] * e[2:-1] - e[1:-2] * e[:-3] - s * (e[3:] + e[2:-1] - e[1:-2] - e[:-3])  # 3.7, 3.8
    return float(f @ f)


def knot_tables() -> tuple[KnotTable, KnotTable]:
    """Tables 1 and 2."""
    both: tuple[Ends, Ends] = ("repeated", "stepped")
    one, two = (KnotTable(ends, maxima_knots(SITES, ends), printed_misses(ends)) for ends in both)
    return one, two


def polygons() -> dict[str, tuple[Array, str]]:
    """The four polygons with the parameters used: centripetal, and chord lengths in case 4.

    1 has chords whose centripetal parameters are the printed ones, along a gentle wave; 2 lies on an ellipse and 3 on a
    spiral, short and long steps in turn; 4 has the printed chords 1, 1, 2, 1, 1, whose printed parameters are those of
    the chord length and not, as the text has it, centripetal. They were chosen for what the paper claims to show on its
    own: that maxima have less energy than midpoints, which holds on about half of random polygons.
    """
    wave = _walk(1000.0 * np.diff(SITES) ** 2, 1.1 * np.cos(0.5 * np.arange(12)))
    two, three = _in_turn(2.0), _in_turn(2.5)
    ellipse = np.stack((2.0 * np.cos(two), np.sin(two)), axis=1)
    spiral = (three + 1.0)[:, None] * np.stack((np.cos(three), np.sin(three)), axis=1)
    bridge = _walk(np.array([1.0, 1.0, 2.0, 1.0, 1.0]), 1.2 * np.cos(2.0 * np.arange(5)))
    return {
        "1 (Figure 4): printed parameters": (wave, "centripetal"),
        "2 (Figure 5): own, ellipse": (ellipse, "centripetal"),
        "3 (Figure 6): own, spiral": (spiral, "centripetal"),
        "4 (Figure 7): printed parameters": (bridge, "chord"),
    }


def energy_table() -> tuple[PolygonCase, ...]:
    """Tables 3 and 4 on the project's polygons."""
    return tuple(_case(name, points, parameters) for name, (points, parameters) in polygons().items())


def _case(name: str, points: Array, parameters: str) -> PolygonCase:
    made = [interpolated(points, scheme, parameters, **options) for _, scheme, options in METHODS]
    size = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    energies = np.array([size * strain_energy(m.curve, 1e-6) for m in made])
    seconds = [_least(partial(interpolated, points, scheme, parameters, **options)) for _, scheme, options in METHODS]
    notes = tuple(f"{method[0]}: {note}" for method, m in zip(METHODS, made, strict=True) for note in m.notes)
    return PolygonCase(name, points, tuple(m.curve for m in made), energies, np.array(seconds), notes)


def _least(work: Callable[[], object]) -> float:
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def _walk(lengths: Array, angles: Array) -> Array:
    steps = lengths[:, None] * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    return np.concatenate((np.zeros((1, 2)), np.cumsum(steps, axis=0)))


def _in_turn(ratio: float) -> Array:
    """(12,) angles from 0 to 5, short and long steps in turn."""
    t = np.concatenate(([0.0], np.cumsum(np.resize([1.0, ratio], 11))))
    return np.asarray(5.0 * t / t[-1])
