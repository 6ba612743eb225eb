"""Two NURBS surfaces that coincide in part: the correspondence of their parameters and the cells it holds on.

Sub-patches, and patches with other knots, degrees, ranges, orientation or order of u and v, are the same functions up
to an affine change of each parameter. That change is read off where a point of one lies on the other, by derivatives
and then by inversion of two distant points; both surfaces then get each other's knots, and a cell is certified by its
control points: over common Bernstein polynomials they bound the distance of the two pieces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.models.closest_point import closest_on_surface
from patchwright.models.knots import between
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.ssi.bezier_pieces import BezierPieces, Frame
from patchwright.ssi.chart import divided, elevation, product

ALIGNED = 1e-6  # sine between an iso-curve of one surface and of the other that run along each other
SNAP = 1e-9  # of the range: knots nearer than this are one
VANISHES = 1e-13  # of the size: a difference of control points that is round-off
SAMPLES = 3  # per span and direction, of the search for points of one surface on the other


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """(u, v) = scale * (s, t) + offset, of (t, s) where `swap`: from the parameters of b to those of a."""

    swap: bool
    scale: Array
    offset: Array

    def __call__(self, st: Array) -> Array:
        """(..., 2) parameters of a."""
        st = np.asarray(st)
        return np.asarray(self.scale * (st[..., ::-1] if self.swap else st) + self.offset)

    def back(self, uv: Array) -> Array:
        """(..., 2) parameters of b."""
        st = (np.asarray(uv) - self.offset) / self.scale
        return np.asarray(st[..., ::-1] if self.swap else st)

    def applied(self, b: NurbsSurface, lines: tuple[Array, Array]) -> NurbsSurface:
        """The surface b in a's parameters; knots beside the given lines are put on them."""
        b = b.transposed() if self.swap else b
        knots, points, weights = [], b.control_points, b.weights
        for axis in (0, 1):
            U = self.scale[axis] * b.knots[axis] + self.offset[axis]
            if self.scale[axis] < 0.0:
                U, points = U[::-1], np.flip(points, axis)
                weights = None if weights is None else np.flip(weights, axis)
            knots.append(_snapped(U, lines[axis]))
        return NurbsSurface(b.degree, (knots[0], knots[1]), points, weights)


@dataclass(frozen=True, slots=True, eq=False)
class Coincidence:
    """Where two surfaces are one.

    Parameters
    ----------
    change : from b's parameters to a's
    a, b : with each other's knots, b in a's parameters
    first : the numbers of a's spans in u and v at which the common rectangle begins, and of b's
    matched : (n, m) which cells of the common rectangle are the same in both
    apart : Bernstein nets (n, m, ., ., 3) of a - b on the cells, divided by powers of the distance from those sides of
        the cell on which it vanishes, up to positive factors
    """

    change: Change
    a: NurbsSurface
    b: NurbsSurface
    first: tuple[tuple[int, int], tuple[int, int]]
    matched: BoolArray
    apart: Array


def coincidences(a: NurbsSurface, b: NurbsSurface, hits: Array, frame: Frame, tol: float) -> list[Coincidence]:
    """All affine correspondences on which a and b coincide within a tolerance (in the frame's unit).

    Parameters
    ----------
    hits : (k, 4) parameters u v s t of points that both surfaces share; see `shared_points`
    """
    out: list[Coincidence] = []
    changes: list[Change] = []
    low, high = np.array([*a.domain, *b.domain]).T
    for hit in hits[((hits >= low) & (hits <= high)).all(axis=1)]:
        uv, st = hit[:2], hit[2:]
        spans = np.array([np.ptp(d) for d in a.domain])
        if any((np.abs(change(st) - uv) <= 1e-7 * spans).all() for change in changes):
            continue
        change = _change(a, b, uv, st, frame, tol)
        if change is None:
            continue
        changes.append(change)
        found = matched(a, b, change, frame, tol)
        if found is not None:
            out.append(found)
    return out


