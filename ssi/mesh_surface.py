"""Intersection of a triangulation with a surface: found on a triangulation of the surface, refined onto the surface.

A point in a mesh triangle moves in the triangle's plane, one on a mesh edge along the edge, one on the border of the
surface along the border: Newton's method in (u, v) on the planes it has to lie in, by the shortest step where that
leaves a freedom (HJR section 4, with the mesh's planes for one of the surfaces). Between points runs a cubic with the
exact tangents, in space and in (u, v): it lies in the mesh's plane, and points are added until it is within tolerance
of the surface.

Limits: existence is decided by the surface's triangulation, so what is smaller than its chord tolerance can be missed;
the result says so and is never `complete`. The parameters of a curve that crosses a seam jump there, at a knot of
multiplicity 4; a piece that was made of two across a seam runs on beyond the domain.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import pairwise
from typing import cast

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface
from patchwright.models.tolerance import FIT_SHARE
from patchwright.models.triangulation import Triangulation
from patchwright.ssi.intersection import Contact, CurveKind, Intersection, IntersectionCurve, Unresolved
from patchwright.ssi.mesh_mesh import mesh_intersection
from patchwright.ssi.mesh_topology import KINDS, MeshIntersection
from patchwright.ssi.triangulate import CLOSING, triangulate

STEPS = 30  # of Newton: twice what it takes from a chord error of 1e-2 at a crossing angle of 1e-3
HALVINGS = 12  # of a piece of curve: each one makes a cubic's error 16 times smaller


@dataclass(slots=True)
class _Pieces:
    """Pieces of curves, one per row, in order along each curve; every piece in the plane of one mesh triangle."""

    curve: IntArray
    normal: Array
    start: Array
    end: Array
    uv_start: Array
    uv_end: Array

    def taken(self, index: IntArray) -> _Pieces:
        return _Pieces(*(getattr(self, f.name)[index] for f in fields(self)))


@dataclass(frozen=True, slots=True, eq=False)
class _Unrolled:
    """A surface whose closed parameters run on beyond the domain."""

    surface: Surface
    closed: tuple[bool, bool]

    @classmethod
    def of(cls, surface: Surface, near: float) -> _Unrolled:
        """Closed where opposite sides of the domain are nowhere farther apart than `near`, in space."""
        (u0, u1), (v0, v1) = surface.domain
        u, v = np.linspace(u0, u1, 33), np.linspace(v0, v1, 33)
        seams = [np.asarray(surface(w, v)) for w in (u0, u1)], [np.asarray(surface(u, w)) for w in (v0, v1)]
        closed = [bool(np.linalg.norm(one - two, axis=1).max() <= near) for one, two in seams]
        return cls(surface, (closed[0], closed[1]))

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Infinite where closed."""
        u, v = ((-np.inf, np.inf) if c else d for c, d in zip(self.closed, self.surface.domain, strict=True))
        return u, v

    def period(self, axis: int) -> float:
        """After which a closed parameter comes round, infinite for others."""
        low, high = self.surface.domain[axis]
        return high - low if self.closed[axis] else np.inf

    def __call__(self, u: npt.ArrayLike, v: npt.ArrayLike, nu: tuple[int, int] = (0, 0)) -> Array:
        at = [np.asarray(u, dtype=np.float64), np.asarray(v, dtype=np.float64)]
        for axis in range(2):
            if self.closed[axis]:
                low, high = self.surface.domain[axis]
                # what is within stays to the last bit, both ends included
                out = (at[axis] < low) | (at[axis] > high)
                at[axis] = np.where(out, low + np.mod(at[axis] - low, high - low), at[axis])
        return np.asarray(self.surface(at[0], at[1], nu))

    def to_nurbs(self) -> NurbsSurface:
        """The surface itself as NURBS."""
        return self.surface.to_nurbs()


