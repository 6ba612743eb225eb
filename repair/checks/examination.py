"""`Examination`: a model under diagnosis, with what several checks need, computed when first asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation

if TYPE_CHECKING:
    from patchwright.repair.mender.orient import Oriented
    from patchwright.repair.mender.rims import Rim
    from patchwright.repair.mender.weld import Copies
    from patchwright.repair.surroundings import Surroundings

CURVE_END = 1e-3  # of the diagonal: where the curve of free edges ends
SMALL_OPENING = 0.05  # of the square root of a component's area: it bounds a body all the same


@dataclass(frozen=True, eq=False)
class Examination:
    """One model and its derived states; none of them changes the model.

    The states, each with the triangles of the one before: `merged` (vertices with equal coordinates are one), `welded`
    (copies of a point within the distance the data shows are one), `body` (collapsed and doubled triangles left out;
    `body_index` are its triangles), `oriented` (as few triangles reversed as a consistent, outward orientation takes).
    """

    assembly: Assembly
    tolerance: Tolerance
    surroundings: Surroundings

    @cached_property
    def raw(self) -> Triangulation:
        """All parts, tagged by part."""
        return self.assembly.triangulation

    @cached_property
    def merged(self) -> Triangulation:
        """Vertices with equal coordinates merged."""
        from patchwright.repair.mender.weld import weld

        return weld(self.raw, 0.0).triangulation

    @cached_property
    def merged_index(self) -> IntArray:
        """(k,) the triangles of `merged` with three different vertices: those `adjacency` is of."""
        return np.flatnonzero(~two_corners(self.merged.triangles))

    @cached_property
    def adjacency(self) -> Adjacency:
        """Of `merged` without the triangles that use one vertex twice."""
        whole = len(self.merged_index) == len(self.merged)
        return Adjacency.of(self.merged if whole else self.merged.take(self.merged_index))

    @cached_property
    def open_edges(self) -> int:
        """Free edges of `merged`."""
        return int(np.count_nonzero(self.adjacency.free))

    @cached_property
    def copies(self) -> Copies:
        """Free edges of `raw` that may be copies of each other, as far apart as any check looks for them."""
        from patchwright.repair.mender.weld import Copies, reach_of

        return Copies.of(self.raw, max(reach_of(self.tolerance), CURVE_END * self.diagonal))

    @cached_property
    def weld_distance(self) -> tuple[float, str]:
        """The distance at which copies of one point are merged, and why; 0 when nothing is open."""
        from patchwright.repair.mender.weld import weld_distance

        if not self.open_edges:
            return 0.0, "no edge is free"
        return weld_distance(self.raw, self.tolerance, self.copies)

    @cached_property
    def welded(self) -> Triangulation:
        """Copies of one point merged."""
        from patchwright.repair.mender.weld import weld_shown

        distance = self.weld_distance[0]
        if distance <= 0.0:
            return self.merged
        return weld_shown(self.raw, distance, self.copies, self.tolerance)[0].triangulation

    @cached_property
    def collapsed(self) -> BoolArray:
        """(m,) triangles of `welded` that use one vertex twice."""
        return two_corners(self.welded.triangles)

    @cached_property
    def duplicate(self) -> BoolArray:
        """(m,) triangles of `welded` over the same three vertices as an earlier one."""
        from patchwright.repair.mender._weld_kernel import merge_exact

        key = np.sort(self.welded.triangles, axis=1)
        return np.asarray((merge_exact(key) != np.arange(len(key))) & ~self.collapsed)

    @cached_property
    def flat(self) -> BoolArray:
        """(m,) triangles of `raw` with three corners but no height beyond the rounding of their coordinates."""
        from patchwright.repair.mender._clean_kernel import triangle_heights

        height = triangle_heights(self.raw.vertices, self.raw.triangles)
        rounding = 4.0 * float(np.finfo(np.float64).eps) * float(np.abs(self.raw.bounds).max())
        return np.asarray((height <= rounding) & ~two_corners(self.merged.triangles))

    @cached_property
    def body_index(self) -> IntArray:
        """(b,) the triangles of `body`."""
        return self._cleaned[1]

    @cached_property
    def body(self) -> Triangulation:
        """`welded` without collapsed triangles, with one copy of doubled ones, none where they are a wall inside.

        Triangles without height that merely hang on others' edges are left out as well.
        """
        return self._cleaned[0]

    @cached_property
    def _cleaned(self) -> tuple[Triangulation, IntArray]:
        from patchwright.repair.mender.clean import drop_collapsed, drop_duplicates

        if not (self.collapsed.any() or self.duplicate.any() or self.flat.any()):
            return self.welded, np.arange(len(self.welded))
        whole = drop_collapsed(self.welded)
        single = drop_duplicates(whole.triangulation)
        index = whole.parents[single.parents]
        flat = self.flat[index]
        if flat.any():
            adjacency = Adjacency.of(single.triangulation)
            around = adjacency.triangle_edges
            free = np.count_nonzero(adjacency.free[around], axis=1)
            flap = flat & ((free >= 2) | ((free > 0) & adjacency.non_manifold[around].any(axis=1)))
            return single.triangulation.take(~flap), index[~flap]
        return single.triangulation, index

    @cached_property
    def body_adjacency(self) -> Adjacency:
        """Of `body`."""
        return self.adjacency if self.body is self.merged else Adjacency.of(self.body)

    @cached_property
    def component(self) -> IntArray:
        """(b,) label of each triangle of `body`, connected through edges."""
        return np.asarray(self.body_adjacency.components(), dtype=np.int64)

    @cached_property
    def component_closed(self) -> BoolArray:
        """(c,) components of `body` without a free edge."""
        open_triangle = self.body_adjacency.free[self.body_adjacency.triangle_edges].any(axis=1)
        return np.asarray(np.bincount(self.component, weights=open_triangle) == 0)

    @cached_property
    def oriented(self) -> Oriented:
        """`body` with a consistent, outward orientation."""
        from patchwright.repair.mender.orient import orient

        return orient(self.body, self.body_adjacency)

    @cached_property
    def normals(self) -> Array:
        """(b, 3) unit normals of `oriented`; zero for a triangle without area."""
        return self.oriented.triangulation.normals

    @cached_property
    def areas(self) -> Array:
        """(b,) areas of the triangles of `body`."""
        return self.body.areas

    @cached_property
    def rims(self) -> tuple[Rim, ...]:
        """The rims of `oriented`."""
        from patchwright.repair.mender.rims import classify_rims

        turned = self.oriented.flipped.any()
        adjacency = Adjacency.of(self.oriented.triangulation) if turned else self.body_adjacency
        return classify_rims(self.oriented.triangulation, adjacency, self.tolerance)

    @cached_property
    def bodies(self) -> BoolArray:
        """(c,) components of `body` that bound a body: closed, or open by gaps, holes and next to no openings."""
        area = np.bincount(self.component, weights=self.areas)
        wide = np.zeros(len(area))
        for rim in self.rims:
            if rim.kind == "opening":
                own = self.component[rim.triangles[0]]
                wide[own] = max(wide[own], rim.diameter)
        return np.asarray(wide <= SMALL_OPENING * np.sqrt(area))

    def run_past(self, label: IntArray) -> BoolArray:
        """(k,) pairs of components (k, 2) whose rims run past each other: what comes of it is one overlap."""
        count = len(self.component_closed)
        some = [
            (self.component[rim.triangles[0]], self.component[self.rims[rim.overlaps].triangles[0]])
            for rim in self.rims
            if rim.overlaps is not None
        ]
        pair = np.sort(np.array(some, dtype=np.int64).reshape(-1, 2), axis=1)
        own = np.sort(label, axis=1)
        return np.asarray((own[:, 0] != own[:, 1]) & np.isin(own @ [count, 1], pair @ [count, 1]))

    @cached_property
    def crossing_pairs(self) -> IntArray:
        """(k, 2) pairs of triangles of `body` that pass through each other."""
        from patchwright.repair.mender.crossings import crossing_pairs

        return crossing_pairs(self.body, self.tolerance.gap)

    @cached_property
    def tessellation_crossings(self) -> IntArray:
        """(k, 2) pairs of triangles of `merged` that pass through each other."""
        from patchwright.repair.mender.crossings import crossing_pairs

        return crossing_pairs(self.merged, self.tolerance.gap)

    @cached_property
    def junctions(self) -> IntArray:
        """(k, 3) vertex, triangle of `oriented` and its edge 0..2 the vertex lies on, along the rims."""
        from patchwright.repair.checks.junctions import find_junctions

        return find_junctions(self)

    @cached_property
    def diagonal(self) -> float:
        """Diagonal of the model's box, without what bounds the flow domain from outside."""
        return self.surroundings.body_size(self.assembly).diagonal

    def parts_of(self, triangles: IntArray) -> tuple[str, ...]:
        """Names of the parts some triangles (indices into `raw`) lie in."""
        tags = self.raw.tags
        if tags is None or not self.raw.tag_names:
            return ()
        return tuple(self.raw.tag_names[k] for k in np.flatnonzero(np.bincount(tags[triangles].reshape(-1))))

    def triangles_of_face(self, faces: list[int]) -> IntArray:
        """One triangle (index into `raw`) of each of some CAD faces that have any."""
        sizes = np.array([len(part.triangulation) for part in self.assembly.parts], dtype=np.int64)
        starts = np.cumsum(sizes) - sizes
        return np.array([starts[face] for face in faces if sizes[face]], dtype=np.int64)

    def length(self, value: float) -> str:
        """A length in words: the number, the unit when it is known, and its share of the diagonal."""
        unit = "" if self.assembly.unit == "unknown" else f" {self.assembly.unit}"
        share = value / self.diagonal if self.diagonal > 0.0 else 0.0
        return f"{value:.3g}{unit} ({share:.2g} of the diagonal)"


def corners_of(triangulation: Triangulation, which: IntArray) -> Array:
    """(k, 3, 3) corners of some triangles, without those of all the others."""
    return triangulation.vertices[triangulation.triangles[which]]


def two_corners(triangles: IntArray) -> BoolArray:
    """(m,) triangles that use one vertex twice."""
    a, b, c = triangles.T
    return np.asarray((a == b) | (b == c) | (c == a))


def box_of(points: Array) -> Array:
    """(2, 3) box of some points (..., 3)."""
    flat = np.asarray(points).reshape(-1, 3)
    return np.stack([flat.min(axis=0), flat.max(axis=0)])
