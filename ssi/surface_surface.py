"""Two bounded surfaces meet: every branch, touch and overlap, and boxes where doubt remains.

Method. Both surfaces fall into Bezier pieces in a common scale; dual subdivision (`_subdivision_kernel`) excludes,
explains or hands back every pair of boxes: completeness comes from there alone. Arcs are followed from the points it
found to the borders of the pieces (`_tracing_kernel`) and joined across them; branch points, poles and points where the
surfaces agree to second order (`osculation`) end them. Every node is refined by the paper's auxiliary planes (HJR
section 4; `_jet_kernel.slice_newton`). Branches are split at branch points, at poles and where they cross the seam of a
closed surface.

Surfaces that coincide in part go another way (`coincident_surfaces`).

Limits. Coincident regions whose parameters do not correspond affinely are handed back as unresolved boxes. Crossing
angles of curved surfaces far below 6e-7 rad, and tangent curves into the apex of a cone, can spend the budget or fail
to be followed; both are handed back. Tangency is decided by samples within the tolerance along a valley whose
convexity across is certified.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.surface import Surface
from patchwright.ssi.arcs import Arc, joined, samples
from patchwright.ssi.bezier_pieces import BezierPieces, Frame, widening
from patchwright.ssi.fit import fitted
from patchwright.ssi.following import Ground, crossing_arcs, touching_arcs
from patchwright.ssi.intersection import Box, Contact, Intersection, Unresolved
from patchwright.ssi.pair_findings import BUDGET, SMALL
from patchwright.ssi.singular_points import Ball, balls_of
from patchwright.ssi.two_orders import both_ways, completed, one_of_each, swapped

if TYPE_CHECKING:
    from patchwright.models.nurbs_surface import NurbsSurface

FIRST = 20_000  # pairs of boxes judged before it is asked whether the surfaces coincide
WORST = 1e-6  # of the size: a curve that is further off is not returned but reported
WILD = 1e6  # sizes: a longer arc is a step that went astray near a singular point


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
    from patchwright.ssi._subdivision_kernel import OVERLAP, subdivide
    from patchwright.ssi.coincident_surfaces import intersect_coincident

    if not tolerance > 0.0:
        raise ParameterError(f"the tolerance must be positive, got {tolerance}")
    surfaces = (a.to_nurbs(), b.to_nurbs())
    frame = Frame.of(*surfaces)
    pieces = (BezierPieces.of(surfaces[0], frame), BezierPieces.of(surfaces[1], frame))
    tol = max(tolerance / frame.size, 2e-14)
    matrices = [widening(d) for s in surfaces for d in s.degree]
    rational = pieces[0].rational or pieces[1].rational
    nets, small = (pieces[0].nets, pieces[1].nets), max(SMALL, 4.0 * tol)
    rows, counts = subdivide(*nets, *matrices, rational, tol, small, FIRST)
    left = int(counts[3])
    if (left or (rows[:, 0] == OVERLAP).any()) and surfaces == (a, b):
        coincident = intersect_coincident(*surfaces, _shared(rows, pieces), frame, tol)
        if coincident is not None:
            return coincident
    if left:
        rows, counts = subdivide(*nets, *matrices, rational, tol, small, BUDGET)
    return _Work(a, b, surfaces, pieces, frame, tol, rows, int(counts[3])).result()


def _shared(rows: Array, pieces: tuple[BezierPieces, BezierPieces]) -> Array:
    """(k, 4) parameters of the points at which subdivision found the surfaces to coincide."""
    from patchwright.ssi._subdivision_kernel import OVERLAP

    found = rows[rows[:, 0] == OVERLAP]
    sides = [pieces[s].parameters(found[:, 1 + s].astype(np.int64), found[:, 11 + 2 * s : 13 + 2 * s]) for s in (0, 1)]
    return np.concatenate(sides, axis=1)


def assembled(
    surfaces: tuple[Surface, Surface],
    nurbs: tuple[NurbsSurface, NurbsSurface],
    pieces: tuple[BezierPieces, BezierPieces],
    frame: Frame,
    tol: float,
    findings: tuple[Array, int],
    *,
    alone: bool = False,
    pinches: Sequence[Ball] = (),
) -> Intersection:
    """Curves and contacts from the findings (k, ROW) of subdivision on pieces, and the number of pairs left over.

    `alone`: both surfaces are one; a finding then stands for both orders of its two places, and curves may end at
    the `pinches` inside it.
    """
    return _Work(*surfaces, nurbs, pieces, frame, tol, *findings, alone=alone, pinches=pinches).result()


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
        *,
        alone: bool = False,
        pinches: Sequence[Ball] = (),
    ) -> None:
        self.a, self.b, self.nurbs, self.pieces, self.frame, self.tol = a, b, nurbs, pieces, frame, tol
        self.rows, self.left, self.alone, self.pinches = rows, left, alone, list(pinches)
        self.codes: IntArray = rows[:, 0].astype(np.int64)
        self.ground = Ground(a, b, pieces, frame, tol)
        self.unresolved: list[Unresolved] = []

    def result(self) -> Intersection:
        from patchwright.ssi._subdivision_kernel import BUDGET as OVER
        from patchwright.ssi._subdivision_kernel import OVERLAP, TANGENT, TRANSVERSAL

        balls, plain = balls_of(self.rows, self.tol, self.pieces)
        if self.alone:
            balls = [both_ways(ball) for ball in balls] + self.pinches
        branches: list[Arc] = []
        for code, follow in ((TRANSVERSAL, crossing_arcs), (TANGENT, touching_arcs)):
            seeds = self.rows[self.codes == code]
            arcs, stuck = follow(np.concatenate((seeds, swapped(seeds))) if self.alone else seeds, balls, self.ground)
            found = joined(completed(arcs, self.ground.scale) if self.alone else arcs, self.ground.scale)
            branches += one_of_each(found, self.ground.scale) if self.alone else found
            for at, which in stuck:
                self._stuck(at, which)
        self._check_ends(branches)
        sound = [arc for arc in branches if self._sound(arc)]
        limit = max(WORST * self.frame.size, 16.0 * self.tol * self.frame.size)
        pairs = list(zip(sound, fitted(sound, self.a, self.b), strict=True))
        curves = [curve for _, curve in pairs if curve.residual <= limit]
        for arc in branches:
            if not self._sound(arc):
                self._drop(arc)
        for arc, curve in pairs:
            if not curve.residual <= limit:
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
            if ball.kind == "pinch":
                continue
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
            row = self.ground.own(row, np.array([[i, j]]))
            uv = [float(t) for t in row[0, 0, 3:]]
            kind = "touch" if ball.kind == "touch" or arcs == 0 else "branch"
            out.append(Contact(x, (uv[0], uv[1]), (uv[2], uv[3]), kind, ball.gap * self.frame.size))  # type: ignore[arg-type]
        return out
