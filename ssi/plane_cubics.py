"""Curves that follow a surface in the planes of a mesh's triangles, as cubics in space and in (u, v).

Newton's method in (u, v), by the shortest step along the surface, brings a point into a plane (HJR section 4, with the
mesh's planes for one of the surfaces). Between points runs a cubic with the exact tangents, in space and in (u, v): it
lies in the triangle's plane, and points are added until it is within tolerance of the surface.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.models.triangulation import Triangulation
from patchwright.ssi.intersection import CurveKind, IntersectionCurve
from patchwright.ssi.mesh_surface_arcs import Chains
from patchwright.ssi.triangle_planes import from_triangles

STEPS = 30  # of Newton: twice what it takes from a chord error of 1e-2 at a crossing angle of 1e-3
HALVINGS = 12  # of a piece of curve: each one makes a cubic's error 16 times smaller
JUMP = 1e-6  # of the parameters' range: farther apart than this, the parameters of neighbouring pieces jump
ROUND_OFF = 1e-14  # of the coordinates: no curve is asked to be nearer to the surface
FLAT = 1e-6  # sine of the crossing angle below which a curve is one of touch
INWARD = 1e-6  # of a piece: where the surface's normal is taken when there is none at its end
ONE_SIDE = 1e-12  # of the parameters' range: derivatives are taken this far inside a piece, for kinks lie at its ends


@dataclass(slots=True)
class _Pieces:
    """Pieces of curves, one per row, in order along each curve; every piece in the plane of one mesh triangle."""

    curve: IntArray
    triangle: IntArray
    normal: Array
    start: Array
    end: Array
    uv_start: Array
    uv_end: Array

    def taken(self, index: IntArray) -> _Pieces:
        return _Pieces(*(getattr(self, f.name)[index] for f in fields(self)))


def on_surface(
    mesh: Triangulation, surface: Surface, chains: Chains, tolerance: float
) -> tuple[IntersectionCurve, ...]:
    """One curve per chain of arcs, within `tolerance` (a length) of the surface at nine places of every piece.

    The residual is measured, there and at the ends, on the surface and on the triangle of each piece: it is larger than
    the tolerance where a piece cannot follow both.
    """
    arcs = chains.arcs
    number = np.repeat(np.arange(len(chains.closed)), np.diff(chains.offsets))
    start, end = arcs.ends[:, 0].copy(), arcs.ends[:, 1].copy()
    after = np.flatnonzero(number[1:] == number[:-1]) + 1
    start[after] = end[after - 1]
    round_ = chains.closed
    start[chains.offsets[:-1][round_]] = end[chains.offsets[1:][round_] - 1]
    pieces = _Pieces(number, arcs.triangle, arcs.normal, start, end, arcs.uv[:, 0].copy(), arcs.uv[:, 1].copy())
    least = ROUND_OFF * float(np.abs(arcs.ends).max(initial=0.0))
    for _ in range(HALVINGS):
        # off the surface by d is off the curve by d / sin of the crossing angle
        far = _residual(surface, pieces, 9) > np.maximum(tolerance * _sines(surface, pieces), least)
        if not far.any():
            break
        pieces = _halved(surface, pieces, far)
    residual = np.maximum(_residual(surface, pieces, 9), _off_triangles(mesh, surface, pieces, 9))
    curves = []
    borders = np.searchsorted(pieces.curve, np.arange(len(chains.closed) + 1))
    for i, (first, stop) in enumerate(pairwise(borders.tolist())):
        own = pieces.taken(np.arange(first, stop))
        space, plane = _splines(surface, own)
        points = np.concatenate([own.start, own.end[-1:]])
        worst = float(residual[first:stop].max())
        kind: CurveKind = "tangential" if _sines(surface, own).max() < FLAT else "transversal"
        curves.append(IntersectionCurve(space, None, plane, points, kind, bool(chains.closed[i]), worst))
    return tuple(curves)


def _newton(surface: Surface, uv: Array, about: Array, normal: Array) -> Array:
    """(n, 2) parameters whose points lie in the planes through `about` with `normal`."""
    low, high = np.array(surface.domain).T
    uv = np.clip(uv, low, high)
    best = np.full(len(uv), np.inf)
    result = uv.copy()
    for _ in range(STEPS):
        u, v = uv.T
        f = np.einsum("ij,ij->i", np.asarray(surface(u, v)) - about, normal)
        better = np.abs(f) < best
        result[better], best[better] = uv[better], np.abs(f)[better]
        if not better.any():
            break
        su, sv = np.asarray(surface(u, v, (1, 0))), np.asarray(surface(u, v, (0, 1)))
        a, b = np.einsum("ij,ij->i", normal, su), np.einsum("ij,ij->i", normal, sv)
        # the shortest step in space along the surface: metric E, F, G
        E, F, G = (np.einsum("ij,ij->i", x, y) for x, y in ((su, su), (su, sv), (sv, sv)))
        p, q = G * a - F * b, E * b - F * a
        slope = a * p + b * q
        step = np.stack([p, q], axis=1) * np.divide(f, slope, out=np.zeros(len(f)), where=slope != 0.0)[:, None]
        uv = np.clip(uv - step, low, high)
    return result


def _sines(surface: Surface, pieces: _Pieces) -> Array:
    """(n,) the larger sine of the crossing angles at both ends."""
    both = [
        np.linalg.norm(np.cross(pieces.normal, _normals(surface, _one_sided(surface, uv, other), other)), axis=1)
        for uv, other in ((pieces.uv_start, pieces.uv_end), (pieces.uv_end, pieces.uv_start))
    ]
    return np.asarray(np.maximum(*both))


def _one_sided(surface: Surface, uv: Array, inner: Array) -> Array:
    """(n, 2) parameters a little from `uv` towards `inner`: derivatives there are those on this side of a kink."""
    low, high = np.array(surface.domain).T
    least = ONE_SIDE * (high - low)
    return np.asarray(uv + np.clip(inner - uv, -least, least))


def _normals(surface: Surface, uv: Array, inner: Array) -> Array:
    """(n, 3) unit normals; where the surface has none (a pole), those a little towards `inner`."""
    normal = np.cross(surface(uv[:, 0], uv[:, 1], (1, 0)), surface(uv[:, 0], uv[:, 1], (0, 1)))
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    poor = length[:, 0] <= JUMP * length.max(initial=0.0)
    if poor.any():
        at = uv[poor] + INWARD * (inner[poor] - uv[poor])
        at[:, 0], at[:, 1] = _inside(surface, at)
        normal[poor] = np.cross(surface(at[:, 0], at[:, 1], (1, 0)), surface(at[:, 0], at[:, 1], (0, 1)))
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
        for column, sign, uv, other in (
            (1, 1.0, pieces.uv_start, pieces.uv_end),
            (2, -1.0, pieces.uv_end, pieces.uv_start),
        ):
            at = _one_sided(surface, uv, other)
            ahead = np.cross(pieces.normal, _normals(surface, at, other))
            size = np.linalg.norm(ahead, axis=1, keepdims=True)
            ahead = np.where(size > 0.0, ahead / np.where(size > 0.0, size, 1.0), way / length[:, None])
            ahead *= np.where(np.einsum("ij,ij->i", ahead, way) < 0.0, -1.0, 1.0)[:, None]
            reach = (sign * span / 3.0)[:, None]
            base = 0 if column == 1 else 3
            space[:, column] = space[:, base] + reach * ahead
            su, sv = np.asarray(surface(at[:, 0], at[:, 1], (1, 0))), np.asarray(surface(at[:, 0], at[:, 1], (0, 1)))
            E, F, G = (np.einsum("ij,ij->i", x, y) for x, y in ((su, su), (su, sv), (sv, sv)))
            p, q = np.einsum("ij,ij->i", su, ahead), np.einsum("ij,ij->i", sv, ahead)
            det = E * G - F * F
            flat = (det <= JUMP**2 * E * G)[:, None]
            rate = np.stack([G * p - F * q, E * q - F * p], axis=1)
            rate *= np.divide(1.0, det, out=np.zeros_like(det), where=~flat[:, 0])[:, None]
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


def _off_triangles(mesh: Triangulation, surface: Surface, pieces: _Pieces, samples: int) -> Array:
    """(n,) largest distance of each cubic in space from its own triangle."""
    space, _, _ = _bezier(surface, pieces)
    corners = mesh.corners[pieces.triangle]
    worst = np.zeros(len(space))
    for t in np.linspace(0.0, 1.0, samples + 2):
        worst = np.maximum(worst, from_triangles(_at(space, float(t)), corners))
    return worst


def _inside(surface: Surface, uv: Array) -> tuple[Array, Array]:
    """Parameters no farther out than the domain."""
    (u0, u1), (v0, v1) = surface.domain
    return np.clip(uv[:, 0], u0, u1), np.clip(uv[:, 1], v0, v1)


def _halved(surface: Surface, pieces: _Pieces, far: BoolArray) -> _Pieces:
    """The pieces, those that are `far` cut at a new point on the surface."""
    space, plane, _ = _bezier(surface, pieces.taken(np.flatnonzero(far)))
    normal = pieces.normal[far]
    middle = np.stack(_inside(surface, _at(plane, 0.5)), axis=1)
    about = _at(space, 0.5)
    uv = _newton(surface, middle, about, normal)
    points = np.asarray(surface(uv[:, 0], uv[:, 1]))
    points -= np.einsum("ij,ij->i", points - about, normal)[:, None] * normal
    result = pieces.taken(np.repeat(np.arange(len(far)), np.where(far, 2, 1)))
    first = np.flatnonzero(far) + np.arange(len(points))
    result.end[first], result.uv_end[first] = points, uv
    result.start[first + 1], result.uv_start[first + 1] = points, uv
    return result


def _splines(surface: Surface, pieces: _Pieces) -> tuple[NurbsCurve, NurbsCurve]:
    """The pieces as one cubic spline in space and one in (u, v), on about arc length."""
    space, plane, span = _bezier(surface, pieces)
    knots = np.concatenate([[0.0], np.cumsum(span)])
    full = np.concatenate([knots[:1], np.repeat(knots, 3), knots[-1:]])
    low, high = np.array(surface.domain).T
    # at seams and poles the next piece starts elsewhere in (u, v)
    jump = (np.abs(plane[1:, 0] - plane[:-1, 3]) > JUMP * (high - low)).any(axis=1)
    count = np.concatenate([[4], np.where(jump, 4, 3), [4]])
    stays = np.ones(plane.shape[:2], dtype=np.bool_)
    stays[:-1, 3] = jump
    net = np.concatenate([space[:, :3].reshape(-1, 3), space[-1:, 3]])
    return NurbsCurve(3, full, net), NurbsCurve(3, np.repeat(knots, count), plane[stays])
