"""Two bounded surfaces meet: every branch, touch and overlap, and boxes where doubt remains.

Method. Both surfaces fall into Bezier pieces in a common scale; dual subdivision (`_subdivision_kernel`) excludes,
explains or hands back every pair of boxes: completeness comes from there alone. Arcs are followed from the points it
found to the borders of the pieces (`_tracing_kernel`) and joined across them; branch points, poles and tangent points
end them. Branches are split at branch points, at poles and where they cross the seam of a closed surface.

Limits. Coincident regions are handed back as unresolved boxes, not yet as overlaps with boundary curves. Crossing
angles below about 1e-5 rad of curved surfaces, and tangent curves into the apex of a cone, can spend the budget or
fail to be followed; both are handed back. Tangency is decided by samples within the tolerance along a valley whose
convexity across is certified.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.surface import Surface
from patchwright.ssi.arcs import Arc, in_analytic_parameters, in_own_parameters, joined, samples, without_repeats
from patchwright.ssi.bezier_pieces import BezierPieces, Frame, widening
from patchwright.ssi.fit import fitted
from patchwright.ssi.intersection import Box, Contact, Intersection, Unresolved
from patchwright.ssi.singular_points import Ball, arc_to_centre, balls_of, ray_seeds
from patchwright.ssi.tangential import TURN, jets_of, steady

if TYPE_CHECKING:
    from patchwright.models.nurbs_surface import NurbsSurface

BUDGET = 300_000  # pairs of boxes judged; 10 to 20 microseconds each
SMALL = 1e-8  # of the size: boxes are not split below
FIT = 1e-11  # of the size: residual asked of a piece of a curve
WORST = 1e-6  # of the size: a curve that is further off is not returned but reported
WILD = 1e6  # sizes: a longer arc is a step that went astray near a singular point
LONGEST = 0.25  # of the size: longest step


def intersect_surfaces(a: Surface, b: Surface, tolerance: float) -> Intersection:
    """Everything two bounded surfaces share.

    Parameters
    ----------
    a, b : bounded surfaces, NURBS or with an exact NURBS form
    tolerance : a length; surfaces that come this near without crossing touch

    Raises
    ------
    ParameterError : a tolerance that is not positive.
    """
    from patchwright.ssi._subdivision_kernel import subdivide

    if not tolerance > 0.0:
        raise ParameterError(f"the tolerance must be positive, got {tolerance}")
    surfaces = (a.to_nurbs(), b.to_nurbs())
    frame = Frame.of(*surfaces)
    pieces = (BezierPieces.of(surfaces[0], frame), BezierPieces.of(surfaces[1], frame))
    tol = max(tolerance / frame.size, 2e-14)
    matrices = [widening(d) for s in surfaces for d in s.degree]
    rational = pieces[0].rational or pieces[1].rational
    rows, counts = subdivide(pieces[0].nets, pieces[1].nets, *matrices, rational, tol, max(SMALL, 4.0 * tol), BUDGET)
    return _Work(a, b, surfaces, pieces, frame, tol, rows, int(counts[3])).result()


class _Work:
    """The stages after subdivision, on its findings."""

    def __init__(
        self,
        a: Surface,
        b: Surface,
        nurbs: tuple[NurbsSurface, NurbsSurface],
        pieces: tuple[BezierPieces, BezierPieces],
        frame: Frame,
        tol: float,
        rows: Array,
        left: int,
    ) -> None:
        self.a, self.b, self.nurbs, self.pieces, self.frame, self.tol = a, b, nurbs, pieces, frame, tol
        self.rows, self.left = rows, left
        self.codes: IntArray = rows[:, 0].astype(np.int64)
        (u, v), (s, t) = a.domain, b.domain
        spans = [hi - lo for lo, hi in (u, v, s, t)]
        self.scale = np.array([frame.size] * 3 + spans)
        self.unresolved: list[Unresolved] = []

    def result(self) -> Intersection:
        from patchwright.ssi._subdivision_kernel import BUDGET as OVER
        from patchwright.ssi._subdivision_kernel import OVERLAP, TANGENT

        balls, plain = balls_of(self.rows, self.tol, self.pieces)
        arcs = self._arcs(balls)
        branches = joined(arcs, self.scale)
        branches += joined(self._tangent_arcs(balls), self.scale)
        self._check_ends(branches)
        curves = []
        for arc in branches:
            if not self._sound(arc):
                self._drop(arc)
                continue
            curve = fitted(arc, self.a, self.b)
            if curve.residual <= max(WORST * self.frame.size, 16.0 * self.tol * self.frame.size):
                curves.append(curve)
            else:
                self._drop(arc)
        contacts = self._contacts(balls, branches)
        for ball in plain:
            if not self._on(ball, branches):
                self._leave(ball.rows, "boxes at the size of the tolerance are neither excluded nor explained")
        for code, why in (
            (OVER, "the work budget is spent"),
            (TANGENT, "the surfaces touch along a curve"),
            (OVERLAP, "the surfaces coincide"),
        ):
            rows = self.rows[self.codes == code]
            if code == TANGENT and rows.size:
                rows = self._unexplained(rows, balls, branches)
            self._leave(rows, why)
        return Intersection(tuple(curves), tuple(contacts), (), tuple(self.unresolved))

    def _sound(self, arc: Arc) -> bool:
        """Whether an arc's numbers are finite and its length one that surfaces of this size can hold."""
        finite = bool(np.isfinite(arc.jets).all() and np.isfinite(arc.lengths).all())
        return finite and float(arc.lengths.sum()) < WILD * self.frame.size

    def _arcs(self, balls: list[Ball]) -> list[Arc]:
        from patchwright.ssi._subdivision_kernel import TRANSVERSAL
        from patchwright.ssi._tracing_kernel import BALL, STUCK, trace

        seeds = self.rows[self.codes == TRANSVERSAL]
        pairs: dict[tuple[int, int], list[Array]] = {}
        order = np.lexsort((seeds[:, 2], seeds[:, 1]))
        seeds = seeds[order]
        cuts = np.flatnonzero(np.any(np.diff(seeds[:, 1:3], axis=0) != 0, axis=1)) + 1
        for group in np.split(seeds, cuts):
            if group.size:
                pairs[int(group[0, 1]), int(group[0, 2])] = [group[:, 11:18]]
        for which, extra in ray_seeds(balls, self.pieces, self.tol):
            pairs.setdefault(which, []).append(extra)
        spheres = np.array([[*ball.centre, ball.radius] for ball in balls]).reshape(-1, 4)
        out: list[Arc] = []
        along: list[bool] = []
        for (i, j), groups in pairs.items():
            nodes, arcs = trace(
                self.pieces[0].nets[i], self.pieces[1].nets[j], np.ascontiguousarray(np.concatenate(groups)), spheres,
                LONGEST, FIT, min(self.tol, 1e-12),
            )  # fmt: skip
            for first, end, behind, ahead, ball0, ball1 in arcs.tolist():
                if end - first < 2:
                    continue
                jets, lengths = nodes[first:end, :21].reshape(-1, 3, 7), nodes[first : end - 1, 21]
                ends = [-1, -1]
                for side, (code, ball) in enumerate(((behind, ball0), (ahead, ball1))):
                    if code == BALL:
                        jets, lengths = arc_to_centre(jets, lengths, side, balls[ball], (i, j))
                        ends[side] = ball
                    elif code == STUCK:
                        at = jets[0 if side == 0 else -1, 0]
                        self._stuck(at, (i, j))
                        ends[side] = len(balls) + 1
                jets, lengths = in_own_parameters(jets, lengths, self.pieces, (i, j), self.frame)
                along.append(self._along_border(nodes[first:end, 3:7], (i, j)))
                jets = self._own(jets, (i, j))
                closed = behind == 1
                out.append(Arc(jets, lengths, (ends[0], ends[1]), "transversal", closed))
        return without_repeats(out, along, self.scale)

    def _tangent_arcs(self, balls: list[Ball]) -> list[Arc]:
        from patchwright.ssi._subdivision_kernel import TANGENT
        from patchwright.ssi._tracing_kernel import BALL, STUCK
        from patchwright.ssi._valley_kernel import trace_valleys

        found = self.rows[self.codes == TANGENT]
        spheres = np.array([[*ball.centre, max(ball.radius, 1e-6)] for ball in balls]).reshape(-1, 4)
        out: list[Arc] = []
        along: list[bool] = []
        for i, j in np.unique(found[:, 1:3].astype(np.int64), axis=0).tolist():
            seeds = found[(found[:, 1] == i) & (found[:, 2] == j)][:, 11:18]
            rows, arcs = trace_valleys(
                self.pieces[0].nets[i], self.pieces[1].nets[j], np.ascontiguousarray(seeds), spheres, 0.1, TURN,
                4.0 * self.tol,
            )  # fmt: skip
            for first, end, behind, ahead, ball0, ball1 in arcs.tolist():
                if end - first < 2:
                    continue
                steady(rows[first:end], self.pieces[0].nets[i], self.pieces[1].nets[j])
                jets, lengths = jets_of(rows[first:end], behind == 1)
                ends = [-1, -1]
                for side, (code, ball) in enumerate(((behind, ball0), (ahead, ball1))):
                    if code == BALL:
                        jets, lengths = arc_to_centre(jets, lengths, side, balls[ball], (i, j))
                        ends[side] = ball
                    elif code == STUCK:
                        self._stuck(jets[0 if side == 0 else -1, 0], (i, j))
                        ends[side] = len(balls) + 1
                jets, lengths = in_own_parameters(jets, lengths, self.pieces, (i, j), self.frame)
                along.append(True)
                out.append(Arc(self._own(jets, (i, j)), lengths, (ends[0], ends[1]), "tangential", behind == 1))
        return without_repeats(out, along, self.scale)

    def _own(self, jets: Array, which: tuple[int, int]) -> Array:
        """Jets in NURBS parameters to those of the surfaces given."""
        half = np.array([0.5, 0.5])
        jets = in_analytic_parameters(jets, 0, self.a, self.pieces[0].parameters(which[0], half))
        return in_analytic_parameters(jets, 1, self.b, self.pieces[1].parameters(which[1], half))

    def _along_border(self, local: Array, which: tuple[int, int]) -> bool:
        """Whether nodes (n, 4) all lie within the tolerance of one border of their pieces."""
        from patchwright.ssi._tracing_kernel import surface_jets

        for side in (0, 1):
            w = np.ascontiguousarray(local[:, 2 * side : 2 * side + 2])
            j = surface_jets(self.pieces[side].nets[which[side]], w)
            speed = np.linalg.norm(j[:, 1:3], axis=2)
            if (np.minimum(w, 1.0 - w) * speed).max(axis=0).min() <= 20.0 * self.tol:
                return True
        return False

    def _box(self, side: int, piece: int, local: Array) -> Box:
        low = self.pieces[side].parameters(piece, local[[0, 2]])
        high = self.pieces[side].parameters(piece, local[[1, 3]])
        return ((float(low[0]), float(high[0])), (float(low[1]), float(high[1])))

    def _leave(self, rows: Array, why: str, most: int = 64) -> None:
        for row in rows[:most]:
            box_a, box_b = self._box(0, int(row[1]), row[3:7]), self._box(1, int(row[2]), row[7:11])
            self.unresolved.append(Unresolved(box_a, box_b, why))
        if rows.shape[0] > most:
            lows = rows[most:]
            row = lows[0].copy()
            self.unresolved.append(Unresolved(self.a.domain, self.b.domain, f"{why}: and {lows.shape[0]} more boxes"))

    def _drop(self, arc: Arc) -> None:
        low, high = arc.jets[:, 0, 3:].min(axis=0), arc.jets[:, 0, 3:].max(axis=0)
        box = list(zip(low.tolist(), high.tolist(), strict=True))
        self.unresolved.append(
            Unresolved((box[0], box[1]), (box[2], box[3]), "a branch could not be fitted within 1e-6 of the size")
        )

    def _stuck(self, at: Array, which: tuple[int, int]) -> None:
        w = at[3:7]
        box = np.stack((w - 1e-6, w + 1e-6), axis=1).clip(0.0, 1.0).ravel()
        self.unresolved.append(
            Unresolved(
                self._box(0, which[0], box[:4]), self._box(1, which[1], box[4:]), "a branch could not be followed on"
            )
        )

    def _check_ends(self, branches: list[Arc]) -> None:
        """A branch may end at a border of a surface, at a singular point or at an unresolved place only."""
        domain = np.array([*self.a.domain, *self.b.domain])
        slack = 1e-6 * (domain[:, 1] - domain[:, 0])
        for arc in branches:
            if arc.closed:
                continue
            for end, ball in ((0, arc.ends[0]), (-1, arc.ends[1])):
                w = arc.jets[end, 0, 3:]
                if ball < 0 and not ((w <= domain[:, 0] + slack) | (w >= domain[:, 1] - slack)).any():
                    low, high = np.maximum(w - slack, domain[:, 0]), np.minimum(w + slack, domain[:, 1])
                    box = list(zip(low.tolist(), high.tolist(), strict=True))
                    self.unresolved.append(
                        Unresolved((box[0], box[1]), (box[2], box[3]), "a branch ends inside both surfaces")
                    )

    def _unexplained(self, rows: Array, balls: list[Ball], branches: list[Arc]) -> Array:
        """The findings of tangency that lie on no branch and at no singular point."""
        keep = np.ones(rows.shape[0], dtype=bool)
        for ball in balls:
            keep &= np.linalg.norm(rows[:, 15:18] - ball.centre, axis=1) > max(ball.radius, 1e-6)
        if branches and keep.any():
            keep[keep] = ~self._near(rows[keep, 15:18], np.full(int(keep.sum()), 1e-6), branches)
        return rows[keep]

    def _near(self, points: Array, reach: Array, branches: list[Arc]) -> BoolArray:
        """Which scaled points lie within a reach of branches."""
        from scipy.spatial import cKDTree

        cloud = np.concatenate([samples(arc) for arc in branches])
        x = self.frame.origin + self.frame.size * points
        _, at = cKDTree(cloud[:, :3]).query(x)
        across = x - cloud[at, :3]
        across -= (across * cloud[at, 3:]).sum(axis=1)[:, None] * cloud[at, 3:]
        return np.asarray(np.linalg.norm(across, axis=1) <= reach * self.frame.size)

    def _on(self, ball: Ball, branches: list[Arc]) -> bool:
        """Whether all boxes of a cluster lie on branches already found, within their own size and the tolerance."""
        if not branches:
            return False
        reach = 4.0 * (ball.rows[:, 18] + 4.0 * self.tol) + 1e-8
        return bool(self._near(ball.rows[:, 15:18], reach, branches).all())

    def _contacts(self, balls: list[Ball], branches: list[Arc]) -> list[Contact]:
        out: list[Contact] = []
        for k, ball in enumerate(balls):
            arcs = sum((arc.ends[0] == k) + (arc.ends[1] == k) for arc in branches)
            if ball.kind == "cluster":
                if arcs == 0 and not ball.pole:
                    if not self._on(ball, branches):
                        self._leave(ball.rows, "boxes at the size of the tolerance are neither excluded nor explained")
                    continue
                if arcs in (1, 2) and ball.pole:
                    continue  # branches run through or into a pole
                if arcs in (1, 2):
                    self._leave(ball.rows, "a singular point that could not be classified", 1)
            x = self.frame.origin + self.frame.size * ball.centre
            (i, j), w = ball.places[0]
            uv_a, uv_b = self.pieces[0].parameters(i, w[:2]), self.pieces[1].parameters(j, w[2:])
            row = np.zeros((1, 3, 7))
            row[0, 0] = [*x, *uv_a, *uv_b]
            row = self._own(row, (i, j))
            uv = [float(t) for t in row[0, 0, 3:]]
            kind = "touch" if ball.kind == "touch" or arcs == 0 else "branch"
            out.append(Contact(x, (uv[0], uv[1]), (uv[2], uv[3]), kind, ball.gap * self.frame.size))  # type: ignore[arg-type]
        return out
