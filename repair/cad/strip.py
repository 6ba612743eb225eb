"""Move boundary strips so that the surfaces themselves meet: NURBS faces whose borders miss each other by a gap.

Borders that face each other along their whole length, end to end, get one common curve: half-way across the gap on the
cubic that leaves both surfaces along their tangents (the midpoint of a Hermite cubic), or the other face's own edge
where only one of the two can move. Each surface then changes only near its border (`models.boundary_strip`), within
`DEPTH` gap widths. Corners that meet there become one point, half-way between the mean of the borders' ends and where
their tangent planes meet: on a sphere both miss by the same amount, on opposite sides.

Limits: a border counts where it is one edge on a natural side of its surface; faces with other trims, or whose sides
run at very different speeds, are left to the next rung.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.boundary_strip import SIDES, Border, border_below, border_space, through, with_borders
from patchwright.models.cad.editing import compacted, with_loops
from patchwright.models.errors import GeometryError
from patchwright.models.extension import surface_on
from patchwright.models.knots import greville
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface, Side
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.cad.draft import Change, Draft, Limits
from patchwright.repair.decisions import STRIPS
from patchwright.repair.result import Rung

DEPTH = 4.0  # gap widths that a strip reaches into its face
SKEW = 1.5  # borders whose points at equal shares are farther apart than this many gap widths run at other speeds
SLENDER = 0.5  # of a border's length: a gap as wide as this is no seam
SAMPLES = 33


@dataclass(frozen=True, slots=True, eq=False)
class _Side:
    """One free edge that is a whole natural side of its face's surface; `points` (k, 3) run with the surface."""

    face: int
    side: Side
    edge: int
    points: Array

    def ends(self, topology: Topology, use: EdgeUse) -> tuple[int, int]:
        """The corners where the side begins and ends, in the surface's own direction."""
        first, last = (int(v) for v in topology.ends[self.edge])
        along = 1 if self.side[0] == "u" else 0
        points = use.pcurve.control_points
        return (first, last) if points[0, along] < points[-1, along] else (last, first)


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """Two sides that face each other; `against` says that they run opposite ways, `gap` is the largest distance."""

    one: _Side
    two: _Side
    against: bool
    gap: float


def strip(draft: Draft, limits: Limits) -> tuple[Draft, tuple[Change, ...]]:
    """Every pair of facing natural borders brought onto one curve, all faces at once."""
    sides = _sides(draft)
    pairs = [pair for pair in _pairs(sides, limits) if not draft.vetoed(_change(pair, limits), limits)]
    pairs, places = _closed_corners(draft, sides, pairs, limits)
    if not pairs:
        return draft, ()
    try:
        return _joined(draft, sides, pairs, places, limits)
    except (GeometryError, np.linalg.LinAlgError):
        return draft, ()


def _uses(draft: Draft, face: int) -> list[EdgeUse]:
    return [use for loop in draft.topology.loops[face] for use in loop]


def _sides(draft: Draft) -> list[_Side]:
    """The free natural sides of faces whose every edge is a natural side."""
    owner, out = draft.owners(), []
    share = np.linspace(0.0, 1.0, SAMPLES)
    for face in sorted(set(owner.values())):
        surface, uses = draft.parts[face].surface, _uses(draft, face)
        if not isinstance(surface, NurbsSurface) or len(draft.topology.loops[face]) != 1:
            continue
        found = [_natural(surface, use.pcurve) for use in uses]
        if None in found or len(set(found)) < len(found):
            continue
        for use, side in zip(uses, found, strict=True):
            if side is None or owner.get(use.edge) != face:
                continue
            low, high = surface.domain[1 if side[0] == "u" else 0]
            border = surface.clamped().boundary(side)
            out.append(_Side(face, side, use.edge, border(low + share * (high - low))))
    return out


def _natural(surface: NurbsSurface, pcurve: NurbsCurve) -> Side | None:
    """The side of the domain the pcurve runs along from end to end, None where it does not."""
    box = np.array(surface.domain)
    size = box[:, 1] - box[:, 0]
    uv = (pcurve(np.linspace(*pcurve.domain, 9)) - box[:, 0]) / size
    for side in SIDES:
        across, end = (0 if side[0] == "u" else 1), int(side[1])
        ends = np.sort(uv[[0, -1], 1 - across])
        if np.abs(uv[:, across] - end).max() < 1e-7 and np.abs(ends - [0.0, 1.0]).max() < 1e-7:
            return side
    return None


