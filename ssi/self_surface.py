"""One bounded surface with itself: the curves along which it passes through itself, with both parameter curves.

Pairs of pieces that touch in the parameters are told apart by the directions of their derivatives (`chart`,
`neighbours`); all others are pairs of two surfaces for subdivision and tracing. Seams and poles are neighbourhoods like
any other and no contacts. Every curve is found once in each order of its two parameter curves, and kept once.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface
from patchwright.ssi.bezier_pieces import Frame
from patchwright.ssi.chart import Chart
from patchwright.ssi.intersection import Intersection, Unresolved
from patchwright.ssi.neighbours import TOUCH, Pairs, apart_at_pole, apart_on, told_apart, touching
from patchwright.ssi.pair_findings import subdivided
from patchwright.ssi.singular_points import grouped
from patchwright.ssi.surface_surface import assembled

SPANS = 4  # at least so many in a closed direction: then pieces touch in one way only
LEAST = 1e-4  # of a piece: neighbours are not split below
NEIGHBOURS = 10_000  # pairs of neighbours tested beyond four for each pair of pieces


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
    native = _spanned(surface.to_nurbs().clamped())
    frame = Frame.of(native)
    chart = Chart.of(native, frame)
    tol = max(tolerance / frame.size, 2e-14)
    near, far = _pairs(chart, tol)
    slack = TOUCH * np.array([np.ptp(t) for t in chart.breaks])

    def explained(pairs: Pairs) -> BoolArray:
        close = touching(pairs, slack)
        out = np.zeros(len(pairs), dtype=bool)
        out[close] = apart_on(chart, pairs.where(close))
        out[~close] = apart_at_pole(chart, pairs.where(~close))
        return out

    def stays(pairs: Pairs) -> BoolArray:
        return touching(pairs, slack) | _at_one_pole(chart, pairs)

    apart, stuck = told_apart(near, explained, stays, LEAST, NEIGHBOURS + 4 * len(near))
    findings = subdivided((chart, chart), Pairs.together([far, apart]), tol)
    two = (chart.pieces, chart.pieces)
    found = assembled((surface, surface), (native, native), two, frame, tol, findings, alone=True)
    if not len(stuck):
        return found
    return replace(found, unresolved=found.unresolved + _clusters(stuck, chart))


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


def _spanned(surface: NurbsSurface) -> NurbsSurface:
    """The surface with at least four spans in every direction."""
    more: list[Array] = []
    for breaks in surface.breaks:
        parts = -(-SPANS // (breaks.size - 1))
        inner = np.linspace(breaks[:-1], breaks[1:], parts + 1)[1:-1]
        more.append(np.sort(inner.ravel()))
    return surface.insert_knots(*more)


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
