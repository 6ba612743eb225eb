"""Two surfaces of which parts coincide: the overlaps, and everything else they share.

Pairs of boxes that touch in the common parameters are told apart as those of one surface are: a straight way in u and
one in v lead from a point of the first to one of the second, over a cell where both are one. What no longer touches is
subdivided and traced as for any two surfaces.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.ssi.bezier_pieces import Frame
from patchwright.ssi.chart import Chart, independent, local, parallel_free, restricted
from patchwright.ssi.coincidence import Change, Coincidence, coincidences, shared_points
from patchwright.ssi.intersection import Contact, Intersection, IntersectionCurve, Unresolved
from patchwright.ssi.neighbours import TOUCH, Pairs, apart_on, tangents, told_apart, touching
from patchwright.ssi.overlap import overlaps
from patchwright.ssi.pair_findings import subdivided

LEAST = 1e-3  # of a cell: neighbours are not split below
NEIGHBOURS = 10_000  # pairs of neighbours tested beyond four for each pair of pieces


class Together:
    """The charts of two surfaces over the parameters they share, and which of their pieces are one."""

    def __init__(self, found: Coincidence, frame: Frame) -> None:
        self.found = found
        self.slack = TOUCH * np.array([np.ptp(t) for t in found.a.breaks])
        self.charts = (Chart.of(found.a, frame), Chart.of(found.b, frame))
        shapes = [np.array(c.pieces.shape) for c in self.charts]
        # the span of the other surface at each span of one, -1 where it has none
        self.across: list[list[IntArray]] = []
        for side in (0, 1):
            rows = []
            for axis in (0, 1):
                at: IntArray = np.full(shapes[side][axis], -1)
                n = found.matched.shape[axis]
                start, other = found.first[side][axis], found.first[1 - side][axis]
                at[start : start + n] = np.arange(other, other + n)
                rows.append(at)
            self.across.append(rows)
        (i, j), (n, m) = found.first[0], found.matched.shape
        self.one = np.zeros(tuple(shapes[0]), dtype=bool)  # of a's pieces
        self.one[i : i + n, j : j + m] = found.matched

    def _spans(self, side: int, k: IntArray) -> tuple[IntArray, IntArray]:
        """Rows and columns of pieces."""
        i, j = np.divmod(k, self.charts[side].pieces.shape[1])
        return i, j

    def _shared(self, i: IntArray, j: IntArray) -> BoolArray:
        """Whether a's piece in a row and a column (-1: none) is one of b too."""
        return np.asarray((i >= 0) & (j >= 0) & self.one[i, j])

    def _piece(self, side: int, i: IntArray, j: IntArray) -> IntArray:
        """The number of a piece."""
        return np.asarray(i * self.charts[side].pieces.shape[1] + j)

    def beside(self, pairs: Pairs) -> BoolArray:
        """(n,) which pairs touch each other in the chart, and both the region in which the surfaces are one."""
        out = touching(pairs, self.slack)
        for side, box, k in ((0, pairs.p, pairs.kp), (1, pairs.q, pairs.kq)):
            i, j = self._spans(side, k)
            cell = self.charts[side].cell(k)
            n, m = self.charts[side].pieces.shape
            near = np.zeros(len(pairs), dtype=bool)
            for di in (-1, 0, 1):
                for dj in (-1, 0, 1):
                    at = (i + di >= 0) & (i + di < n) & (j + dj >= 0) & (j + dj < m)
                    for d, axis in ((di, 0), (dj, 1)):
                        column = 2 * axis + (1 if d > 0 else 0)
                        at &= (d == 0) | (np.abs(box[:, column] - cell[:, column]) <= self.slack[axis])
                    r, c = np.clip(i + di, 0, n - 1), np.clip(j + dj, 0, m - 1)
                    if side == 1:
                        r, c = self.across[1][0][r], self.across[1][1][c]
                    near |= at & self._shared(r, c)
            out &= near
        return out

    def explained(self, pairs: Pairs) -> BoolArray:
        """(n,) which pairs of boxes share only what lies at the same parameters."""
        (i, j), (k, m) = self._spans(0, pairs.kp), self._spans(1, pairs.kq)
        k_a, m_a = self.across[1][0][k], self.across[1][1][m]  # b's spans among a's
        i_b, j_b = self.across[0][0][i], self.across[0][1][j]
        out = np.zeros(len(pairs), dtype=bool)
        ways = (
            self._shared(k_a, m_a),
            self._shared(i, j),
            self._shared(k_a, j),
            self._shared(i, m_a),
            (i_b >= 0) & (j_b >= 0),
            (k_a >= 0) & (m_a >= 0),
        )
        for way, rows in enumerate(ways):
            at = np.flatnonzero(rows & ~out)
            if not at.size:
                continue
            p = pairs.where(at)
            if way == 0:
                done = apart_on(self.charts[0], replace(p, kq=self._piece(0, k_a[at], m_a[at])))
            elif way == 1:
                done = apart_on(self.charts[1], replace(p, kp=self._piece(1, i_b[at], j_b[at])))
            elif way == 2:  # along u on a to b's column, then along v on b
                a_corner, b_corner = self._piece(0, k_a[at], j[at]), self._piece(1, k[at], j_b[at])
                done = self._round(p, (p.kp, a_corner), (b_corner, p.kq), 0)
            elif way == 3:  # along v on a, then along u on b
                a_corner, b_corner = self._piece(0, i[at], m_a[at]), self._piece(1, i_b[at], m[at])
                done = self._round(p, (p.kp, a_corner), (b_corner, p.kq), 1)
            elif way == 4:  # from a to b at the same parameters, then on b
                other = replace(p, kp=self._piece(1, i_b[at], j_b[at]))
                done = self._parting(p.p, p.kp, self.charts[1], other)
            else:  # on a, then from a to b at the same parameters
                other = replace(p, kq=self._piece(0, k_a[at], m_a[at]))
                done = self._parting(p.q, other.kq, self.charts[0], other)
            out[at] = done
        return out

    def _parting(self, box: Array, k: IntArray, chart: Chart, pairs: Pairs) -> BoolArray:
        """Pairs told apart by the direction in which a and b part, over boxes in a's pieces k of the common rectangle,
        and the derivatives of one of them over the pairs' hulls."""
        i, j = self._spans(0, k)
        nets = self.found.apart[i - self.found.first[0][0], j - self.found.first[0][1]]
        away = restricted(nets, *local(self.charts[0].cell(k), box)).reshape(len(pairs), -1, 3)
        return independent(([away], *tangents(chart, pairs)))

    def _round(
        self, p: Pairs, on_a: tuple[IntArray, IntArray], on_b: tuple[IntArray, IntArray], axis: int
    ) -> BoolArray:
        """Pairs joined by a way along an axis on a and one along the other axis on b."""
        hull = p.hull
        box_a, box_b = hull.copy(), hull.copy()
        across = 1 - axis
        box_a[:, 2 * across : 2 * across + 2] = p.p[:, 2 * across : 2 * across + 2]
        box_b[:, 2 * axis : 2 * axis + 2] = p.q[:, 2 * axis : 2 * axis + 2]
        none = np.zeros((len(p), 2))
        first = [self.charts[0].directions(axis, k, box_a, none) for k in on_a]
        second = [self.charts[1].directions(across, k, box_b, none) for k in on_b]
        return parallel_free(first, second) if axis == 0 else parallel_free(second, first)


