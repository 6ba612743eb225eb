"""Outer hull of a union of closed meshes: cut along the curves in which they meet, keep what has the outside in front.

Each piece lies between two winding numbers of the whole: in front of it and behind it. It belongs to the hull when the
space in front is outside (0 or less) and the space behind inside (1 or more). So overlaps, nested bodies, bodies that
run through themselves and cavities (bodies facing inward) need no cases of their own. Of faces that coincide the one of
the first mesh stays; faces of two bodies against each other both go.

Limits: as those of `cut_triangles`. Bodies closer than about 1e-9 of a piece's size without touching may be refused.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import GeometryError, ParameterError
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation, concatenate
from patchwright.models.winding import winding_number
from patchwright.ssi.cut_triangles import CutTriangles, cut_triangles
from patchwright.ssi.mesh_mesh import mesh_intersection
from patchwright.ssi.mesh_topology import MeshIntersection

NEAREST = 10  # tenths of the piece's size: how near to it, at last, the winding number is asked


def outer_hull(meshes: Sequence[Triangulation]) -> Triangulation:
    """The closed outer surface of the union; triangles in the order of the input, uncut ones with their vertices.

    Tags are those of the triangle a piece was cut from; equal names become one. Cost: n log n.

    Raises
    ------
    ParameterError : the meshes together are not closed: some edge is not run as often one way as the other.
    GeometryError : sheets so near each other that the side of one the other lies on cannot be told.
    """
    return outer_pieces(concatenate(list(meshes)))[0]


def outer_pieces(whole: Triangulation) -> tuple[Triangulation, IntArray]:
    """The outer hull of all bodies of one mesh, and (m,) int64 the triangle each of its pieces is or was cut from.

    Raises
    ------
    as `outer_hull`
    """
    whole, number = _welded(whole)
    gaps = unbalanced_edges(whole.triangles, len(whole.vertices))
    if gaps:
        raise ParameterError(
            f"{gaps} edges are not closed, an outer hull needs closed and consistently oriented meshes"
        )
    if not len(whole):
        return whole, number
    found = mesh_intersection(whole)
    cut = cut_triangles(whole, found)
    patch = regions(cut)
    front, back = _sides(whole, cut, patch)
    keep = ((front <= 0) & (back >= 1))[patch]
    keep &= ~_repeated(whole, found, cut)
    hull = Triangulation(
        cut.vertices,
        cut.triangles[keep],
        tags=None if whole.tags is None else whole.tags[cut.parents[keep]],
        tag_names=whole.tag_names,
    ).compact()
    gaps = unbalanced_edges(hull.triangles, len(hull.vertices))
    if gaps:
        raise GeometryError(
            f"the outer hull has {gaps} open edges: some of the meshes are within round-off of each other"
        )
    return hull, number[cut.parents[keep]]


def unbalanced_edges(triangles: IntArray, vertices: int) -> int:
    """How many edges are not run as often one way as the other."""
    tail, head = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    keys = np.minimum(tail, head) * vertices + np.maximum(tail, head)
    order = np.argsort(keys)
    first = np.flatnonzero(np.diff(keys[order], prepend=-1))
    way = np.where(tail < head, 1, np.where(tail > head, -1, 0))[order]
    return int(np.count_nonzero(np.add.reduceat(way, first))) if len(first) else 0


def _welded(mesh: Triangulation) -> tuple[Triangulation, IntArray]:
    """Equal coordinates as one vertex, without triangles that have one vertex twice; and which triangles are left."""
    order = np.lexsort(mesh.vertices.T[::-1])
    rows = mesh.vertices[order]
    fresh = np.ones(len(rows), dtype=np.bool_)
    fresh[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    start = np.maximum.accumulate(np.where(fresh, np.arange(len(rows)), 0))
    number = np.empty(len(rows), dtype=np.int64)
    number[order] = order[start]  # the sort is stable: the lowest number of those with equal coordinates
    triangles = number[mesh.triangles]
    good = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    tags = None if mesh.tags is None else mesh.tags[good]
    return Triangulation(mesh.vertices, triangles[good], tags=tags, tag_names=mesh.tag_names), np.flatnonzero(good)


def regions(cut: CutTriangles) -> IntArray:
    """(m,) label of the connected region of each piece; seams and edges of more than two pieces part regions."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(cut.vertices)
    tail, head = cut.triangles.reshape(-1), np.roll(cut.triangles, -1, axis=1).reshape(-1)
    keys = np.minimum(tail, head) * count + np.maximum(tail, head)
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    first = np.flatnonzero(np.diff(ordered, prepend=-1))
    pair = first[np.diff(np.append(first, len(ordered))) == 2]
    seams = np.unique(cut.seams[:, 0] * count + cut.seams[:, 1])
    if len(seams):
        pair = pair[seams[np.minimum(np.searchsorted(seams, ordered[pair]), len(seams) - 1)] != ordered[pair]]
    i, j = order[pair] // 3, order[pair + 1] // 3
    size = len(cut.triangles)
    _, label = connected_components(coo_array((np.ones(len(i)), (i, j)), shape=(size, size)), directed=False)
    return label.astype(np.int64)


