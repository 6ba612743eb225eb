"""`Truth`: distance to, points of, volume and area of the outer surface of a sample's bodies.

Closed bodies are united first: what lies inside another body is no part of the truth. The union is computed by
manifold3d on tessellations within about `chord` of the surfaces; every triangle of it remembers the surface and (u, v)
it came from, so that points, distances and volume are then moved from the facets onto the surfaces themselves, and the
foot of a distance is improved by one Newton step there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import GeometryError, ParameterError
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples.body import Body
from patchwright.models.triangulation import Triangulation, concatenate

if TYPE_CHECKING:
    from patchwright.models.tree import Tree

CHORD = 2e-5
"""Default normal distance between the true surfaces and the truth's tessellation, as a share of the diagonal."""


class OuterSurface(NamedTuple):
    """A union's surface and where each of its triangles lies on the united triangulations."""

    triangulation: Triangulation
    body: IntArray
    """(m,) which triangulation the triangle is a piece of"""
    source: IntArray
    """(m,) which of its triangles"""


class SurfacePoints(NamedTuple):
    """Points of the outer surface."""

    points: Array
    """(n, 3) on the true surface to round-off"""
    normals: Array
    """(n, 3) outward unit normals"""
    body: IntArray
    """(n,) index of the body each lies on"""


@dataclass(frozen=True, eq=False)
class Truth:
    """The known shape of a sample.

    Parameters
    ----------
    bodies : the sample's bodies
    chord : normal distance between surfaces and tessellation, share of the diagonal
    exact_distance, exact_volume, exact_area : closed forms that replace the tessellation where they are known
    """

    bodies: tuple[Body, ...]
    chord: float = CHORD
    exact_distance: Callable[[Array], Array] | None = None
    exact_volume: float | None = None
    exact_area: float | None = None

    @cached_property
    def fine(self) -> tuple[Triangulation, ...]:
        """Each body's own fine tessellation, uv carried, tagged by surface."""
        rough = [b.tessellate().bounds for b in self.bodies]
        size = np.max([r[1] for r in rough], axis=0) - np.min([r[0] for r in rough], axis=0)
        chord = self.chord * float(np.linalg.norm(size))
        return tuple(b.tessellate(chord=chord) for b in self.bodies)

    @cached_property
    def outer(self) -> OuterSurface:
        """The outer surface of the union, finely tessellated."""
        if len(self.bodies) > 1 and all(b.closed for b in self.bodies):
            return united(self.fine)
        body = np.repeat(np.arange(len(self.fine)), [len(t) for t in self.fine])
        return OuterSurface(concatenate(self.fine), body, np.concatenate([np.arange(len(t)) for t in self.fine]))

    @cached_property
    def _tree(self) -> Tree:
        from patchwright.models.tree import Tree

        return Tree.of(self.outer.triangulation)

    def distance(self, points: npt.ArrayLike) -> Array:
        """(n,) unsigned distance of points (n, 3) to the outer surface.

        Off by less than 1e-6 of the diagonal; by `chord` at most where the foot lies on the intersection of two bodies,
        which happens only for points inside the union.
        """
        where = np.ascontiguousarray(points, dtype=np.float64)
        if where.ndim != 2 or where.shape[1] != 3:
            raise ParameterError(f"points must be (n, 3), got {where.shape}")
        if self.exact_distance is not None:
            return self.exact_distance(where)
        hit = self._tree.closest(where)
        foot, triangle = np.asarray(hit.points), np.asarray(hit.triangle)
        outer = self.outer.triangulation
        on_surface, normal = self._lifted(foot, triangle)
        lift = np.einsum("ij,ij->i", on_surface - foot, normal)
        distance = np.linalg.norm(where - foot - lift[:, None] * normal, axis=1)
        corners = outer.corners[triangle]
        reach = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        free = (_barycentric(foot, corners) * ~self._border[outer.triangles[triangle]]).sum(axis=1) > 1e-9
        for b, s, on, uv in self._places(foot, triangle):
            improved = _newton(self.bodies[b].surfaces[s], uv, where[on], reach[on])
            distance[on] = np.where(free[on] & np.isfinite(improved), improved, distance[on])
        return np.asarray(distance)

    @cached_property
    def _border(self) -> BoolArray:
        """(n,) vertices of the outer surface where two bodies meet."""
        outer, body, _ = self.outer
        low, high = np.full(len(outer.vertices), len(self.bodies)), np.full(len(outer.vertices), -1)
        np.minimum.at(low, outer.triangles, body[:, None])
        np.maximum.at(high, outer.triangles, body[:, None])
        return np.asarray(low < high)

    @property
    def volume(self) -> float:
        """Volume of the union.

        Raises
        ------
        GeometryError : a body is open.
        """
        return self.exact_volume if self.exact_volume is not None else self._volume

    @cached_property
    def _volume(self) -> float:
        if not all(b.closed for b in self.bodies):
            raise GeometryError("an open surface encloses no volume")
        outer = self.outer.triangulation
        centres = outer.corners.mean(axis=1)
        on_surface, _ = self._lifted(centres, np.arange(len(outer)))
        # a quadratic that vanishes at the corners has 3/4 of its value at the centre as its mean
        return outer.volume + 0.75 * float(np.einsum("ij,ij->", on_surface - centres, outer.area_vectors))

    @property
    def area(self) -> float:
        """Area of the outer surface."""
        return self.exact_area if self.exact_area is not None else float(self.outer.triangulation.areas.sum())

    def sample(self, n: int, seed: int = 0) -> SurfacePoints:
        """`n` points spread evenly by area over the outer surface, evaluated on the NURBS surfaces themselves."""
        rng = np.random.default_rng(seed)
        outer, body, _ = self.outer
        running = np.cumsum(outer.areas)
        chosen = np.minimum(np.searchsorted(running, rng.uniform(0.0, running[-1], n)), len(outer) - 1)
        root, other = np.sqrt(rng.random(n)), rng.random(n)
        weight = np.stack([1.0 - root, root * (1.0 - other), root * other], axis=1)
        points, normals = self._lifted(np.einsum("ij,ijk->ik", weight, outer.corners[chosen]), chosen)
        return SurfacePoints(points, normals, body[chosen])

    def _places(self, points: Array, triangle: IntArray) -> Iterator[tuple[int, int, IntArray, Array]]:
        """Per surface: body, face, which points (of outer triangles) lie on it, and their (k, 2) uv."""
        _, body, source = self.outer
        for b, (shape, fine) in enumerate(zip(self.bodies, self.fine, strict=True)):
            assert fine.uv is not None
            assert fine.tags is not None
            mine = np.flatnonzero(body[triangle] == b)
            own = source[triangle[mine]]
            uv = np.einsum("ij,ijk->ik", _barycentric(points[mine], fine.corners[own]), fine.uv[own])
            for s in range(len(shape.surfaces)):
                on = fine.tags[own] == s
                yield b, s, mine[on], uv[on]

    def _lifted(self, points: Array, triangle: IntArray) -> tuple[Array, Array]:
        """Points (n, 3) of outer triangles moved onto the surfaces at their (u, v), and the unit normals there."""
        lifted, normals = points.copy(), self.outer.triangulation.normals[triangle]
        for b, s, on, uv in self._places(points, triangle):
            jet = self.bodies[b].surfaces[s].derivatives(uv[:, 0], uv[:, 1], (1, 1))
            lifted[on] = jet[:, 0, 0]
            normal = np.cross(jet[:, 1, 0], jet[:, 0, 1])
            length = np.linalg.norm(normal, axis=1)
            regular = length > 1e-12 * np.max(length, initial=0.0)  # at a pole the facet's normal has to do
            normals[on[regular]] = normal[regular] / length[regular, None]
        return lifted, normals


