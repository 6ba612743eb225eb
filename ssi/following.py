"""Arcs followed through pairs of pieces from the points that subdivision found, in the surfaces' own parameters."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.surface import Surface
from patchwright.ssi.arcs import Arc, in_analytic_parameters, in_own_parameters, without_repeats
from patchwright.ssi.bezier_pieces import BezierPieces, Frame
from patchwright.ssi.singular_points import Ball, arc_to_centre, ray_seeds
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
    from patchwright.ssi._tracing_kernel import MOST, NODE, trace

    pieces, tol = ground.pieces, ground.tol
    groups: dict[Which, list[Array]] = {}
    for which, part in _by_pair(seeds):
        groups[which] = [part]
    for which, extra in ray_seeds(balls, pieces, tol):
        groups.setdefault(which, []).append(extra)
    spheres = np.array([[*ball.centre, ball.radius] for ball in balls]).reshape(-1, 4)
    found: list[_Local] = []
    stuck: Stuck = []
    room = np.empty((2, MOST, NODE))
    for (i, j), parts in groups.items():
        start = np.ascontiguousarray(np.concatenate(parts))
        nodes, arcs = trace(pieces[0].nets[i], pieces[1].nets[j], start, spheres, LONGEST, FIT, min(tol, 1e-12), room)
        for row in arcs.tolist():
            first, end = row[:2]
            jets, lengths = nodes[first:end, :21].reshape(-1, 3, 7), nodes[first : end - 1, 21]
            if end - first >= 2:
                found.append(_ended(jets, lengths, (i, j), row[2:], balls, nodes[first:end, 3:7], stuck))
    return without_repeats(_own_arcs(found, ground, "transversal"), _along_border(found, ground), ground.scale), stuck


def touching_arcs(seeds: Array, balls: list[Ball], ground: Ground) -> tuple[list[Arc], Stuck]:
    """The arcs along which the surfaces touch, and places where one could not be followed."""
    from patchwright.ssi._valley_kernel import trace_valleys

    pieces = ground.pieces
    spheres = np.array([[*ball.centre, max(ball.radius, NEAREST)] for ball in balls]).reshape(-1, 4)
    found: list[_Local] = []
    stuck: Stuck = []
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
            found.append(_ended(jets, lengths, (i, j), row[2:], balls, rows[first:end, 3:7], stuck))
    return without_repeats(_own_arcs(found, ground, "tangential"), np.ones(len(found), np.bool_), ground.scale), stuck


def _by_pair(seeds: Array) -> Iterator[tuple[Which, Array]]:
    """The points (k, 7) of findings, pair of pieces by pair of pieces."""
    order = np.lexsort((seeds[:, 2], seeds[:, 1]))
    seeds = seeds[order]
    cuts = np.flatnonzero(np.any(np.diff(seeds[:, 1:3], axis=0) != 0, axis=1)) + 1
    for group in np.split(seeds, cuts):
        if group.size:
            yield (int(group[0, 1]), int(group[0, 2])), group[:, 11:18]


def _ended(
    jets: Array, lengths: Array, which: Which, how: list[int], balls: list[Ball], nodes: Array, stuck: Stuck
) -> _Local:
    """The arc with its ends led to the singular points they run into."""
    from patchwright.ssi._tracing_kernel import BALL, CLOSED, STUCK

    behind, ahead, ball0, ball1 = how
    ends = [-1, -1]
    for side, (code, ball) in enumerate(((behind, ball0), (ahead, ball1))):
        if code == BALL:
            jets, lengths = arc_to_centre(jets, lengths, side, balls[ball], which)
            ends[side] = ball
        elif code == STUCK:
            stuck.append((jets[0 if side == 0 else -1, 0], which))
            ends[side] = len(balls) + 1
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
