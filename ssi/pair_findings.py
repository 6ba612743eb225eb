"""The findings of subdivision for listed pairs of boxes on the pieces of two surfaces."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.ssi.bezier_pieces import widening
from patchwright.ssi.chart import Chart, restricted
from patchwright.ssi.neighbours import Pairs

SMALL = 1e-8  # of the size: boxes are not split below
BUDGET = 300_000  # pairs of boxes judged; 10 to 20 microseconds each
MOST = 2000  # boxes at the least size: where sheets meet in a singular point there is no end of them


def subdivided(charts: tuple[Chart, Chart], pairs: Pairs, tol: float) -> tuple[Array, int]:
    """Findings (k, ROW) of the subdivision of pairs of boxes, on their pieces, and the number of pairs left over."""
    from patchwright.ssi._subdivision_kernel import ROW, SINGULAR, subdivide

    sides = []
    for chart, box, k, shift in (
        (charts[0], pairs.p, pairs.kp, np.zeros_like(pairs.shift)),
        (charts[1], pairs.q, pairs.kq, pairs.shift),
    ):
        cell = chart.cell(k) + np.repeat(shift, 2, axis=1)
        low, width = cell[:, ::2], cell[:, 1::2] - cell[:, ::2]
        start, end = np.clip((box[:, ::2] - low) / width, 0.0, 1.0), np.clip((box[:, 1::2] - low) / width, 0.0, 1.0)
        nets = restricted(chart.pieces.nets[k], start, end)
        points = nets[..., :3] / nets[..., 3:]
        sides.append((nets, start, end - start, points.min(axis=(1, 2)), points.max(axis=(1, 2))))
    a, b = sides
    meet = np.flatnonzero((a[3] <= b[4] + tol).all(axis=1) & (b[3] <= a[4] + tol).all(axis=1))
    matrices = [widening(d - 1) for side in sides for d in side[0].shape[1:3]]
    rational = charts[0].pieces.rational or charts[1].pieces.rational
    out, spent, left, singular = [np.empty((0, ROW))], 0, 0, 0
    large = np.round(np.log2(np.prod(a[2][meet], axis=1)))  # large boxes first: what is small may use up the budget
    order = meet[np.lexsort((*pairs.p[meet].T, pairs.kp[meet], -large))]
    same = (np.diff(pairs.kp[order]) == 0) & (np.diff(pairs.p[order], axis=0) == 0.0).all(axis=1)
    for group in np.split(order, np.flatnonzero(~same) + 1):
        if not group.size:
            continue
        rows, counts = subdivide(
            np.ascontiguousarray(a[0][group[:1]]), np.ascontiguousarray(b[0][group]), *matrices, rational, tol,
            max(SMALL, 4.0 * tol), max(BUDGET - spent, 0),
        )  # fmt: skip
        spent, left = spent + int(counts[0]), left + int(counts[3])
        singular += int((rows[:, 0] == SINGULAR).sum())
        if singular > MOST:
            spent = BUDGET
        which = group[rows[:, 2].astype(np.int64)]
        for side, k, column, corner in ((a, pairs.kp, 1, (3, 11)), (b, pairs.kq, 2, (7, 13))):
            rows[:, column] = k[which]
            start, width = side[1][which], side[2][which]
            first, place = corner
            for axis in (0, 1):
                for c in (first + 2 * axis, first + 2 * axis + 1, place + axis):
                    rows[:, c] = start[:, axis] + width[:, axis] * rows[:, c]
        out.append(rows)
    return np.concatenate(out), left
