"""A surface over a plane through any number of rings: the smoothest one that keeps to them.

x(u, v) = o + u e1 + v e2 + h(u, v) n with h a C2 bicubic spline on a box round the rings. h has the least thin-plate
energy among those that take the rings' heights and, where the surfaces around go on across, their slope square to the
rim. An edge's image in (u, v) is its own curve projected, so pcurves are exact and only the height is fitted; the grid
is refined until the heights are met. Source of the energy: Duchon 1977; the border's slope is that of the tangent
planes around.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.repair.patches import spline_space

CELLS = (6, 12, 18)
MARGIN = 0.02  # of the box: how far it reaches beyond the rings
HEIGHT, SLOPE = 1e16, 1e4  # weights of heights and slopes over the energy, in units of the box


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A plane: origin (3,), and the rows e1, e2, n (3, 3) of a right-handed orthonormal frame."""

    origin: Array
    axes: Array

    @classmethod
    def across(cls, points: Array, normal: Array) -> Frame:
        """Through the mean of points (k, 3), its first axis along their greatest extent."""
        n = normal / np.linalg.norm(normal)
        origin = points.mean(axis=0)
        flat = points - origin - np.outer((points - origin) @ n, n)
        e1 = np.linalg.svd(flat, full_matrices=False)[2][0]
        e1 = e1 - (e1 @ n) * n
        e1 /= np.linalg.norm(e1)
        return cls(origin, np.stack([e1, np.cross(n, e1), n]))

    def local(self, points: Array) -> Array:
        """(k, 3) coordinates along e1, e2, n."""
        return np.asarray((points - self.origin) @ self.axes.T)


@dataclass(frozen=True, slots=True, eq=False)
class Rim:
    """Points (k, 3) in the frame, and where known the slope (k,) dh/ds along the unit direction (k, 2); nan if not."""

    points: Array
    direction: Array
    slope: Array


def height_surface(frame: Frame, rim: Rim, tolerance: float) -> tuple[NurbsSurface, float]:
    """The surface and its largest distance from the rim's points, on the coarsest grid that meets the tolerance.

    The finest grid's where none does.
    """
    low, high = rim.points[:, :2].min(axis=0), rim.points[:, :2].max(axis=0)
    size = float((high - low).max())
    low, high = low - MARGIN * size, high + MARGIN * size
    width = high - low
    best: tuple[NurbsSurface, float] | None = None
    for cells in CELLS:
        heights = _solved(cells, rim, low, width, size)
        site = spline_space.greville(cells)
        u, v = low[0] + width[0] * site, low[1] + width[1] * site
        flat = np.stack([*np.meshgrid(u, v, indexing="ij"), heights], axis=2)
        knots = spline_space.knots(cells)
        surface = NurbsSurface(
            (3, 3), (low[0] + width[0] * knots, low[1] + width[1] * knots), frame.origin + flat @ frame.axes
        )
        there = surface(rim.points[:, 0], rim.points[:, 1])
        off = float(np.linalg.norm(frame.local(there) - rim.points, axis=1).max())
        if best is None or off < best[1]:
            best = surface, off
        if off <= tolerance:
            break
    assert best is not None
    return best


def _solved(cells: int, rim: Rim, low: Array, width: Array, size: float) -> Array:
    """(n, n) spline coefficients of the heights."""
    x = np.clip((rim.points[:, :2] - low) / width, 0.0, 1.0)
    count = cells + spline_space.DEGREE
    values = [spline_space.collocation(cells, x[:, k]) for k in (0, 1)]
    rows = np.sqrt(HEIGHT / len(x)) * _products(values[0], values[1])
    right = np.sqrt(HEIGHT / len(x)) * rim.points[:, 2] / size
    known = np.isfinite(rim.slope)
    if known.any():
        d = rim.direction[known] * size / width  # dh/ds in units of the box
        first = [spline_space.collocation(cells, x[known, k], 1) for k in (0, 1)]
        along = d[:, :1] * _products(first[0], values[1][known]) + d[:, 1:] * _products(values[0][known], first[1])
        weight = np.sqrt(SLOPE / len(x))
        rows = np.concatenate([rows, weight * along])
        right = np.concatenate([right, weight * rim.slope[known]])
    eigenvalues, vectors = np.linalg.eigh(_energy(cells, width / size))
    bending = np.sqrt(np.maximum(eigenvalues, 0.0))[:, None] * vectors.T
    rows = np.concatenate([rows, bending])
    right = np.concatenate([right, np.zeros(count * count)])
    q, r = np.linalg.qr(rows)
    scale = np.abs(np.diag(r)).max()
    r = r + 1e-15 * scale * np.eye(len(r))
    return np.asarray(size * np.linalg.solve(r, q.T @ right)).reshape(count, count)


def _products(a: Array, b: Array) -> Array:
    """(k, n * m) products of the rows of a (k, n) and b (k, m)."""
    return np.asarray(np.einsum("ki,kj->kij", a, b).reshape(len(a), -1))


def _energy(cells: int, width: Array) -> Array:
    """(n * n, n * n) the thin-plate energy of the coefficients on a box of a width (2,)."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    t = ((np.arange(cells)[:, None] + 0.5 * (nodes + 1.0)) / cells).ravel()
    w = np.tile(0.5 * weights / cells, cells)
    gram = []
    for derivative in (0, 1, 2):
        values = spline_space.collocation(cells, t, derivative)
        gram.append(values.T @ (w[:, None] * values))
    a, b = width
    return np.asarray(
        np.kron(gram[2], gram[0]) * b / a**3
        + 2.0 * np.kron(gram[1], gram[1]) / (a * b)
        + np.kron(gram[0], gram[2]) * a / b**3
    )
