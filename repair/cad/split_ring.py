"""A ring with five corners or more filled by one four-sided patch per corner, all meeting in a centre.

Every side is divided in its middle and a spoke leads from there to the centre; a patch has half of a side, a corner,
half of the next side and two spokes for its sides (the midpoint split of Catmull and Clark 1978). Spokes are cubics
that leave a side in the tangent plane of the face beside it where the edge was smooth (`coons_ring`), and all end in
one plane at the centre. Along a spoke both patches take one set of tangent planes, turned from the side's to the
centre's, so that they join smoothly (`tangent_coons`); it starts to turn as the twists of the face beside the side ask
(S_u . N_v = S_v . N_u) and ends level, as on a sphere. Nothing has to be a graph over a plane.

Limits: an edge that is a whole side is cut in two, also on the face beside it, whose surface stays; at a corner of the
ring that opens by more than a straight angle a four-sided patch folds, and the ring is left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad.editing import with_cut
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.topology import Topology
from patchwright.repair.cad.coons_ring import SMOOTH, coons_ring
from patchwright.repair.cad.draft import Limits
from patchwright.repair.cad.ring_judged import RingPatch
from patchwright.repair.cad.ring_sides import Normals, Steps, side_curve, sides

LEAST = 5  # corners
MIDDLE = (0.3, 0.7)  # shares of a side between which a corner of its edges is taken for its middle
STEEPEST = np.radians(150.0)  # angle at which spokes leave the plane: steeper ones count as this
NEAR = 1e-5  # of an edge or a spoke: steps of difference quotients
BEZIER = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class _Planes:
    """Tangent planes along a spoke: unit normals (3,) at its ends, and how fast they begin to turn about it, in radians
    per unit of its parameter; nan where nothing asks for a rate."""

    first: Array
    last: Array
    rate: float


@dataclass(frozen=True, slots=True, eq=False)
class SplitRing:
    """The topology with the spokes, and the patches on it."""

    topology: Topology
    patches: tuple[RingPatch, ...]


def split_ring(
    topology: Topology, ring: Steps, normals_of: Callable[[Topology], Normals], limits: Limits
) -> SplitRing | str:
    """Patches that fill one ring, counter-clockwise as seen from outside; a sentence where they do not.

    `normals_of` gives the normals of the faces beside the edges of a topology, here of one whose edges are cut.
    """
    around = sides(topology, ring)
    count = len(around)
    if count < LEAST:
        return f"its ring has {count} corners, too few to be split about a centre"
    halves = []
    for side in around:
        topology, first, second = halved(topology, side, limits)
        halves.append((first, second))
    normals = normals_of(topology)
    middles = np.array([_end(topology, first[-1]) for first, _ in halves])
    slopes = [_leaving(topology, halves, k, normals) for k in range(count)]
    outward = _outward(topology, halves)
    mean = middles.mean(axis=0)
    flat = middles - mean - np.outer((middles - mean) @ outward, outward)
    # an arc that leaves the rim at an angle and is level at the centre rises by distance times the half angle's tangent
    rises = [0.0 if d is None else _rise(d, -f, outward) for d, f in zip(slopes, flat, strict=True)]
    centre = mean + outward * float(np.mean(rises))
    topology, hub = _with_vertex(topology, centre)
    spokes: dict[int, _Planes] = {}
    names = []
    for k in range(count):
        topology, edge, planes = _spoke(topology, halves[k], hub, slopes[k], outward, normals)
        spokes[edge] = planes
        names.append(edge)

    def beside(edge: int, t: Array) -> Array | None:
        if edge not in spokes:
            return normals(edge, t)
        return _turned(topology.curves[edge], spokes[edge], t)

    patches = []
    for k in range(count):
        after = (k + 1) % count
        ways: list[Steps] = [halves[k][1], halves[after][0], ((names[after], False),), ((names[k], True),)]
        made = coons_ring(topology, [side_curve(topology, way, limits) for way in ways], beside, limits)
        if isinstance(made, str):
            return f"one of {count} patches about a centre: {made}"
        patches.append(replace(made, how=f"one of {count} patches about a centre, each {made.how}"))
    return SplitRing(topology, tuple(patches))


def halved(topology: Topology, side: Steps, limits: Limits) -> tuple[Topology, Steps, Steps]:
    """A side in two parts, cut where two of its edges meet if that is near its middle, else inside an edge."""
    _, spans = side_curve(topology, side, limits)
    stops = [b for _, _, b in spans[:-1]]
    near = [k for k, stop in enumerate(stops) if MIDDLE[0] <= stop <= MIDDLE[1]]
    if near:
        at = min(near, key=lambda k: abs(stops[k] - 0.5)) + 1
        return topology, side[:at], side[at:]
    at = next(k for k, (_, _, b) in enumerate(spans) if b > 0.5)
    (edge, reverse), a, b = spans[at]
    share = (0.5 - a) / (b - a)
    t0, t1 = topology.curves[edge].domain
    at_t = t0 + (1.0 - share if reverse else share) * (t1 - t0)
    breaks = topology.curves[edge].breaks
    knot = float(breaks[np.abs(breaks - at_t).argmin()])
    if t0 < knot < t1 and abs(knot - at_t) <= NEAR * (t1 - t0):  # a span that is next to nothing is no use
        at_t = knot
    topology, (one, two) = with_cut(topology, edge, at_t)
    first, second = (two, one) if reverse else (one, two)
    return topology, (*side[:at], (first, reverse)), ((second, reverse), *side[at + 1 :])


def _end(topology: Topology, step: tuple[int, bool]) -> Array:
    """(3,) where the ring leaves an edge."""
    edge, reverse = step
    return np.asarray(topology.vertices[int(topology.ends[edge][0 if reverse else 1])])


def _outward(topology: Topology, halves: list[tuple[Steps, Steps]]) -> Array:
    """(3,) the unit normal of the ring as a whole."""
    points = []
    for step in (step for pair in halves for half in pair for step in half):
        curve = topology.curves[step[0]]
        t = np.linspace(*curve.domain, 9)
        points.append(curve(t[::-1] if step[1] else t)[:-1])
    local = np.concatenate(points)
    local = local - local.mean(axis=0)
    area = np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
    return np.asarray(area / np.linalg.norm(area))


def _leaving(topology: Topology, halves: list[tuple[Steps, Steps]], k: int, normals: Normals) -> Array | None:
    """(3,) the direction into the ring in the tangent plane beside the middle of a side; None where it is sharp.

    It is smooth where the sides before and after leave its ends in the tangent planes beside it.
    """
    before, after = halves[k - 1][1][-1], halves[(k + 1) % len(halves)][0][0]
    for step, other, last in ((halves[k][0][0], before, False), (halves[k][1][-1], after, True)):
        n = _normal(topology, step, normals, last)
        away = _tangent(topology, other, not last)
        if n is None or abs(float(n @ away)) > np.sin(np.radians(SMOOTH)):
            return None
    step = halves[k][0][-1]
    n = _normal(topology, step, normals, True)
    if n is None:
        return None
    inward = np.cross(n, _tangent(topology, step, True))  # the ring has the hole on its left
    return np.asarray(inward / np.linalg.norm(inward))


def _normal(topology: Topology, step: tuple[int, bool], normals: Normals, last: bool) -> Array | None:
    found = normals(step[0], np.array([topology.curves[step[0]].domain[int(last != step[1])]]))
    return None if found is None else found[0]


def _tangent(topology: Topology, step: tuple[int, bool], last: bool) -> Array:
    """(3,) the unit direction in which the ring runs at one end of an edge."""
    curve = topology.curves[step[0]]
    slope = curve(np.array([curve.domain[int(last != step[1])]]), 1)[0]
    return np.asarray(slope / max(float(np.linalg.norm(slope)), np.finfo(float).tiny) * (-1.0 if step[1] else 1.0))


def _rise(direction: Array, inward: Array, outward: Array) -> float:
    """How far a circular arc rises over a way (3,) in the plane that it begins in a direction and ends level."""
    size = float(np.linalg.norm(inward))
    run = float(direction @ inward) / max(size, np.finfo(float).tiny)
    angle = np.clip(np.arctan2(float(direction @ outward), run), -STEEPEST, STEEPEST)
    return size * float(np.tan(0.5 * angle))


def _with_vertex(topology: Topology, place: Array) -> tuple[Topology, int]:
    return replace(topology, vertices=np.concatenate([topology.vertices, place[None]])), len(topology.vertices)


def _spoke(
    topology: Topology, half: tuple[Steps, Steps], hub: int, leaving: Array | None, outward: Array, normals: Normals
) -> tuple[Topology, int, _Planes]:
    """The topology with the cubic from the middle of a side to the centre, and the normals at its ends."""
    step = half[0][-1]
    start, centre = int(topology.ends[step[0]][0 if step[1] else 1]), topology.vertices[hub]
    a = topology.vertices[start]
    way = centre - a
    size = float(np.linalg.norm(way))
    begin = way / size if leaving is None else leaving
    level = way - (way @ outward) * outward
    level /= max(float(np.linalg.norm(level)), np.finfo(float).tiny)
    turn = np.arccos(np.clip(float(begin @ level), -1.0, 1.0))
    handle = size / (3.0 * np.cos(0.25 * turn) ** 2)  # of an arc between these tangents
    net = np.stack([a, a + handle * begin, centre - handle * level, centre])
    n = _normal(topology, step, normals, True) if leaving is not None else None
    rate = float("nan") if n is None else 3.0 * handle * float(begin @ _bend(topology, step, normals))
    if n is None:
        n = np.cross(_tangent(topology, step, True), begin)
        n /= max(float(np.linalg.norm(n)), np.finfo(float).tiny)
    wider = replace(
        topology,
        curves=(*topology.curves, NurbsCurve(3, BEZIER, net)),
        ends=np.concatenate([topology.ends, [[start, hub]]]),
    )
    return wider, len(topology.curves), _Planes(n, outward, rate)


def _bend(topology: Topology, step: tuple[int, bool], normals: Normals) -> Array:
    """(3,) how the normal beside the end of an edge changes per length along it, as the ring runs."""
    curve = topology.curves[step[0]]
    t0, t1 = curve.domain
    t = np.array([t0 + NEAR * (t1 - t0), t0] if step[1] else [t1 - NEAR * (t1 - t0), t1])
    found = normals(step[0], t)
    if found is None:
        return np.zeros(3)
    points = curve(t)
    return np.asarray((found[1] - found[0]) / np.linalg.norm(points[1] - points[0]))


def _turned(curve: NurbsCurve, planes: _Planes, t: Array) -> Array:
    """(k, 3) unit normals of a spoke on [0, 1] at its parameters."""
    n, across = _evenly(curve, planes, t)
    ends = np.array([0.0, NEAR, 1.0 - NEAR, 1.0])
    even, beside = _evenly(curve, planes, ends)
    own = np.array([(even[1] - even[0]) @ beside[0], (even[3] - even[2]) @ beside[3]]) / NEAR
    begin = 0.0 if np.isnan(planes.rate) else planes.rate - own[0]
    angle = begin * t * (1.0 - t) ** 2 + own[1] * t**2 * (1.0 - t)  # Hermite: slopes `begin` and -own[1]
    return np.asarray(np.cos(angle)[:, None] * n + np.sin(angle)[:, None] * across)


def _evenly(curve: NurbsCurve, planes: _Planes, t: Array) -> tuple[Array, Array]:
    """(k, 3) unit normals square to the spoke between those of its ends, and the directions square to both."""
    along = curve(t, 1)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    n = (1.0 - t)[:, None] * planes.first + t[:, None] * planes.last
    n = n - np.einsum("ij,ij->i", n, along)[:, None] * along
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    return n, np.cross(along, n)