def shared_points(a: NurbsSurface, b: NurbsSurface, frame: Frame, tol: float) -> Array:
    """(k, 4) parameters of sample points of each surface that lie on the other within the tolerance."""
    out = []
    for one, other in ((a, b), (b, a)):
        us, vs = (between(t, SAMPLES) for t in one.breaks)
        uv = np.stack(np.meshgrid(us, vs, indexing="ij"), axis=-1).reshape(-1, 2)
        points = one(uv[:, 0], uv[:, 1])
        net = other.control_points.reshape(-1, 3)
        reach = tol * frame.size
        keep = ((points >= net.min(axis=0) - reach) & (points <= net.max(axis=0) + reach)).all(axis=1)
        if not keep.any():
            continue
        feet = closest_on_surface(other, points[keep])
        on = feet.distance <= reach
        mine, theirs = uv[keep][on], np.stack((feet.u, feet.v), axis=1)[on]
        out.append(np.concatenate((mine, theirs) if one is a else (theirs, mine), axis=1))
    return np.concatenate(out) if out else np.empty((0, 4))


def _change(a: NurbsSurface, b: NurbsSurface, uv: Array, st: Array, frame: Frame, tol: float) -> Change | None:
    """The affine change of parameters near a common point; None where iso-curves do not run along each other."""
    J = np.stack((a(uv[0], uv[1], (1, 0)), a(uv[0], uv[1], (0, 1))), axis=1)
    K = np.stack((b(st[0], st[1], (1, 0)), b(st[0], st[1], (0, 1))), axis=1)
    rates, *_ = np.linalg.lstsq(J, K, rcond=None)  # (u, v) by (s, t)
    lengths = np.linalg.norm(J, axis=0)[:, None] * np.abs(rates) / np.maximum(np.linalg.norm(K, axis=0), 1e-300)
    if not np.isfinite(lengths).all() or np.linalg.norm(J @ rates - K) > ALIGNED * np.linalg.norm(K):
        return None
    swap = bool(lengths[0, 1] > lengths[0, 0])
    off = lengths[[0, 1], [0, 1]] if swap else lengths[[0, 1], [1, 0]]
    if off.max() > 1e3 * ALIGNED:
        return None
    scale = np.asarray(rates[[0, 1], [1, 0]] if swap else rates[[0, 1], [0, 1]], dtype=np.float64)
    rough = Change(swap, scale, uv - scale * (st[::-1] if swap else st))
    whole = [np.array(x.domain).T for x in (a, b)]
    near = [_span(x, at) for x, at in ((a, uv), (b, st))]
    for (low_a, high_a), ends_b in ((whole[0], whole[1]), (near[0], near[1])):  # where all agrees, else round the point
        corners = rough(np.array(ends_b))
        low = np.maximum(corners.min(axis=0), low_a)
        high = np.minimum(corners.max(axis=0), high_a)
        if (high - low <= SNAP * (whole[0][1] - whole[0][0])).any():
            return None
        ends = rough.back(np.stack((low + 0.01 * (high - low), high - 0.01 * (high - low))))
        ends = np.clip(ends, *whole[1])
        feet = closest_on_surface(a, b(ends[:, 0], ends[:, 1]), start=np.clip(rough(ends), *whole[0]))
        if (feet.distance <= 2.0 * tol * frame.size).all():
            at = np.stack((feet.u, feet.v), axis=1)
            ends = ends[:, ::-1] if swap else ends
            scale = (at[1] - at[0]) / (ends[1] - ends[0])
            return Change(swap, scale, at[0] - scale * ends[0])
    return None


def _span(surface: NurbsSurface, at: Array) -> tuple[Array, Array]:
    """The corners of the span that holds a parameter."""
    low, high = np.empty(2), np.empty(2)
    for axis, ts in enumerate(surface.breaks):
        i = int(np.clip(np.searchsorted(ts, at[axis], side="right"), 1, ts.size - 1))
        low[axis], high[axis] = ts[i - 1], ts[i]
    return low, high


