"""One bounded surface with itself: the curves along which it passes through itself, with both parameter curves.

Pairs of pieces that touch in the parameters are told apart by the directions of their derivatives (`chart`,
`neighbours`); all others are pairs of two surfaces for subdivision and tracing. Seams and poles are neighbourhoods like
any other and no contacts. Every curve is found once in each order of its two parameter curves, and kept once. Curves
that end inside the surface end at pinch points (`pinch`).

Limits: cusp edges, pinch points on a knot line or of rational surfaces, and lines inside the domain that shrink to a
point are handed back as undecided boxes; curves end where they run into these.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.surface import Surface
from patchwright.ssi.bezier_pieces import Frame
from patchwright.ssi.chart import Chart, local, restricted, spanned
from patchwright.ssi.intersection import Intersection, Unresolved
from patchwright.ssi.neighbours import TOUCH, Pairs, apart_at_pole, apart_on, told_apart, touching
from patchwright.ssi.pair_findings import subdivided
from patchwright.ssi.pinch import ball_of, metric_of, one_curve, pinches, seed_of
from patchwright.ssi.singular_points import Ball, grouped
from patchwright.ssi.surface_surface import assembled

NEAR = 8.0  # sizes of an undecided box within which curves are taken to run into it
LEAST = 1e-4  # of a piece: neighbours are not split below
NEIGHBOURS = 4_000  # pairs of neighbours tested beyond four for each pair of pieces


def intersect_itself(surface: Surface, tolerance: float) -> Intersection:
    """Everything a bounded surface shares with itself beyond seams and poles.

    Parameters
    ----------
    surface : bounded, NURBS or with an exact NURBS form
    tolerance : a length; sheets that come this near without crossing touch

    Raises
    ------
    ParameterError : a tolerance that is not positive.
    """
    if not tolerance > 0.0:
        raise ParameterError(f"the tolerance must be positive, got {tolerance}")
    native = spanned(surface.to_nurbs().clamped())
    frame = Frame.of(native)
    chart = Chart.of(native, frame)
    tol = max(tolerance / frame.size, 2e-14)
    near, far = _pairs(chart, tol)
    slack = TOUCH * np.array([np.ptp(t) for t in chart.breaks])
    metric = metric_of(chart)
    ends: list[Pairs] = []

    def explained(pairs: Pairs) -> BoolArray:
        close = touching(pairs, slack)
        out = np.zeros(len(pairs), dtype=bool)
        out[close] = apart_on(chart, pairs.where(close))
        out[~close] = apart_at_pole(chart, pairs.where(~close))
        doubt = np.flatnonzero(close & ~out)
        if doubt.size:
            curved = one_curve(chart, pairs.where(doubt), metric)
            out[doubt] = curved
            ends.append(pairs.where(doubt[curved]))
        return out

    def stays(pairs: Pairs) -> BoolArray:
        return touching(pairs, slack) | _at_one_pole(chart, pairs)

    apart, stuck = told_apart(near, explained, stays, LEAST, NEIGHBOURS + 4 * len(near))
    findings = subdivided((chart, chart), Pairs.together([far, apart]), tol)
    two = (chart.pieces, chart.pieces)
    points = pinches(chart, Pairs.together(ends), metric) if ends else []
    findings = np.concatenate((findings[0], *(seed_of(x) for x in points))), findings[1]
    pinched = [ball_of(x) for x in points]
    pinched += _barriers(stuck, findings[0], chart)
    found = assembled((surface, surface), (native, native), two, frame, tol, findings, alone=True, pinches=pinched)
    if not len(stuck):
        return found
    return replace(found, unresolved=found.unresolved + _clusters(stuck, chart))


def _barriers(stuck: Pairs, rows: Array, chart: Chart) -> list[Ball]:
    """Balls that end curves at the undecided boxes they run into: those with findings of the box's own size beside."""
    from scipy.spatial import cKDTree

    from patchwright.ssi._subdivision_kernel import TRANSVERSAL

    rows = rows[rows[:, 0] == TRANSVERSAL]
    if not len(stuck) or not rows.size:
        return []
    p, q = (chart.pieces.parameters(rows[:, 1 + k].astype(np.int64), rows[:, 11 + 2 * k : 13 + 2 * k]) for k in (0, 1))
    hull = stuck.hull
    size = (hull[:, 1::2] - hull[:, ::2]).max(axis=0)
    close = (np.abs(p - q) <= NEAR * size).all(axis=1)
    if not close.any():
        return []
    middle = 0.5 * (hull[:, ::2] + hull[:, 1::2])
    far = cKDTree(0.5 * (p + q)[close] / size).query(middle / size, p=np.inf)[0]
    beside = stuck.where(np.asarray(far <= NEAR))
    out = []
    for k, box in zip(beside.kp, beside.hull, strict=True):
        net = restricted(chart.pieces.nets[[k]], *local(chart.cell(np.array([k])), box[None]))[0]
        points = (net[..., :3] / net[..., 3:]).reshape(-1, 3)
        centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        radius = float(np.linalg.norm(points - centre, axis=1).max())
        out.append(Ball(centre, radius, "pinch", 0.0, (), lead=lambda jets, lengths, which: (jets, lengths)))
    return out


