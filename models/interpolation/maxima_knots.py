"""Knots whose quadratic basis functions have their maxima at given sites, as nearly as any knots can.

Source: Cheng, Wang and Barsky, Quadratic B-spline curve interpolation, Computers and Mathematics with Applications 41
(2001) 39-50; equation numbers are theirs. Knots t[-2..n+3], sites s[0..n]; the basis function B_{i-1} is greatest at
s_i where (3.2) holds,

    f_i = t_{i+2} t_{i+1} - t_i t_{i-1} - s_i (t_{i+2} + t_{i+1} - t_i - t_{i-1}) = 0.

n + 1 equations for the n + 2 unknowns t_0..t_{n+1}, s_{i-1} <= t_i <= s_i, have no solution in general; the knots are
then those of a local minimum of F = sum f_i^2 (3.9), reached from the midpoints of the sites. Departures: the bounded
least-squares problem is solved with seven diagonals (`_maxima_kernel`) instead of by sequential quadratic programming;
and minima with coincident knots, where the curve loses its C1 or the system its rank, are left for regular ones, though
their F may be lower. Where no regular one is found the knots are kept apart, and that is reported.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import ParameterError

Ends: TypeAlias = Literal["repeated", "stepped"]

CONTACT = 2.0**-7
"""Knots on either side of a site meet when they are nearer than this share of the two steps there; the regular minimum
of the paper's first case has no knots nearer than 0.013."""
CLEARANCE = 0.25
"""Knots that would meet keep this share of their steps from the site. Measured on 60 polygons of 5 to 14 normally
distributed points, with this share also for CONTACT: the energy over the cubic's, in the geometric mean, is 7.1, 2.2,
1.2 and 1.2 for shares of 2^-14, 2^-7, 2^-3 and 2^-2."""
REACH = 1.0
"""The first knot lies at most this far before the first site, the last as far after the last (of the range of sites):
alpha = -1 and beta = 2."""


class Meeting(StrEnum):
    """How well the knots meet the condition that every basis function is greatest at its site."""

    EXACT = "every site is where its basis function is greatest"
    NEAREST = "no knots near by put every site where its basis function is greatest; these come nearest"
    DEGENERATE = "the condition that every site is a maximum asks for coincident knots; they were kept apart"
    UNFINISHED = "the search for knots was cut off before it settled"


@dataclass(frozen=True, slots=True, eq=False)
class MaximaKnots:
    """The knots with what is left of the condition."""

    knots: Array
    """(n + 6,) t[-2..n+3]."""
    F: float
    """The sum of squares (3.9), for sites scaled to [0, 1]."""
    meeting: Meeting
    kept_apart: IntArray
    """Sites k at which t_k and t_{k+1} would meet and were kept apart."""
    steps: int
    """Of the descent, restarts included."""


def maxima_knots(sites: Array, ends: Ends = "repeated") -> MaximaKnots:
    """Knots for increasing sites (n + 1,), n of at least 2.

    Parameters
    ----------
    ends : "repeated": t_-2 = t_-1 = t_0 and the same at the end (3.5, "maximum-1"); "stepped": t_0 - t_-1 =
        t_-1 - t_-2 = s_1 - s_0 and the same at the end (3.6, "maximum-2")

    Raises
    ------
    ParameterError : fewer than three sites, an unknown kind of ends.
    """
    if ends not in ("repeated", "stepped"):
        raise ParameterError(f'ends must be "repeated" or "stepped", got {ends!r}')
    if len(sites) < 3:
        raise ParameterError(f"knots by maxima need at least 3 sites, got {len(sites)}")
    low, width = float(sites[0]), float(sites[-1] - sites[0])
    search = _Search((sites - low) / width, ends)
    found, steps = search.regular()
    s, room = search.s, search.room
    below, above = search.below.copy(), search.above.copy()
    apart = search.meeting(found.t)
    new = apart
    while new.size:
        above[new] = s[new] - CLEARANCE * room[new]
        below[new + 1] = s[new] + CLEARANCE * room[new + 1]
        found = search.descend(found.t, below, above)
        steps += found.steps
        new = np.setdiff1d(search.meeting(found.t), apart)
        apart = np.union1d(apart, new)
    t = low + width * found.t
    first, last = width * search.outer[0], width * search.outer[1]
    knots = np.concatenate(([t[0] - 2 * first, t[0] - first], t, [t[-1] + last, t[-1] + 2 * last]))
    return MaximaKnots(knots, found.F, _meeting(found, apart, len(s)), apart, steps)


class _Descent(NamedTuple):
    t: Array
    F: float
    steps: int
    settled: bool


class _Search:
    """Sites on [0, 1] with what every descent needs."""

    def __init__(self, s: Array, ends: Ends) -> None:
        step = np.diff(s)
        self.s = s
        self.outer = (float(step[0]), float(step[-1])) if ends == "stepped" else (0.0, 0.0)
        self.below = np.concatenate(([-REACH], s))
        self.above = np.concatenate((s, [1.0 + REACH]))
        self.start = np.concatenate(([-step[0] / 2], (s[:-1] + s[1:]) / 2, [1.0 + step[-1] / 2]))
        self.room = np.concatenate((step[:1], step, step[-1:]))  # before and after each site

    def descend(self, t: Array, below: Array, above: Array) -> _Descent:
        from patchwright.models.interpolation._maxima_kernel import descend

        return _Descent(*descend(self.s, *self.outer, t, below, above))

    def meeting(self, t: Array) -> IntArray:
        """Sites k at which t_k and t_{k+1} come too close."""
        room = self.room[:-1] + self.room[1:]
        near = np.diff(t) < CONTACT * room
        # on an end site one knot is enough: it takes the support of the outermost function out of the curve
        near[0] |= t[1] - self.s[0] < CONTACT * self.room[1]
        near[-1] |= self.s[-1] - t[-2] < CONTACT * self.room[-2]
        return np.flatnonzero(near)

    def regular(self) -> tuple[_Descent, int]:
        """The minimum with the fewest meeting knots that a few descents find, and all their steps.

        Where knots meet at a site, the one before, the one after, or both go back to where they started, and all
        descend again; as long as fewer and fewer knots meet.
        """
        found = self.descend(self.start, self.below, self.above)
        steps = found.steps
        meet = self.meeting(found.t)
        while meet.size:
            others = []
            for back in (meet, meet + 1, np.union1d(meet, meet + 1)):
                t = found.t.copy()
                t[back] = self.start[back]
                others.append(self.descend(t, self.below, self.above))
            steps += sum(other.steps for other in others)
            best = min(others, key=lambda other: (self.meeting(other.t).size, other.F))
            fewer = self.meeting(best.t)
            if fewer.size >= meet.size:
                break
            found, meet = best, fewer
        return found, steps


def _meeting(found: _Descent, apart: IntArray, count: int) -> Meeting:
    round_off = count * (64.0 * float(np.finfo(np.float64).eps)) ** 2
    left = found.F
    if left <= round_off:
        return Meeting.EXACT
    if apart.size:
        return Meeting.DEGENERATE
    return Meeting.NEAREST if found.settled else Meeting.UNFINISHED