def intersect_mesh_surface(
    mesh: Triangulation, surface: Surface, tolerance: float | None = None, *, chord: float | None = None
) -> Intersection:
    """Curves and contacts of a mesh (the first) with a surface (the second).

    Parameters
    ----------
    tolerance : the curves are this near the surface, length; default 1e-10 of the surface's size
    chord : tolerance of the surface's triangulation, length; default 1e-4 of the surface's size

    Raises
    ------
    ParameterError : an unbounded surface, a tolerance that is not positive.
    """
    coarse = np.asarray(surface(*_sample(surface, 9))).reshape(-1, 3)
    size = float(np.linalg.norm(np.ptp(coarse, axis=0)))
    tolerance = 1e-10 * size if tolerance is None else tolerance
    chord = FIT_SHARE * size if chord is None else chord
    if not tolerance > 0.0:
        raise ParameterError(f"the tolerance must be a positive length, got {tolerance}")
    facets = triangulate(surface, chord)
    found = mesh_intersection(mesh, facets)
    reason = f"found on a triangulation within {chord:.3g} of the surface: what is smaller than that may be missing"
    doubt = Unresolved(((0.0, float(len(mesh))), (0.0, 0.0)), surface.domain, reason)
    contacts = tuple(Contact(found.points[i], None, None, "touch", 0.0) for i in found.contacts)
    if not len(found.traced):
        return Intersection((), contacts, (), (doubt,))
    unrolled = _Unrolled.of(surface, CLOSING * chord)
    pieces = _refined(mesh, unrolled, facets, found)
    for _ in range(HALVINGS):
        far = _residual(unrolled, pieces, 9) > tolerance
        if not far.any():
            break
        pieces = _halved(unrolled, pieces, far)
    residual = _residual(surface, pieces, 9)  # without what runs on beyond a seam
    curves = []
    borders = np.searchsorted(pieces.curve, np.arange(len(found.traced) + 1))
    for i, (start, stop) in enumerate(pairwise(borders.tolist())):
        if start == stop:
            continue
        own = pieces.taken(np.arange(start, stop))
        space, plane = _splines(unrolled, own)
        points = np.concatenate([own.start, own.end[-1:]])
        kind = cast(CurveKind, KINDS[found.traced.kinds[i]])
        closed = bool(found.traced.closed[i])
        curves.append(IntersectionCurve(space, None, plane, points, kind, closed, float(residual[start:stop].max())))
    return Intersection(tuple(curves), contacts, (), (doubt,))


def _sample(surface: Surface, count: int) -> tuple[Array, Array]:
    """A grid of parameters over the domain."""
    (u0, u1), (v0, v1) = surface.domain
    if not np.isfinite([u0, u1, v0, v1]).all():
        raise ParameterError(f"only a bounded surface can meet a mesh, its domain is {surface.domain}")
    return np.linspace(u0, u1, count)[:, None], np.linspace(v0, v1, count)[None]


def _refined(mesh: Triangulation, surface: Surface, facets: Triangulation, found: MeshIntersection) -> _Pieces:
    """The traced segments with their ends on the surface."""
    traced = found.traced
    number = np.repeat(np.arange(len(traced)), np.diff(traced.offsets))
    row = np.arange(len(traced.chain)) + number
    ends = np.stack([traced.points[row], traced.points[row + 1]], axis=1)
    of_mesh, of_surface = found.triangles[traced.chain].T
    normal = mesh.normals[of_mesh]
    assert facets.uv is not None
    uv = np.stack([_parameters(facets, of_surface, found.points[ends[:, k]]) for k in range(2)], axis=1)
    # the planes a point has to lie in: two through the mesh's edge, or the triangle's
    names = found.names
    count = len(mesh.vertices)
    sides = np.full((len(names), 2), -1)
    for column in (0, 2):
        side = (names[:, column + 1] >= 0) & (names[:, column] < count) & (names[:, column + 1] < count)
        whole = side & ((names[:, 4] < 0) if column == 2 else True)
        sides[whole] = names[whole, column : column + 2]
    inside = sides[:, 0] < 0
    one = np.zeros((len(names), 3))
    two = np.zeros((len(names), 3))
    one[ends.reshape(-1)] = np.repeat(normal, 2, axis=0)
    line = mesh.vertices[sides[~inside, 1]] - mesh.vertices[sides[~inside, 0]]
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    across = np.cross(line, np.eye(3)[np.abs(line).argmin(axis=1)])
    one[~inside] = across / np.linalg.norm(across, axis=1, keepdims=True)
    two[~inside] = np.cross(line, one[~inside])
    free = _free(surface, facets, found, uv, ends)
    flat = ends.reshape(-1)
    moved = _newton(surface, uv.reshape(-1, 2), found.points[flat], one[flat], two[flat], free[flat])
    points = found.points.copy()
    points[flat[::-1]] = np.asarray(surface(moved[::-1, 0], moved[::-1, 1]))
    away = points - found.points
    points -= np.einsum("ij,ij->i", away, one)[:, None] * one + np.einsum("ij,ij->i", away, two)[:, None] * two
    # a point may have slipped past its neighbours on the edges of the triangle: leave it out
    pieces = _Pieces(number, normal, points[ends[:, 0]], points[ends[:, 1]], moved.reshape(-1, 2, 2)[:, 0],
                     moved.reshape(-1, 2, 2)[:, 1])  # fmt: skip
    return _unfolded(surface, pieces, inside[ends], of_mesh)


