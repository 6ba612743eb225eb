"""A new surface through given rings of edges: what replaces a face, or bridges a gap, on exactly those edges.

Candidates, the first that is exact first: the plane of the rings; for one ring with three or four corners the Coons
patch of its sides, which takes the tangent planes of the faces beside it where its edges were smooth; for any rings the
smoothest height over their plane. Among those that hold the edges within the tolerance and do not fold, the one that
meets the surfaces around at the smallest angle is taken.

Whether an edge was smooth the edges left around tell: the missing face's tangent plane in a corner holds both sides
that meet there, so an edge is smooth where the sides at its ends leave it in the tangent plane of the face beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.analytic import Plane
from patchwright.models.arrays import Array
from patchwright.models.errors import GeometryError
from patchwright.models.knots import divided
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface, Side
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.cad_draft import Limits
from patchwright.repair.coons_surface import coons_surface
from patchwright.repair.height_surface import Frame, Rim, height_surface
from patchwright.repair.loop_shape import simple
from patchwright.repair.pcurves import fitted, joined
from patchwright.repair.tangent_coons import Beside, tangent_coons, worst_angle

RIM = 64  # parts an edge is divided into where a surface is fitted to it
PROBES = 12  # per span of an edge
CORNER = 30.0  # degrees a ring turns at a corner of a four-sided patch
GOES_ON = 0.5  # cosine of the angle between the plane's normal and a neighbour's up to which its slope is taken over
ROOM = 0.01  # of a plane's size: how far its ranges reach beyond its rings
GRID = 15  # per direction, where a Coons patch is looked at for folds
BETTER = 1.0  # degrees by which a later candidate must meet the surfaces around better

EVEN = 1e-12  # of a weight: weights that differ by less are equal
IN = 1e-6  # of a side: how far from its ends it is looked at how the patch leaves it
MET = 0.05  # degrees: tangent planes this near to each other are one
SMOOTH = 10.0  # degrees by which a side may leave the tangent plane beside it in a corner of a smooth edge
AROUND: tuple[Side, ...] = ("v0", "u1", "v1", "u0")  # the sides of a patch as its ring runs

Steps = tuple[tuple[int, bool], ...]  # edges with whether the ring runs along them backwards
Span = tuple[tuple[int, bool], float, float]  # an edge of a side, and its range in the side's parameter
Normals = Callable[[int, Array], Array | None]  # unit normals (k, 3) beside an edge at its parameters (k,), or None


@dataclass(frozen=True, slots=True, eq=False)
class RingPatch:
    """A surface, the rings' uses on it, how far they are from the edges, the mean angle to the surfaces around (nan
    where there are none), and what it is in words."""

    surface: Surface
    loops: tuple[tuple[EdgeUse, ...], ...]
    residual: float
    angle: float
    how: str


def ring_patch(topology: Topology, rings: tuple[Steps, ...], normals: Normals, limits: Limits) -> RingPatch | str:
    """The best surface through rings that run counter-clockwise as seen from outside, the outer one first.

    A sentence where none holds them.
    """
    points = [np.concatenate([_along(topology, step) for step in ring]) for ring in rings]
    outward = _newell(points[0])
    size = float(np.linalg.norm(np.ptp(np.concatenate(points), axis=0)))
    if np.linalg.norm(outward) <= limits.on * size:
        return "its edges enclose no area"
    frame = Frame.across(np.concatenate(points), outward)
    plane = _plane(topology, rings, frame, normals, limits)
    if plane is not None:
        return plane
    found: RingPatch | None = None
    reasons = []
    for make in (_coons, _height):
        made = make(topology, rings, frame, normals, limits)
        if isinstance(made, str):
            reasons.append(made)
        elif found is None or made.angle < found.angle - BETTER:
            found = made
    return found or "; ".join(reasons)


def _plane(
    topology: Topology, rings: tuple[Steps, ...], frame: Frame, normals: Normals, limits: Limits
) -> RingPatch | None:
    every = np.concatenate([_along(topology, step) for ring in rings for step in ring])
    _, _, axes = np.linalg.svd(every - frame.origin, full_matrices=False)
    n = axes[2] if axes[2] @ frame.axes[2] > 0.0 else -axes[2]
    off = float(np.abs((every - frame.origin) @ n).max())
    if off > limits.on:
        return None
    flat = Frame.across(every, n)
    loops = _projected(topology, rings, flat)
    low, high = _box(loops)
    room = ROOM * float((high - low).max())
    (u0, v0), (u1, v1) = (low - room).tolist(), (high + room).tolist()
    plane = Plane(flat.origin, n, flat.axes[0], u=(u0, u1), v=(v0, v1))
    return _judged(topology, plane, loops, normals, f"the plane of its edges, which leave it by {off:.2g}")


def _coons(
    topology: Topology, rings: tuple[Steps, ...], frame: Frame, normals: Normals, limits: Limits
) -> RingPatch | str:
    if len(rings) > 1:
        return "it has holes, so no Coons patch fills it"
    sides = _sides(topology, rings[0])
    if len(sides) not in (3, 4):
        return f"its ring has {len(sides)} corners, so no Coons patch fills it"
    made = [_side(topology, side, limits) for side in sides]
    curves = [curve for curve, _ in made]
    if len(curves) == 3:
        tip = curves[1].control_points[-1]
        curves.insert(2, NurbsCurve(1, np.array([0.0, 0.0, 1.0, 1.0]), np.stack([tip, tip])))
        made.insert(2, (curves[2], []))
    corners = [curve.control_points[0] for curve in curves]
    curves = [_between(c, corners[i], corners[(i + 1) % 4]) for i, c in enumerate(curves)]
    try:
        surface = coons_surface(curves[0], curves[2].reversed(), curves[3].reversed(), curves[1])
    except GeometryError as error:
        return str(error)
    surface, smooth = _with_tangents(topology, surface, [spans for _, spans in made], normals, frame)
    if _folds(surface, frame):
        return "the Coons patch of its sides folds"
    starts = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    uses = []
    for k, (_, spans) in enumerate(made):
        start, way = starts[k], starts[(k + 1) % 4] - starts[k]
        for (edge, reverse), a, b in spans:
            first, last = start + a * way, start + b * way
            if reverse:
                first, last = last, first
            t0, t1 = topology.curves[edge].domain
            uses.append(EdgeUse(edge, reverse, NurbsCurve(1, np.array([t0, t0, t1, t1]), np.stack([first, last]))))
    words = f"the Coons patch of its {len(sides)} sides{smooth}"
    patch = _judged(topology, surface, (tuple(uses),), normals, words)
    if patch.residual > limits.on:
        return f"the Coons patch of its sides misses its edges by {patch.residual:.3g}"
    return patch


def _with_tangents(
    topology: Topology, coons: NurbsSurface, spans: list[list[Span]], normals: Normals, frame: Frame
) -> tuple[NurbsSurface, str]:
    """The patch with the tangent planes beside it where its edges were smooth, and words for what it met."""
    beside = {
        side: _beside(topology, some, k, normals) for k, (side, some) in enumerate(zip(AROUND, spans, strict=True))
    }
    smooth: dict[Side, Beside] = {s: own for s, own in beside.items() if own is not None and _was_smooth(coons, s, own)}
    before = worst_angle(coons, smooth)
    if before <= MET:
        return coons, ""
    surface, after = tangent_coons(coons, smooth, MET)
    if after > 0.5 * before or _folds(surface, frame):
        return coons, ""
    return surface, f", tangent to {len(smooth)} faces around to {after:.2g} degrees"


def _beside(topology: Topology, spans: list[Span], k: int, normals: Normals) -> Beside | None:
    """Normals along the k-th side of a ring as functions of the patch's own parameter."""
    if not spans:
        return None

    def at(t: Array) -> Array:
        share = 1.0 - t if k > 1 else t  # the ring runs against the patch there
        out = np.full((len(t), 3), np.nan)
        for (edge, reverse), a, b in spans:
            mine = (share >= a) & (share <= b)
            local = (share[mine] - a) / (b - a)
            t0, t1 = topology.curves[edge].domain
            found = normals(edge, t0 + (1.0 - local if reverse else local) * (t1 - t0))
            if found is not None:
                out[mine] = found
        return out

    return at