def _pairs(sides: list[_Side], limits: Limits) -> list[_Pair]:
    """Each side with the one that faces it best, where both agree."""
    best: dict[int, tuple[float, int, bool]] = {}
    lengths = [float(np.linalg.norm(np.diff(s.points, axis=0), axis=1).sum()) for s in sides]
    for i, j in combinations(range(len(sides)), 2):
        if sides[i].face == sides[j].face:
            continue
        for against in (False, True):
            away = sides[i].points - (sides[j].points[::-1] if against else sides[j].points)
            gap = float(np.linalg.norm(away, axis=1).max())
            if gap > min(limits.reach, SLENDER * min(lengths[i], lengths[j])) or _skewed(away, sides[i].points):
                continue
            for a, b in ((i, j), (j, i)):
                if a not in best or gap < best[a][0]:
                    best[a] = (gap, b, against)
    return [
        _Pair(sides[i], sides[j], against, gap)
        for i, (gap, j, against) in sorted(best.items())
        if i < j and best[j][1] == i
    ]


def _skewed(away: Array, points: Array) -> bool:
    """Whether the pairs of points are joined along the borders rather than across the gap."""
    along = np.gradient(points, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(float).tiny)
    slip = np.abs(np.einsum("ij,ij->i", away, along))
    size = np.linalg.norm(away, axis=1)
    return bool(size.max() > SKEW * np.sqrt(np.maximum(size**2 - slip**2, 0.0)).max())


def _closed_corners(
    draft: Draft, sides: list[_Side], pairs: list[_Pair], limits: Limits
) -> tuple[list[_Pair], dict[int, Array]]:
    """The pairs whose corners can move, and the new place of each corner.

    A corner may move when every edge at it is on a side that moves, or on a free side that can follow; otherwise it
    stays, and so do its pairs unless their ends are there already.
    """
    topology = draft.topology
    free = {side.edge: side.face for side in sides}
    uses = {use.edge: use for face in range(len(draft.parts)) for use in _uses(draft, face)}
    while pairs:
        moving = {side.edge for pair in pairs for side in (pair.one, pair.two)}
        faces = {side.face for pair in pairs for side in (pair.one, pair.two)}
        following = {edge for edge, face in free.items() if face in faces}
        groups = _groups(topology, uses, pairs)
        bad: set[int] = set()
        places: dict[int, Array] = {}
        for group in groups:
            edges = np.flatnonzero(np.isin(topology.ends, sorted(group)).any(axis=1) & (topology.use_counts() > 0))
            fixed = [int(e) for e in edges if int(e) not in moving | following]
            at = topology.vertices[sorted(group)]
            held = sorted({int(v) for e in fixed for v in topology.ends[e]} & group)
            place = topology.vertices[held[0]] if held else _meeting(draft, group, pairs, uses)
            if held and np.linalg.norm(at - place, axis=1).max() > limits.on:
                bad |= set(edges.tolist()) & moving
            places.update(dict.fromkeys(group, place))
        if not bad:
            return pairs, places
        pairs = [p for p in pairs if p.one.edge not in bad and p.two.edge not in bad]
    return [], {}


def _groups(topology: Topology, uses: dict[int, EdgeUse], pairs: list[_Pair]) -> list[set[int]]:
    """Corners that become one."""
    group: dict[int, set[int]] = {}
    for pair in pairs:
        a, b = pair.one.ends(topology, uses[pair.one.edge]), pair.two.ends(topology, uses[pair.two.edge])
        for v, w in zip(a, b[::-1] if pair.against else b, strict=True):
            merged = group.get(v, {v}) | group.get(w, {w})
            for member in merged:
                group[member] = merged
    return list({id(one): one for one in group.values()}.values())


def _meeting(draft: Draft, group: set[int], pairs: list[_Pair], uses: dict[int, EdgeUse]) -> Array:
    """One point for corners that come together: see the module's head."""
    points, normals, seen = [], [], set()
    for pair in pairs:
        for side in (pair.one, pair.two):
            for end, corner in enumerate(side.ends(draft.topology, uses[side.edge])):
                if corner in group and (side.face, corner) not in seen:
                    seen.add((side.face, corner))
                    surface = draft.surface(side.face)
                    (u0, u1), (v0, v1) = surface.domain
                    along, across = (1, 0) if side.side[0] == "u" else (0, 1)
                    uv = np.empty(2)
                    uv[across] = ((u0, u1), (v0, v1))[across][int(side.side[1])]
                    uv[along] = ((u0, u1), (v0, v1))[along][end]
                    normal = np.cross(surface(uv[0], uv[1], (1, 0)), surface(uv[0], uv[1], (0, 1)))
                    points.append(draft.topology.vertices[corner])
                    normals.append(normal / max(float(np.linalg.norm(normal)), np.finfo(float).tiny))
    P, N = np.array(points), np.array(normals)
    mean = P.mean(axis=0)
    # the point of least distance from the tangent planes, nearest to the mean
    planes = mean + np.linalg.lstsq(N, np.einsum("ij,ij->i", P - mean, N), rcond=1e-3)[0]
    return np.asarray(0.5 * (mean + planes))


