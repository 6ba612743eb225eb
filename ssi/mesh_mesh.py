"""Intersection of two triangulations, or of one with itself: curves, contacts and coplanar overlaps, decided exactly.

Triangles may meet in any way: corner on corner, side along side, face on face. What meets is decided by exact signs
(`_mesh_mesh_kernel`), what joins by names of vertices, sides and faces; coordinates are computed last and always in the
same way, so that the result depends neither on the order of the triangles nor on which mesh is the first.

Limits: triangles without area are left out; where three sheets of one mesh run through one point the curves cross there
without being split; vertices are one where their coordinates are, so weld round-off cracks first. Within one mesh,
triangles that have a vertex or an edge in common, by coordinates, are neighbours there and do not meet in it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeAlias, cast

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.tree import Tree, shares_of, side_by_side
from patchwright.models.triangulation import Triangulation
from patchwright.ssi.intersection import Contact, CurveKind, Intersection, IntersectionCurve, Overlap
from patchwright.ssi.mesh_cull import near
from patchwright.ssi.mesh_topology import (
    KINDS,
    OVERLAP_BOUNDARY,
    OVERLAP_INNER,
    TANGENTIAL,
    TRANSVERSAL,
    MeshIntersection,
    trace,
)

Corners: TypeAlias = Callable[[IntArray, int], Array]  # (k, 3, 3) corners of triangles of the first or second mesh


def intersect_meshes(a: Triangulation, b: Triangulation | None = None) -> Intersection:
    """Everything two triangulations share; without `b`, where parts of `a` that are no neighbours meet each other.

    Curves are polylines as NURBS of degree 1 on arc length, split at singular points and where their kind changes:
    "transversal" where one mesh passes through the other (or ends on it), "tangential" where an edge touches without
    passing through, "overlap-boundary" round coplanar regions, which also stand in `overlaps`. Points where the meshes
    only touch are contacts. Always complete: every pair of triangles is decided.

    Cost: linear in the triangles for two meshes, n log n for one, both plus what is found.
    """
    return as_intersection(mesh_intersection(a, b), (0, 0) if b is None else (0, 1))


def mesh_intersection(a: Triangulation, b: Triangulation | None = None) -> MeshIntersection:
    """The same as arrays, with the triangles every segment lies in."""
    from patchwright.models._triangle_triangle_kernel import with_area
    from patchwright.ssi import _mesh_mesh_kernel as kernel

    second = a if b is None else b
    pairs = _candidates(a, b)
    used_a, first = np.unique(pairs[:, 0], return_inverse=True)
    used_b, other = np.unique(pairs[:, 1], return_inverse=True)
    shift = 0 if b is None else len(a.vertices)
    rows = np.concatenate([a.triangles[used_a], second.triangles[used_b] + shift])
    used, local = np.unique(rows, return_inverse=True)
    near_a = used[: np.searchsorted(used, len(a.vertices))]
    coordinates = np.concatenate([a.vertices[near_a], second.vertices[used[len(near_a) :] - shift]])
    number, points, kept = _ranked(coordinates, used)
    triangles = np.ascontiguousarray(number[local].reshape(-1, 3))
    mine, theirs = triangles[: len(used_a)], triangles[len(used_a) :]
    index = np.stack([first.reshape(-1), other.reshape(-1)], axis=1)
    good = np.zeros((2, max(len(mine), len(theirs))), dtype=np.int64)
    good[0, : len(mine)], good[1, : len(theirs)] = with_area(points, mine), with_area(points, theirs)
    work: list[Callable[[], IntArray]] = [
        partial(kernel.stretches, points, mine, theirs, share, good, b is None) for share in shares_of(index)
    ]
    found: list[IntArray] = side_by_side(work)
    lengths = np.cumsum([0] + [len(share) for share in shares_of(index)])
    for rows_found, at in zip(found, lengths[:-1], strict=True):
        rows_found[:, kernel.PAIR] += at

    def corners(which: IntArray, mesh: int) -> Array:
        return (a, second)[mesh].vertices[(a, second)[mesh].triangles[which]]

    return _assembled(np.concatenate(found), pairs, points, kept, corners)


def _candidates(a: Triangulation, b: Triangulation | None) -> IntArray:
    """(k, 2) triangles whose boxes touch."""
    if b is None:
        return Tree.of(a).touching()
    keep_a, keep_b = near(a, b)
    if not len(keep_a) or not len(keep_b):
        return np.zeros((0, 2), dtype=np.int64)
    trees = side_by_side([partial(_tree, mesh, keep) for mesh, keep in ((a, keep_a), (b, keep_b))])
    pairs = trees[0].touching(trees[1])
    return np.stack([keep_a[pairs[:, 0]], keep_b[pairs[:, 1]]], axis=1)


def _tree(mesh: Triangulation, keep: IntArray) -> Tree:
    """A tree over some triangles, which it numbers from 0."""
    if len(keep) == len(mesh):
        return Tree.of(mesh)
    used, triangles = np.unique(mesh.triangles[keep], return_inverse=True)
    return Tree.of(Triangulation(mesh.vertices[used], triangles.reshape(-1, 3)))


def _ranked(coordinates: Array, numbers: IntArray) -> tuple[IntArray, Array, IntArray]:
    """The rank of each row among the different ones in lexicographic order, those rows, and their least numbers."""
    order = np.lexsort(coordinates.T[::-1])
    rows = coordinates[order]
    fresh = np.ones(len(rows), dtype=np.bool_)
    fresh[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    rank = np.empty(len(rows), dtype=np.int64)
    rank[order] = np.cumsum(fresh) - 1
    return rank, rows[fresh] + 0.0, numbers[order[fresh]]  # + 0.0: minus zero is zero


def _rows(rows: IntArray) -> tuple[IntArray, IntArray]:
    """The different rows in lexicographic order, and which of them each is."""
    order = np.lexsort(rows.T[::-1])
    fresh = np.ones(len(rows), dtype=np.bool_)
    fresh[1:] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    inverse = np.empty(len(rows), dtype=np.int64)
    inverse[order] = np.cumsum(fresh) - 1
    return rows[order[fresh]], inverse


def _assembled(
    found: IntArray, pairs: IntArray, vertices: Array, numbers: IntArray, corners: Corners
) -> MeshIntersection:
    """Points, segments and curves from the kernel's rows."""
    from patchwright.ssi import _mesh_mesh_kernel as kernel

    names, inverse = _rows(found[:, : kernel.PAIR].reshape(-1, kernel.NAME))
    points = np.empty((len(names), 3))
    kernel.place(vertices, names, points)
    order = np.lexsort(points.T[::-1])  # stable: equal points stay in the order of their names
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    points, names = points[order], names[order]
    ends = rank[inverse].reshape(-1, 2)
    flags = found[:, kernel.FLAGS]
    lone = flags == kernel.POINT
    ends, flags, pair, single = ends[~lone], flags[~lone], found[~lone, kernel.PAIR], ends[lone, 0]
    count = max(len(points), 1)
    low, high = ends.min(axis=1), ends.max(axis=1)
    keys, segment = np.unique(low * count + high, return_inverse=True)
    segments = np.stack([keys // count, keys % count], axis=1)
    kinds = _kinds(segments, segment, ends, flags, pairs[pair], points, corners)
    sources = np.concatenate([segment[:, None], pairs[pair]], axis=1)
    coplanar, regions, areas = _overlaps(segment, ends, flags == kernel.PLANE, pair, points)
    sources = sources[np.lexsort(sources.T[::-1])]
    drawn = np.zeros(len(points), dtype=np.bool_)
    drawn[segments.reshape(-1)] = True
    contacts = np.unique(single[~drawn[single]])
    named = np.where(names >= 0, numbers[names], -1) if len(numbers) else names
    return MeshIntersection(
        points, named, segments, kinds, sources, pairs[coplanar], regions, areas, contacts,
        trace(segments, kinds, len(points)),
    )  # fmt: skip


def _kinds(
    segments: IntArray,
    segment: IntArray,
    ends: IntArray,
    flags: IntArray,
    pairs: IntArray,
    points: Array,
    corners: Corners,
) -> IntArray:
    """(s,) the kind of each segment from the flags of all pairs of triangles that share it."""
    from patchwright.ssi import _mesh_mesh_kernel as kernel

    count = len(segments)
    plane = flags == kernel.PLANE
    way = np.where(ends[:, 0] < ends[:, 1], 1.0, -1.0) * plane
    net = np.bincount(segment, way, minlength=count)
    seen = [np.bincount(segment, flags == flag, minlength=count) for flag in (1, 2, 4, 8, 16, 32, 64)]
    below, above = seen[0] + seen[2], seen[1] + seen[3]
    kinds = np.full(count, TRANSVERSAL)
    # on one side of a face only, and not the end of an open mesh
    kinds[(seen[4] == 0) & (seen[5] == 0) & ((below == 0) != (above == 0)) & (below + above > 1)] = TANGENTIAL
    along = np.flatnonzero((seen[5] > 0) & (seen[4] == 0))
    if len(along):
        kinds[along] = _along_edges(along, segments, segment, pairs, points, corners)
    # a side two polygons share lies inside the overlap, be it bent there, unless both lie on the same side of it
    kinds[seen[6] > 0] = OVERLAP_INNER
    kinds[seen[6] % 2 == 1] = OVERLAP_BOUNDARY
    folded = np.flatnonzero((seen[6] > 1) & (np.abs(net) == seen[6]))
    if len(folded):
        kinds[folded[_flat(folded, segment[plane], pairs[plane], corners)]] = OVERLAP_BOUNDARY
    return kinds


def _flat(lines: IntArray, segment: IntArray, pairs: IntArray, corners: Corners) -> BoolArray:
    """(l,) whether all overlaps at a segment lie in one plane, to round-off."""
    p = corners(pairs[:, 0], 0)
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    number = np.full(int(segment.max()) + 1, -1)
    number[lines] = np.arange(len(lines))
    here = number[segment] >= 0
    at, normal = number[segment[here]], normal[here]
    first = normal[np.unique(at, return_index=True)[1]]
    bend = np.linalg.norm(np.cross(normal, first[at]), axis=1)
    most = np.zeros(len(lines))
    np.maximum.at(most, at, bend)
    flat: BoolArray = most < np.sqrt(np.finfo(np.float64).eps)
    return flat


def _along_edges(
    along: IntArray, segments: IntArray, segment: IntArray, pairs: IntArray, points: Array, corners: Corners
) -> IntArray:
    """Kinds of segments along edges of both meshes: tangential unless the triangles alternate round the edge."""
    kinds = np.full(len(along), TRANSVERSAL)
    order = np.argsort(segment, kind="stable")
    bounds = np.searchsorted(segment[order], np.stack([along, along + 1]))
    for row, (start, stop) in enumerate(bounds.T):
        both = [np.unique(pairs[order[start:stop], k]) for k in range(2)]
        if min(len(some) for some in both) < 2:
            continue  # the end of an open mesh
        foot, tip = points[segments[along[row]]]
        axis = (tip - foot) / np.linalg.norm(tip - foot)
        away = np.concatenate([corners(some, k).mean(axis=1) - foot for k, some in enumerate(both)])
        x = away[0] - (away[0] @ axis) * axis
        angle = np.arctan2(away @ np.cross(axis, x), away @ x)
        label = np.repeat([0, 1], [len(some) for some in both])[np.argsort(angle, kind="stable")]
        if np.count_nonzero(label != np.roll(label, 1)) < 4:
            kinds[row] = TANGENTIAL
    return kinds


def _overlaps(segment: IntArray, ends: IntArray, plane: Array, pair: IntArray, points: Array
              ) -> tuple[IntArray, IntArray, Array]:  # fmt: skip
    """Pairs that overlap in one plane, the connected region each belongs to and the area each shares."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    which, cell = np.unique(pair[plane], return_inverse=True)
    if not len(which):
        return which, np.zeros(0, dtype=np.int64), np.zeros(0)
    sides, line = np.unique(segment[plane], return_inverse=True)
    ones = np.ones(len(cell))
    graph = coo_array((ones, (cell, len(which) + line)), shape=(len(which) + len(sides),) * 2)
    _, label = connected_components(graph, directed=False)
    _, regions = np.unique(label[: len(which)], return_inverse=True)
    # the vector area of each polygon about one of its own points
    about = np.empty((len(which), 3))
    about[cell] = points[ends[plane, 0]]
    start, stop = points[ends[plane, 0]] - about[cell], points[ends[plane, 1]] - about[cell]
    vectors = np.cross(start, stop)
    total = np.stack([np.bincount(cell, vectors[:, k], minlength=len(which)) for k in range(3)], axis=1)
    return which, regions, 0.5 * np.linalg.norm(total, axis=1)


def as_intersection(found: MeshIntersection, surfaces: tuple[int, int] = (0, 1)) -> Intersection:
    """The curves, contacts and overlaps of a `MeshIntersection`."""
    traced = found.traced
    closed = traced.closed
    curves: list[IntersectionCurve] = []
    rings: dict[int, list[IntersectionCurve]] = {}
    region = _region_of_segments(found)
    for i in range(len(traced)):
        points = found.points[traced.curve(i)]
        kind = cast(CurveKind, KINDS[traced.kinds[i]])
        curve = polyline(points)
        if curve is None:
            continue
        made = IntersectionCurve(curve, None, None, points, kind, bool(closed[i]), 0.0, surfaces)
        curves.append(made)
        if traced.kinds[i] == OVERLAP_BOUNDARY:
            rings.setdefault(int(region[traced.chain[traced.offsets[i]]]), []).append(made)
    contacts = tuple(Contact(found.points[i], None, None, "touch", 0.0, surfaces) for i in found.contacts)
    area = np.bincount(found.regions, found.areas)
    order = sorted(range(len(area)), key=lambda r: rings[r][0].points[0].tolist() if r in rings else [np.inf])
    overlaps = tuple(Overlap(tuple(rings.get(r, [])), float(area[r]), surfaces) for r in order)
    return Intersection(tuple(curves), contacts, overlaps)


def _region_of_segments(found: MeshIntersection) -> IntArray:
    """(s,) the overlap region a segment bounds, -1 if none."""
    region = np.full(len(found.segments), -1, dtype=np.int64)
    if len(found.coplanar):
        width = int(max(found.sources[:, 2].max(), found.coplanar[:, 1].max())) + 1
        keys = found.coplanar[:, 0] * width + found.coplanar[:, 1]
        order = np.argsort(keys)
        own = found.sources[:, 1] * width + found.sources[:, 2]
        at = np.minimum(np.searchsorted(keys[order], own), len(keys) - 1)
        hit = keys[order][at] == own
        region[found.sources[hit, 0]] = found.regions[order][at[hit]]
    return region


def polyline(points: Array) -> NurbsCurve | None:
    """A degree-1 curve through `points` (n, 3) on arc length; None if it has no length."""
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(step)])
    keep = np.concatenate([[True], np.diff(length) > 0.0])
    if np.count_nonzero(keep) < 2:
        return None
    keep[np.flatnonzero(keep)[-1]] = False
    keep[-1] = True  # the end stays the end
    length, points = length[keep], points[keep]
    return NurbsCurve(1, np.concatenate([length[:1], length, length[-1:]]), points)
