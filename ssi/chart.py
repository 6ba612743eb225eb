"""A surface over its parameter rectangle: where two of its points are proved to be apart.

Between two parameters S(p) - S(q) = du a + dv b, where a is a mean of S_u and b one of S_v along the way. Bernstein
nets of positive multiples of S_u and S_v bound the directions a and b can have: for rational pieces the numerators
X_u w - X w_u, at an edge that is a single point (a pole) divided by the distance from it, which changes no direction.
When, seen along one normal, no a is parallel to a b, du a + dv b vanishes only for p = q (or for p and q on the pole).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.ssi.bezier_pieces import BezierPieces, Frame

SPANS = 4  # at least so many in a closed direction: then pieces touch in one way only
SAME = 1e-12  # of the size: control points nearer than this are one
CLEAR = 1e-9  # by which directions have to differ: far above the round-off of unit-size coordinates


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """The Bezier pieces of a surface over their parameters.

    Parameters
    ----------
    pieces : in a common scale
    breaks : the knots in u and in v
    along : Bernstein nets (k, ., ., 3) whose cones hold S_u and S_v on each piece
    rays : for each end of u and of v, the net (k, ., ., 3) of directions from the pole there; None without one
    period : of u and v, 0 where the surface is open
    """

    pieces: BezierPieces
    breaks: tuple[Array, Array]
    along: tuple[Array, Array]
    rays: dict[tuple[int, int], Array]
    period: tuple[float, float]

    @classmethod
    def of(cls, surface: NurbsSurface, frame: Frame) -> Chart:
        """The chart of a clamped surface, which in a closed direction has four pieces or more."""
        pieces = BezierPieces.of(surface, frame)
        n, m = pieces.shape
        grid = pieces.nets.reshape(n, m, *pieces.nets.shape[1:])
        period = [0.0, 0.0]
        for axis, ends in ((0, (grid[0, :, 0], grid[-1, :, -1])), (1, (grid[:, 0, :, 0], grid[:, -1, :, -1]))):
            points = [e / e[..., 3:] for e in ends]
            weights = [e[..., 3] / e.flat[3] for e in ends]
            closed = max(np.abs(points[0] - points[1]).max(), np.abs(weights[0] - weights[1]).max()) <= SAME
            if closed and pieces.shape[axis] >= 4:
                period[axis] = float(np.ptp(surface.domain[axis]))
        along = [numerators(pieces.nets, 0), numerators(pieces.nets, 1)]
        rays: dict[tuple[int, int], Array] = {}
        index = np.arange(n * m).reshape(n, m)
        for axis in (0, 1):
            for end in (0, 1):
                rim = np.take(index, -end, axis=axis).ravel()
                edge = np.take(pieces.nets[rim], -end, axis=1 + axis)
                points = edge[..., :3] / edge[..., 3:]
                if np.abs(points - points[0, 0]).max() > SAME:
                    continue
                # S - P = t Y / w: the other family's derivatives are t times those of Y / w
                other = 1 - axis
                shifted = pieces.nets[rim].copy()
                shifted[..., :3] -= points[0, 0] * shifted[..., 3:]
                along[other] = along[other].copy()
                along[other][rim] = divided(numerators(shifted, other), 1 + axis, end)
                rays[axis, end] = divided(shifted[..., :3], 1 + axis, end)
        return cls(pieces, surface.breaks, (along[0], along[1]), rays, (period[0], period[1]))

    def cell(self, k: IntArray) -> Array:
        """(n, 4) u0 u1 v0 v1 of pieces."""
        i, j = np.divmod(k, self.pieces.shape[1])
        us, vs = self.breaks
        return np.stack((us[i], us[i + 1], vs[j], vs[j + 1]), axis=1)

    def directions(self, axis: int, k: IntArray, box: Array, shift: Array) -> Array:
        """(n, m, 3) vectors whose cone holds S_u (axis 0) or S_v on the common part of pieces, shifted by whole periods
        (n, 2), and boxes (n, 4)."""
        cell = self.cell(k) + np.repeat(shift, 2, axis=1)
        return restricted(self.along[axis][k], *local(cell, box)).reshape(k.size, -1, 3)


def spanned(surface: NurbsSurface) -> NurbsSurface:
    """The surface with at least four spans in a closed direction."""
    more: list[Array] = []
    net = surface.control_points
    size = float(np.ptp(net.reshape(-1, 3), axis=0).max())
    for axis, breaks in enumerate(surface.breaks):
        rows = np.moveaxis(net, axis, 0)
        parts = -(-SPANS // (breaks.size - 1)) if np.abs(rows[0] - rows[-1]).max() <= 1e-9 * size else 1
        more.append(np.sort(np.linspace(breaks[:-1], breaks[1:], parts + 1)[1:-1].ravel()))
    return surface.insert_knots(*more)


def local(cell: Array, box: Array) -> tuple[Array, Array]:
    """The common part of boxes and cells in the cells' own [0, 1]."""
    low, width = cell[:, ::2], cell[:, 1::2] - cell[:, ::2]
    return np.clip((box[:, ::2] - low) / width, 0.0, 1.0), np.clip((box[:, 1::2] - low) / width, 0.0, 1.0)