def _was_smooth(coons: NurbsSurface, side: Side, beside: Beside) -> bool:
    """Whether the sides at both ends of a side leave it in the tangent planes beside it."""
    k, end = (0 if side[0] == "u" else 1), int(side[1])
    low, high = coons.domain[1 - k]
    t = np.array([low, high]) + IN * (high - low) * np.array([1.0, -1.0])  # nothing leaves a pole itself
    at = np.full(2, coons.domain[k][end])
    u, v = (at, t) if k == 0 else (t, at)
    across = coons(u, v, (1, 0) if k == 0 else (0, 1))
    n = beside(t)
    size = np.linalg.norm(across, axis=1)
    if not np.isfinite(n).all() or (size <= 0.0).any():
        return False
    return bool((np.abs(np.einsum("ij,ij->i", across, n)) <= np.sin(np.radians(SMOOTH)) * size).all())


def _height(
    topology: Topology, rings: tuple[Steps, ...], frame: Frame, normals: Normals, limits: Limits
) -> RingPatch | str:
    loops = _projected(topology, rings, frame)
    if not simple(loops):
        return "its edges cross each other as seen along their mean normal, so no height over their plane fills it"
    points, directions, slopes = [], [], []
    for loop in loops:
        for use in loop:
            curve = topology.curves[use.edge]
            t = _crowded(curve.breaks)
            local = frame.local(curve(t))
            along = frame.local(frame.origin + curve(t, 1))[:, :2]
            across = np.stack([along[:, 1], -along[:, 0]], axis=1)
            across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), np.finfo(float).tiny)
            beside = normals(use.edge, t)
            slope = np.full(len(t), np.nan)
            if beside is not None:
                n = beside @ frame.axes.T
                steep = n[:, 2] > GOES_ON
                slope[steep] = -np.einsum("ij,ij->i", n[steep, :2], across[steep]) / n[steep, 2]
            points.append(local)
            directions.append(across)
            slopes.append(slope)
    rim = Rim(np.concatenate(points), np.concatenate(directions), np.concatenate(slopes))
    surface, off = height_surface(frame, rim, 0.5 * limits.on)
    words = f"the smoothest height over the plane of its edges, which it meets to {off:.2g}"
    patch = _judged(topology, surface, loops, normals, words)
    if patch.residual > limits.on:
        return f"the smoothest height over the plane of its edges misses them by {patch.residual:.3g}"
    return patch


