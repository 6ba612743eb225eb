"""Arcs of a surface in single triangles, joined end to end to curves.

An arc ends at a side of its triangle, where one of a neighbouring triangle goes on, or at the border of its box on the
surface, where one of a neighbouring box goes on: across seams and poles too, since ends are joined in space.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.surface import Surface
from patchwright.models.triangulation import Triangulation
from patchwright.ssi.arcs import in_analytic_parameters
from patchwright.ssi.bezier_pieces import BezierPieces
from patchwright.ssi.intersection import Box
from patchwright.ssi.mesh_topology import TRANSVERSAL, Traced, trace

N = TypeVar("N", bound=np.generic)

RIM = 1e-9  # of the parameters' range: an end this near a border of the surface lies on it


@dataclass(frozen=True, slots=True, eq=False)
class Arcs:
    """One arc per row.

    Parameters
    ----------
    triangle : (n,) its triangle
    normal : (n, 3) unit normal of that
    ends : (n, 2, 3) in space, in the triangle's plane
    uv : (n, 2, 2) in the surface's own parameters
    side : (n, 2) side of the triangle each end lies on, -1 for none
    """

    triangle: IntArray
    normal: Array
    ends: Array
    uv: Array
    side: IntArray

    @classmethod
    def of(cls, rows: Array, mesh: Triangulation, surface: Surface, pieces: BezierPieces) -> Arcs:
        """The arcs among the kernel's findings."""
        from patchwright.ssi import _triangle_box_kernel as kernel

        some = rows[rows[:, 0] == kernel.ARC]
        along = np.flatnonzero(some[:, 14] != kernel.BORDER)
        if len(along):  # an arc along a side of two triangles is the lower one's
            lower = _lowest(mesh)[some[along, 1].astype(np.int64), some[along, 14].astype(np.int64)]
            some = np.delete(some, along[lower != some[along, 1]], axis=0)
        triangle, piece = some[:, 1].astype(np.int64), some[:, 2].astype(np.int64)
        uv = np.stack([cls.parameters(surface, pieces, piece, some[:, 8 + 2 * k : 10 + 2 * k]) for k in (0, 1)], axis=1)
        ends = np.asarray(surface(uv[..., 0], uv[..., 1])).reshape(-1, 2, 3)
        side = np.where(some[:, 12:14] == kernel.BORDER, -1, some[:, 12:14]).astype(np.int64)
        corners = mesh.corners[triangle]
        normal = mesh.normals[triangle]
        ends = ends - np.einsum("nki,ni->nk", ends - corners[:, :1], normal)[..., None] * normal[:, None]
        for k in range(2):
            on = np.flatnonzero(side[:, k] >= 0)
            foot, tip = corners[on, side[on, k]], corners[on, (side[on, k] + 1) % 3]
            way = tip - foot
            share = np.einsum("ni,ni->n", ends[on, k] - foot, way) / np.einsum("ni,ni->n", way, way)
            ends[on, k] = foot + share[:, None] * way
        return cls(triangle, normal, ends, uv, side)

    @staticmethod
    def parameters(surface: Surface, pieces: BezierPieces, piece: IntArray, local: Array) -> Array:
        """(n, 2) own parameters of local ones (n, 2) on pieces."""
        if not len(piece):
            return np.zeros((0, 2))
        jets = np.zeros((len(piece), 3, 7))
        jets[:, 0, 3:5] = pieces.parameters(piece, local)
        middle = pieces.parameters(piece, np.array([0.5, 0.5]))
        return np.asarray(in_analytic_parameters(jets, 0, surface, middle)[:, 0, 3:5])

    @classmethod
    def touches(
        cls, rows: Array, mesh: Triangulation, surface: Surface, pieces: BezierPieces, points: IntArray, arcs: Arcs
    ) -> tuple[IntArray, Array, Array]:
        """Triangles, parameters and points where the surface may touch: the kernel's, and arcs that are points."""
        from patchwright.ssi import _triangle_box_kernel as kernel

        some = rows[(rows[:, 0] == kernel.POINT) | (rows[:, 0] == kernel.TOUCH)]
        uv = cls.parameters(surface, pieces, some[:, 2].astype(np.int64), some[:, 8:10])
        uv = np.concatenate([uv, arcs.uv[points, 0]])
        triangle = np.concatenate([some[:, 1].astype(np.int64), arcs.triangle[points]])
        return triangle, uv, np.asarray(surface(uv[:, 0], uv[:, 1]))

    def __len__(self) -> int:
        return len(self.triangle)


@dataclass(frozen=True, slots=True, eq=False)
class Chains:
    """Arcs in the order of curves: those of curve i are rows `offsets[i]:offsets[i + 1]`, each run forwards.

    `place` (n, 2) numbers the points their ends are; `closed` says which curves are.
    """

    offsets: IntArray
    arcs: Arcs
    place: IntArray
    closed: BoolArray


