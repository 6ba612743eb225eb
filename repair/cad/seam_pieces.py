"""Free edges cut where other faces' corners lie on them, and which pieces of two faces are one seam.

Corners nearer than a reach are one node; a node beside another face's edge divides that edge there (a T-junction).
Pieces of two faces that run between the same nodes, nearer than the reach all along, are one seam. A node where nothing
happens but one face's edge being divided is taken out again, so that one long edge against several short ones gives one
seam, led by the long edge.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad.connectivity import is_point
from patchwright.models.closest_point import closest_on_curve
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.repair.cad.draft import Draft, Limits

SAMPLES = 17  # per piece where its distance from another is measured
SLENDER = 0.1  # of a piece's length: pieces farther apart are no seam ...
STOUT = 0.5  # ... or, of a face that came loose as a whole, so that it has to go somewhere, farther apart than this


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """The part of a face's free edge between two parameters, and the nodes there."""

    face: int
    edge: int
    t0: float
    t1: float
    start: int
    end: int


@dataclass(frozen=True, slots=True, eq=False)
class Seam:
    """One piece of one face and the pieces of another that lie along it.

    `others` run in the order of `lead`; `against` says that they run the other way, `gap` is the largest distance.
    """

    lead: Piece
    others: tuple[Piece, ...]
    against: bool
    gap: float

    @property
    def faces(self) -> tuple[int, int]:
        """The two faces."""
        return self.lead.face, self.others[0].face

    def turned(self) -> Seam:
        """The same seam led by the other piece, where that is only one."""
        (other,) = self.others
        return Seam(other, (self.lead,), self.against, self.gap)


@dataclass(frozen=True, slots=True, eq=False)
class Cut:
    """All free edges in pieces.

    Parameters
    ----------
    pieces : per edge, its pieces in order
    node : the node of each corner of a free edge
    members : per node, its corners
    divides : per node, the edges it divides
    """

    pieces: dict[int, tuple[Piece, ...]]
    node: dict[int, int]
    members: dict[int, tuple[int, ...]]
    divides: dict[int, tuple[int, ...]]


def cut(draft: Draft, reach: float) -> Cut:
    """Free edges divided at the nodes that corners within `reach` make."""
    topology, owner = draft.topology, draft.owners()
    free = sorted(e for e in owner if not is_point(topology.curves[e]))
    node = _nodes(draft, free, reach)
    members: dict[int, list[int]] = {}
    for vertex, number in node.items():
        members.setdefault(number, []).append(vertex)
    faces: dict[int, set[int]] = {}
    for edge in free:
        for vertex in topology.ends[edge].tolist():
            faces.setdefault(node[vertex], set()).add(owner[edge])
    corners = np.array(sorted(node), dtype=np.int64)
    points = topology.vertices[corners]
    pieces: dict[int, tuple[Piece, ...]] = {}
    divides: dict[int, list[int]] = {}
    for edge in free:
        curve, face = topology.curves[edge], owner[edge]
        start, end = (node[v] for v in topology.ends[edge].tolist())
        places: dict[int, tuple[float, float]] = {}
        low, high = curve.control_points.min(axis=0) - reach, curve.control_points.max(axis=0) + reach
        inside = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
        inside = np.array([i for i in inside if face not in faces[node[int(corners[i])]]], dtype=np.int64)
        if len(inside):
            found = closest_on_curve(curve, points[inside])
            tips = curve(np.array(curve.domain))
            clear = np.linalg.norm(found.points[:, None] - tips[None], axis=2).min(axis=1) > 2.0 * reach
            for i in np.flatnonzero((found.distance <= reach) & clear):
                number = node[int(corners[inside[i]])]
                if number not in (start, end) and found.distance[i] < places.get(number, (np.inf, 0.0))[0]:
                    places[number] = float(found.distance[i]), float(found.t[i])
        stops = sorted((t, number) for number, (_, t) in places.items())
        for _, number in stops:
            divides.setdefault(number, []).append(edge)
        ts = [curve.domain[0], *(t for t, _ in stops), curve.domain[1]]
        at = [start, *(number for _, number in stops), end]
        pieces[edge] = tuple(
            Piece(face, edge, a, b, m, n) for (a, b), (m, n) in zip(pairwise(ts), pairwise(at), strict=True)
        )
    return Cut(
        pieces,
        node,
        {n: tuple(some) for n, some in members.items()},
        {n: tuple(some) for n, some in divides.items()},
    )


