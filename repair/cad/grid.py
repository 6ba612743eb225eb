"""A structured grid straight on kept CAD faces: one block per four-sided face, nodes matching across shared edges."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.structured_grid import StructuredGrid
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.patches.coons import coons_grid

FEWEST, MOST = 4, 64  # intervals along a block's side
PER_DIAGONAL = 64.0  # intervals on a side as long as the model's diagonal


def four_sided_faces(topology: Topology, lengths: Array) -> list[int]:
    """Faces with one loop of four edges, at most one of them a pole: each is its own block."""
    faces = []
    for face, loops in enumerate(topology.loops):
        if len(loops) == 1 and len(loops[0]) == 4 and sum(lengths[use.edge] == 0.0 for use in loops[0]) <= 1:
            faces.append(face)
    return faces


def cad_grid(assembly: Assembly) -> tuple[StructuredGrid | None, tuple[str, ...]]:
    """The grid and the names of the faces that are not four-sided and so have no block; None when no face has one."""
    topology = assembly.topology
    if topology is None:
        return None, assembly.names
    lengths = _edge_lengths(topology)
    faces = four_sided_faces(topology, lengths)
    if not faces:
        return None, assembly.names
    intervals = _matching_intervals(topology, faces, lengths, assembly.diagonal)
    blocks = [_block(assembly, topology, face, intervals) for face in faces]
    rest = tuple(name for i, name in enumerate(assembly.names) if i not in set(faces))
    names = tuple(assembly.names[i] for i in faces)
    return StructuredGrid(tuple(blocks), names, tuple(np.zeros(b.shape[:3], dtype=np.int64) for b in blocks)), rest


def _edge_lengths(topology: Topology) -> Array:
    """(e,) chord lengths over 17 samples: enough to choose a number of nodes."""
    return np.array(
        [np.linalg.norm(np.diff(c(np.linspace(*c.domain, 17)), axis=0), axis=1).sum() for c in topology.curves]
    )


def _matching_intervals(topology: Topology, faces: list[int], lengths: Array, diagonal: float) -> IntArray:
    """(e,) intervals per edge, equal on opposite sides of every block and so all along each chain of blocks."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    pairs = [(topology.loops[f][0][k].edge, topology.loops[f][0][k + 2].edge) for f in faces for k in (0, 1)]
    i, j = np.array(pairs).T
    count = len(topology.curves)
    chains, label = connected_components(coo_matrix((np.ones(len(i)), (i, j)), shape=(count, count)), directed=False)
    longest = np.zeros(chains)
    np.maximum.at(longest, label, lengths)
    wanted = np.ceil(PER_DIAGONAL * longest / max(diagonal, 1e-300))
    return np.clip(wanted, FEWEST, MOST).astype(np.int64)[label]


def _block(assembly: Assembly, topology: Topology, face: int, intervals: IntArray) -> Array:
    """(ni, nj, 1, 3) nodes: the sides from the shared edge curves, the inside from the surface over blended (u, v)."""
    loop = topology.loops[face][0]
    points, uv = zip(*(_side(topology, use, int(intervals[use.edge])) for use in loop), strict=True)

    def blend(sides: tuple[Array, ...]) -> Array:
        return coons_grid(sides[0], sides[2][::-1], sides[3][::-1], sides[1])

    flat = blend(tuple(np.pad(side, ((0, 0), (0, 1))) for side in uv))[..., :2]
    surface = assembly.parts[face].surface
    assert surface is not None  # a face of a CAD assembly
    (u0, u1), (v0, v1) = surface.domain
    nodes = surface(np.clip(flat[..., 0], u0, u1), np.clip(flat[..., 1], v0, v1)).copy()
    nodes[:, 0], nodes[-1], nodes[:, -1], nodes[0] = points[0], points[1], points[2][::-1], points[3][::-1]
    if topology.flipped[face]:
        nodes = nodes[::-1]
    return np.ascontiguousarray(nodes[:, :, None])


def _side(topology: Topology, use: EdgeUse, intervals: int) -> tuple[Array, Array]:
    """Points and (u, v) along one side in the loop's direction, equidistant in the edge's parameter."""
    curve = topology.curves[use.edge]
    t = np.linspace(*curve.domain, intervals + 1)
    points, uv = curve(t), use.pcurve(t)
    start, end = topology.ends[use.edge]
    points[0], points[-1] = topology.vertices[start], topology.vertices[end]
    return (points[::-1], uv[::-1]) if use.reversed else (points, uv)
