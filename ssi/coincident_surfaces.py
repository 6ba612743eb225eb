"""Two surfaces of which parts coincide: the overlaps, and everything else they share.

Pairs of boxes that touch in the common parameters are told apart as those of one surface are: a straight way in u and
one in v lead from a point of the first to one of the second, over a cell where both are one. What no longer touches is
subdivided and traced as for any two surfaces.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.ssi.bezier_pieces import Frame
from patchwright.ssi.chart import Chart, independent, local, parallel_free, restricted, spanned
from patchwright.ssi.coincidence import (
    Change,
    Coincidence,
    coincidences,
    lines_inside,
    matched,
    shared_points,
)
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
        for side, box, k in ((0, pairs.p, pairs.kp), (1, pairs.q - np.repeat(pairs.shift, 2, axis=1), pairs.kq)):
            i, j = self._spans(side, k)
            cell = self.charts[side].cell(k)
            n, m = self.charts[side].pieces.shape
            round_u, round_v = (t > 0.0 for t in self.charts[side].period)
            near = np.zeros(len(pairs), dtype=bool)
            for di in (-1, 0, 1):
                for dj in (-1, 0, 1):
                    at = ((i + di >= 0) & (i + di < n)) | round_u
                    at &= ((j + dj >= 0) & (j + dj < m)) | round_v
                    for d, axis in ((di, 0), (dj, 1)):
                        column = 2 * axis + (1 if d > 0 else 0)
                        at &= (d == 0) | (np.abs(box[:, column] - cell[:, column]) <= self.slack[axis])
                    r, c = (i + di) % n, (j + dj) % m
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
        straight = ~pairs.shift.any(axis=1)
        closed = [((pairs.shift == 0.0) | (np.array(c.period) > 0.0)).all(axis=1) for c in self.charts]
        for way, rows in enumerate(ways):  # across a seam only on a surface that is closed there
            at = np.flatnonzero(rows & ~out & (closed[way] if way < 2 else straight))
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

    found = coincidences(spanned(a), spanned(b), np.concatenate((hits, shared_points(a, b, frame, tol))), frame, tol)
    if not found:
        return None
    one, *more = found = _on_common_lines(found, frame, tol)
    both = Together(one, frame)
    rest, stuck = _pairs(both, tol), []
    for other in found:
        here = both if other is one else Together(other, frame)
        rest, left = _told_apart(rest, here, np.asarray(other.change.offset - one.change.offset), alone=not more)
        stuck.append(left)
    pieces = (both.charts[0].pieces, both.charts[1].pieces)
    findings = subdivided(both.charts, rest, tol)
    out = _own(assembled((one.a, one.b), (one.a, one.b), pieces, frame, tol, findings), one.change, b)
    doubt = tuple(_boxes(Pairs.together(stuck), one.change, b, a))
    return replace(out, overlaps=overlaps(a, b, found, frame.size), unresolved=out.unresolved + doubt)


def _on_common_lines(found: list[Coincidence], frame: Frame, tol: float) -> list[Coincidence]:
    """Correspondences that differ by a shift, as across a seam, with the same cells; the first alone if there are none.

    A closed surface has one correspondence before its seam and one behind.
    """
    one = found[0]
    kin = [
        x
        for x in found
        if x.change.swap == one.change.swap and np.abs(x.change.scale / one.change.scale - 1.0).max() <= 1e-9
    ]
    if len(kin) == 1:
        return kin
    a, b = one.a, one.b
    for other in kin[1:]:
        shift = one.change.offset - other.change.offset
        a = a.insert_knots(*(lines_inside(other.a.breaks[k], a.breaks[k]) for k in (0, 1)))
        b = b.insert_knots(*(lines_inside(other.b.breaks[k] + shift[k], b.breaks[k]) for k in (0, 1)))
    out = []
    for x in kin:  # b is in the first one's parameters now
        shift = x.change.offset - one.change.offset
        again = matched(a, b, Change(False, np.ones(2), shift), frame, tol)
        if again is not None:
            out.append(replace(again, change=x.change))
    same = all(
        len(p) == len(q)
        for x in out
        for side in ("a", "b")
        for p, q in zip(getattr(x, side).breaks, getattr(out[0], side).breaks, strict=True)
    )
    return out if len(out) == len(kin) and same else [one]


def _pairs(both: Together, tol: float) -> Pairs:
    """All pairs of pieces whose boxes meet."""
    boxes = []
    for chart in both.charts:
        points = chart.pieces.nets[..., :3] / chart.pieces.nets[..., 3:]
        boxes.append((points.min(axis=(1, 2)), points.max(axis=(1, 2)) + tol))
    (low_a, high_a), (low_b, high_b) = boxes
    kp, kq = np.nonzero((low_a[:, None] <= high_b).all(axis=2) & (low_b <= high_a[:, None]).all(axis=2))
    return Pairs(both.charts[0].cell(kp), both.charts[1].cell(kq), kp, kq, np.zeros((kp.size, 2)))


def _told_apart(pairs: Pairs, both: Together, offset: Array, *, alone: bool) -> tuple[Pairs, Pairs]:
    """(ordinary, stuck): pairs without those explained beside the region in which the surfaces are one.

    Parameters
    ----------
    offset : of this correspondence's parameters of b from the pairs'
    alone : whether it is the only one, which then goes round closed surfaces
    """
    turns = [{0.0, *(s * c.period[axis] for c in both.charts for s in (-1.0, 1.0) if alone)} for axis in (0, 1)]
    left = np.ones(len(pairs), dtype=bool)
    near = []
    for shift in itertools.product(*turns):
        moved = replace(pairs, q=pairs.q + np.repeat(offset + shift, 2), shift=pairs.shift + np.array(shift))
        at = np.flatnonzero(touching(moved, both.slack))
        at = at[both.beside(moved.where(at))]
        near.append(moved.where(at))
        left[at] = False
    beside = Pairs.together(near)
    far, stuck = told_apart(beside, both.explained, both.beside, LEAST, NEIGHBOURS + 4 * len(beside), alone=False)
    back = np.repeat(offset, 2)
    far, stuck = (replace(x, q=x.q - back) for x in (far, stuck))
    return Pairs.together([pairs.where(left), far]), stuck


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
