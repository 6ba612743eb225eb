"""The sides of a ring of edges: cut at its corners, each as one curve that keeps the edges' own shape."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.topology import Topology
from patchwright.repair.cad.draft import Limits
from patchwright.repair.cad.pcurves import fitted, joined

CORNER = 30.0  # degrees a ring turns at a corner of a four-sided patch
EVEN = 1e-12  # of a weight: weights that differ by less are equal

Steps = tuple[tuple[int, bool], ...]  # edges with whether the ring runs along them backwards
Span = tuple[tuple[int, bool], float, float]  # an edge of a side, and its range in the side's parameter
SideCurve = tuple[NurbsCurve, list[Span]]  # a side as one curve on [0, 1], and which part of it each edge is
Normals = Callable[[int, Array], Array | None]  # unit normals (k, 3) beside an edge at its parameters (k,), or None


def sides(topology: Topology, ring: Steps) -> list[Steps]:
    """The ring cut at its corners; as one side where it has none."""
    count = len(ring)
    ends = [ends_of(topology, step) for step in ring]
    turn = np.array([_angle(ends[k - 1][1], ends[k][0]) for k in range(count)])  # where step k begins
    corners = np.flatnonzero(turn > CORNER).tolist()
    if not corners:
        return [ring]
    return [
        tuple(ring[i % count] for i in range(a, b if b > a else b + count))
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)
    ]


def ends_of(topology: Topology, step: tuple[int, bool]) -> tuple[Array, Array]:
    """Directions in which the ring enters and leaves an edge, by chords too short to matter."""
    curve = topology.curves[step[0]]
    t0, t1 = curve.domain
    t = np.array([t0, t0 + 1e-3 * (t1 - t0), t1 - 1e-3 * (t1 - t0), t1])
    points = curve(t[::-1] if step[1] else t)
    return points[1] - points[0], points[3] - points[2]


def _angle(a: Array, b: Array) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


def side_curve(topology: Topology, side: Steps, limits: Limits) -> SideCurve:
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


def between(curve: NurbsCurve, first: Array, last: Array) -> NurbsCurve:
    """The curve with its ends put on given points, which they miss by round-off only."""
    points = curve.control_points.copy()
    points[0], points[-1] = first, last
    return replace(curve, control_points=points)
