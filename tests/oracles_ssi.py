"""Pairs of surfaces whose intersection is known in closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import BSpline

from patchwright.models import NurbsSurface
from patchwright.models.arrays import Array
from patchwright.models.knots import greville, uniform_knots


def graph(f: Callable[[Array, Array], Array], degree: tuple[int, int] = (3, 3), spans: int = 1) -> NurbsSurface:
    """z = f(x, y) over the unit square: exact for polynomials up to the degree, a spline interpolant otherwise."""
    p, q = degree
    U, V = uniform_knots(p, spans + p), uniform_knots(q, spans + q)
    u, v = greville(p, U), greville(q, V)
    x, y = np.meshgrid(u, v, indexing="ij")
    rows = BSpline.design_matrix(u, U, p).toarray(), BSpline.design_matrix(v, V, q).toarray()
    z = np.linalg.solve(rows[1], np.linalg.solve(rows[0], f(x, y) + 0.0 * x).T).T
    return NurbsSurface(degree, (U, V), np.stack((x, y, z), axis=-1))


def flat(z: float = 0.0) -> NurbsSurface:
    """A bicubic plane over the unit square."""
    return graph(lambda x, y: z + 0.0 * x)


def dome(depth: float, at: tuple[float, float] = (0.5, 0.5)) -> NurbsSurface:
    """Dips `depth` below z = 0: the loop's radius is sqrt(depth / 4.5)."""
    return graph(lambda x, y: 4.5 * ((x - at[0]) ** 2 + (y - at[1]) ** 2) - depth)


def wavy(k: int) -> tuple[NurbsSurface, NurbsSurface]:
    """Two bicubic graphs that cross in many loops."""
    waves = graph(lambda x, y: 0.1 * np.sin(np.pi * k * x) * np.sin(np.pi * k * y), spans=4 * k)
    return waves, graph(lambda x, y: 0.03 + 0.02 * np.sin(3.0 * x + y), spans=3)


def contour(a: NurbsSurface, b: NurbsSurface, samples: int = 1201) -> tuple[int, float, float]:
    """Number and total length, in the plane and in space, of the zero contours of z_a - z_b for two graphs over the
    unit square, by marching squares with linear interpolation: loops counted by union of the segments' ends."""
    t = np.linspace(0.0, 1.0, samples)
    z = b.grid(t, t)[..., 2]
    f = a.grid(t, t)[..., 2] - z
    from scipy.ndimage import label

    h = t[1]
    height = [z[:-1, :-1], z[1:, :-1], z[1:, 1:], z[:-1, 1:]]
    corner = [f[:-1, :-1], f[1:, :-1], f[1:, 1:], f[:-1, 1:]]
    place = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    ends, seen = np.zeros((2, *corner[0].shape, 3)), np.zeros(corner[0].shape, dtype=int)
    for k in range(4):
        p, q = corner[k], corner[(k + 1) % 4]
        cut = p * q < 0.0
        s = np.where(cut, p / np.where(cut, p - q, 1.0), 0.0)
        (x0, y0), (x1, y1) = place[k], place[(k + 1) % 4]
        lift = (height[k] + s * (height[(k + 1) % 4] - height[k])) / h
        at = np.stack((x0 + s * (x1 - x0), y0 + s * (y1 - y0), lift), axis=-1)
        for n in (0, 1):
            pick = cut & (seen == n)
            ends[n][pick] = at[pick]
        seen += cut
    two = seen == 2
    d = h * (ends[0][two] - ends[1][two])
    flat_length, length = (float(np.linalg.norm(d[:, :k], axis=1).sum()) for k in (2, 3))
    return int(label(f > 0.0)[1]), flat_length, length