def _parameters(facets: Triangulation, which: IntArray, points: Array) -> Array:
    """(n, 2) parameters of points on triangles, linear over each."""
    corners, uv = facets.corners[which], cast(Array, facets.uv)[which]
    a, b, c = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(b, c)
    square = np.einsum("ij,ij->i", normal, normal)
    s = np.einsum("ij,ij->i", np.cross(points - a, c), normal) / square
    t = np.einsum("ij,ij->i", np.cross(b, points - a), normal) / square
    return np.asarray(uv[:, 0] + s[:, None] * (uv[:, 1] - uv[:, 0]) + t[:, None] * (uv[:, 2] - uv[:, 0]))


def _free(surface: Surface, facets: Triangulation, found: MeshIntersection, uv: Array, ends: IntArray) -> Array:
    """(n, 2) 1 for parameters that may change: not that of the border an end of a curve lies on."""
    free = np.ones((len(found.points), 2))
    loose = found.use_count == 1
    for axis in range(2):
        low, high = surface.domain[axis]
        if not np.isfinite(high - low):
            continue
        near = 64.0 * np.finfo(np.float64).eps * max(abs(low), abs(high), high - low)
        value = uv[..., axis]
        at = ((np.abs(value - low) <= near) | (np.abs(value - high) <= near)) & loose[ends]
        free[ends[at], axis] = 0.0
    return free


def _newton(surface: Surface, uv: Array, about: Array, one: Array, two: Array, free: Array) -> Array:
    """(n, 2) parameters whose points lie in the planes through `about` normal to `one` and (unless zero) `two`."""
    low, high = np.array(surface.domain).T
    uv = np.clip(uv, low, high)
    single = cast(BoolArray, ~two.any(axis=1))
    best = np.full(len(uv), np.inf)
    result = uv.copy()
    for _ in range(STEPS):
        u, v = uv.T
        away = np.asarray(surface(u, v)) - about
        f = np.stack([np.einsum("ij,ij->i", away, one), np.einsum("ij,ij->i", away, two)], axis=1)
        error = np.abs(f).max(axis=1)
        better = error < best
        result[better], best[better] = uv[better], error[better]
        if not better.any():
            break
        su = np.asarray(surface(u, v, (1, 0))) * free[:, :1]
        sv = np.asarray(surface(u, v, (0, 1))) * free[:, 1:]
        a, b = np.einsum("ij,ij->i", one, su), np.einsum("ij,ij->i", one, sv)
        c, d = np.einsum("ij,ij->i", two, su), np.einsum("ij,ij->i", two, sv)
        # the shortest step in space along the surface: metric E, F, G
        E, F, G = (np.einsum("ij,ij->i", x, y) for x, y in ((su, su), (su, sv), (sv, sv)))
        E, G = np.where(free[:, 0] > 0, E, 1.0), np.where(free[:, 1] > 0, G, 1.0)
        p, q = G * a - F * b, E * b - F * a
        slope = a * p + b * q
        step = np.stack([p, q], axis=1) * np.divide(f[:, 0], slope, out=np.zeros(len(f)), where=slope != 0.0)[:, None]
        det = a * d - b * c
        both = np.stack([d * f[:, 0] - b * f[:, 1], a * f[:, 1] - c * f[:, 0]], axis=1)
        both *= np.divide(1.0, det, out=np.zeros(len(f)), where=det != 0.0)[:, None]
        uv = np.clip(uv - np.where(single[:, None], step, both), low, high)
    return result