def intersect_coincident(
    a: NurbsSurface, b: NurbsSurface, hits: Array, frame: Frame, tol: float
) -> Intersection | None:
    """Everything two surfaces share that coincide in part; None when no part of them is found to.

    Parameters
    ----------
    hits : (k, 4) parameters u v s t of points both share, from elsewhere
    frame, tol : the scale, and the tolerance in it
    """
    from patchwright.ssi.surface_surface import assembled

    found = coincidences(a, b, np.concatenate((hits, shared_points(a, b, frame, tol))), frame, tol)
    if not found:
        return None
    one = found[0]
    both = Together(one, frame)
    counts = [int(np.prod(c.pieces.shape)) for c in both.charts]
    kp, kq = (x.ravel() for x in np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"))
    pairs = Pairs(both.charts[0].cell(kp), both.charts[1].cell(kq), kp, kq, np.zeros((kp.size, 2)))
    near = both.beside(pairs)
    far, stuck = told_apart(
        pairs.where(near), both.explained, both.beside, LEAST, NEIGHBOURS + 4 * int(near.sum()), alone=False
    )
    rest = Pairs.together([pairs.where(~near), far])
    pieces = (both.charts[0].pieces, both.charts[1].pieces)
    findings = subdivided(both.charts, rest, tol)
    out = _own(assembled((one.a, one.b), (one.a, one.b), pieces, frame, tol, findings), one.change, b)
    doubt = tuple(_boxes(stuck, one.change, b, a))
    return replace(out, overlaps=overlaps(a, b, found, frame.size), unresolved=out.unresolved + doubt)


def _boxes(stuck: Pairs, change: Change, b: NurbsSurface, a: NurbsSurface) -> list[Unresolved]:
    out = []
    for p, q in zip(stuck.p[:64], stuck.q[:64], strict=True):
        out.append(
            Unresolved(((p[0], p[1]), (p[2], p[3])), _box(change, q), "beside an overlap the surfaces stay near")
        )
    if len(stuck) > 64:
        out.append(Unresolved(a.domain, b.domain, f"and {len(stuck) - 64} more boxes beside an overlap"))
    return out


def _box(change: Change, box: Array) -> tuple[tuple[float, float], tuple[float, float]]:
    corners = change.back(np.array([box[::2], box[1::2]]))
    low, high = corners.min(axis=0), corners.max(axis=0)
    return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))


def _own(found: Intersection, change: Change, b: NurbsSurface) -> Intersection:
    """The result in b's own parameters."""
    low, high = np.array(b.domain).T

    def curve(c: IntersectionCurve) -> IntersectionCurve:
        assert c.uv_b is not None
        uv = np.clip(change.back(c.uv_b.control_points), low, high)
        return replace(c, uv_b=NurbsCurve(c.uv_b.degree, c.uv_b.knots, uv, c.uv_b.weights))

    def point(p: Contact) -> Contact:
        s, t = change.back(np.array(p.uv_b)).tolist()
        return replace(p, uv_b=(s, t))

    return Intersection(
        tuple(curve(c) for c in found.curves),
        tuple(point(p) for p in found.points),
        found.overlaps,
        tuple(replace(u, box_b=_box(change, np.array(u.box_b).ravel())) for u in found.unresolved),
    )