def parallel_free(a: list[Array], b: list[Array]) -> BoolArray:
    """(n,) whether no direction of the cones of a is, up to sign, one of those of b, seen along one normal.

    Each of a and b is a list of arrays (n, m, 3), parts of one cone.
    """
    means = []
    for vectors in (a[0], b[0]):
        length = np.linalg.norm(vectors, axis=2, keepdims=True)
        means.append((vectors / np.where(length > 0.0, length, 1.0)).sum(axis=1))
    normal = np.cross(means[0], means[1])
    across = [np.cross(means[1], normal), np.cross(normal, means[0])]  # dual to the means, but for their lengths
    for k in (0, 1):
        across[k] = across[k] / np.maximum(np.linalg.norm(across[k], axis=1, keepdims=True), 1e-300)
    good = np.ones(len(normal), dtype=bool)
    ranges = []
    for (x_axis, y_axis), parts in ((across, a), (across[::-1], b)):
        low, high = np.full(len(normal), np.inf), np.full(len(normal), -np.inf)
        for vectors in parts:
            x = np.einsum("nmc,nc->nm", vectors, x_axis)
            y = np.einsum("nmc,nc->nm", vectors, y_axis)
            good &= (x > CLEAR * np.linalg.norm(vectors, axis=2)).all(axis=1)
            with np.errstate(divide="ignore", invalid="ignore"):
                slope = y / x
            low, high = np.fmin(low, slope.min(axis=1)), np.fmax(high, slope.max(axis=1))
        ranges.append((low, high))
    (s0, s1), (r0, r1) = ranges
    with np.errstate(invalid="ignore", over="ignore"):
        worst = np.max([s0 * r0, s0 * r1, s1 * r0, s1 * r1], axis=0)
    return np.asarray(good & np.isfinite(worst) & (worst < 1.0 - CLEAR))


def independent(families: tuple[list[Array], list[Array], list[Array]]) -> BoolArray:
    """(n,) whether no vectors of three cones, one of each up to sign, are linearly dependent.

    In the coordinates of the cones' middles, c_i min |x_ii| <= sum_j c_j max |x_ij| for the coefficients of a
    combination that vanishes: impossible when the matrix of the quotients has a power of norm below one.
    """
    means = []
    for parts in families:
        length = np.linalg.norm(parts[0], axis=2, keepdims=True)
        means.append((parts[0] / np.where(length > 0.0, length, 1.0)).sum(axis=1))
    basis = np.stack(means, axis=2)
    size = np.linalg.norm(basis, axis=1).prod(axis=1)
    good = np.abs(np.linalg.det(basis)) > CLEAR * size
    basis[~good] = np.eye(3)
    back = np.linalg.inv(basis)
    R = np.zeros((len(good), 3, 3))
    own = np.empty((len(good), 3))
    for j, parts in enumerate(families):
        x = [np.einsum("nic,nmc->nmi", back, vectors) for vectors in parts]
        own[:, j] = np.min([y[:, :, j].min(axis=1) for y in x], axis=0)
        R[:, :, j] = np.max([np.abs(y).max(axis=1) for y in x], axis=0)
    good &= (own > 0.0).all(axis=1)
    R[:, [0, 1, 2], [0, 1, 2]] = 0.0
    R[good] /= own[good][:, :, None]
    R[~good] = np.eye(3)
    for _ in range(4):
        R = np.minimum(R @ R, 1e30)
    return np.asarray(good & (R.sum(axis=2).max(axis=1) < 1.0 - CLEAR))


