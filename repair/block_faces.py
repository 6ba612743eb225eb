"""Faces of a patch network: the patches of each block of quads as one bicubic surface, shared edges kept.

A block of M x N patches is stored as one surface whose knots are simple inside a patch and triple where two patches
meet: the same points as before, one face in place of M N. Lines across a block along which patches turn by more than
`JOINT` against each other stay borders of faces, so that no face has a crease inside. Blocks meet at T-junctions: a
side of a face is one edge per quad along it, and each edge is the network's own curve.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.block_cuts import cut_along, cut_apart
from patchwright.repair.blocks import Blocks
from patchwright.repair.joins import seam_angles, side_normals
from patchwright.repair.network import PatchNetwork
from patchwright.repair.spline_space import DEGREE, knots

JOINT = 0.5  # degrees: patches that turn more against each other are different faces
_LINE = np.array([0.0, 0.0, 1.0, 1.0])
# the corners in the order of a loop: which end of u and which end of v; side k runs from corner k to corner k + 1
_CORNER = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])


@dataclass(frozen=True, slots=True, eq=False)
class BlockFaces:
    """The faces of a network.

    Parameters
    ----------
    face : (m,) the face of each patch
    surfaces : one bicubic surface per face, normals outward, domain [0, 1] x [0, 1]
    topology : vertices, edges and loops of the faces
    """

    face: IntArray
    surfaces: tuple[NurbsSurface, ...]
    topology: Topology

    def __len__(self) -> int:
        return len(self.surfaces)


def block_faces(network: PatchNetwork, blocks: Blocks) -> BlockFaces:
    """The faces of a network.

    Parameters
    ----------
    network : patches that join exactly
    blocks : of the network's layout; cut where patches join too roughly and where a block meets itself

    The knots of a face grow with the mean lengths of its columns and rows of patches.
    """
    layout = network.layout
    rough = seam_angles(layout, side_normals(layout, network.nets)) > JOINT
    blocks = cut_apart(layout, cut_along(layout, blocks, rough))
    nets = network.nets.refined(_common_cells(network, blocks))
    order = np.lexsort((blocks.place[:, 1], blocks.place[:, 0], blocks.block))
    starts = np.concatenate([[0], np.cumsum(blocks.shape.prod(axis=1))])
    surfaces, corners = [], np.empty((len(network), 2, 2))
    for face, (m, n) in enumerate(blocks.shape.tolist()):
        own = order[starts[face] : starts[face + 1]].reshape(m, n)
        pieces = [[np.rot90(nets.nets(q[None])[0], blocks.turn[q]) for q in column] for column in own]
        surface, u, v = _merged(pieces)
        surfaces.append(surface)
        corners[own, :, 0] = np.stack([u[:-1], u[1:]], axis=1)[:, None]
        corners[own, :, 1] = np.stack([v[:-1], v[1:]], axis=1)[None]
    return BlockFaces(blocks.block, tuple(surfaces), _topology(network, blocks, corners))


def _common_cells(network: PatchNetwork, blocks: Blocks) -> IntArray:
    """(m, 2) pieces along each patch's own u and v so that all patches of a column, and of a row, have as many."""
    across = blocks.turn % 2 == 1
    cells = np.array(network.nets.cells)
    cells[across] = cells[across, ::-1]
    for axis in (0, 1):
        line = np.concatenate([[0], np.cumsum(blocks.shape[:, axis])])[blocks.block] + blocks.place[:, axis]
        most = np.zeros(int(line.max()) + 1, dtype=np.int64)
        np.maximum.at(most, line, cells[:, axis])
        cells[:, axis] = most[line]
    cells[across] = cells[across, ::-1]
    return cells


