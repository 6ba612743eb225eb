"""The four boundary curves of a patch a person asks for, and where they come from.

Source: Hamann, Jean, Razdan, section 3.2: boundary curves are chosen as combinations of points and curves on the given
geometry. Here a side is made of points through any interpolation scheme, of a CAD edge, an iso-curve, a plane section
or an intersection curve; the last two are found as the shortest way along their pieces (`side_paths`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.errors import GeometryError, ParameterError
from patchwright.models.interpolation import interpolate
from patchwright.models.interpolation.parameters import Wanted
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.repair.patches.coons import check_corners, coons_grid, offset_distance
from patchwright.repair.patches.probes import SIDE, Probes, line_directions
from patchwright.repair.patches.projection import FACING, Ground, project

if TYPE_CHECKING:
    from patchwright.models.assembly import Assembly
    from patchwright.models.nurbs_surface import NurbsSurface

LAID = 129  # points of a side that is moved onto the geometry
FEWEST = 4  # of them that must find it


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """One boundary curve and a few words on where it comes from."""

    curve: NurbsCurve
    source: str

    def at(self, shares: Array) -> Array:
        """(n, 3) points at shares (n,) of the arc length; both ends are the curve's own."""
        from patchwright.reparam.yu_soni import curve_parameters

        out = np.array(self.curve(curve_parameters(self.curve, shares, 1e-10)))
        low, high = self.curve.domain
        out[shares == 0.0], out[shares == 1.0] = self.curve(low), self.curve(high)
        return out

    @property
    def reversed(self) -> Side:
        """The same the other way round."""
        return replace(self, curve=self.curve.reversed())

    @property
    def ends(self) -> Array:
        """(2, 3) first and last point."""
        return np.array(self.curve(np.array(self.curve.domain)))


@dataclass(frozen=True, slots=True, eq=False)
class Sides:
    """South (u, at v = 0) and north (u, v = 1), west (v, u = 0) and east (v, u = 1), corners exactly in common."""

    south: Side
    east: Side
    north: Side
    west: Side

    @classmethod
    def of(
        cls,
        south: Side,
        east: Side,
        north: Side,
        west: Side,
        tolerance: float,
        firm: tuple[bool, bool, bool, bool] = (True, True, True, True),
    ) -> Sides:
        """Four sides in the order south, east, north, west, each in either direction, made to run along +u and +v.

        Parameters
        ----------
        tolerance : sides that miss each other by no more are moved onto one corner
        firm : which of the sides lie where they should; a corner of one that does and one that does not is the first's,
            any other is midway

        Raises
        ------
        GeometryError : sides that do not meet; names the corner and the gap.
        """
        south, east, north, west = _directed(south, east, north, west)
        check_corners(south.ends, north.ends, west.ends, east.ends, tolerance)
        on = dict(zip(("s", "e", "n", "w"), firm, strict=True))
        sw = _corner(south.ends[0], west.ends[0], on["s"], on["w"])
        se = _corner(south.ends[1], east.ends[0], on["s"], on["e"])
        ne = _corner(north.ends[1], east.ends[1], on["n"], on["e"])
        nw = _corner(north.ends[0], west.ends[1], on["n"], on["w"])
        return cls(_pinned(south, sw, se), _pinned(east, se, ne), _pinned(north, nw, ne), _pinned(west, sw, nw))

    def rows(self, u: Array, v: Array) -> tuple[Array, Array, Array, Array]:
        """Points of south, north (M + 1, 3) at shares u and of west, east (N + 1, 3) at shares v of the arc length."""
        return self.south.at(u), self.north.at(u), self.west.at(v), self.east.at(v)

    def coons(self, u: Array, v: Array) -> Array:
        """(M + 1, N + 1, 3) points of the Coons patch at shares u and v of the arc length (HJR 4)."""
        return coons_grid(*self.rows(u, v), u=u, v=v)