def _joined(
    draft: Draft, sides: list[_Side], pairs: list[_Pair], places: dict[int, Array], limits: Limits
) -> tuple[Draft, tuple[Change, ...]]:
    topology = draft.topology
    uses = {use.edge: use for face in range(len(draft.parts)) for use in _uses(draft, face)}
    borders: dict[int, dict[Side, Border]] = {}
    common: dict[int, NurbsCurve] = {}
    for pair in pairs:
        one, two = pair.one, pair.two
        a, b = _even(draft.surface(one.face), one.side), _even(draft.surface(two.face), two.side)
        degree = max(a.degree, b.degree)
        space = _space(a, b, degree, pair.against)
        leader = _half_way(draft, pair, space, [places[v] for v in one.ends(topology, uses[one.edge])])
        common[one.edge] = leader
        for side, flip in ((one, False), (two, pair.against)):
            target = leader.reversed() if flip else leader
            own = draft.surface(side.face)
            assert isinstance(own, NurbsSurface)
            depth = DEPTH * pair.gap / speed_across(own, side.side)
            borders.setdefault(side.face, {})[side.side] = Border(target, depth)
    surfaces: dict[int, Surface] = {}
    for face, wanted in borders.items():
        own = draft.surface(face)
        assert isinstance(own, NurbsSurface)
        raised = _raised(own, wanted)
        fitted = {side: Border(_on_domain(raised, side, b.target, limits), b.depth) for side, b in wanted.items()}
        surfaces[face] = with_borders(raised, fitted)
    return _topology(draft, sides, pairs, places, surfaces, limits)


def _even(surface: Surface, side: Side) -> NurbsCurve:
    """A border on [0, 1]."""
    assert isinstance(surface, NurbsSurface)
    curve = surface.clamped().boundary(side)
    t0, t1 = curve.domain
    return NurbsCurve(curve.degree, (curve.knots - t0) / (t1 - t0), curve.control_points, curve.weights)


def _space(a: NurbsCurve, b: NurbsCurve, degree: int, against: bool) -> NurbsCurve:
    """A curve with the knots of both borders and the first one's weights, of the higher degree."""
    from patchwright.models.knots import distinct

    a, b = (c.elevated(degree - c.degree) if c.degree < degree else c for c in (a, b))
    b = b.reversed() if against else b
    values, counts = distinct(b.knots)
    own = [int(np.count_nonzero(np.abs(a.knots - v) < 1e-9)) for v in values]
    extra = [v for v, c, h in zip(values, counts, own, strict=True) if 1e-9 < v < 1 - 1e-9 for _ in range(int(c) - h)]
    return a.insert_knots(extra)


def _half_way(draft: Draft, pair: _Pair, space: NurbsCurve, ends: list[Array]) -> NurbsCurve:
    """The common curve in the first border's direction, on [0, 1], through the corners `ends`."""
    one, two = (_Rail.of(draft.surface(s.face), s.side, pair.gap) for s in (pair.one, pair.two))

    def middle(t: Array) -> Array:
        (a, out_a), (b, out_b) = one(t), two(1.0 - t if pair.against else t)
        away = b - a
        size = np.linalg.norm(away, axis=1, keepdims=True)
        # both tangents point across the gap; their part square to it is what bends the cubic
        return np.asarray(0.5 * (a + b) + 0.125 * size * (_across(out_a, away) + _across(out_b, -away)))

    room = min(one.room, two.room)
    begin, end = (_nearest(middle, at, place, room) for at, place in zip((0.0, 1.0), ends, strict=True))
    t = greville(space.degree, space.knots)
    places, share = middle(begin + t * (end - begin)), t[:, None]
    places += (1.0 - share) * (ends[0] - places[0]) + share * (ends[1] - places[-1])
    return through(space, places)