def _judged(
    topology: Topology, surface: Surface, loops: tuple[tuple[EdgeUse, ...], ...], normals: Normals, how: str
) -> RingPatch:
    """The patch with its largest distance from the edges and its mean angle to the surfaces around."""
    worst, angles = 0.0, []
    low, high = np.array(surface.domain).T
    for loop in loops:
        for use in loop:
            curve = topology.curves[use.edge]
            t = divided(_crowded(curve.breaks), 2)
            u, v = np.clip(use.pcurve(t), low, high).T
            worst = max(worst, float(np.linalg.norm(surface(u, v) - curve(t), axis=1).max()))
            beside = normals(use.edge, t)
            if beside is not None:
                normal = np.cross(surface(u, v, (1, 0)), surface(u, v, (0, 1)))
                length = np.linalg.norm(normal, axis=1)
                sound = length > 1e-9 * max(float(length.max()), np.finfo(float).tiny)
                cosine = np.einsum("ij,ij->i", normal[sound], beside[sound]) / length[sound]
                angles.append(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    return RingPatch(surface, loops, worst, float(np.concatenate(angles).mean()) if angles else float("nan"), how)


def _projected(topology: Topology, rings: tuple[Steps, ...], frame: Frame) -> tuple[tuple[EdgeUse, ...], ...]:
    """The rings' edges in the frame's plane: their own curves, projected."""
    loops = []
    for ring in rings:
        row = []
        for edge, reverse in ring:
            curve = topology.curves[edge]
            flat = frame.local(curve.control_points)[:, :2]
            row.append(EdgeUse(edge, reverse, NurbsCurve(curve.degree, curve.knots, flat, curve.weights)))
        loops.append(tuple(row))
    return tuple(loops)


def _box(loops: tuple[tuple[EdgeUse, ...], ...]) -> tuple[Array, Array]:
    points = np.concatenate([use.pcurve.control_points for loop in loops for use in loop])
    return points.min(axis=0), points.max(axis=0)


def _along(topology: Topology, step: tuple[int, bool]) -> Array:
    """(k, 3) points along an edge as the ring runs, without its last."""
    curve = topology.curves[step[0]]
    t = divided(curve.breaks, PROBES)
    return curve(t[::-1] if step[1] else t)[:-1]


def _newell(points: Array) -> Array:
    """The area vector of a ring of points."""
    local = points - points.mean(axis=0)
    return np.asarray(0.5 * np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0))


