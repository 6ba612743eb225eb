"""Point, use and segment topology of the intersection of triangulations, and the curves traced through it.

After Jean and Hamann's structure of points, point uses and segments (HJR section 4), as arrays: a point with a number
of uses other than two ends curves, one with more than two is singular and splits branches, and what is left are loops.
Points, segments and curves come in an order that follows from their coordinates alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray

TRANSVERSAL, TANGENTIAL, OVERLAP_BOUNDARY, OVERLAP_INNER = range(4)
KINDS = ("transversal", "tangential", "overlap-boundary", "overlap-inner")


@dataclass(frozen=True, slots=True, eq=False)
class Traced:
    """Curves through segments: curve i runs along segments `chain[offsets[i]:offsets[i + 1]]`.

    Parameters
    ----------
    offsets : (c + 1,) int64
    chain : (k,) int64, segments in order
    points : (k + c,) int64, the points of curve i are `points[offsets[i] + i:offsets[i + 1] + i + 1]`
    kinds : (c,) int64, index into KINDS
    """

    offsets: IntArray
    chain: IntArray
    points: IntArray
    kinds: IntArray

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def closed(self) -> BoolArray:
        """(c,) whether a curve ends where it begins."""
        number = np.arange(len(self))
        closed: BoolArray = self.points[self.offsets[:-1] + number] == self.points[self.offsets[1:] + number]
        return closed

    def curve(self, i: int) -> IntArray:
        """The points of curve i."""
        return self.points[self.offsets[i] + i : self.offsets[i + 1] + i + 1]


@dataclass(frozen=True, slots=True, eq=False)
class MeshIntersection:
    """All that two triangulations, or the parts of one, share; for those who cut along it.

    Vertices are numbered through both meshes, those of b after those of a; of vertices with equal coordinates the first
    stands for all.

    Parameters
    ----------
    points : (n, 3) float64, model length unit, in lexicographic order
    names : (n, 5) int64, what meets in a point, by vertices, the rest -1: (v) a vertex, (v, v, v, v) two sides,
        (v, v, v, v, v) a side and a face
    segments : (s, 2) int64 points, lower first, each segment once
    kinds : (s,) int64, index into KINDS; "overlap-inner" are sides of triangles inside a coplanar overlap
    sources : (r, 3) int64, a segment and the triangles of a and of b that share it, by rising segment
    coplanar : (k, 2) int64, pairs of triangles that overlap with area in one plane
    regions : (k,) int64, the connected overlap each belongs to
    areas : (k,) float64, the area each shares
    contacts : (m,) int64, points on no segment: the meshes touch there
    traced : the curves through all segments that are not "overlap-inner"
    """

    points: Array
    names: IntArray
    segments: IntArray
    kinds: IntArray
    sources: IntArray
    coplanar: IntArray
    regions: IntArray
    areas: Array
    contacts: IntArray
    traced: Traced

    @property
    def triangles(self) -> IntArray:
        """(s, 2) a triangle of a and one of b for each segment, the lowest of those that share it."""
        first = np.searchsorted(self.sources[:, 0], np.arange(len(self.segments)))
        return self.sources[first, 1:]

    @property
    def use_count(self) -> IntArray:
        """(n,) how many segments of curves end in each point."""
        drawn = self.segments[self.kinds != OVERLAP_INNER]
        return np.bincount(drawn.reshape(-1), minlength=len(self.points))


def trace(segments: IntArray, kinds: IntArray, count: int) -> Traced:
    """Curves through `segments` (s, 2) over `count` points, split at singular points and where the kind changes."""
    from patchwright.ssi import _mesh_trace_kernel as kernel

    drawn = np.flatnonzero(kinds != OVERLAP_INNER)
    lines = segments[drawn]
    tails, heads = lines.T.reshape(-1), lines[:, ::-1].T.reshape(-1)
    order = np.lexsort((heads, tails))
    uses = np.tile(np.arange(len(lines)), 2)[order]
    offsets = np.searchsorted(tails[order], np.arange(count + 1))
    ends = np.diff(offsets) != 2
    pair = offsets[:-1][~ends]
    ends[np.flatnonzero(~ends)[kinds[drawn[uses[pair]]] != kinds[drawn[uses[pair + 1]]]]] = True
    start, points, chain = kernel.trace(lines, offsets, uses, ends)
    chain = drawn[chain]
    return Traced(start, chain, points, kinds[chain[start[:-1]]])
