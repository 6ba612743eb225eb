"""Projection of patch points onto the dirty triangulation along both patch normals, with the thin-skin rule.

Source: Hamann, Jean, Razdan, section 3 (HJR 5-10). Departure: nearest is not enough on thin bodies, so a hit counts
only if its triangle faces the same way as the patch and lies nearer than 0.4 of the local thickness. On a `TrueGround`
the hit then goes to the parametric surface its triangle came from.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.ground.true_ground import TrueGround
from patchwright.repair.ground.true_surface import Outcome

if TYPE_CHECKING:
    from patchwright.models.tree import ClosestPoints, SegmentHits
    from patchwright.models.triangulation import Triangulation

FACING = 0.2  # cosine: a triangle turned further from the patch normal belongs to another skin or to a step
SKIN_SHARE = 0.4  # of the local thickness: hits farther from the patch may be the other skin


class Ground(Protocol):
    """What patches are projected onto: a `Tree`, or a `TrueGround` that knows the surfaces behind its triangles."""

    @property
    def triangulation(self) -> Triangulation:
        """The triangles, consistently oriented."""
        ...

    def closest(self, points: npt.ArrayLike) -> ClosestPoints:
        """The closest point of the ground to each of `points` (n, 3)."""
        ...

    def all_hits(self, start: npt.ArrayLike, end: npt.ArrayLike) -> SegmentHits:
        """Every triangle each segment crosses."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Projected:
    """What became of each patch point.

    `points` (n, 3) are on the triangulation where `triangle` >= 0 and the patch's own points elsewhere; `t` (n,) is
    the place on the offset segment a-b, p = (1 - t) a + t b (HJR 10), 0.5 for a miss; `barycentric` (n, 3) in the
    triangle that was hit; `outcome` (n,) says which points lie on the true surface behind it (see `Outcome`).
    """

    points: Array
    t: Array
    triangle: IntArray
    barycentric: Array
    outcome: IntArray

    @property
    def hit(self) -> BoolArray:
        """(n,) whether the point found its surface."""
        return self.triangle >= 0


def project(
    points: Array,
    normals: Array,
    distance: Array,
    tree: Ground,
    *,
    region: IntArray | None = None,
    allowed: IntArray | None = None,
    outermost: bool = False,
) -> Projected:
    """Project points along their normals, both ways, onto the tree's triangles.

    Parameters
    ----------
    points, normals : (n, 3), unit normals facing outward
    distance : (n,) half the length of each segment (HJR 6)
    tree : over a consistently oriented triangulation; a `TrueGround` has its hits moved on to the true surfaces
    region, allowed : (m,) label of each triangle and (n,) the label each point may land on; None: any
    outermost : of several admissible hits take the first along the normal from outside, which over crossing sheets
        follows their outer hull, where the nearest jumps from sheet to sheet

    Returns
    -------
    Projected; of several admissible hits the one nearest the point (HJR, section 3).
    """
    a = points + distance[:, None] * normals  # HJR 6
    b = points - distance[:, None] * normals
    hits = tree.all_hits(a, b)
    facing = tree.triangulation.normals
    chosen = _choose(hits.offsets, hits.t, hits.triangle, facing, normals, distance, region, allowed, outermost)
    found = chosen >= 0
    pick = np.where(found, chosen, 0)
    t = np.full(len(points), 0.5)
    triangle = np.full(len(points), -1, dtype=np.int64)
    barycentric = np.zeros((len(points), 3))
    out = points.copy()
    outcome = np.full(len(points), int(Outcome.NO_SURFACE))
    if found.any():
        t[found] = hits.t[pick[found]]
        triangle[found] = hits.triangle[pick[found]]
        barycentric[found] = hits.barycentric[pick[found]]
        out[found] = (1.0 - t[found, None]) * a[found] + t[found, None] * b[found]  # HJR 10
    if found.any() and isinstance(tree, TrueGround):
        out[found], t[found], outcome[found] = tree.on_segments(
            triangle[found], out[found], t[found], a[found], b[found]
        )  # HJR 8-9
    return Projected(out, t, triangle, barycentric, outcome)


def _choose(
    offsets: IntArray,
    t: Array,
    triangle: IntArray,
    facing: Array,
    normals: Array,
    distance: Array,
    region: IntArray | None,
    allowed: IntArray | None,
    outermost: bool,
) -> IntArray:
    """(n,) index of each segment's admissible hit nearest its middle (or its start), -1 for none."""
    count = np.diff(offsets)
    n = len(count)
    best = np.full(n, -1, dtype=np.int64)
    if not len(t):
        return best
    ray = np.repeat(np.arange(n), count)
    away = np.abs(t - 0.5) * 2.0 * distance[ray]
    turn = np.einsum("ij,ij->i", facing[triangle], normals[ray])
    same = turn > FACING
    if region is not None and allowed is not None:
        same &= (region[triangle] == allowed[ray]) | (allowed[ray] < 0)
    order = np.lexsort((t if outermost else away, ~same, ray))  # per ray: admissible hits first, nearest first
    first = order[np.searchsorted(ray[order], np.flatnonzero(count > 0))]
    first = first[same[first]]
    # local thickness: from the hit to the nearest hit that faces the other way
    depth = np.where(turn < -FACING, t, np.nan) * 2.0 * distance[ray]
    thickness = np.full(n, np.inf)
    own_depth = np.full(n, np.nan)
    own_depth[ray[first]] = t[first] * 2.0 * distance[ray[first]]
    gap = np.abs(depth - own_depth[ray])
    opposed = np.isfinite(gap) & (gap > 0.0)
    np.minimum.at(thickness, ray[opposed], gap[opposed])
    best[ray[first]] = np.where(away[first] <= SKIN_SHARE * thickness[ray[first]], first, -1)
    return best