def restricted(nets: Array, low: Array, high: Array) -> Array:
    """Bernstein nets (n, P, Q, c) on the boxes from low to high (n, 2) of their own [0, 1]^2."""
    P, Q = nets.shape[1:3]
    left, right = blossoms(P - 1, low[:, 0], high[:, 0]), blossoms(Q - 1, low[:, 1], high[:, 1])
    n, c = nets.shape[0], nets.shape[3]
    half = (left @ nets.reshape(n, P, Q * c)).reshape(n, P, Q, c)
    return np.asarray(right[:, None] @ half)


def blossoms(degree: int, low: Array, high: Array) -> Array:
    """(n, p + 1, p + 1) matrices from Bernstein coefficients on [0, 1] to those on [low, high]."""
    n = low.size
    out = np.empty((n, degree + 1, degree + 1))
    eye = np.broadcast_to(np.eye(degree + 1), (n, degree + 1, degree + 1))
    a, b = low[:, None, None], high[:, None, None]
    for r in range(degree + 1):
        rows = eye
        for k in range(degree):  # degree - r times the argument low, r times high
            t = b if k < r else a
            rows = (1.0 - t) * rows[:, :-1] + t * rows[:, 1:]
        out[:, r] = rows[:, 0]
    return out


def numerators(nets: Array, axis: int) -> Array:
    """Bernstein nets of X_u w - X w_u (axis 0) or X_v w - X w_v: positive multiples of S_u or S_v."""
    degree = nets.shape[1 + axis] - 1
    d = degree * np.diff(nets, axis=1 + axis)
    w = nets[..., 3:]
    if (w == 1.0).all():
        return np.asarray(d[..., :3])
    return product(d[..., :3], w) - product(nets[..., :3], d[..., 3:])


def product(f: Array, g: Array) -> Array:
    """Bernstein nets (k, ., ., c) of the product of two functions."""
    (p, q), (r, s) = (np.array(x.shape[1:3]) - 1 for x in (f, g))

    def scaled(x: Array) -> Array:
        n, m = x.shape[1:3]
        rows = np.array([math.comb(n - 1, i) for i in range(n)], dtype=float)
        columns = np.array([math.comb(m - 1, j) for j in range(m)], dtype=float)
        return np.asarray(x * (rows[:, None] * columns)[..., None])

    f, g = scaled(f), scaled(g)
    out = np.zeros((f.shape[0], p + r + 1, q + s + 1, max(f.shape[3], g.shape[3])))
    for i in range(r + 1):
        for j in range(s + 1):
            out[:, i : i + p + 1, j : j + q + 1] += f * g[:, i : i + 1, j : j + 1]
    rows = np.array([math.comb(p + r, i) for i in range(p + r + 1)], dtype=float)
    columns = np.array([math.comb(q + s, j) for j in range(q + s + 1)], dtype=float)
    return np.asarray(out / (rows[:, None] * columns)[..., None])


def divided(nets: Array, axis: int, end: int) -> Array:
    """The nets, zero at an end of an axis, divided by the distance from that end."""
    nets = np.flip(nets, axis) if end else nets
    n = nets.shape[axis] - 1
    shape = [1] * nets.ndim
    shape[axis] = n
    out = np.take(nets, np.arange(1, n + 1), axis=axis) * (n / np.arange(1.0, n + 1.0)).reshape(shape)
    out = np.moveaxis(np.tensordot(elevation(n - 1, n), out, axes=(1, axis)), 0, axis)  # the shape stays
    return np.asarray(np.flip(out, axis) if end else out)


def elevation(degree: int, top: int) -> Array:
    """(top + 1, degree + 1) matrix from Bernstein coefficients to those of a higher degree."""
    out = np.eye(degree + 1)
    for n in range(degree + 1, top + 1):
        share = (np.arange(n + 1.0) / n)[:, None]
        pad = np.zeros((1, out.shape[1]))
        out = share * np.concatenate((pad, out)) + (1.0 - share) * np.concatenate((out, pad))
    return out
