"""C2 bicubic least squares on any knots, the four border curves fitted first and then held.

Source: `design/algorithms.md`, section 7: the default approximant inside a block, with as few knots as the tolerance
allows. A border curve depends only on its own samples and knots, so that two patches with the same samples and knots
along a common side have the same curve there, bit for bit.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.models.nurbs_surface import NurbsSurface

DEGREE = 3
RELAXED = 4


def clamped(breaks: Array) -> Array:
    """The knots of the C2 cubics with these breaks (b + 1,)."""
    return np.concatenate([breaks[:1].repeat(4), breaks[1:-1], breaks[-1:].repeat(4)])


def tensor_fit(
    points: Array, u: Array, v: Array, breaks_u: Array, breaks_v: Array, known: BoolArray | None = None
) -> NurbsSurface:
    """The surface nearest to points (m, n, 3) at parameters u (m,) and v (n,), its corners and borders held.

    Every knot interval needs a sample inside; the solution is the one of least norm where samples are too few.

    Parameters
    ----------
    known : (m, n) which points are data; the others are replaced `RELAXED` times by the surface's own points, so that
        the way a gap was filled does not pull on the data beside it
    """
    along_u, along_v = basis(breaks_u, u), basis(breaks_v, v)
    fit_u, fit_v = (np.asarray(np.linalg.pinv(a[:, 1:-1]), dtype=np.float64) for a in (along_u, along_v))
    net = np.zeros((along_u.shape[1], along_v.shape[1], 3))
    for j in (0, -1):
        net[:, j] = _curve(points[:, j], along_u, fit_u)
    for i in (0, -1):
        net[i] = _curve(points[i], along_v, fit_v)
    held = _both(along_u, net, along_v)
    wanted = points
    for _ in range(1 if known is None or known.all() else 1 + RELAXED):
        net[1:-1, 1:-1] = _both(fit_u, wanted - held, fit_v)
        if known is not None:
            wanted = np.where(known[..., None], points, _both(along_u, net, along_v))
    return NurbsSurface((DEGREE, DEGREE), (clamped(breaks_u), clamped(breaks_v)), net)


def basis(breaks: Array, at: Array) -> Array:
    """(k, b + 3) values of the basis functions at parameters (k,)."""
    from scipy.interpolate import BSpline

    return np.asarray(BSpline.design_matrix(at, clamped(breaks), DEGREE).toarray())


def _both(along_u: Array, values: Array, along_v: Array) -> Array:
    """(m, n, 3) one matrix along the first axis of values (a, b, 3), one along the second."""
    rows = np.tensordot(along_u, values, axes=(1, 0))
    return np.tensordot(rows, along_v, axes=(1, 1)).swapaxes(1, 2)


def _curve(points: Array, values: Array, fit: Array) -> Array:
    """(c, 3) control points of the least-squares curve through the first and the last point."""
    net = np.zeros((values.shape[1], 3))
    net[0], net[-1] = points[0], points[-1]
    net[1:-1] = fit @ (points - values @ net)
    return net