def _sides(topology: Topology, ring: Steps) -> list[Steps]:
    """The ring cut at its corners; as one side where it has none."""
    count = len(ring)
    ends = [_tangents(topology, step) for step in ring]
    turn = np.array([_angle(ends[k - 1][1], ends[k][0]) for k in range(count)])  # where step k begins
    corners = np.flatnonzero(turn > CORNER).tolist()
    if not corners:
        return [ring]
    return [
        tuple(ring[i % count] for i in range(a, b if b > a else b + count))
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)
    ]


def _crowded(breaks: Array) -> Array:
    """Parameters along an edge, closer together towards its ends, where a corner bends the surface most."""
    t0, t1 = float(breaks[0]), float(breaks[-1])
    even = np.linspace(0.0, np.pi, RIM + 1)
    return np.unique(np.concatenate([t0 + (t1 - t0) * 0.5 * (1.0 - np.cos(even)), breaks]))


def _tangents(topology: Topology, step: tuple[int, bool]) -> tuple[Array, Array]:
    """Directions in which the ring enters and leaves an edge, by chords too short to matter."""
    curve = topology.curves[step[0]]
    t0, t1 = curve.domain
    t = np.array([t0, t0 + 1e-3 * (t1 - t0), t1 - 1e-3 * (t1 - t0), t1])
    points = curve(t[::-1] if step[1] else t)
    return points[1] - points[0], points[3] - points[2]


def _angle(a: Array, b: Array) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


def _side(
    topology: Topology, side: Steps, limits: Limits
) -> tuple[NurbsCurve, list[tuple[tuple[int, bool], float, float]]]:
    """The edges of a side as one curve on [0, 1] and the part of it each edge is, by share of length.

    Rational curves stay what they are where their weights are the same at both ends, as those of arcs are.
    """
    curves, lengths = [], []
    for edge, reverse in side:
        curve = topology.curves[edge].clamped()
        if curve.weights is not None and np.ptp(curve.weights[[0, -1]]) > EVEN * curve.weights[0]:
            curve = fitted(curve, curve, limits.fit)
        elif curve.weights is not None:
            curve = replace(curve, weights=curve.weights / curve.weights[0])
        curves.append(curve.reversed() if reverse else curve)
        t = np.linspace(*curve.domain, 33)
        lengths.append(float(np.linalg.norm(np.diff(curve(t), axis=0), axis=1).sum()))
    bounds = np.concatenate([[0.0], np.cumsum(lengths)]) / sum(lengths)
    bounds[-1] = 1.0
    degree = max(curve.degree for curve in curves)
    pieces = []
    for curve, a, b in zip(curves, bounds[:-1], bounds[1:], strict=True):
        t0, t1 = curve.domain
        piece = curve.elevated(degree - curve.degree) if curve.degree < degree else curve
        knots = np.clip(a + (piece.knots - t0) * ((b - a) / (t1 - t0)), a, b)
        pieces.append(NurbsCurve(degree, knots, piece.control_points, piece.weights))
    return _joined(pieces), [(s, float(a), float(b)) for s, a, b in zip(side, bounds[:-1], bounds[1:], strict=True)]


def _joined(pieces: list[NurbsCurve]) -> NurbsCurve:
    """Clamped curves of one degree, weights 1 at their ends, each starting where the last ends, as one."""
    whole = joined(pieces)
    if not any(piece.rational for piece in pieces):
        return whole
    rows = [np.ones(len(p.control_points)) if p.weights is None else p.weights for p in pieces]
    return replace(whole, weights=np.concatenate([rows[0], *(row[1:] for row in rows[1:])]))


def _between(curve: NurbsCurve, first: Array, last: Array) -> NurbsCurve:
    """The curve with its ends put on given points, which they miss by round-off only."""
    points = curve.control_points.copy()
    points[0], points[-1] = first, last
    return replace(curve, control_points=points)


def _folds(surface: Surface, frame: Frame) -> bool:
    """Whether the surface's normal turns away from the rings' anywhere inside, or vanishes there."""
    (u0, u1), (v0, v1) = surface.domain
    share = (np.arange(GRID) + 0.5) / GRID
    u, v = np.meshgrid(u0 + share * (u1 - u0), v0 + share * (v1 - v0), indexing="ij")
    normal = np.cross(surface(u, v, (1, 0)), surface(u, v, (0, 1))).reshape(-1, 3)
    length = np.linalg.norm(normal, axis=1)
    mean = normal.sum(axis=0)
    return bool((normal @ mean <= 1e-3 * np.linalg.norm(mean) * length).any() or mean @ frame.axes[2] <= 0.0)