def through(points: npt.ArrayLike, scheme: str | None = None, parameters: Wanted | None = None, **options: Any) -> Side:
    """The side through points (k, 3) by any interpolation scheme.

    Without one two points are joined by a straight line, three by Bessel's cubics, more by the C2 cubic.
    """
    P = np.asarray(points, dtype=np.float64)
    if P.ndim != 2 or P.shape[1:] != (3,) or len(P) < 2:
        raise ParameterError(f"a side needs at least two points x, y, z, got shape {P.shape}")
    if len(P) == 2 and scheme is None:
        return Side(polyline(P), "straight line")
    name = scheme or ("bessel" if len(P) == 3 else "c2-cubic")
    return Side(interpolate(P, name, parameters, **options), f"{name} through {len(P)} points")


def polyline(points: Array) -> NurbsCurve:
    """The curve of degree 1 through points (k, 3), on its arc length; repeated points are left out."""
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    P = points[np.concatenate([[True], step > 0.0])]
    if len(P) < 2:
        raise GeometryError(f"a side has no length: all its points are {points[0].round(6).tolist()}")
    length = np.concatenate([[0.0], np.cumsum(step[step > 0.0])])
    return NurbsCurve(1, np.concatenate([[0.0], length, length[-1:]]), P)


def iso_side(
    surface: NurbsSurface, direction: str, value: float, start: float | None = None, end: float | None = None
) -> Side:
    """The curve on which `direction` ("u" or "v") has the value, between two values of the other parameter."""
    if direction not in ("u", "v"):
        raise ParameterError(f'an iso-curve holds "u" or "v" constant, got {direction!r}')
    curve = surface.iso_curve("u" if direction == "u" else "v", value)
    low, high = curve.domain
    a, b = low if start is None else start, high if end is None else end
    if not (low <= min(a, b) < max(a, b) <= high):
        raise ParameterError(f"the iso-curve runs from {low:g} to {high:g}, so it has no part from {a:g} to {b:g}")
    part = curve.restricted(min(a, b), max(a, b))
    return Side(part if a < b else part.reversed(), f"iso-curve {direction} = {value:g}")


def edge_side(model: Assembly, start: npt.ArrayLike, end: npt.ArrayLike, middle: npt.ArrayLike | None = None) -> Side:
    """The edge of a CAD model whose ends are nearest to two points; of several the one nearest to `middle`.

    Raises
    ------
    GeometryError : the model has no edges.
    """
    if model.topology is None or not model.topology.curves:
        raise GeometryError(f"{model.source or 'the model'} has no edges to take a side from")
    a, b = (np.asarray(p, dtype=np.float64) for p in (start, end))
    curves = model.topology.curves
    ends = np.array([c(np.array(c.domain)) for c in curves])
    off = np.linalg.norm(ends - a, axis=2)[:, [0, 1]] + np.linalg.norm(ends - b, axis=2)[:, [1, 0]]
    cost = off.min(axis=1)
    same = np.flatnonzero(cost <= cost.min() + 1e-9 * model.diagonal)
    if middle is not None and len(same) > 1:
        m = np.asarray(middle, dtype=np.float64)
        same = same[np.argsort([np.linalg.norm(curves[i](np.mean(curves[i].domain)) - m) for i in same])]
    chosen = int(same[0])
    curve = curves[chosen] if off[chosen, 0] <= off[chosen, 1] else curves[chosen].reversed()
    return Side(curve, f"edge {chosen + 1} of the model")