def _nodes(draft: Draft, free: list[int], reach: float) -> dict[int, int]:
    """The node of each corner; nearest corners join first, and never both ends of one edge."""
    from scipy.spatial import cKDTree

    topology = draft.topology
    corners = np.unique(topology.ends[free]) if free else np.zeros(0, dtype=np.int64)
    group = {int(v): {int(v)} for v in corners}
    apart: dict[int, set[int]] = {}
    for a, b in topology.ends[free].tolist():
        if a != b:
            apart.setdefault(a, set()).add(b)
            apart.setdefault(b, set()).add(a)
    if len(corners):
        points = topology.vertices[corners]
        pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
        size = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
        for i, j in pairs[np.argsort(size, kind="stable")]:
            a, b = group[int(corners[i])], group[int(corners[j])]
            if a is b or any(apart.get(v, set()) & b for v in a):
                continue
            a |= b
            for vertex in b:
                group[vertex] = a
    return {vertex: min(some) for vertex, some in group.items()}


def seams(draft: Draft, whole: Cut, reach: float, limits: Limits, loose: Collection[int] = ()) -> list[Seam]:
    """The seams the pieces make; `loose` are faces that came loose as a whole."""
    curves = draft.topology.curves
    by_nodes: dict[tuple[int, int], list[Piece]] = {}
    for some in whole.pieces.values():
        for piece in some:
            by_nodes.setdefault((min(piece.start, piece.end), max(piece.start, piece.end)), []).append(piece)
    best: dict[Piece, tuple[float, Piece]] = {}
    for candidates in by_nodes.values():
        for a, b in combinations(candidates, 2):
            if a.face == b.face:
                continue
            gap, length = _gap(curves[a.edge], a, curves[b.edge], b, limits)
            most = STOUT if a.face in loose or b.face in loose else SLENDER
            if gap > min(reach, most * length):
                continue
            for one, other in ((a, b), (b, a)):
                if one not in best or gap < best[one][0]:
                    best[one] = gap, other
    partner = {piece: other for piece, (_, other) in best.items() if best[other][1] is piece}
    used: set[Piece] = set()
    out = []
    for edge in sorted(whole.pieces, key=lambda e: (-len(whole.pieces[e]), e)):
        runs: list[list[Piece]] = []
        for piece in whole.pieces[edge]:
            if piece not in partner or piece in used:
                continue
            if runs and runs[-1][-1].t1 == piece.t0 and _plain(draft, whole, edge, runs[-1][-1], piece, partner):
                runs[-1].append(piece)
            else:
                runs.append([piece])
            used |= {piece, partner[piece]}
        out += [_seam(curves, run, partner, best) for run in runs]
    return out


def _plain(draft: Draft, whole: Cut, edge: int, last: Piece, piece: Piece, partner: dict[Piece, Piece]) -> bool:
    """Whether the node between two pieces of an edge only divides it against one other face."""
    one, other, number = partner[last], partner[piece], last.end
    if one.face != other.face or whole.divides.get(number) != (edge,):
        return False
    corners = whole.members[number]
    here = np.flatnonzero(np.isin(draft.topology.ends, corners).any(axis=1) & (draft.topology.use_counts() > 0))
    return set(here.tolist()) == {one.edge, other.edge}


def _seam(
    curves: tuple[NurbsCurve, ...],
    run: list[Piece],
    partner: dict[Piece, Piece],
    best: dict[Piece, tuple[float, Piece]],
) -> Seam:
    first, last = run[0], run[-1]
    lead = Piece(first.face, first.edge, first.t0, last.t1, first.start, last.end)
    others = tuple(partner[p] for p in run)
    other = others[0]
    if first.start != first.end:
        against = other.start != first.start
    else:  # both are rings
        share = np.array([0.25, 0.75])
        a = curves[first.edge](first.t0 + share * (first.t1 - first.t0))
        b = curves[other.edge](other.t0 + share * (other.t1 - other.t0))
        against = bool(np.linalg.norm(a - b, axis=1).sum() > np.linalg.norm(a - b[::-1], axis=1).sum())
    return Seam(lead, others, against, max(best[p][0] for p in run))


def _gap(a: NurbsCurve, first: Piece, b: NurbsCurve, second: Piece, limits: Limits) -> tuple[float, float]:
    """The largest distance of two pieces, each from the other, and the length of the shorter."""
    ranges = (first.t0, first.t1, second.t0, second.t1)
    return limits.remembered("gap", (a, b), ranges, lambda: _measured(a, first, b, second))


def _measured(a: NurbsCurve, first: Piece, b: NurbsCurve, second: Piece) -> tuple[float, float]:
    widest, shortest = 0.0, np.inf
    for curve, piece, other, range_ in ((a, first, b, second), (b, second, a, first)):
        points = curve(np.linspace(piece.t0, piece.t1, SAMPLES))
        shortest = min(shortest, float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()))
        widest = max(widest, float(_distance(points, other, range_).max()))
    return widest, shortest


def _distance(points: Array, curve: NurbsCurve, piece: Piece) -> Array:
    t = np.clip(closest_on_curve(curve, points).t, piece.t0, piece.t1)
    return np.asarray(np.linalg.norm(curve(t) - points, axis=1))