def _sides(whole: Triangulation, cut: CutTriangles, patch: IntArray) -> tuple[IntArray, IntArray]:
    """Winding numbers in front of and behind each region, asked at its largest piece, ever nearer until both are whole.

    They are taken when they differ by a whole number other than zero and, at a tenth of the distance, are the same.
    """
    corners = cut.vertices[cut.triangles]
    vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(vectors, axis=1)
    order = np.lexsort((-np.arange(len(area)), area, patch))
    deep = order[np.append(np.flatnonzero(np.diff(patch[order])), len(order) - 1)]
    normal = whole.normals[cut.parents[deep]]
    middle = corners[deep].mean(axis=1)
    longest = np.linalg.norm(corners[deep] - np.roll(corners[deep], 1, axis=1), axis=2).max(axis=1)
    inner = area[deep] / np.maximum(longest, np.finfo(np.float64).tiny)  # the least height of the piece
    tree = Tree.of(whole)
    result = np.zeros((2, len(deep)), dtype=np.int64)
    previous = np.full((2, len(deep)), np.nan)
    todo = np.arange(len(deep))
    for tenth in range(1, NEAREST):
        step = (inner[todo] * 10.0**-tenth)[:, None] * normal[todo]
        around = np.stack([winding_number(whole, middle[todo] + s * step, tree=tree) for s in (1.0, -1.0)])
        near = np.round(around)
        settled = (
            (near == previous[:, todo]).all(axis=0) & (near[0] != near[1]) & (np.abs(around - near) < 0.1).all(axis=0)
        )
        # between two sheets that coincide and face each other nothing changes: they go either way
        settled |= (near == previous[:, todo]).all(axis=0) & (near[0] == near[1]) & (tenth >= NEAREST // 2)
        previous[:, todo] = near
        result[:, todo[settled]] = near[:, settled].astype(np.int64)
        todo = todo[~settled]
        if not len(todo):
            return result[0], result[1]
    where = np.array2string(middle[todo[0]], precision=6)
    raise GeometryError(
        f"{len(todo)} pieces lie too near others to tell their inside from their outside, the first near {where}"
    )


def _repeated(whole: Triangulation, found: MeshIntersection, cut: CutTriangles) -> BoolArray:
    """(m,) pieces that coincide with one of an earlier triangle with the same orientation."""
    again = np.zeros(len(cut.triangles), dtype=np.bool_)
    if not len(found.coplanar):
        return again
    low, high = found.coplanar.min(axis=1), found.coplanar.max(axis=1)
    same = np.einsum("ij,ij->i", whole.normals[low], whole.normals[high]) > 0.0
    low, high = low[same], high[same]
    # every piece of the later triangle against the earlier triangle
    start, stop = np.searchsorted(cut.parents, high), np.searchsorted(cut.parents, high, side="right")
    count = stop - start
    piece = np.repeat(start - (np.cumsum(count) - count), count) + np.arange(int(count.sum()))
    earlier = np.repeat(low, count)
    middle = cut.vertices[cut.triangles[piece]].mean(axis=1)
    inside = _inside(whole.corners[earlier], middle)
    again[piece[inside]] = True
    return again


def _inside(corners: Array, points: Array) -> BoolArray:
    """(k,) whether points in the planes of triangles (k, 3, 3) lie in them."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inside = np.ones(len(points), dtype=np.bool_)
    for k in range(3):
        side = np.cross(corners[:, (k + 1) % 3] - corners[:, k], points - corners[:, k])
        inside &= np.einsum("ij,ij->i", side, normal) > 0.0
    return inside
