"""Arcs followed through pairs of pieces from the points that subdivision found, in the surfaces' own parameters."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.surface import Surface
from patchwright.ssi.arcs import (
    APART,
    STOPPED,
    Arc,
    hermite,
    in_analytic_parameters,
    in_own_parameters,
    joined,
    without_repeats,
)
from patchwright.ssi.bezier_pieces import BezierPieces, Frame
from patchwright.ssi.singular_points import Ball, arc_to_centre, places_of, ray_seeds
from patchwright.ssi.tangential import TURN, jets_of, steady

if TYPE_CHECKING:
    from patchwright.ssi.intersection import CurveKind

FIT = 1e-11  # of the size: residual asked of a piece of a curve
LONGEST = 0.25  # of the size: longest step
LONGEST_VALLEY = 0.1
NEAREST = 1e-6  # of the size: where a ball round a singular point ends a valley at the latest

Which = tuple[int, int]
Stuck = list[tuple[Array, Which]]


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """The two surfaces, their pieces and the scale everything is in."""

    a: Surface
    b: Surface
    pieces: tuple[BezierPieces, BezierPieces]
    frame: Frame
    tol: float

    @property
    def scale(self) -> Array:
        """(7,) the size and the parameter ranges."""
        (u, v), (s, t) = self.a.domain, self.b.domain
        return np.array([self.frame.size] * 3 + [hi - lo for lo, hi in (u, v, s, t)])

    def own(self, jets: Array, which: IntArray) -> Array:
        """Jets (n, 3, 7) in NURBS parameters on pairs of pieces (n, 2) as those of the surfaces given."""
        half = np.array([0.5, 0.5])
        jets = in_analytic_parameters(jets, 0, self.a, self.pieces[0].parameters(which[:, 0], half))
        return in_analytic_parameters(jets, 1, self.b, self.pieces[1].parameters(which[:, 1], half))


@dataclass(frozen=True, slots=True, eq=False)
class _Local:
    """An arc on one pair of pieces: jets (n, 3, 7) and lengths (n - 1,) in their scale and parameters.

    `nodes` (m, 4) are the parameters at which it is tested whether it runs along a border of its pieces.
    """

    jets: Array
    lengths: Array
    which: Which
    ends: tuple[int, int]
    closed: bool
    nodes: Array


def crossing_arcs(seeds: Array, balls: list[Ball], ground: Ground) -> tuple[list[Arc], Stuck]:
    """The arcs along which the surfaces cross, through findings (k, ROW), and places where one could not go on."""
    from patchwright.ssi._tracing_kernel import trace

    pieces, tol = ground.pieces, ground.tol
    parts = [*_by_pair(seeds), *ray_seeds(balls, pieces, tol)]
    if not parts:
        return [], []
    pairs: IntArray = np.repeat([which for which, _ in parts], [len(points) for _, points in parts], axis=0)
    points = np.concatenate([points for _, points in parts])
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    which, firsts = np.unique(pairs[order], axis=0, return_index=True)
    firsts = np.append(firsts, len(points))
    spheres = np.array([[*ball.centre, ball.radius] for ball in balls]).reshape(-1, 4)
    nodes, arcs = trace(
        pieces[0].nets, pieces[1].nets, which, firsts, points[order], spheres, LONGEST, FIT, min(tol, 1e-12)
    )
    found: list[_Local] = []
    stuck: Stuck = []
    for first, end, *how, g in arcs.tolist():
        if end - first >= 2:
            jets, lengths = nodes[first:end, :21].reshape(-1, 3, 7), nodes[first : end - 1, 21]
            pair = (int(which[g, 0]), int(which[g, 1]))
            found.append(_ended(jets, lengths, pair, how, balls, nodes[first:end, 3:7], stuck, []))
    arcs = without_repeats(_own_arcs(found, ground, "transversal"), _along_border(found, ground), ground.scale)
    return arcs, [place for place in stuck if not _passed(place[0], arcs, ground)]


def touching_arcs(seeds: Array, balls: list[Ball], ground: Ground) -> tuple[list[Arc], Stuck]:
    """The branches along which the surfaces touch, and places where one could not be followed.

    Where the surfaces part again at both ends, so that they are within the tolerance only near one point, that is an
    isolated contact of higher order: it is put on `balls`.
    """
    from patchwright.ssi._valley_kernel import trace_valleys

    pieces = ground.pieces
    spheres = np.array([[*ball.centre, max(ball.radius, NEAREST)] for ball in balls]).reshape(-1, 4)
    found: list[_Local] = []
    stuck: Stuck = []
    parted: Stuck = []
    for (i, j), part in _by_pair(seeds):
        start = np.ascontiguousarray(part)
        rows, arcs = trace_valleys(
            pieces[0].nets[i], pieces[1].nets[j], start, spheres, LONGEST_VALLEY, TURN, 4.0 * ground.tol
        )
        for row in arcs.tolist():
            first, end = row[:2]
            if end - first < 2:
                continue
            steady(rows[first:end], pieces[0].nets[i], pieces[1].nets[j])
            jets, lengths = jets_of(rows[first:end], row[2] == 1)
            found.append(_ended(jets, lengths, (i, j), row[2:], balls, rows[first:end, 3:7], stuck, parted))
    local = without_repeats(_own_arcs(found, ground, "tangential"), np.ones(len(found), np.bool_), ground.scale)
    branches: list[Arc] = []
    for arc in joined(local, ground.scale):
        if arc.ends == (APART, APART):
            balls.append(_summit(arc, seeds, ground))
        else:
            branches.append(arc)
    if any(APART in arc.ends for arc in branches):
        stuck += parted
    return branches, stuck


def _summit(arc: Arc, seeds: Array, ground: Ground) -> Ball:
    """The contact on a short branch at whose ends the surfaces part: where they come nearest, by a quartic through the
    distances at its nodes."""
    w, size = arc.jets[:, 0, 3:], ground.frame.size
    gaps = np.linalg.norm(ground.a(w[:, 0], w[:, 1]) - ground.b(w[:, 2], w[:, 3]), axis=1)
    s = np.concatenate(([0.0], np.cumsum(arc.lengths)))
    t = 2.0 * s / s[-1] - 1.0
    quartic = np.polynomial.Polynomial.fit(t, gaps, min(4, np.unique(t).size - 1), domain=[-1.0, 1.0])
    fine = np.linspace(-1.0, 1.0, 2001)
    best = 0.5 * s[-1] * (1.0 + float(fine[np.argmin(quartic(fine))]))
    k = min(int(np.searchsorted(s, best, side="right")) - 1, len(arc.lengths) - 1)
    x = hermite(arc.jets[k], arc.jets[k + 1], arc.lengths[k], (best - s[k]) / max(arc.lengths[k], 1e-300))[:3]
    centre = (x - ground.frame.origin) / size
    radius = 0.6 * float(s[-1]) / size + NEAREST
    near = seeds[np.linalg.norm(seeds[:, 15:18] - centre, axis=1) <= 2.0 * radius]
    places = places_of(centre, near, ground.pieces, 1e-7 + 8.0 * ground.tol)
    return Ball(centre, radius, "touch", float(gaps.min()) / size, places)


def _by_pair(seeds: Array) -> Iterator[tuple[Which, Array]]:
    """The points (k, 7) of findings, pair of pieces by pair of pieces."""
    order = np.lexsort((seeds[:, 2], seeds[:, 1]))
    seeds = seeds[order]
    cuts = np.flatnonzero(np.any(np.diff(seeds[:, 1:3], axis=0) != 0, axis=1)) + 1
    for group in np.split(seeds, cuts):
        if group.size:
            yield (int(group[0, 1]), int(group[0, 2])), group[:, 11:18]


def _ended(
    jets: Array, lengths: Array, which: Which, how: list[int], balls: list[Ball], nodes: Array, stuck: Stuck,
    parted: Stuck,
) -> _Local:  # fmt: skip
    """The arc with its ends led to the singular points they run into; places where it stops go to the lists."""
    from patchwright.ssi._tracing_kernel import BALL, CLOSED, PARTED, STUCK

    behind, ahead, ball0, ball1 = how
    ends = [-1, -1]
    for side, (code, ball) in enumerate(((behind, ball0), (ahead, ball1))):
        if code == BALL:
            jets, lengths = arc_to_centre(jets, lengths, side, balls[ball], which)
            ends[side] = ball
        elif code in (STUCK, PARTED):
            (stuck if code == STUCK else parted).append((jets[0 if side == 0 else -1, 0], which))
            ends[side] = STOPPED if code == STUCK else APART
    return _Local(jets, lengths, which, (ends[0], ends[1]), behind == CLOSED, nodes)


def _own_arcs(found: list[_Local], ground: Ground, kind: CurveKind) -> list[Arc]:
    """All arcs at once in model units and the surfaces' own parameters."""
    if not found:
        return []
    which = np.repeat([x.which for x in found], [len(x.jets) for x in found], axis=0)
    jets = in_own_parameters(np.concatenate([x.jets for x in found]), ground.pieces, which, ground.frame)
    jets = ground.own(jets, which)
    parts = np.split(jets, np.cumsum([len(x.jets) for x in found])[:-1])
    size = ground.frame.size
    return [Arc(own, x.lengths * size, x.ends, kind, x.closed) for own, x in zip(parts, found, strict=True)]