def matched(a: NurbsSurface, b: NurbsSurface, change: Change, frame: Frame, tol: float) -> Coincidence | None:
    """The cells on which the surfaces are the same; None without any."""
    moved = change.applied(b, a.breaks)
    lines = [s.breaks for s in (a, moved)]
    inner = [(lines_inside(q, p), lines_inside(p, q)) for p, q in zip(*lines, strict=True)]
    both = (a.insert_knots(inner[0][0], inner[1][0]), moved.insert_knots(inner[0][1], inner[1][1]))
    first: list[list[int]] = [[], []]
    count = []
    for axis in (0, 1):
        ts = [s.breaks[axis] for s in both]
        low, high = max(t[0] for t in ts), min(t[-1] for t in ts)
        if high - low <= SNAP * np.ptp(ts[0]):
            return None
        starts = [int(np.argmin(np.abs(t - low))) for t in ts]
        n = [int(np.argmin(np.abs(t - high))) - start for t, start in zip(ts, starts, strict=True)]
        if n[0] != n[1]:
            return None
        first[0].append(starts[0])
        first[1].append(starts[1])
        count.append(n[0])
    nets = []
    degree = [max(s.degree[axis] for s in both) for axis in (0, 1)]
    for s, (i, j) in zip(both, first, strict=True):
        pieces = BezierPieces.of(s, frame)
        net = pieces.nets.reshape(*pieces.shape, *pieces.nets.shape[1:])[i : i + count[0], j : j + count[1]]
        up = [elevation(d, top) for d, top in zip(s.degree, degree, strict=True)]
        nets.append(np.einsum("ik,xykjc,lj->xyilc", up[0], net / net[:, :, :1, :1, 3:], up[1]))
    gap = np.abs(nets[0] - nets[1])
    reach = 1.0 + np.abs(nets[0][..., :3] / nets[0][..., 3:]).max(axis=(2, 3, 4))
    least = np.minimum(nets[0][..., 3].min(axis=(2, 3)), nets[1][..., 3].min(axis=(2, 3)))
    far = np.linalg.norm(gap[..., :3], axis=-1).max(axis=(2, 3)) + reach * gap[..., 3].max(axis=(2, 3))
    same = far <= tol * least
    if not same.any():
        return None
    apart = _difference(nets[0], nets[1]).reshape(*same.shape, *(d + 1 for d in _degrees(nets)), 3)
    return Coincidence(change, both[0], both[1], ((first[0][0], first[0][1]), (first[1][0], first[1][1])), same, apart)


def _degrees(nets: list[Array]) -> tuple[int, int]:
    """Of the numerator of the difference."""
    factor = 1 if all((net[..., 3] == 1.0).all() for net in nets) else 2
    return factor * (nets[0].shape[2] - 1), factor * (nets[0].shape[3] - 1)


def _difference(a: Array, b: Array) -> Array:
    """(k, ., ., 3) the differences of pieces without their zeros along whole sides of the cells."""
    a, b = (x.reshape(-1, *x.shape[2:]) for x in (a, b))
    if (a[..., 3] == 1.0).all() and (b[..., 3] == 1.0).all():
        d = a[..., :3] - b[..., :3]
    else:
        d = product(a[..., :3], b[..., 3:]) - product(b[..., :3], a[..., 3:])
    d = d.copy()
    for axis in (1, 2):
        for end in (0, 1):
            for _ in range(d.shape[axis] - 1):
                size = np.abs(d).max(axis=(1, 2, 3))
                zero = np.abs(np.take(d, -end, axis=axis)).max(axis=(1, 2)) <= np.minimum(VANISHES, 1e-3 * size)
                if not zero.any():
                    break
                d[zero] = divided(d[zero], axis, end)
    return d


def _snapped(U: Array, lines: Array) -> Array:
    at = np.clip(np.searchsorted(lines, U), 1, lines.size - 1)
    nearest = np.where(np.abs(U - lines[at - 1]) <= np.abs(U - lines[at]), lines[at - 1], lines[at])
    return np.where(np.abs(U - nearest) <= SNAP * np.ptp(lines), nearest, U)


def lines_inside(values: Array, breaks: Array) -> Array:
    """The values strictly inside the breaks' range and on none of them."""
    apart = np.abs(values[:, None] - breaks).min(axis=1) > SNAP * np.ptp(breaks)
    return np.asarray(values[apart & (values > breaks[0]) & (values < breaks[-1])])