def _merged(pieces: list[list[Array]]) -> tuple[NurbsSurface, Array, Array]:
    """One surface from the nets (k, l, 3) of a block, by column and row, and the parameters at their corners."""
    columns = [np.concatenate([net[:, (j > 0) :] for j, net in enumerate(column)], axis=1) for column in pieces]
    whole = np.concatenate([column[(i > 0) :] for i, column in enumerate(columns)], axis=0)
    length = np.array([[_lengths(net) for net in column] for column in pieces])
    u, v = (_shares(length[:, :, 0].mean(axis=1)), _shares(length[:, :, 1].mean(axis=0)))
    along_u = _joined_knots(u, [len(column[0]) - DEGREE for column in pieces])
    along_v = _joined_knots(v, [net.shape[1] - DEGREE for net in pieces[0]])
    return NurbsSurface((DEGREE, DEGREE), (along_u, along_v), whole), u, v


def _lengths(net: Array) -> tuple[float, float]:
    """Mean lengths of a net's lines along u and along v."""
    along_u = np.linalg.norm(np.diff(net, axis=0), axis=-1).sum(axis=0)
    along_v = np.linalg.norm(np.diff(net, axis=1), axis=-1).sum(axis=1)
    return float(along_u.mean()), float(along_v.mean())


def _shares(lengths: Array) -> Array:
    """Parameters in [0, 1] that grow with lengths; evenly where there is no length."""
    total = lengths.sum()
    steps = lengths / total if total > 0.0 and lengths.min() > 1e-6 * total else np.full(len(lengths), 1 / len(lengths))
    return np.concatenate([[0.0], np.cumsum(steps)[:-1], [1.0]])


def _joined_knots(at: Array, cells: list[int]) -> Array:
    """Knots of curves of `cells` equal pieces each, one after another between the parameters `at`."""
    inner = [a + (b - a) * knots(count)[DEGREE + 1 : -1] for a, b, count in zip(at[:-1], at[1:], cells, strict=True)]
    # each piece ends with three knots at its end; the last end has a fourth, as has the first beginning
    exact = [np.where(np.arange(len(k)) >= len(k) - DEGREE, b, k) for k, b in zip(inner, at[1:], strict=True)]
    return np.concatenate([np.zeros(DEGREE + 1), *exact, [1.0]])


def _topology(network: PatchNetwork, blocks: Blocks, corners: Array) -> Topology:
    """The network's edges that are no joints, and the loops of the faces; `corners` (m, 2, 2): u, v at two corners."""
    layout = network.layout
    kept = blocks.wall | layout.boundary
    number = np.cumsum(kept) - 1
    used = np.zeros(len(layout.vertices), dtype=bool)
    used[layout.edges[kept]] = True
    vertex = np.cumsum(used) - 1
    curves = tuple(network.curve(edge) for edge in np.flatnonzero(kept).tolist())
    quad, side = np.nonzero(kept[layout.quad_edges])
    turned = (side + blocks.turn[quad]) % 4
    # round each face: side by side, along the first two forwards, along the others backwards
    along = blocks.place[quad, turned % 2] * np.where(turned < 2, 1, -1)
    order = np.lexsort((along, turned, blocks.block[quad]))
    quad, side, turned = quad[order], side[order], turned[order]
    start, end = (
        np.take_along_axis(corners[quad], _CORNER[(turned + k) % 4][:, None, :], axis=1)[:, 0] for k in (0, 1)
    )
    edge, backward = layout.quad_edges[quad, side], layout.edge_reversed[quad, side]
    ends = np.where(backward[:, None, None], np.stack([end, start], axis=1), np.stack([start, end], axis=1))
    uses = [
        EdgeUse(e, b, NurbsCurve(1, _LINE, line))
        for e, b, line in zip(number[edge].tolist(), backward.tolist(), ends, strict=True)
    ]
    count = np.concatenate([[0], np.cumsum(np.bincount(blocks.block[quad], minlength=len(blocks)))]).tolist()
    loops = tuple((tuple(uses[a:b]),) for a, b in pairwise(count))
    return Topology(layout.vertices[used], curves, vertex[layout.edges[kept]], loops)
