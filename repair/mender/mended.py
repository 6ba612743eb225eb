"""`Mended`: the mended triangulation and the account of what was done, and `Work`, the way there."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation
from patchwright.repair.mender.crossings import CROSSING, crossing_pairs, crossing_pairs_after

if TYPE_CHECKING:
    from patchwright.repair.decisions import Decisions

KEPT, CUT, BRIDGED = 0, 1, 2
LEFT_OUT = " left out"
STRAY_SHARE = 1e-4  # of the area: what is smaller and joined to nothing, or thinner than the noise, is scrap


@dataclass(frozen=True, slots=True, eq=False)
class Action:
    """One thing that was done.

    Parameters
    ----------
    kind : "weld", "drop", "conform", "split", "orient", "trim", "bridge", "close", "unite", "wrap"; with `LEFT_OUT`
        behind it, what was not done because it was decided so
    rung : its step on the ladder of least change
    where : (3,) middle of the place
    size : the place's extent, model length unit
    tolerance : the length the decision was made against, 0 when none was needed
    reason : one sentence
    count : triangles, edges or vertices concerned
    largest_move : the farthest anything moved
    area : surface added
    """

    kind: str
    rung: str
    where: Array
    size: float
    tolerance: float
    reason: str
    count: int
    largest_move: float = 0.0
    area: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Dropped:
    """Something that was removed: what, why, the parts concerned, area, middle, triangles of the input, extent."""

    what: str
    why: str
    parts: tuple[str, ...]
    area: float
    where: Array
    triangles: IntArray
    size: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """What could not be mended: kind, place, extent and a sentence."""

    kind: str
    where: Array
    size: float
    message: str


@dataclass(frozen=True, slots=True, eq=False)
class Mended:
    """The mended triangulation and the account of what was done.

    Parameters
    ----------
    triangulation : with the input's tags; bridges have their neighbours'
    origin : (m,) int64, KEPT, CUT (a piece of an input triangle) or BRIDGED (invented)
    source : (m,) int64, the input triangle each is or was cut from, -1 for invented ones
    actions, dropped, problems : what was done, removed, and left undone
    openings : (k, 3) points of each rim that was kept
    closed : every edge has two triangles
    noise : root mean square distance of the input's corners from their points, from the scatter of welded copies
    """

    triangulation: Triangulation
    origin: IntArray
    source: IntArray
    actions: tuple[Action, ...]
    dropped: tuple[Dropped, ...]
    openings: tuple[Array, ...]
    closed: bool
    noise: float
    problems: tuple[Problem, ...]


Mark = tuple[
    Triangulation, IntArray, IntArray, tuple[Triangulation, IntArray] | None, IntArray | None, int, int
]  # fmt: skip


@dataclass(slots=True)
class Work:
    """The triangulation on its way through the stages."""

    given: Triangulation
    now: Triangulation
    source: IntArray
    origin: IntArray
    tolerance: Tolerance
    actions: list[Action] = field(default_factory=list)
    dropped: list[Dropped] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    noise: float = 0.0
    distance: float = 0.0  # the weld distance
    decisions: Decisions | None = None  # what stays as it is
    crossed: tuple[Triangulation, IntArray] | None = None  # the last triangulation asked for crossings, and those
    trace: IntArray | None = None  # (m,) the triangle of that one each triangle is, -1 for new ones
    around: tuple[Triangulation, Adjacency] | None = None  # the last triangulation asked for its adjacency, and that

    def adjacency(self) -> Adjacency:
        """Of the present state."""
        if self.around is None or self.around[0] is not self.now:
            self.around = None  # two at a time would take room
            self.around = self.now, Adjacency.of(self.now)
        return self.around[1]

    def crossings(self) -> IntArray:
        """(k, 2) pairs of triangles of the present state that pass through each other."""
        if self.crossed is None or self.crossed[0] is not self.now:
            depth = CROSSING * self.tolerance.gap
            if self.crossed is None or self.trace is None or len(self.trace) != len(self.now):
                pairs = crossing_pairs(self.now, depth)
            else:
                pairs = crossing_pairs_after(self.now, depth, *self.crossed, self.trace)
            self.crossed = self.now, pairs
            self.trace = np.arange(len(self.now))
        return self.crossed[1]

    def follow(self, triangulation: Triangulation, parents: IntArray, cut: BoolArray | None = None) -> None:
        """Take over a stage's result: `parents` index the triangles before it, -1 are new."""
        known = parents >= 0
        source = np.where(known, self.source[parents], -1)
        origin = np.where(known, self.origin[parents], BRIDGED)
        if cut is not None:
            origin = np.where(cut & (origin == KEPT), CUT, origin)
        if self.trace is not None:
            traced = len(self.trace) == len(self.now)
            whole = known if cut is None else known & ~cut
            self.trace = np.where(whole, self.trace[parents], -1) if traced else None
        self.now, self.source, self.origin = triangulation, source, origin

    def mark(self) -> Mark:
        """The present state, to come back to."""
        counts = len(self.actions), len(self.dropped)
        return self.now, self.source, self.origin, self.crossed, self.trace, *counts

    def back(self, mark: Mark) -> None:
        """Undo everything since `mark`."""
        self.now, self.source, self.origin, self.crossed, self.trace, actions, dropped = mark
        del self.actions[actions:], self.dropped[dropped:]

    def names(self, triangles: IntArray) -> tuple[str, ...]:
        """Names of the parts some triangles of the input belong to."""
        tags = self.given.tags
        if tags is None or not self.given.tag_names:
            return ()
        return tuple(self.given.tag_names[k] for k in np.unique(tags[triangles]) if 0 <= k < len(self.given.tag_names))

    def drop(self, what: str, why: str, now: IntArray, area: float | None = None) -> None:
        """Note that triangles (of the present state) go."""
        if not len(now):
            return
        some = self.now.take(now)
        source = np.unique(self.source[now])
        source = source[source >= 0]
        area = float(some.areas.sum()) if area is None else area
        self.dropped.append(Dropped(what, why, self.names(source), area, middle(some), source, some.diagonal))


def known(source: IntArray) -> IntArray:
    return source[source >= 0]


def middle(triangulation: Triangulation) -> Array:
    return np.asarray(triangulation.bounds.mean(axis=0))
