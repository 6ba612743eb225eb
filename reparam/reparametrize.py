"""`reparametrize`: the same shape within a tolerance, run through at even speed (RCA).

Hamann, Jean and Razdan (1999), section 2: sides first, from arc length and curvature; opposite sides reconciled; the
points inside placed so that the chords have the shares of the steps; a C2 bicubic through them; knots put in where the
deviation is largest. Departures: the deviation is a distance of closest points and not parameter by parameter; the
inner points are placed on 33 equal steps, where the defect is measured, and interpolated between, so that knots put in
later do not disturb them; sites that turn out not to be needed are taken out again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface
from patchwright.reparam.block_cubic import filled, surface_through
from patchwright.reparam.chart import Chart
from patchwright.reparam.charting import Charts, charted
from patchwright.reparam.curve_sites import fewest_sites
from patchwright.reparam.defect import parametrisation_defect
from patchwright.reparam.direction import Direction
from patchwright.reparam.neighbours import AXES, Neighbourhood, neighbourhood, shared_within
from patchwright.reparam.reconciliation import reconciled
from patchwright.reparam.refinement import MOST_SITES, Use, errors_at, refined, thinned
from patchwright.reparam.region import Region
from patchwright.reparam.verification import Deviation, deviation

GOOD = 0.01  # defect of a surface that is left as it is
PER_DIRECTION = 0.5  # of the tolerance, for the interpolation along one direction
FIT_SAMPLES = 5  # per cell and direction while knots are put in
VERIFY_SAMPLES = 20  # for the deviation that is reported
ROUNDS = 8  # of putting in, for either sampling
PLACES = 64  # looked at in a round and surface, the worst


@dataclass(frozen=True, slots=True, eq=False)
class Reparametrized:
    """A surface with its new parametrisation, and what was measured."""

    surface: NurbsSurface
    """C2 bicubic on the unit square, with a crease wherever the old one has; the old one where that is good."""
    deviation: float
    """Largest distance of closest points between both, from either and along the sides, at 20 x 20 samples a cell."""
    defect_before: float
    """max |chord share / step share - 1|, see `defect`; of a trimmed face over the box of its sides."""
    defect_after: float
    tolerance: float
    control_points_before: tuple[int, int]
    control_points_after: tuple[int, int]
    least_sine: float
    """Smallest sine between the new tangents, negative where the surface folds; poles left out."""
    notes: tuple[str, ...] = ()

    @property
    def converged(self) -> bool:
        """Whether the tolerance is kept and nothing folds."""
        return self.deviation <= self.tolerance and self.least_sine > 0.0


@overload
def reparametrize(surface: Surface | Region, tolerance: float) -> Reparametrized: ...


@overload
def reparametrize(surface: Sequence[Surface | Region], tolerance: float) -> tuple[Reparametrized, ...]: ...


def reparametrize(
    surface: Surface | Region | Sequence[Surface | Region], tolerance: float
) -> Reparametrized | tuple[Reparametrized, ...]:
    """Give a surface, or neighbouring surfaces together, chord-length parameters.

    Parameters
    ----------
    surface : a bounded surface; a region of one (`Region.of_sides`, `face_region`); or several that may share whole
        sides: these keep one parametrisation and get identical boundary curves, so that a gap between them is closed
        and none is opened
    tolerance : the largest distance between old and new, in the unit of the points

    Returns
    -------
    One result per surface. A surface with a defect of at most 0.01 is returned as it is (of several, when all are).
    Where 240 knots a direction do not reach the tolerance, the best found is returned and not `converged`.

    Raises
    ------
    ParameterError : a tolerance that is not positive and finite, an unbounded surface, one without extent in one
        direction or with two poles on neighbouring sides.
    """
    if not (isinstance(tolerance, int | float | np.number) and np.isfinite(tolerance) and tolerance > 0.0):
        raise ParameterError(f"the tolerance must be a positive length in the unit of the points, got {tolerance}")
    if isinstance(surface, Sequence):
        if not surface:
            raise ParameterError("there is no surface to reparametrize: give at least one")
        return _together([_region(s, f"surface {k + 1}") for k, s in enumerate(surface)], float(tolerance))
    return _together([_region(surface, "")], float(tolerance))[0]


def _region(surface: Surface | Region, name: str) -> Region:
    if isinstance(surface, Region):
        return surface
    if not isinstance(surface, Surface):
        raise ParameterError(f"cannot reparametrize a {type(surface).__name__}: give a surface")
    if not np.isfinite(np.array(surface.domain)).all():
        raise ParameterError(
            f"the {type(surface).__name__} is unbounded: give it ranges of u and v before reparametrizing it"
        )
    return Region.of_surface(surface.to_nurbs(), name=name)


def _together(regions: list[Region], tolerance: float) -> tuple[Reparametrized, ...]:
    before = [parametrisation_defect(r.surface, r.box) for r in regions]
    if all(r.whole and d <= GOOD for r, d in zip(regions, before, strict=True)):
        return tuple(_kept(r, d, tolerance) for r, d in zip(regions, before, strict=True))
    known = neighbourhood(regions, shared_within(regions, tolerance))
    charts = charted(regions, known)
    directions = [
        _sites(number, direction, charts, known, tolerance) for number, direction in enumerate(charts.directions)
    ]
    surfaces, measured = _fitted(charts, directions, known, tolerance)
    return tuple(
        _result(region, new, d, m, tolerance, notes)
        for region, new, d, m, notes in zip(regions, surfaces, before, measured, charts.notes, strict=True)
    )


def _fitted(
    charts: Charts, directions: list[Direction], known: Neighbourhood, tolerance: float
) -> tuple[list[NurbsSurface], list[Deviation]]:
    """The surfaces, with sites put in until they keep the tolerance, first at few samples, then at many."""
    for per_span in (FIT_SAMPLES, VERIFY_SAMPLES):
        for _ in range(ROUNDS):
            surfaces = _surfaces(charts.charts, directions, known)
            measured = [
                deviation(chart, surface, _own_sites(directions, known, i), per_span)
                for i, (chart, surface) in enumerate(zip(charts.charts, surfaces, strict=True))
            ]
            if not _insert(charts, directions, known, measured, tolerance):
                break
        if max(m.largest for m in measured) > tolerance:
            break
    return surfaces, measured


def _kept(region: Region, defect: float, tolerance: float) -> Reparametrized:
    (u, v), surface = region.box, region.surface
    if (region.box != np.array(surface.domain)).any():
        surface = surface.restricted((float(u[0]), float(u[1])), (float(v[0]), float(v[1])))
    shape = surface.control_points.shape[0], surface.control_points.shape[1]
    note = f"left as it is: its defect is at most {GOOD:g}"
    return Reparametrized(surface, 0.0, defect, defect, tolerance, _shape(region.surface), shape, 1.0, (note,))


def _shape(surface: NurbsSurface) -> tuple[int, int]:
    return surface.control_points.shape[0], surface.control_points.shape[1]


def _result(
    region: Region, new: NurbsSurface, before: float, measured: Deviation, tolerance: float, notes: tuple[str, ...]
) -> Reparametrized:
    if measured.largest > tolerance:
        notes += (f"{MOST_SITES} knots a direction do not reach the tolerance: the shape has a corner inside",)
    return Reparametrized(
        new, measured.largest, before, parametrisation_defect(new), tolerance, _shape(region.surface), _shape(new),
        measured.least_sine, notes,
    )  # fmt: skip


def _uses(charts: Sequence[Chart], known: Neighbourhood, number: int) -> list[Use]:
    return [
        Use(charts[i], axis, bool(known.backwards[i, axis]))
        for i, axis in np.argwhere(known.direction == number).tolist()
    ]


def _sites(number: int, direction: Direction, charts: Charts, known: Neighbourhood, tolerance: float) -> Direction:
    """The fewest sites of a direction: of its sides, reconciled, refined for what lies inside, thinned."""
    breaks = direction.breaks
    allowed = PER_DIRECTION * tolerance
    found = []
    for use in _uses(charts.charts, known, number):
        for k in range(4):
            border = use.chart.borders[k]
            if AXES[k] != use.axis or border.side.is_pole:
                continue
            own = fewest_sites(border.points, allowed, 1.0 - breaks[::-1] if use.backwards else breaks)
            found.append(1.0 - own[::-1] if use.backwards else own)
    sites = filled(reconciled(*found) if found else breaks, breaks)
    uses = _uses(charts.charts, known, number)
    sites, good = refined(sites, breaks, uses, allowed)
    return direction.with_sites(thinned(sites, breaks, uses, allowed) if good else sites)


def _own_sites(directions: Sequence[Direction], known: Neighbourhood, region: int) -> tuple[Array, Array]:
    s, t = (_own_direction(directions, known, region, axis).sites for axis in (0, 1))
    return s, t


def _own_direction(directions: Sequence[Direction], known: Neighbourhood, region: int, axis: int) -> Direction:
    direction = directions[int(known.direction[region, axis])]
    return direction.flipped() if known.backwards[region, axis] else direction


def _surfaces(charts: Sequence[Chart], directions: Sequence[Direction], known: Neighbourhood) -> list[NurbsSurface]:
    """The bicubic of every chart; followers of a shared side get its control points."""
    nets, knots = [], []
    for i, chart in enumerate(charts):
        s, t = (_own_direction(directions, known, i, axis) for axis in (0, 1))
        through = surface_through((s.cubic, t.cubic), chart.points(s.sites, t.sites))
        nets.append(np.array(through.control_points))
        knots.append(through.knots)
        for k, border in enumerate(chart.borders):
            if border.side.is_pole:
                _row(nets[i], k)[:] = nets[i][-(k == 3), -(k == 1)]  # one point, without the spline's round-off
    for pair in known.shared:
        row = _row(nets[pair.leader], pair.first)
        _row(nets[pair.follower], pair.second)[:] = row[::-1] if pair.against else row
    return [NurbsSurface((3, 3), k, net) for k, net in zip(knots, nets, strict=True)]


def _row(net: Array, side: int) -> Array:
    """The control points of a side, as a view."""
    return net[:, -(side % 2)] if side < 2 else net[-(side % 2)]


def _insert(
    charts: Charts, directions: list[Direction], known: Neighbourhood, measured: Sequence[Deviation], tolerance: float
) -> bool:
    """Knot lines through the worst places of cells that stray too far; False where none does or no more may be put in.

    Each runs across the direction whose interpolation strays more there; an interval between sites gets one at most.
    """
    wanted: dict[int, list[tuple[float, float]]] = {}
    for i, (chart, found) in enumerate(zip(charts.charts, measured, strict=True)):
        places = found.worst[found.worst[:, 2] > tolerance][:PLACES]
        if not len(places):
            continue
        errors = []
        for axis in (0, 1):
            own = _own_direction(directions, known, i, axis)
            errors.append(errors_at(Use(chart, axis), own.sites, own.breaks, places[:, axis], places[:, 1 - axis]))
        for (*at, distance), axis in zip(places.tolist(), np.argmax(errors, axis=0).tolist(), strict=True):
            x = 1.0 - at[axis] if known.backwards[i, axis] else at[axis]
            wanted.setdefault(int(known.direction[i, axis]), []).append((-distance, x))
    grown = False
    for number, ranked in wanted.items():
        sites = directions[number].sites
        x = np.array([place for _, place in sorted(ranked)])
        interval = np.clip(np.searchsorted(sites, x) - 1, 0, len(sites) - 2)
        _, first = np.unique(interval, return_index=True)
        first = np.sort(first)[: max(MOST_SITES - len(sites), 0)]
        a, b = sites[interval[first]], sites[interval[first] + 1]
        new = np.clip(x[first], 0.8 * a + 0.2 * b, 0.2 * a + 0.8 * b)
        directions[number] = directions[number].with_sites(np.sort(np.concatenate((sites, new))))
        grown = grown or len(new) > 0
    return grown
