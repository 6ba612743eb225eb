"""A tessellation of CAD faces that answers with the true surfaces its triangles stand for.

A `TrueGround` is asked like a `Tree`. Mending may have welded, turned or cut the tessellation's triangles: each mended
triangle still knows the raw triangle it came from, and a point's (u, v) starts from its barycentric coordinates in that
raw triangle. A point whose surface is not reached keeps its place on the triangle, and its outcome says so.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.surface import Surface
from patchwright.models.tree import ClosestPoints, SegmentHits, Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.ground.true_surface import Bounds, Outcome, feet, on_segments

ACCURACY = 1e-12  # of the diagonal
SLANT = 0.5  # sine of the largest angle (30 degrees) between a facet and the surface it stands for


@dataclass(frozen=True, slots=True, eq=False)
class TrueSurfaces:
    """The surfaces behind a raw tessellation.

    `raw` has uv; `face` (m,) is the number in `surfaces` of each raw triangle; `bounds` one per surface (None for a
    face without triangles).
    """

    surfaces: tuple[Surface, ...]
    bounds: tuple[Bounds | None, ...]
    raw: Triangulation
    face: IntArray

    @classmethod
    def of(cls, assembly: Assembly) -> TrueSurfaces | None:
        """Those of a CAD assembly whose tessellation carries uv, else None."""
        raw = assembly.triangulation
        if not assembly.is_cad or raw.uv is None or raw.tags is None or not len(raw):
            return None
        surfaces = tuple(part.surface for part in assembly.parts if part.surface is not None)
        bounds = []
        for part, surface in zip(assembly.parts, surfaces, strict=True):
            uv = part.triangulation.uv
            bounds.append(Bounds.of(surface, uv.reshape(-1, 2)) if uv is not None and len(uv) else None)
        return cls(surfaces, tuple(bounds), raw, raw.tags)

    def starts(self, triangle: IntArray, points: Array) -> Array:
        """(n, 2) the (u, v) of points on or near raw triangles, by barycentric interpolation (HJR 8)."""
        assert self.raw.uv is not None
        weight = _barycentric(self.raw.corners[triangle], points)
        return np.asarray(np.einsum("ij,ijk->ik", weight, self.raw.uv[triangle]))


@dataclass(frozen=True, slots=True, eq=False)
class TrueGround:
    """A tree over a mended tessellation, with the true surfaces.

    `source` (m,) is the raw triangle of each of the tree's triangles, -1 for invented ones; `accuracy` is a length.
    """

    tree: Tree
    source: IntArray
    true: TrueSurfaces
    accuracy: float

    @classmethod
    def of(cls, tree: Tree, source: IntArray, true: TrueSurfaces) -> TrueGround:
        """The ground with accuracy 1e-12 of the diagonal."""
        return cls(tree, source, true, ACCURACY * true.raw.diagonal)

    @property
    def triangulation(self) -> Triangulation:
        """The tessellation itself."""
        return self.tree.triangulation

    def deflection(self) -> float:
        """How far the facets stray from their surfaces: the largest distance at their sides' middles and centroids.

        For an arc the middle is the farthest place of its chord; elsewhere it may be missed by a part.
        """
        corners = self.tree.triangulation.corners[self.source >= 0]
        middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
        places = np.concatenate([middles.reshape(-1, 3), corners.mean(axis=1)])
        return float(self.closest(places).distance.max(initial=0.0))

    def all_hits(self, start: npt.ArrayLike, end: npt.ArrayLike) -> SegmentHits:
        """Every triangle each segment crosses, as the tree says."""
        return self.tree.all_hits(start, end)

    def closest(self, points: npt.ArrayLike) -> ClosestPoints:
        """The closest points on the true surfaces; `triangle` and `barycentric` are the tessellation's."""
        return self.closest_with_outcome(points)[0]

    def closest_with_outcome(self, points: npt.ArrayLike) -> tuple[ClosestPoints, IntArray]:
        """`closest`, and (n,) how the search of each point ended.

        The surface runs on beyond the face's trimming, so a foot counts only if it lies no farther from the closest
        point h of the tessellation than facets slanted by up to 30 degrees, at their height over the surface, account
        for; otherwise the foot of h is the answer.
        """
        query = np.atleast_2d(np.asarray(points, dtype=np.float64))
        found = self.tree.closest(query)
        place, status = found.points.copy(), np.full(len(query), int(Outcome.NO_SURFACE))
        normal = self.tree.triangulation.normals
        for some, number, uv in self._by_surface(found.triangle, found.points):
            surface, bounds = self.true.surfaces[number], self.true.bounds[number]
            below, target = found.points[some], query[some]
            height = np.einsum("ij,ij->i", surface(uv[:, 0], uv[:, 1]) - below, normal[found.triangle[some]])
            made = feet(surface, uv, target, self.accuracy, bounds)
            drift = np.linalg.norm(made.points - below, axis=1)
            sound = drift <= SLANT * found.distance[some] + np.abs(height) + self.accuracy
            sound &= made.status <= Outcome.LEFT_DOMAIN
            place[some[sound]], status[some[sound]] = made.points[sound], made.status[sound]
            rest = ~sound
            if rest.any():
                again = feet(surface, uv[rest], below[rest], self.accuracy, bounds)
                good = again.status <= Outcome.LEFT_DOMAIN
                place[some[rest][good]] = again.points[good]
                status[some[rest]] = again.status
        return replace(found, points=place, distance=np.linalg.norm(place - query, axis=1)), status

    def normals(self, triangle: IntArray, points: Array) -> Array:
        """(n, 3) unit normals at points near their triangles: of the true surfaces where a foot is found.

        They face as the triangles do; the triangle's own normal stands where there is no surface or no foot.
        """
        from patchwright.models.differential import normals

        out = np.array(self.tree.triangulation.normals[triangle])
        for some, number, uv in self._by_surface(triangle, points):
            surface, bounds = self.true.surfaces[number], self.true.bounds[number]
            made = feet(surface, uv, points[some], self.accuracy, bounds)
            own = normals(surface, made.uv[:, 0], made.uv[:, 1])
            good = (made.status <= Outcome.LEFT_DOMAIN) & np.isfinite(own).all(axis=1)
            turn = np.sign(np.einsum("ij,ij->i", own, out[some]))
            out[some[good]] = (own * turn[:, None])[good]
        return out

    def on_segments(
        self, triangle: IntArray, points: Array, t: Array, a: Array, b: Array
    ) -> tuple[Array, Array, IntArray]:
        """Hits of segments a-b moved along their segments onto the true surfaces (HJR 9).

        Parameters
        ----------
        triangle, points, t : (n,), (n, 3), (n,) the hits on the tessellation
        a, b : (n, 3) the segments' ends

        Returns
        -------
        points (n, 3), t (n,) and (n,) outcomes; a hit whose search did not converge stays where it was.
        """
        place, status = t.copy(), np.full(len(points), int(Outcome.NO_SURFACE))
        corners = self.tree.triangulation.corners[triangle]
        longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1, initial=0.0)
        for some, number, uv in self._by_surface(triangle, points):
            surface, bounds = self.true.surfaces[number], self.true.bounds[number]
            made = on_segments(surface, uv, t[some], a[some], b[some], self.accuracy, bounds)
            strayed = np.linalg.norm(made.points - points[some], axis=1) > longest[some]
            strayed &= made.status == Outcome.CONVERGED
            status[some] = np.where(strayed, int(Outcome.STRAYED), made.status)
            good = status[some] == Outcome.CONVERGED
            place[some[good]] = made.t[good]
        return (1.0 - place[:, None]) * a + place[:, None] * b, place, status

    def _by_surface(self, triangle: IntArray, points: Array) -> Iterator[tuple[IntArray, int, Array]]:
        """For each surface in question: which points lie on its triangles, its number, and their (k, 2) parameters."""
        source = self.source[triangle]
        known = np.flatnonzero(source >= 0)
        face = self.true.face[source[known]]
        order = np.argsort(face, kind="stable")
        for some in np.split(known[order], np.flatnonzero(np.diff(face[order])) + 1):
            if len(some):
                yield some, int(self.true.face[source[some[0]]]), self.true.starts(source[some], points[some])


def _barycentric(corners: Array, points: Array) -> Array:
    """(n, 3) coordinates of the points' feet in the triangles' planes, held inside; thirds where there is no plane."""
    origin = corners[:, 0]
    e, f, d = corners[:, 1] - origin, corners[:, 2] - origin, points - origin
    ee, ef, ff = (np.einsum("ij,ij->i", x, y) for x, y in ((e, e), (e, f), (f, f)))
    de, df = np.einsum("ij,ij->i", d, e), np.einsum("ij,ij->i", d, f)
    det = ee * ff - ef * ef
    flat = det <= np.finfo(np.float64).eps * ee * ff
    safe = np.where(flat, 1.0, det)
    v, w = (ff * de - ef * df) / safe, (ee * df - ef * de) / safe
    weight = np.where(flat[:, None], 1.0 / 3.0, np.clip(np.stack([1.0 - v - w, v, w], axis=1), 0.0, 1.0))
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))
