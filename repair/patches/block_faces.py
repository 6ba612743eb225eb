"""Faces of a patch network: the patches of each block of quads as one bicubic surface, shared edges kept.

A block of M x N patches is stored as one surface whose knots are simple inside a patch and triple where two patches
meet: the same points as before, one face in place of M N. Lines across a block along which patches turn by more than
`JOINT` against each other stay borders of faces, so that no face has a crease inside. Blocks meet at T-junctions: a
side of a face has one edge for each stretch along another face, the network's own curves one after another.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.layout.block_cuts import cut_along, cut_apart
from patchwright.repair.layout.blocks import Blocks
from patchwright.repair.patches.edge_runs import joined_curve, joined_knots, passed_vertices, polyline, shares
from patchwright.repair.patches.joins import seam_angles, side_normals
from patchwright.repair.patches.network import PatchNetwork
from patchwright.repair.patches.spline_space import DEGREE

JOINT = 0.5  # degrees: patches that turn more against each other are different faces
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
    u, v = (shares(length[:, :, 0].mean(axis=1)), shares(length[:, :, 1].mean(axis=0)))
    along_u = joined_knots(u, [len(column[0]) - DEGREE for column in pieces])
    along_v = joined_knots(v, [net.shape[1] - DEGREE for net in pieces[0]])
    return NurbsSurface((DEGREE, DEGREE), (along_u, along_v), whole), u, v


def _lengths(net: Array) -> tuple[float, float]:
    """Mean lengths of a net's lines along u and along v."""
    along_u = np.linalg.norm(np.diff(net, axis=0), axis=-1).sum(axis=0)
    along_v = np.linalg.norm(np.diff(net, axis=1), axis=-1).sum(axis=1)
    return float(along_u.mean()), float(along_v.mean())


def _topology(network: PatchNetwork, blocks: Blocks, corners: Array) -> Topology:
    """Edges and loops of the faces; `corners` (m, 2, 2): u, v at two opposite corners of each patch in its face.

    Along a loop the network's edges are gathered into runs that end where faces meet or the edge turns. The two runs of
    one edge go opposite ways; the edge is built from the first.
    """
    layout = network.layout
    kept = blocks.wall | layout.boundary
    passing = passed_vertices(network, blocks, kept)
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
    first, last = layout.quads[quad, side], layout.quads[quad, (side + 1) % 4]
    used = np.zeros(len(layout.vertices), dtype=bool)
    used[first[~passing[first]]] = True
    vertex = np.cumsum(used) - 1
    breaks = [*np.flatnonzero(~passing[first]).tolist(), len(quad)]
    curves: list[NurbsCurve] = []
    at: list[Array] = []
    ends: list[tuple[int, int]] = []
    number: dict[int, int] = {}
    loops: list[list[EdgeUse]] = [[] for _ in range(len(blocks))]
    for a, b in pairwise(breaks):
        name = int(edge[a:b].min())
        reverse = name in number
        if not reverse:
            number[name] = len(curves)
            curve, places = joined_curve(network, edge[a:b], backward[a:b])
            curves.append(curve)
            at.append(places)
            ends.append((int(vertex[first[a]]), int(vertex[last[b - 1]])))
        uv = np.concatenate([start[a:b], end[b - 1 : b]])
        pcurve = polyline(at[number[name]], uv[::-1] if reverse else uv)
        loops[blocks.block[quad[a]]].append(EdgeUse(number[name], reverse, pcurve))
    return Topology(layout.vertices[used], tuple(curves), np.array(ends), tuple((tuple(loop),) for loop in loops))