def _clusters(stuck: Pairs, chart: Chart) -> tuple[Unresolved, ...]:
    """One box for all pairs of neighbours that hang together."""
    hull = stuck.hull
    middle = np.stack((hull[:, 0] + hull[:, 1], hull[:, 2] + hull[:, 3]), axis=1) * 0.5
    extent = np.maximum(np.max(hull[:, 1::2] - hull[:, ::2], axis=0), 1e-300)
    out = []
    for group in grouped(middle / extent, 1.5):
        part = hull[group]
        box = (
            (float(part[:, 0].min()), float(part[:, 1].max())),
            (float(part[:, 2].min()), float(part[:, 3].max())),
        )
        out.append(Unresolved(box, box, "whether the surface folds onto itself here is not decided"))
    return tuple(out)


def _pairs(chart: Chart, tol: float) -> tuple[Pairs, Pairs]:
    """Pairs of pieces that are neighbours (or one), and all others whose boxes meet."""
    n, m = chart.pieces.shape
    index = np.arange(n * m)
    i, j = np.divmod(index, m)
    near: list[Pairs] = []
    for di, dj in ((0, 0), (0, 1), (1, -1), (1, 0), (1, 1)):
        i2, j2 = i + di, j + dj
        turns = np.stack((np.floor_divide(i2, n), np.floor_divide(j2, m)), axis=1)
        ok = ((turns == 0) | (np.array(chart.period) > 0.0)).all(axis=1)
        near.append(_pieces_paired(chart, index[ok], (i2 % n * m + j2 % m)[ok], turns[ok] * np.array(chart.period)))
    known = np.zeros((n * m, n * m), dtype=bool)
    for pairs in near:
        known[pairs.kp, pairs.kq] = known[pairs.kq, pairs.kp] = True
    for axis, end in chart.rays:
        rim = np.take(index.reshape(n, m), -end, axis=axis).ravel()
        a, b = (rim[x] for x in np.triu_indices(rim.size, 1))
        fresh = ~known[a, b]
        known[a, b] = known[b, a] = True
        near.append(_pieces_paired(chart, a[fresh], b[fresh], np.zeros((int(fresh.sum()), 2))))
    points = chart.pieces.nets[..., :3] / chart.pieces.nets[..., 3:]
    low, high = points.min(axis=(1, 2)) - tol, points.max(axis=(1, 2))
    meet = ~known & (low[:, None] <= high[None] + tol).all(axis=2) & (low[None] <= high[:, None] + tol).all(axis=2)
    a, b = np.nonzero(np.triu(meet, 1))
    return Pairs.together(near), _pieces_paired(chart, a, b, np.zeros((a.size, 2)))


def _pieces_paired(chart: Chart, a: IntArray, b: IntArray, shift: Array) -> Pairs:
    return Pairs(chart.cell(a), chart.cell(b) + np.repeat(shift, 2, axis=1), a, b, shift)


def _at_one_pole(chart: Chart, pairs: Pairs) -> BoolArray:
    out = np.zeros(len(pairs), dtype=bool)
    for axis, end in chart.rays:
        at = chart.breaks[axis][-end]
        out |= (pairs.p[:, 2 * axis + end] == at) & (pairs.q[:, 2 * axis + end] == at)
    return out