def _unfolded(surface: Surface, pieces: _Pieces, inside: BoolArray, triangle: IntArray) -> _Pieces:
    """The pieces without points inside a triangle from which the curve would run back."""
    way = pieces.end - pieces.start
    ahead = np.cross(pieces.normal, _normals(surface, pieces.uv_start))
    following = np.roll(np.arange(len(way)), -1)
    # between two neighbouring pieces of one triangle the direction must not turn by more than a right angle
    joined: BoolArray = inside[:, 1] & (pieces.curve == pieces.curve[following]) & (triangle == triangle[following])
    length = np.linalg.norm(way, axis=1)
    back = joined & (np.einsum("ij,ij->i", way, way[following]) < 0.0)
    joined[-1], back[-1] = False, False
    drop = back & (np.linalg.norm(ahead, axis=1) > 0.0)
    drop |= joined & ((length == 0.0) | (length[following] == 0.0))
    drop[1:] &= ~drop[:-1]
    merged = np.flatnonzero(drop)
    # a seam between the two: the first takes its parameters along
    pieces.uv_start[merged] += pieces.uv_start[merged + 1] - pieces.uv_end[merged]
    pieces.end[merged], pieces.uv_end[merged] = pieces.end[merged + 1], pieces.uv_end[merged + 1]
    keep = np.ones(len(way), dtype=np.bool_)
    keep[merged + 1] = False
    kept = pieces.taken(np.flatnonzero(keep))
    # points at one place, but for round-off, are one
    least = 64.0 * np.finfo(np.float64).eps * float(np.abs(kept.start).max(initial=0.0))
    return kept.taken(np.flatnonzero(np.linalg.norm(kept.end - kept.start, axis=1) > least))


def _normals(surface: Surface, uv: Array) -> Array:
    """(n, 3) unit normals, zero where the surface has none."""
    normal = np.cross(surface(uv[:, 0], uv[:, 1], (1, 0)), surface(uv[:, 0], uv[:, 1], (0, 1)))
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0))


def _bezier(surface: Surface, pieces: _Pieces) -> tuple[Array, Array, Array]:
    """(n, 4, 3) and (n, 4, 2) control points of the cubics with the exact tangents at both ends, and their lengths."""
    way = pieces.end - pieces.start
    length = np.linalg.norm(way, axis=1)
    space = np.stack([pieces.start, pieces.start, pieces.end, pieces.end], axis=1)
    plane = np.stack([pieces.uv_start, pieces.uv_start, pieces.uv_end, pieces.uv_end], axis=1)
    span = length.copy()
    for sweep in range(2):
        for column, sign, uv in ((1, 1.0, pieces.uv_start), (2, -1.0, pieces.uv_end)):
            ahead = np.cross(pieces.normal, _normals(surface, uv))
            size = np.linalg.norm(ahead, axis=1, keepdims=True)
            ahead = np.where(size > 0.0, ahead / np.where(size > 0.0, size, 1.0), way / length[:, None])
            ahead *= np.where(np.einsum("ij,ij->i", ahead, way) < 0.0, -1.0, 1.0)[:, None]
            reach = (sign * span / 3.0)[:, None]
            base = 0 if column == 1 else 3
            space[:, column] = space[:, base] + reach * ahead
            su, sv = np.asarray(surface(uv[:, 0], uv[:, 1], (1, 0))), np.asarray(surface(uv[:, 0], uv[:, 1], (0, 1)))
            E, F, G = (np.einsum("ij,ij->i", x, y) for x, y in ((su, su), (su, sv), (sv, sv)))
            p, q = np.einsum("ij,ij->i", su, ahead), np.einsum("ij,ij->i", sv, ahead)
            det = E * G - F * F
            rate = np.stack([G * p - F * q, E * q - F * p], axis=1)
            rate *= np.divide(1.0, det, out=np.zeros_like(det), where=det > 0.0)[:, None]
            flat = (det <= 0.0)[:, None]
            plane[:, column] = np.where(flat, plane[:, base] + (plane[:, 3 - base] - plane[:, base]) / 3.0,
                                        plane[:, base] + reach * rate)  # fmt: skip
        if sweep == 0:
            # the cubic's own length in place of the chord's: then its speed is nearly one (Simpson on the derivative)
            middle = 0.75 * (space[:, 2] + space[:, 3] - space[:, 0] - space[:, 1])
            span = length / 3.0 + 4.0 * np.linalg.norm(middle, axis=1) / 6.0
    return space, plane, span


