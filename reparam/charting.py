"""Charts for a set of regions: directions in common, borders in common, then the points inside each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.reparam.border import Border, Pace
from patchwright.reparam.chart import Chart
from patchwright.reparam.creases import crease_parameters
from patchwright.reparam.defect import STEPS, unevenness
from patchwright.reparam.direction import Direction
from patchwright.reparam.neighbours import AXES, BORDER, Neighbourhood
from patchwright.reparam.placement import place
from patchwright.reparam.region import Region
from patchwright.reparam.start_grid import start_grid
from patchwright.reparam.straightening import Straightened


@dataclass(frozen=True, slots=True, eq=False)
class Charts:
    """A chart per region, the directions of the neighbourhood, and what was noted per region."""

    charts: tuple[Chart, ...]
    directions: tuple[Direction, ...]
    notes: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class _Crease:
    """A line across a region that must be a line of the new parameter too."""

    region: int
    axis: int
    parameter: float
    share: float
    """Mean arc share, in the region's own sense."""
    side: int | None = None
    """The one side it concerns, a joint of two edges; None: it runs all across."""


def charted(regions: Sequence[Region], known: Neighbourhood) -> Charts:
    """Place the inner points of all regions; equal chords in 33 equal steps are the aim.

    Raises
    ------
    ParameterError : a region has no extent in one direction, or no grid without folds fits into it.
    """
    straights = [_straightened(region) for region in regions]
    notes: list[list[str]] = [[] for _ in regions]
    creases = _creases(regions, straights, notes)
    count = int(known.direction.max()) + 1
    directions = []
    for number in range(count):
        at = [
            1.0 - c.share if known.backwards[c.region, c.axis] else c.share
            for c in creases
            if known.direction[c.region, c.axis] == number
        ]
        directions.append(Direction.of(np.array(at)))
    borders = _borders(regions, known, directions, creases)
    charts = []
    for i, region in enumerate(regions):
        own = _own(known, directions, i)
        charts.append(_chart(i, region, straights[i], own, borders[i], creases, known, notes[i]))
    return Charts(tuple(charts), tuple(directions), tuple(tuple(n) for n in notes))


def check_region(region: Region) -> None:
    """That a grid fits into the region on its own, before it is charted together with others.

    Raises
    ------
    ParameterError : as `charted`.
    """
    straight, x = _straightened(region), np.linspace(0.0, 1.0, STEPS + 1)
    south, north, west, east = (straight.places(side.uv(x)) for side in region.sides)
    _started(region, south, north, west, east)


def _started(region: Region, south: Array, north: Array, west: Array, east: Array) -> Array:
    try:
        return start_grid(south, north, west, east)
    except ParameterError as error:
        raise ParameterError(f"{region.label}{error}") from None


def _straightened(region: Region) -> Straightened:
    try:
        return Straightened.of(region.surface, region.box)
    except ParameterError as error:
        raise ParameterError(f"{region.label}{error}") from None


def _creases(regions: Sequence[Region], straights: Sequence[Straightened], notes: list[list[str]]) -> list[_Crease]:
    found = []
    for i, (region, straight) in enumerate(zip(regions, straights, strict=True)):
        for axis in (0, 1):
            at = crease_parameters(region.surface, axis, region.box)
            if len(at) and not region.whole:
                notes[i].append("a corner line inside the trimmed face is followed by close knots, not by one of them")
            elif len(at):
                shares = straight.shares[axis](at)
                found += [_Crease(i, axis, p, x) for p, x in zip(at.tolist(), shares.tolist(), strict=True)]
        for k, side in enumerate(region.sides):
            found += [_Crease(i, AXES[k], 0.0, x, k) for x in side.joints.tolist()]
    return found


def _own(known: Neighbourhood, directions: Sequence[Direction], region: int) -> tuple[Direction, Direction]:
    """The directions of a region, in its own sense."""
    s, t = (
        directions[known.direction[region, axis]].flipped()
        if known.backwards[region, axis]
        else directions[known.direction[region, axis]]
        for axis in (0, 1)
    )
    return s, t


def _break_of(direction: Direction, share: float) -> int:
    """The inner break a crease at this share has become."""
    return int(np.argmin(np.abs(direction.breaks - share)))