def joined(arcs: Arcs, reach: float) -> tuple[Chains, IntArray]:
    """Curves through arcs whose ends lie within `reach`, and the arcs that are no longer than that.

    Points where other than two arcs end, end curves.
    """
    place, points = places(arcs.ends.reshape(-1, 3), reach)
    place = place.reshape(-1, 2)
    length = np.linalg.norm(arcs.ends[:, 1] - arcs.ends[:, 0], axis=1)
    keep = np.flatnonzero((place[:, 0] != place[:, 1]) | (length > 4.0 * reach))
    points_only = np.setdiff1d(np.arange(len(arcs)), keep)
    segments = place[keep]
    traced: Traced = trace(segments, np.full(len(keep), TRANSVERSAL), len(points))
    number = np.repeat(np.arange(len(traced)), np.diff(traced.offsets))
    start = traced.points[np.arange(len(traced.chain)) + number]
    row = keep[traced.chain]
    turned = segments[traced.chain, 0] != start

    def way(x: npt.NDArray[N]) -> npt.NDArray[N]:
        out = x[row].copy()
        out[turned] = out[turned, ::-1]
        return out

    ordered = Arcs(arcs.triangle[row], arcs.normal[row], way(arcs.ends), way(arcs.uv), way(arcs.side))
    return Chains(traced.offsets, ordered, way(place), traced.closed), points_only


def places(points: Array, reach: float) -> tuple[IntArray, Array]:
    """Which place each point is, places in lexicographic order, and a point of each."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    if not len(points):
        return np.zeros(0, dtype=np.int64), points
    i, j = cKDTree(points).query_pairs(reach, output_type="ndarray").T
    graph = coo_array((np.ones(len(i)), (i, j)), shape=(len(points), len(points)))
    _, label = connected_components(graph, directed=False)
    order = np.lexsort(points.T[::-1])
    _, first = np.unique(label[order], return_index=True)
    lead = order[first]
    rank = np.empty(len(lead), dtype=np.int64)
    rank[np.lexsort(points[lead].T[::-1])] = np.arange(len(lead))
    out = np.empty((len(lead), 3))
    out[rank] = points[lead]
    return rank[label], out


def loose_ends(arcs: Arcs, chains: Chains, mesh: Triangulation, surface: Surface) -> list[tuple[int, Box]]:
    """Triangles and places on the surface where a curve ends though neither the mesh nor the surface does."""
    if not len(chains.arcs):
        return []
    uses = np.bincount(chains.place.reshape(-1))
    rows, column = np.nonzero(uses[chains.place] == 1)
    if not len(rows):
        return []
    low, high = np.array(surface.domain).T
    uv = chains.arcs.uv[rows, column]
    rim = RIM * (high - low)
    free = _on_border(surface, uv, rim)
    side = chains.arcs.side[rows, column]
    free |= (side >= 0) & _open_sides(mesh)[chains.arcs.triangle[rows], side]
    out: list[tuple[int, Box]] = []
    for k in np.flatnonzero(~free).tolist():
        a, b = np.maximum(uv[k] - rim, low).tolist(), np.minimum(uv[k] + rim, high).tolist()
        out.append((int(chains.arcs.triangle[rows[k]]), ((a[0], b[0]), (a[1], b[1]))))
    return out


def _on_border(surface: Surface, uv: Array, rim: Array) -> BoolArray:
    """(n,) whether places lie on a border of the surface that is no seam: it does not go on at the opposite one."""
    low, high = np.array(surface.domain).T
    here = np.asarray(surface(uv[:, 0], uv[:, 1]))
    free = np.zeros(len(uv), dtype=np.bool_)
    for axis in range(2):
        beyond = uv.copy()
        beyond[:, axis] = low[axis] + high[axis] - uv[:, axis]
        away = np.linalg.norm(np.asarray(surface(beyond[:, 0], beyond[:, 1])) - here, axis=1)
        at = (uv[:, axis] <= low[axis] + rim[axis]) | (uv[:, axis] >= high[axis] - rim[axis])
        free |= at & (away > RIM * np.linalg.norm(here.max(axis=0, initial=0.0)))
    return free


def _sides(mesh: Triangulation) -> tuple[IntArray, IntArray, IntArray]:
    """(3 m,) the edge each side of each triangle is, corners compared by coordinates; uses and first side of edges."""
    _, number = np.unique(mesh.vertices, axis=0, return_inverse=True)
    rows = number.reshape(-1)[mesh.triangles]
    ends = np.sort(np.stack([rows, np.roll(rows, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    _, first, inverse, count = np.unique(ends, axis=0, return_index=True, return_inverse=True, return_counts=True)
    return inverse.reshape(-1), count, first


def _open_sides(mesh: Triangulation) -> BoolArray:
    """(m, 3) sides of triangles, from corner k on, that no other triangle has."""
    edge, uses, _ = _sides(mesh)
    open_: BoolArray = (uses[edge] == 1).reshape(-1, 3)
    return open_


def _lowest(mesh: Triangulation) -> IntArray:
    """(m, 3) the lowest triangle at each side."""
    edge, _, first = _sides(mesh)
    return (first[edge] // 3).reshape(-1, 3)