def _nearest(curve: Callable[[Array], Array], start: float, place: Array, room: float) -> float:
    """The parameter within `room` of `start` where a curve is nearest to a place."""
    low, high = start - room, start + room
    for _ in range(12):
        t = np.linspace(low, high, 9)
        best = t[int(np.argmin(np.linalg.norm(curve(t) - place, axis=1)))]
        step = (high - low) / 8.0
        low, high = max(best - step, start - room), min(best + step, start + room)
    return float(best)


@dataclass(frozen=True, slots=True, eq=False)
class _Rail:
    """A border of a surface at shares of its length in parameters, carried on by `room` at both ends."""

    surface: NurbsSurface
    side: Side
    low: float
    width: float
    room: float

    @classmethod
    def of(cls, surface: Surface, side: Side, gap: float) -> _Rail:
        assert isinstance(surface, NurbsSurface)
        along = 1 if side[0] == "u" else 0
        low, high = surface.domain[along]
        length = float(surface.clamped().boundary(side).length(accuracy=1e-3))
        room = min(2.0 * gap / max(length, np.finfo(float).tiny), 0.5)
        ranges = list(surface.domain)
        ranges[along] = (low - room * (high - low), high + room * (high - low))
        try:
            return cls(surface_on(surface, ranges[0], ranges[1]), side, low, high - low, room)
        except GeometryError:  # its weights vanish out there
            return cls(surface, side, low, high - low, 0.0)

    def __call__(self, share: Array) -> tuple[Array, Array]:
        """Points, and unit directions out of the face square to the border."""
        across, end = (0 if self.side[0] == "u" else 1), int(self.side[1])
        uv = np.empty((len(share), 2))
        uv[:, across] = self.surface.domain[across][end]
        uv[:, 1 - across] = np.clip(self.low + share * self.width, *self.surface.domain[1 - across])
        order = [(1, 0), (0, 1)]
        out = self.surface(uv[:, 0], uv[:, 1], order[across]) * (1.0 if end else -1.0)
        along = self.surface(uv[:, 0], uv[:, 1], order[1 - across])
        along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(float).tiny)
        out -= np.einsum("ij,ij->i", out, along)[:, None] * along
        out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), np.finfo(float).tiny)
        return self.surface(uv[:, 0], uv[:, 1]), out


def _across(outward: Array, away: Array) -> Array:
    """Unit directions out of a face, scaled to the advance across the gap; zero where they do not lead across it."""
    size = np.linalg.norm(away, axis=1, keepdims=True)
    unit = np.divide(away, size, out=np.zeros_like(away), where=size > 0.0)
    ahead = np.einsum("ij,ij->i", outward, unit)[:, None]
    leads = ahead > 0.5
    return np.where(leads, outward / np.where(leads, ahead, 1.0), unit)


def speed_across(surface: NurbsSurface, side: Side) -> float:
    """The greatest speed across a border, length per parameter."""
    across, end = (0 if side[0] == "u" else 1), int(side[1])
    box = np.array(surface.domain)
    low, high = box[1 - across].tolist()
    at, along = np.array([box[across, end]]), np.linspace(low, high, SAMPLES)
    order = ((1, 0), (0, 1))[across]
    slope = surface.grid(at, along, order) if across == 0 else surface.grid(along, at, order)
    return max(float(np.linalg.norm(slope, axis=2).max()), np.finfo(float).tiny)


def _raised(surface: NurbsSurface, wanted: dict[Side, Border]) -> NurbsSurface:
    """The surface with its degrees raised to its targets'."""
    p = max([b.target.degree for side, b in wanted.items() if side[0] == "v"] or [0])
    q = max([b.target.degree for side, b in wanted.items() if side[0] == "u"] or [0])
    more = max(0, p - surface.degree[0]), max(0, q - surface.degree[1])
    return surface.elevated(*more) if any(more) else surface


def _on_domain(surface: NurbsSurface, side: Side, target: NurbsCurve, limits: Limits) -> NurbsCurve:
    """The target on the border's own domain, in the border's degree and weights.

    Exact where degree and weights agree; refined until it is near enough otherwise.
    """
    low, high = surface.domain[1 if side[0] == "u" else 0]
    for extra in (0, 1, 3, 7, 15, 31):
        breaks = target.breaks
        cuts = (breaks[:-1, None] + np.diff(breaks)[:, None] * np.arange(1, extra + 1) / (extra + 1)).ravel()
        wanted = np.concatenate([target.knots[target.degree + 1 : -target.degree - 1], cuts])
        space = border_space(surface, side, low + (high - low) * np.sort(wanted))
        sites = (greville(space.degree, space.knots) - low) / (high - low)
        made = through(space, target(np.clip(sites, *target.domain)))
        t = np.linspace(0.0, 1.0, 8 * len(sites) + 1)
        off = np.linalg.norm(made(low + t * (high - low)) - target(t), axis=1).max()
        if off <= limits.fit:
            return made
    raise GeometryError(f"a border's weights keep it {off:.3g} from its neighbour's")


