"""The control nets of all patches of a network, grouped by size so that every step runs on whole arrays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, IntArray, frozen
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.edge_curves import EdgeCurves
from patchwright.repair.patches.spline_space import greville, refinement, uniform_collocation

FOLD_SAMPLES = 13


@dataclass(frozen=True, slots=True, eq=False)
class PatchNets:
    """Bicubic control nets on uniform knots.

    Parameters
    ----------
    cells : (m, 2) pieces along u and v of each patch
    offsets : (m + 1,) rows of `controls` that belong to each patch
    controls : (sum((cells_u + 3) * (cells_v + 3)), 3) control points, u slowest
    """

    cells: IntArray
    offsets: IntArray
    controls: Array

    @classmethod
    def pack(cls, cells: IntArray, groups: list[tuple[IntArray, Array]]) -> PatchNets:
        """From groups (patch indices, (k, M + 3, N + 3, 3)) that cover every patch once."""
        offsets = np.concatenate([[0], np.cumsum((cells + 3).prod(axis=1))])
        controls = np.empty((int(offsets[-1]), 3))
        for which, nets in groups:
            rows = offsets[which][:, None] + np.arange(nets.shape[1] * nets.shape[2])
            controls[rows] = nets.reshape(len(which), -1, 3)
        return cls(frozen(cells, np.int64), frozen(offsets, np.int64), frozen(controls, np.float64))

    def __len__(self) -> int:
        return len(self.cells)

    def groups(self) -> Iterator[tuple[tuple[int, int], IntArray, Array]]:
        """((M, N), patch indices, (k, M + 3, N + 3, 3) nets) for each size in use."""
        for m, n in np.unique(self.cells, axis=0):
            which = np.flatnonzero((self.cells == (m, n)).all(axis=1))
            yield (int(m), int(n)), which, self.nets(which)

    def nets(self, which: IntArray) -> Array:
        """(k, M + 3, N + 3, 3) nets of patches of one size."""
        m, n = self.cells[which[0]] + 3
        rows = self.offsets[which][:, None] + np.arange(m * n)
        return self.controls[rows].reshape(len(which), m, n, 3)

    def refined(self, cells: IntArray) -> PatchNets:
        """The same surfaces in finer spaces: `cells` (m, 2) are whole multiples of the present ones."""
        sizes = np.concatenate([self.cells, cells], axis=1)
        groups = []
        for m, n, fine_m, fine_n in np.unique(sizes, axis=0).tolist():
            which = np.flatnonzero((sizes == (m, n, fine_m, fine_n)).all(axis=1))
            groups.append((which, evaluate(self.nets(which), refinement(m, fine_m), refinement(n, fine_n))))
        return PatchNets.pack(cells, groups)

    def sample(self, count: int, derivative: tuple[int, int] = (0, 0)) -> Array:
        """(m, count, count, 3) a derivative of every patch at count x count equidistant parameters."""
        out = np.empty((len(self), count, count, 3))
        for (m, n), which, nets in self.groups():
            out[which] = evaluate(
                nets, uniform_collocation(m, count, derivative[0]), uniform_collocation(n, count, derivative[1])
            )
        return out


def evaluate(nets: Array, basis_u: Array, basis_v: Array) -> Array:
    """(k, a, b, 3) tensor-product values of nets (k, M, N, 3) by basis matrices (a, M) and (b, N)."""
    return np.asarray(np.matmul(basis_v, np.einsum("ai,kijd->kajd", basis_u, nets, optimize=True)))


def sides(
    layout: QuadLayout, edges: EdgeCurves, which: IntArray, cells: tuple[int, int]
) -> tuple[Array, Array, Array, Array]:
    """Control rows (south, north, west, east) of patches of one size, each (k, cells + 3, 3) and run along +u or +v.

    Corner k of a quad is at (u, v) = (0, 0), (1, 0), (1, 1), (0, 1); edge k joins corners k and k + 1.
    """
    out = []
    for k, along, backward in ((0, 0, False), (2, 0, True), (3, 1, True), (1, 1, False)):
        points = edges.refined(layout.quad_edges[which, k], cells[along])
        flip = layout.edge_reversed[which, k] != backward
        points[flip] = points[flip, ::-1]
        out.append(points)
    return out[0], out[1], out[2], out[3]


def coons_nets(south: Array, north: Array, west: Array, east: Array) -> Array:
    """(k, M, N, 3) control nets of the bilinear Coons patches of four boundary control rows, (k, M, 3) and (k, N, 3).

    Exact: in a spline space the coefficients of the parameter itself are the Greville abscissae.
    """
    u = greville(south.shape[1] - 3)[:, None, None]
    v = greville(west.shape[1] - 3)[None, :, None]
    ruled = (1 - u) * west[:, None] + u * east[:, None] + (1 - v) * south[:, :, None] + v * north[:, :, None]
    x00, xm0, x0n, xmn = (x[:, None, None] for x in (south[:, 0], south[:, -1], north[:, 0], north[:, -1]))
    return np.asarray(ruled - ((1 - u) * (1 - v) * x00 + u * (1 - v) * xm0 + (1 - u) * v * x0n + u * v * xmn))


def folds(nets: PatchNets, count: int = FOLD_SAMPLES) -> Array:
    """(m,) share of neighbouring samples of each patch between which its normal turns by more than a right angle.

    Zero on a patch that does not fold, however bent, as long as it turns by less than that within a sample's step.
    """
    normal = normals_of(nets.sample(count, (1, 0)), nets.sample(count, (0, 1)))
    along_u = (normal[:, 1:] * normal[:, :-1]).sum(axis=-1) < 0.0
    along_v = (normal[:, :, 1:] * normal[:, :, :-1]).sum(axis=-1) < 0.0
    return np.asarray(0.5 * (along_u.mean(axis=(1, 2)) + along_v.mean(axis=(1, 2))))


def normals_of(du: Array, dv: Array) -> Array:
    """Unit normals of paired tangents (..., 3); zero where the tangents are parallel."""
    normal = np.cross(du, dv)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.asarray(np.divide(normal, length, out=np.zeros_like(normal), where=length > 0))