def laid(
    sides: Sides,
    ground: tuple[Ground, int],
    which: tuple[bool, bool, bool, bool] = (True, True, True, True),
    offset: float | None = None,
    hits: str = "nearest",
) -> Sides:
    """Sides drawn over a geometry, moved onto it: C2 cubics through the points found along the geometry's normals.

    The directions are those at the closest points, so that a side two patches have in common is the same for both;
    where these face away from the patch its own normal is taken. Over a gap, where nothing is found, the cubic runs on
    between the points on both sides of it.

    Parameters
    ----------
    ground : the geometry as it faces the patch, and the sign of the patch's normals (`PatchGround.under`)
    which : whether south, east, north and west are moved; a corner moves with a side, to the closest point
    offset : half the probes' length; default an eighth of the perimeter (HJR 7)
    hits : "nearest" or "outermost", as for `approximate`

    Raises
    ------
    GeometryError : fewer than four points are found along a side.
    """
    if not any(which):
        return sides
    shares = np.linspace(0.0, 1.0, LAID)
    coons = sides.coons(shares, shares)
    reach = float(offset_distance(coons)) if offset is None else offset
    few = np.linspace(0.0, 1.0, SIDE)
    probes = Probes.of(sides.coons(few, few), reach, ground[1])
    normal = probes.at(shares, shares)
    out = []
    four = (sides.south, sides.east, sides.north, sides.west)
    for side, moved, drawn, along in zip(four, which, _border(coons), _border(normal), strict=True):
        out.append(_laid(side, drawn, along, ground[0], reach, hits) if moved else side)
    return Sides.of(out[0], out[1], out[2], out[3], np.inf)


def _border(grid: Array) -> tuple[Array, Array, Array, Array]:
    """South, east, north and west of a grid."""
    return grid[:, 0], grid[-1], grid[:, -1], grid[0]


def _laid(side: Side, drawn: Array, normal: Array, ground: Ground, reach: float, which: str) -> Side:
    below = ground.triangulation.normals[ground.closest(drawn).triangle]
    with_patch = np.einsum("ij,ij->i", below, normal) > FACING
    normal = line_directions(drawn, np.where(with_patch[:, None], below, normal), reach)
    hits = project(drawn, normal, np.full(len(drawn), reach), ground, outermost=which == "outermost")
    points, found = np.array(hits.points), np.array(hits.hit)
    ends = ground.closest(drawn[[0, -1]])
    points[[0, -1]], found[[0, -1]] = ends.points, True
    if found.sum() < FEWEST:
        raise GeometryError(
            f"only {found.sum()} of {len(found)} points of a side from {drawn[0].round(6).tolist()} to "
            f"{drawn[-1].round(6).tolist()} find the geometry; move it, or give it by a curve that lies there"
        )
    on = points[found]
    step = np.linalg.norm(np.diff(on, axis=0), axis=1)
    keep = np.concatenate([[True], step > 1e-3 * step.mean()])
    return Side(interpolate(on[keep], "c2-cubic", "chord"), f"{side.source}, laid on the geometry")


def _corner(one: Array, other: Array, one_firm: bool, other_firm: bool) -> Array:
    if one_firm != other_firm:
        return one if one_firm else other
    return np.asarray(0.5 * (one + other))


def _directed(south: Side, east: Side, north: Side, west: Side) -> tuple[Side, Side, Side, Side]:
    """The sides along +u and +v, whichever way each was given: the choice of turns with the nearest corners."""
    best, least = (south, east, north, west), np.inf
    for code in range(16):
        s, e, n, w = (side.reversed if code >> k & 1 else side for k, side in enumerate((south, east, north, west)))
        gaps = [s.ends[0] - w.ends[0], s.ends[1] - e.ends[0], n.ends[1] - e.ends[1], n.ends[0] - w.ends[1]]
        total = float(np.linalg.norm(gaps, axis=1).sum())
        if total < least * (1.0 - 1e-12):
            best, least = (s, e, n, w), total
    return best


def _pinned(side: Side, start: Array, end: Array) -> Side:
    """The side with its ends moved onto the common corners, its clamped end control points with them."""
    curve = side.curve.clamped()
    net = np.array(curve.control_points)
    if curve.weights is None:
        net[0], net[-1] = start, end
        return replace(side, curve=NurbsCurve(curve.degree, curve.knots, net))
    net[0], net[-1] = start, end
    return replace(side, curve=NurbsCurve(curve.degree, curve.knots, net, curve.weights))