def _borders(
    regions: Sequence[Region], known: Neighbourhood, directions: Sequence[Direction], creases: Sequence[_Crease]
) -> list[tuple[Border, Border, Border, Border]]:
    leaders = {(p.follower, p.second): (p.leader, p.first, p.against) for p in known.shared}
    paces: dict[tuple[int, int], Pace] = {}
    for i, region in enumerate(regions):
        for k, side in enumerate(region.sides):
            if (i, k) in leaders:
                continue
            direction = _own(known, directions, i)[AXES[k]]
            pace = Pace.of(side, direction.nodes, direction.breaks[[0, -1]], np.zeros(0))
            if len(direction.breaks) > 2:
                fixed = pace(direction.breaks[1:-1])
                users = [(i, k, False)] + [(j, o, a) for (j, o), (n, m, a) in leaders.items() if (n, m) == (i, k)]
                for j, o, against in users:
                    for crease in creases:
                        if (crease.region, crease.axis) == (j, AXES[o]) and crease.side in (None, o):
                            share = 1.0 - crease.share if against else crease.share
                            where = _arc_share(regions[j], o, crease)
                            at = _break_of(direction, share) - 1
                            if 0 <= at < len(fixed):
                                fixed[at] = 1.0 - where if against else where
                pace = Pace.of(side, direction.nodes, direction.breaks, np.maximum.accumulate(fixed))
            paces[i, k] = pace
    out = []
    for i, region in enumerate(regions):
        own = []
        for k, side in enumerate(region.sides):
            leader, first, against = leaders.get((i, k), (i, k, False))
            own.append(Border(side, regions[leader].sides[first], paces[leader, first], against))
        out.append((own[0], own[1], own[2], own[3]))
    return out


def _arc_share(region: Region, side: int, crease: _Crease) -> float:
    """Where the crease meets the side; those of a whole region run along the parameter, on [0, 1]."""
    if crease.side is not None:
        return crease.share
    low, high = region.box[AXES[side]]
    return region.sides[side].share((crease.parameter - low) / (high - low))


def _chart(
    i: int,
    region: Region,
    straight: Straightened,
    own: tuple[Direction, Direction],
    borders: tuple[Border, Border, Border, Border],
    creases: Sequence[_Crease],
    known: Neighbourhood,
    notes: list[str],
) -> Chart:
    s, t = own[0].nodes, own[1].nodes
    south, north, west, east = (straight.places(b.uv(x)) for b, x in zip(borders, (s, s, t, t), strict=True))
    start = _started(region, south, north, west, east)
    held = np.zeros(start.shape, dtype=bool)
    for crease in creases:
        if crease.region != i or crease.side is not None:
            continue
        direction = own[crease.axis]
        at = int(np.searchsorted(direction.nodes, direction.breaks[_break_of(direction, crease.share)]))
        if 0 < at < len(direction.nodes) - 1:
            line = (at, slice(None)) if crease.axis == 0 else (slice(None), at)
            held[(*line, crease.axis)] = True
            start[(*line, crease.axis)] = crease.share
    placed = place(straight, start, s, t, held=held)
    corners = known.vertices[known.vertex[i]].reshape(2, 2, 3).swapaxes(0, 1)
    charts = [
        Chart.of(region, straight, _with_poles(places, borders), own, borders, corners) for places in (placed.uv, start)
    ]
    equal = np.linspace(0.0, 1.0, STEPS + 1)
    defects = [unevenness(chart.points(equal, equal)) for chart in charts]
    best = int(np.argmin(defects))
    if best == 1:
        notes.append(f"the inner points stay on straight lines: placing them ended with '{placed.status.value}'")
    return charts[best]


def _with_poles(places: Array, borders: tuple[Border, Border, Border, Border]) -> Array:
    """The points of a pole, which is one point whatever its parameter, go where the lines through them lead."""
    out = places.copy()
    for border, index, along in zip(borders, BORDER, AXES, strict=True):
        if border.side.is_pole:
            lines = np.moveaxis(out[..., along], 1 - along, 0)  # a view: the pole is its first or last line
            near, further = (lines[1], lines[2]) if 0 in index else (lines[-2], lines[-3])
            led = np.clip(2.0 * near - further, 0.0, 1.0)
            pole = lines[0] if 0 in index else lines[-1]
            led[0], led[-1] = pole[0], pole[-1]
            pole[:] = np.maximum.accumulate(led)
    return out