def _topology(
    draft: Draft,
    sides: list[_Side],
    pairs: list[_Pair],
    places: dict[int, Array],
    surfaces: dict[int, Surface],
    limits: Limits,
) -> tuple[Draft, tuple[Change, ...]]:
    """One edge per pair, the first face's border; corners that came together are one, and free sides follow them."""
    topology = draft.topology
    curves, vertices = list(topology.curves), topology.vertices.copy()
    for corner, place in places.items():
        vertices[corner] = place
    same = {v: min(w for w, other in places.items() if other is places[v]) for v in places}
    ends = np.vectorize(lambda v: same.get(int(v), int(v)), otypes=[np.int64])(topology.ends)
    taken: dict[int, tuple[int, EdgeUse]] = {}
    for pair in pairs:
        for side, edge, flip in ((pair.one, pair.one.edge, False), (pair.two, pair.one.edge, pair.against)):
            surface = surfaces[side.face]
            assert isinstance(surface, NurbsSurface)
            if side is pair.one:
                curves[edge] = surface.boundary(side.side)
                ends[edge] = [same.get(v, v) for v in pair.one.ends(topology, _use(draft, side))]
            t0, t1 = curves[edge].domain
            uv = _corners_of(surface, side.side)
            pcurve = NurbsCurve(1, np.array([t0, t0, t1, t1]), uv[::-1] if flip else uv)
            taken[side.edge] = (side.face, EdgeUse(edge, _reversed(draft, side, flip), pcurve))
    for side in sides:  # those that only follow their corners
        if side.face in surfaces and side.edge not in taken:
            follower = surfaces[side.face]
            assert isinstance(follower, NurbsSurface)
            use = _use(draft, side)
            line = use.pcurve if use.pcurve.degree == 1 else straight(use.pcurve)
            follows = border_below(follower, side.side, line)
            if follows is not None:
                curves[side.edge] = follows
                taken[side.edge] = side.face, replace(use, pcurve=line)
    changed = {}
    for face in surfaces:
        rows = tuple(
            tuple(taken[use.edge][1] if use.edge in taken else use for use in loop) for loop in topology.loops[face]
        )
        changed[face] = rows
    new = replace(topology, curves=tuple(curves), vertices=vertices, ends=ends)
    mended = draft.with_surfaces(surfaces, compacted(with_loops(new, changed)), same=False)
    return mended, tuple(_change(pair, limits) for pair in pairs)


def straight(pcurve: NurbsCurve) -> NurbsCurve:
    """The straight pcurve between the ends of one along a side."""
    t0, t1 = pcurve.domain
    return NurbsCurve(1, np.array([t0, t0, t1, t1]), pcurve.control_points[[0, -1]])


def _use(draft: Draft, side: _Side) -> EdgeUse:
    return next(use for use in _uses(draft, side.face) if use.edge == side.edge)


def _corners_of(surface: NurbsSurface, side: Side) -> Array:
    across, end = (0 if side[0] == "u" else 1), int(side[1])
    box = np.array(surface.domain)
    uv = np.empty((2, 2))
    uv[:, across] = box[across, end]
    uv[:, 1 - across] = box[1 - across]
    return uv


def _reversed(draft: Draft, side: _Side, flip: bool) -> bool:
    """Whether the face's loop runs against the common edge."""
    use = _use(draft, side)
    along = 1 if side.side[0] == "u" else 0
    points = use.pcurve.control_points
    with_surface = bool(points[0, along] < points[-1, along])
    runs_with_surface = with_surface != use.reversed
    return runs_with_surface == flip


def _change(pair: _Pair, limits: Limits) -> Change:
    return Change(
        STRIPS,
        Rung.STRIP,
        (pair.one.face, pair.two.face),
        f"both borders are NURBS and face each other from end to end across {pair.gap:.3g}",
        limits.fit,
        0.5 * pair.gap,
        0.5 * (pair.one.points[SAMPLES // 2] + pair.two.points[SAMPLES // 2]),
        float(np.linalg.norm(np.ptp(pair.one.points, axis=0))),
    )
