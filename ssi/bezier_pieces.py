"""The Bezier pieces of a surface as flat arrays in a common scale, and the way back to its own parameters.

Everything after this stage works on pieces with local parameters in [0, 1]^2 and coordinates divided by the size of the
pair, so that no later threshold depends on the unit or the distance to the origin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.nurbs_surface import NurbsSurface

MARGIN = 0.125  # by which a box is widened on every side: bounds hold there too, so neighbours share their feet


@dataclass(frozen=True, slots=True)
class Frame:
    """x_scaled = (x - origin) / size."""

    origin: Array
    size: float

    @classmethod
    def of(cls, *surfaces: NurbsSurface) -> Frame:
        """The middle of the common part of the boxes, and the diagonal of the smallest box."""
        low = np.array([s.control_points.min(axis=(0, 1)) for s in surfaces])
        high = np.array([s.control_points.max(axis=(0, 1)) for s in surfaces])
        origin = 0.5 * (low.max(axis=0) + high.min(axis=0))
        size = float(np.linalg.norm(high - low, axis=1).min())
        return cls(origin, size or 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class BezierPieces:
    """All Bezier pieces of one surface.

    Parameters
    ----------
    nets : (k, p + 1, q + 1, 4) homogeneous, scaled
    low, width : (k, 2) the parameter ranges of the pieces
    shape : (pieces in u, pieces in v); piece (i, j) is row i * shape[1] + j
    rational : whether a weight differs from 1
    """

    nets: Array
    low: Array
    width: Array
    shape: tuple[int, int]
    rational: bool

    @classmethod
    def of(cls, surface: NurbsSurface, frame: Frame) -> BezierPieces:
        """The pieces of a NURBS surface."""
        us, vs, nets = surface.bezier_nets()
        n, m, P, Q, d = nets.shape
        out = np.ones((n * m, P, Q, 4))
        flat = nets.reshape(n * m, P, Q, d)
        w = flat[..., 3:] if d == 4 else 1.0
        out[..., :3] = (flat[..., :3] - w * frame.origin) / frame.size
        if d == 4:
            out[..., 3] = flat[..., 3]
            out /= out[..., 3].reshape(n * m, -1).mean(axis=1)[:, None, None, None]
        low = np.stack(np.meshgrid(us[:-1], vs[:-1], indexing="ij"), axis=-1).reshape(-1, 2)
        width = np.stack(np.meshgrid(np.diff(us), np.diff(vs), indexing="ij"), axis=-1).reshape(-1, 2)
        return cls(np.ascontiguousarray(out), low, width, (n, m), bool((out[..., 3] != 1.0).any()))

    def parameters(self, piece: int | IntArray, local: Array) -> Array:
        """(..., 2) the surface's parameters of local ones in pieces."""
        return np.asarray(self.low[piece] + local * self.width[piece])


def widening(degree: int) -> Array:
    """(p + 1, p + 1) the matrix from the Bernstein net on [0, 1] to the one on [-MARGIN, 1 + MARGIN]."""
    net = np.eye(degree + 1)

    def split(rows: Array, t: float) -> tuple[Array, Array]:
        left, right, now = [rows[0]], [rows[-1]], rows
        while now.shape[0] > 1:
            now = (1.0 - t) * now[:-1] + t * now[1:]
            left.append(now[0])
            right.append(now[-1])
        return np.array(left), np.array(right[::-1])

    up, _ = split(net, 1.0 + MARGIN)  # on [0, 1 + m]
    _, both = split(up, -MARGIN / (1.0 + MARGIN))
    return np.ascontiguousarray(both)
