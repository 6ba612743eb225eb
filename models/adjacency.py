"""`Adjacency`: which triangles share which edges, the components they form and the loops that bound them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from patchwright.models.arrays import BoolArray, IntArray, frozen
from patchwright.models.triangulation import Triangulation


@dataclass(frozen=True, slots=True, eq=False)
class BoundaryLoops(Sequence[IntArray]):
    """Ordered chains of boundary vertices; a sequence of index arrays.

    Parameters
    ----------
    loops : index arrays; in each the vertices follow one another along free edges, none twice
    closed : (l,) bool, whether an edge leads from the last vertex of a loop back to its first
    """

    loops: tuple[IntArray, ...]
    closed: BoolArray

    def __len__(self) -> int:
        return len(self.loops)

    def __iter__(self) -> Iterator[IntArray]:
        return iter(self.loops)

    @overload
    def __getitem__(self, which: int) -> IntArray: ...
    @overload
    def __getitem__(self, which: slice) -> tuple[IntArray, ...]: ...
    def __getitem__(self, which: int | slice) -> IntArray | tuple[IntArray, ...]:
        return self.loops[which]


@dataclass(frozen=True, slots=True, eq=False)
class Adjacency:
    """Edges of a triangulation, each stored once, and the triangles around them; linear in time and memory.

    A side whose two corners are one and the same vertex keeps an edge lo == hi, so that `triangle_edges` can always
    be used as an index; such an edge is neither free nor non-manifold and has no neighbours.

    Parameters
    ----------
    triangles : (m, 3) int64, as in the triangulation
    edges : (e, 2) int64, lo < hi, unique, in lexicographic order
    triangle_edges : (m, 3) int64, edge k joins corner k and corner k + 1 mod 3
    edge_offsets : (e + 1,) int64, `edge_members[edge_offsets[i]:edge_offsets[i + 1]]` are the triangles around edge i
    edge_members : (3 m,) int64, rising within an edge
    neighbours : (m, 3) int64, the triangle across edge k; -1 where that edge has not exactly two triangles
    inconsistent : (e,) bool, two triangles share the edge and run along it in the same direction
    """

    triangles: IntArray
    edges: IntArray
    triangle_edges: IntArray
    edge_offsets: IntArray
    edge_members: IntArray
    neighbours: IntArray
    inconsistent: BoolArray

    def __post_init__(self) -> None:
        for name in ("triangles", "edges", "triangle_edges", "edge_offsets", "edge_members", "neighbours"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.int64))
        object.__setattr__(self, "inconsistent", frozen(self.inconsistent, np.bool_))

    @classmethod
    def of(cls, triangulation: Triangulation) -> Adjacency:
        """The adjacency of a triangulation, by vertex index: weld first what coordinates alone make one."""
        from patchwright.models._adjacency_kernel import unique_edges

        found = unique_edges(triangulation.triangles, len(triangulation.vertices))
        for array in found:
            array.flags.writeable = False
        return cls(triangulation.triangles, *found)

    @property
    def edge_triangles(self) -> tuple[IntArray, IntArray]:
        """(e + 1,) offsets and (3 m,) triangles: the triangles around each edge."""
        return self.edge_offsets, self.edge_members

    @property
    def use_count(self) -> IntArray:
        """(e,) how many triangle sides lie on each edge."""
        return np.diff(self.edge_offsets)

    @property
    def free(self) -> BoolArray:
        """(e,) edges of a single triangle."""
        free: BoolArray = (self.use_count == 1) & (self.edges[:, 0] != self.edges[:, 1])
        return free

    @property
    def non_manifold(self) -> BoolArray:
        """(e,) edges of three triangles or more."""
        crowded: BoolArray = (self.use_count > 2) & (self.edges[:, 0] != self.edges[:, 1])
        return crowded

    def components(self) -> IntArray:
        """(m,) label of each triangle: 0, 1, ... by first triangle; edges of any kind connect."""
        from patchwright.models._adjacency_kernel import component_labels

        labels: IntArray = component_labels(self.edge_offsets, self.edge_members)
        return labels

    def boundary_loops(self) -> BoundaryLoops:
        """The free edges as ordered chains of vertices, in the direction their triangles run.

        A chain is split where it touches itself, so no vertex comes twice in one chain. Where the winding of the
        triangles is inconsistent an edge is run backwards. A chain stays open only where it ends at a vertex
        with an odd number of free edges, as non-manifold edges cause it.
        """
        from patchwright.models._adjacency_kernel import chains

        single = self.edge_members[self.edge_offsets[:-1][self.free]]
        corner = (self.triangle_edges[single] == np.flatnonzero(self.free)[:, None]).argmax(axis=1)
        tail = self.triangles[single, corner]
        head = self.triangles[single, (corner + 1) % 3]
        names, compact = np.unique(np.concatenate([tail, head]), return_inverse=True)
        offsets, vertices, closed = chains(compact[: len(tail)], compact[len(tail) :], len(names))
        return BoundaryLoops(tuple(np.split(names[vertices], offsets[1:-1])) if len(closed) else (), closed)