def _newton(surface: NurbsSurface, uv: Array, points: Array, reach: Array) -> Array:
    """(n,) distances after one Newton step for the foot from uv; NaN where it moves beyond `reach` or is no better."""
    jet = surface.derivatives(uv[:, 0], uv[:, 1], (2, 2))
    off, du, dv = points - jet[:, 0, 0], jet[:, 1, 0], jet[:, 0, 1]
    g = np.stack([np.einsum("ij,ij->i", off, du), np.einsum("ij,ij->i", off, dv)], axis=1)
    a = np.einsum("ij,ij->i", du, du) - np.einsum("ij,ij->i", off, jet[:, 2, 0])
    b = np.einsum("ij,ij->i", du, dv) - np.einsum("ij,ij->i", off, jet[:, 1, 1])
    c = np.einsum("ij,ij->i", dv, dv) - np.einsum("ij,ij->i", off, jet[:, 0, 2])
    determinant = a * c - b * b
    proper = (a > 0.0) & (determinant > 0.0)  # otherwise the foot is no minimum
    step = np.stack([c * g[:, 0] - b * g[:, 1], a * g[:, 1] - b * g[:, 0]], axis=1)
    step /= np.where(proper, determinant, 1.0)[:, None]
    low, high = np.transpose(surface.domain)
    there = np.where(proper[:, None], np.clip(uv + step, low, high), uv)
    foot = surface(there[:, 0], there[:, 1])
    near = np.linalg.norm(foot - jet[:, 0, 0], axis=1) <= reach
    distance = np.linalg.norm(points - foot, axis=1)
    return np.where(proper & near & (distance <= np.linalg.norm(off, axis=1)), distance, np.nan)


def _barycentric(points: Array, corners: Array) -> Array:
    """(n, 3) barycentric coordinates of the points in the planes of triangles (n, 3, 3), kept inside."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    square = np.einsum("ij,ij->i", normal, normal)
    square = np.where(square > 0.0, square, 1.0)
    at_b = np.einsum("ij,ij->i", np.cross(points - a, c - a), normal) / square
    at_c = np.einsum("ij,ij->i", np.cross(b - a, points - a), normal) / square
    weight = np.maximum(np.stack([1.0 - at_b - at_c, at_b, at_c], axis=1), 0.0)
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def united(bodies: tuple[Triangulation, ...]) -> OuterSurface:
    """The union of closed, outward oriented triangulations by manifold3d (Apache-2.0), pieces traced to their origin.

    Raises
    ------
    GeometryError : a body is not a closed manifold.
    """
    import manifold3d

    first = int(manifold3d.Manifold.reserve_ids(len(bodies)))
    solids = []
    for i, body in enumerate(bodies):
        mesh = manifold3d.Mesh64(
            vert_properties=np.array(body.vertices),
            tri_verts=body.triangles.astype(np.uint64),
            run_index=np.array([0, 3 * len(body)], dtype=np.uint64),
            run_original_id=np.array([first + i], dtype=np.uint32),
            face_id=np.arange(len(body), dtype=np.uint64),
        )
        solid = manifold3d.Manifold(mesh)
        if solid.status() != manifold3d.Error.NoError:
            raise GeometryError(f"body {i} of {len(bodies)} is not a closed manifold: {solid.status()}")
        solids.append(solid)
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add).to_mesh64()
    points, triangles = np.asarray(union.vert_properties)[:, :3], np.asarray(union.tri_verts).astype(np.int64)
    runs = np.asarray(union.run_index).astype(np.int64) // 3
    origin = np.asarray(union.run_original_id).astype(np.int64) - first
    triangulation = Triangulation(points, triangles)
    return OuterSurface(triangulation, np.repeat(origin, np.diff(runs)), np.asarray(union.face_id).astype(np.int64))
