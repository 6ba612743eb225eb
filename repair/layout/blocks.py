"""`Blocks`: the quads of a layout gathered into structured blocks by the motorcycle graph.

From every irregular vertex a trace runs straight along each edge, all at one speed, and stops where it meets a border
or an earlier trace (Eppstein, Goodrich, Kim, Tamstorf, Motorcycle Graphs: Canonical Quad Mesh Partitioning, 2008).
Features, boundaries and the borders between parts are walls from the beginning. The blocks are M x N grids of quads
that may meet at T-junctions; `full_faces=True` goes on until whole sides meet, which costs many more blocks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import BoolArray, IntArray
from patchwright.models.errors import GeometryError
from patchwright.repair.layout.quad_layout import QuadLayout


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """A partition of a layout's quads into rectangles.

    Parameters
    ----------
    wall : (e,) edges that are block borders
    block : (m,) the block of each quad
    place : (m, 2) column and row of each quad in its block
    turn : (m,) quarter turns, counter-clockwise, that bring a quad's own u, v to the block's
    shape : (b, 2) quads along u and v of each block
    """

    wall: BoolArray
    block: IntArray
    place: IntArray
    turn: IntArray
    shape: IntArray

    def __len__(self) -> int:
        return len(self.shape)

    def corners(self) -> tuple[IntArray, IntArray]:
        """Quads and their corner numbers, each (b, 4), at the corners (0, 0), (1, 0), (1, 1), (0, 1) of every block."""
        quads, numbers = np.empty((len(self), 4), dtype=np.int64), np.empty((len(self), 4), dtype=np.int64)
        for k, (i, j) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
            last = (self.shape - 1) * (i, j)
            at = np.flatnonzero((self.place == last[self.block]).all(axis=1))
            quads[self.block[at], k] = at
            numbers[self.block[at], k] = (k - self.turn[at]) % 4
        return quads, numbers


def find_blocks(layout: QuadLayout, *, full_faces: bool = False) -> Blocks:
    """The blocks of a layout.

    Parameters
    ----------
    layout : pure quads, oriented
    full_faces : split blocks until each side meets one whole side, as HJR section 3 asks of its patches

    Raises
    ------
    GeometryError : the quads are not an oriented 2-manifold.
    """
    from patchwright.repair.layout._block_kernel import starts

    mesh = _Mesh.of(layout)
    wall = np.array(layout.sharp | layout.boundary | _part_borders(layout))
    visited = np.zeros(len(layout.vertices), dtype=bool)
    mesh.trace(wall, visited, starts(mesh.twin, mesh.first, mesh.edge, wall, False))
    while True:
        if full_faces:
            while len(more := starts(mesh.twin, mesh.first, mesh.edge, wall, True)):
                mesh.trace(wall, visited, more)
        blocks, rings = mesh.placed(wall)
        if not len(rings):
            break
        mesh.trace(wall, visited, mesh.cuts(wall, blocks.block, rings))
    size = np.bincount(blocks.block, minlength=len(blocks))
    wrong = np.flatnonzero(size != blocks.shape.prod(axis=1))
    if len(wrong):
        quad = layout.quads[np.flatnonzero(blocks.block == wrong[0])[0]]
        where = layout.vertices[quad].mean(axis=0).round(6).tolist()
        raise GeometryError(f"the quads near {where} form no rectangular block: the layout is not a 2-manifold there")
    return blocks


def single_blocks(layout: QuadLayout) -> Blocks:
    """Every quad a block of its own."""
    m = len(layout.quads)
    zero = np.zeros(m, dtype=np.int64)
    wall = np.ones(len(layout.edges), dtype=bool)
    return Blocks(wall, np.arange(m), np.zeros((m, 2), dtype=np.int64), zero, np.ones((m, 2), dtype=np.int64))


@dataclass(frozen=True, slots=True, eq=False)
class _Mesh:
    """A layout's half-edges, see `_block_kernel`; `tail` and `head` (4 m,) are the vertices each one joins."""

    twin: IntArray
    first: IntArray
    edge: IntArray
    tail: IntArray
    head: IntArray

    @classmethod
    def of(cls, layout: QuadLayout) -> _Mesh:
        edge = np.array(layout.quad_edges.reshape(-1))
        tail, head = np.array(layout.quads.reshape(-1)), np.roll(layout.quads, -1, axis=1).reshape(-1)
        twin = np.full(len(edge), -1, dtype=np.int64)
        order = np.argsort(edge, kind="stable")
        pair = np.flatnonzero(np.diff(edge[order]) == 0)
        wrong = np.concatenate(
            [order[pair[1:]][np.diff(pair) == 1], order[pair][tail[order[pair]] == tail[order[pair + 1]]]]
        )
        if len(wrong):
            where = layout.vertices[[tail[wrong[0]], head[wrong[0]]]].mean(axis=0).round(6).tolist()
            raise GeometryError(f"three quads, or two of opposite orientation, share the edge at {where}")
        twin[order[pair]], twin[order[pair + 1]] = order[pair + 1], order[pair]
        first = np.full(len(layout.vertices), -1, dtype=np.int64)
        first[tail] = np.arange(len(edge))
        border = np.flatnonzero(twin < 0)
        first[tail[border]] = border
        return cls(twin, first, edge, tail, head)

    def trace(self, wall: BoolArray, visited: BoolArray, start: IntArray) -> None:
        """Run traces from half-edges; `wall` (e,) and `visited` (n,) grow."""
        from patchwright.repair.layout._block_kernel import trace

        visited[self.tail[start]] = True
        for end in (self.tail, self.head):
            visited[end[wall[self.edge]]] = True
        trace(self.twin, self.edge, self.head, wall, visited, start)

    def placed(self, wall: BoolArray) -> tuple[Blocks, IntArray]:
        """The blocks these walls make, and the numbers of those that close on themselves."""
        from patchwright.repair.layout._block_kernel import place_quads

        m = len(self.edge) // 4
        block, place, turn = np.full(m, -1), np.zeros((m, 2), dtype=np.int64), np.zeros(m, dtype=np.int64)
        count = place_quads(self.twin, self.edge, wall, block, place, turn)
        limits = np.iinfo(np.int64)
        low, high = np.full((count, 2), limits.max), np.full((count, 2), limits.min)
        np.minimum.at(low, block, place)
        np.maximum.at(high, block, place)
        blocks = Blocks(wall.copy(), block, place - low[block], turn, high - low + 1)
        return blocks, np.unique(block[turn < 0])

    def cuts(self, wall: BoolArray, block: IntArray, rings: IntArray) -> IntArray:
        """One half-edge for each ring: from its border inwards, or any where it has none."""
        bordered = np.zeros(int(self.tail.max()) + 1, dtype=bool)
        for end in (self.tail, self.head):
            bordered[end[wall[self.edge]]] = True
        inner = np.flatnonzero(~wall[self.edge] & np.isin(block, rings)[np.arange(len(self.edge)) // 4])
        order = inner[np.argsort(~bordered[self.tail[inner]], kind="stable")]
        _, at = np.unique(block[order // 4], return_index=True)
        return np.asarray(order[at])


def _part_borders(layout: QuadLayout) -> BoolArray:
    """(e,) edges between quads of different tags."""
    one, two = layout.edge_quads.T
    return np.asarray((two >= 0) & (layout.tags[one] != layout.tags[two]))


def smallest_corner(layout: QuadLayout, blocks: Blocks) -> float:
    """The smallest angle at a block's corner, degrees, between the chords of its sides' first quads."""
    quads, corner = blocks.corners()
    at = layout.vertices[layout.quads[quads, corner]]
    ahead = layout.vertices[layout.quads[quads, (corner + 1) % 4]] - at
    back = layout.vertices[layout.quads[quads, (corner - 1) % 4]] - at
    angle = np.arctan2(np.linalg.norm(np.cross(ahead, back), axis=-1), (ahead * back).sum(axis=-1))
    return float(np.degrees(angle.min()))