def _at(control: Array, t: float) -> Array:
    """The point at t of cubics (n, 4, d)."""
    s = 1.0 - t
    weight = np.array([s**3, 3 * s * s * t, 3 * s * t * t, t**3])
    return np.asarray(np.einsum("k,nkd->nd", weight, control))


def _residual(surface: Surface, pieces: _Pieces, samples: int) -> Array:
    """(n,) largest distance of each cubic in space from the surface's point at its cubic in (u, v)."""
    space, plane, _ = _bezier(surface, pieces)
    worst = np.zeros(len(space))
    for t in np.append(np.arange(samples) + 1.0, 0.0) / (samples + 1.0):
        uv = _at(plane, float(t))
        on = np.asarray(surface(*_inside(surface, uv)))
        worst = np.maximum(worst, np.linalg.norm(_at(space, float(t)) - on, axis=1))
    return worst


def _inside(surface: Surface, uv: Array) -> tuple[Array, Array]:
    """Parameters no farther out than the domain."""
    (u0, u1), (v0, v1) = surface.domain
    return np.clip(uv[:, 0], u0, u1), np.clip(uv[:, 1], v0, v1)


def _halved(surface: Surface, pieces: _Pieces, far: BoolArray) -> _Pieces:
    """The pieces, those that are `far` cut at a new point on the surface."""
    space, plane, _ = _bezier(surface, pieces.taken(np.flatnonzero(far)))
    normal = pieces.normal[far]
    free = np.ones((len(normal), 2))
    middle = np.stack(_inside(surface, _at(plane, 0.5)), axis=1)
    about = _at(space, 0.5)
    uv = _newton(surface, middle, about, normal, np.zeros_like(normal), free)
    points = np.asarray(surface(uv[:, 0], uv[:, 1]))
    points -= np.einsum("ij,ij->i", points - about, normal)[:, None] * normal
    result = pieces.taken(np.repeat(np.arange(len(far)), np.where(far, 2, 1)))
    first = np.flatnonzero(far) + np.arange(len(points))
    result.end[first], result.uv_end[first] = points, uv
    result.start[first + 1], result.uv_start[first + 1] = points, uv
    return result


def _splines(surface: _Unrolled, pieces: _Pieces) -> tuple[NurbsCurve, NurbsCurve]:
    """The pieces as one cubic spline in space and one in (u, v), on about arc length."""
    space, plane, span = _bezier(surface, pieces)
    knots = np.concatenate([[0.0], np.cumsum(span)])
    full = np.concatenate([knots[:1], np.repeat(knots, 3), knots[-1:]])
    jump = np.zeros(len(plane) - 1, dtype=np.bool_)
    for axis in range(2):
        period = surface.period(axis)
        if np.isfinite(period):  # seams: the next piece starts elsewhere in (u, v)
            jump |= np.round((plane[1:, 0, axis] - plane[:-1, 3, axis]) / period) != 0.0
    count = np.concatenate([[4], np.where(jump, 4, 3), [4]])
    stays = np.ones(plane.shape[:2], dtype=np.bool_)
    stays[:-1, 3] = jump
    net = np.concatenate([space[:, :3].reshape(-1, 3), space[-1:, 3]])
    return NurbsCurve(3, full, net), NurbsCurve(3, np.repeat(knots, count), plane[stays])