def _passed(at: Array, arcs: list[Arc], ground: Ground) -> bool:
    """Whether an arc runs through a place (7,) in pieces' scale at which another could not go on: along the border of
    two pieces, within the tolerance of both, one of the two is enough."""
    size = ground.frame.size
    x = ground.frame.origin + size * at[:3]
    for arc in arcs:
        nodes, L = arc.jets[:, 0, :3], arc.lengths
        ahead = ((x - nodes[:-1]) * arc.jets[:-1, 1, :3]).sum(axis=1)
        for k in np.flatnonzero((ahead >= 0.0) & (ahead <= L) & (np.linalg.norm(nodes[:-1] - x, axis=1) <= 1.1 * L)):
            t = ahead[k] / L[k]
            for _ in range(6):
                gap = x - hermite(arc.jets[k], arc.jets[k + 1], L[k], t)[:3]
                t = min(max(t + gap @ arc.jets[k, 1, :3] / L[k], 0.0), 1.0)
            inner = min(np.linalg.norm(x - nodes[0]), np.linalg.norm(x - nodes[-1])) > 1e-6 * size
            if inner and np.linalg.norm(gap) <= 1e-8 * size:
                return True
    return False


def _along_border(found: list[_Local], ground: Ground) -> BoolArray:
    """(k,) whether all nodes of an arc lie within the tolerance of one border of their pieces."""
    from patchwright.ssi._tracing_kernel import speeds

    if not found:
        return np.zeros(0, dtype=np.bool_)
    count = [len(x.nodes) for x in found]
    first = np.concatenate(([0], np.cumsum(count)[:-1]))
    which = np.repeat([x.which for x in found], count, axis=0)
    nodes = np.concatenate([x.nodes for x in found])
    out = np.zeros(len(found), dtype=np.bool_)
    for side in (0, 1):
        w = np.ascontiguousarray(nodes[:, 2 * side : 2 * side + 2])
        far = np.minimum(w, 1.0 - w) * speeds(ground.pieces[side].nets, np.ascontiguousarray(which[:, side]), w)
        out |= np.maximum.reduceat(far, first).min(axis=1) <= 20.0 * ground.tol
    return out
