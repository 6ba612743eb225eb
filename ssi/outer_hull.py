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
from patchwright.ssi.cut_triangles import CutTriangles, cut_triangles, merged
from patchwright.ssi.flat_triangles import without_flat
from patchwright.ssi.mesh_mesh import mesh_intersection
from patchwright.ssi.mesh_topology import MeshIntersection

NEARER = (1, 2, 4, 6, 8, 9)  # tenth powers of the piece's size: how near to it the winding number is asked, in turn
THIN = 1e-13  # of the coordinates: a piece no higher is a line
COINCIDENT = 6  # from here on what is the same on both sides is taken to be so
RAYS = ((0.9347, 0.2113, 0.2857), (-0.3371, 0.7823, -0.5239))  # in no direction that models favour


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
    largest = _largest(cut, patch)
    thin = _heights(cut, largest) <= THIN * float(np.abs(whole.bounds).max())
    front, back = _sides(whole, cut, largest[~thin])
    kept = np.zeros(len(largest), dtype=np.bool_)
    kept[~thin] = (front <= 0) & (back >= 1) & ~_repeated(whole, found, cut, largest[~thin])
    kept |= _closing(cut, patch, kept, thin)
    keep = kept[patch]
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
    """What round-off cannot tell apart as one vertex, triangles without area taken out; and what each was a piece of.

    Equal coordinates become the lowest vertex that has them. Vertices within `ROUNDING` of each other would give
    pieces that no arithmetic on rounded coordinates can order, and become one too.
    """
    order = np.lexsort(mesh.vertices.T[::-1])
    rows = mesh.vertices[order]
    fresh = np.ones(len(rows), dtype=np.bool_)
    fresh[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    start = np.maximum.accumulate(np.where(fresh, np.arange(len(rows)), 0))
    number = np.empty(len(rows), dtype=np.int64)
    number[order] = order[start]  # the sort is stable: the lowest number of those with equal coordinates
    used = np.zeros(len(number), dtype=np.bool_)
    used[number[mesh.triangles]] = True
    number = merged(mesh.vertices, np.flatnonzero(used), 0)[number]
    triangles, parent = without_flat(mesh.vertices, number[mesh.triangles])
    tags = None if mesh.tags is None else mesh.tags[parent]
    return Triangulation(mesh.vertices, triangles, tags=tags, tag_names=mesh.tag_names), parent


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


def _largest(cut: CutTriangles, patch: IntArray) -> IntArray:
    """(r,) the largest piece of each region: what is true of it is true of all, and it can be told there best."""
    corners = cut.vertices[cut.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    order = np.lexsort((-np.arange(len(area)), area, patch))
    return np.asarray(order[np.append(np.flatnonzero(np.diff(patch[order])), len(order) - 1)])


def _heights(cut: CutTriangles, some: IntArray) -> Array:
    """(k,) the least height of some pieces."""
    corners = cut.vertices[cut.triangles[some]]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return np.asarray(area / np.maximum(longest, np.finfo(np.float64).tiny))


def _closing(cut: CutTriangles, patch: IntArray, kept: BoolArray, thin: BoolArray) -> BoolArray:
    """(r,) which of the `thin` regions close edges that the `kept` ones leave open.

    Three points in one line but for rounding make a piece without an inside or an outside to ask for; its border tells.
    """
    chosen = np.zeros(len(thin), dtype=np.bool_)
    if not thin.any():
        return chosen
    count = len(cut.vertices)
    tail, head = cut.triangles, np.roll(cut.triangles, -1, axis=1)
    keys, way = np.minimum(tail, head) * count + np.maximum(tail, head), np.sign(head - tail)
    some = thin[patch]
    edges, at = np.unique(keys[some], return_inverse=True)
    place = np.minimum(np.searchsorted(edges, keys[kept[patch]]), len(edges) - 1)
    mine = edges[place] == keys[kept[patch]]
    open_ = np.bincount(place[mine], way[kept[patch]][mine], minlength=len(edges))
    entries, entry = np.unique(np.repeat(patch[some], 3) * len(edges) + at.reshape(-1), return_inverse=True)
    region, edge = entries // len(edges), entries % len(edges)
    net = np.bincount(entry.reshape(-1), way[some].reshape(-1))
    while True:
        change = np.bincount(region, np.abs(open_[edge] + net) - np.abs(open_[edge]), minlength=len(thin))
        better = (change < 0) & thin & ~chosen
        if not better.any():
            return chosen
        # of those at one edge the first, as the others may not be wanted any more
        asked = better[region]
        first = np.full(len(edges), len(thin))
        np.minimum.at(first, edge[asked], region[asked])
        better[region[asked & (first[edge] != region)]] = False
        chosen |= better
        taken = better[region]
        open_ += np.bincount(edge[taken], net[taken], minlength=len(edges))


def _sides(whole: Triangulation, cut: CutTriangles, deep: IntArray) -> tuple[IntArray, IntArray]:
    """Winding numbers in front of and behind some pieces, asked ever nearer until both are whole.

    They are taken when they differ and are the same nearer to the piece.
    """
    normal = whole.take(cut.parents[deep]).normals
    middle = cut.vertices[cut.triangles[deep]].mean(axis=1)
    inner = _heights(cut, deep)
    if not len(deep):
        return deep, deep
    tree = Tree.of(whole)
    result = np.zeros((2, len(deep)), dtype=np.int64)
    previous = np.full((2, len(deep)), np.nan)
    todo = np.arange(len(deep))
    for tenth in NEARER:
        step = (inner[todo] * 10.0**-tenth)[:, None] * normal[todo]
        near = np.stack([_winding(whole, tree, middle[todo] + s * step) for s in (1.0, -1.0)])
        settled = (near == previous[:, todo]).all(axis=0)
        # between two sheets that coincide and face each other nothing changes: they go either way
        settled &= (near[0] != near[1]) | (tenth >= COINCIDENT)
        previous[:, todo] = near
        result[:, todo[settled]] = near[:, settled].astype(np.int64)
        todo = todo[~settled]
        if not len(todo):
            return result[0], result[1]
    where = np.array2string(middle[todo[0]], precision=6)
    raise GeometryError(
        f"{len(todo)} pieces lie too near others to tell their inside from their outside, the first near {where}"
    )


def _winding(whole: Triangulation, tree: Tree, points: Array) -> Array:
    """(k,) winding numbers of a closed mesh, NaN where none is near a whole number.

    Counted along rays: what leaves the mesh less what enters it. Where two rays do not agree (one ran through an edge)
    the solid angles are summed.
    """
    length = 2.0 * whole.diagonal
    counts = []
    for ray in RAYS:
        direction = np.array(ray) / np.linalg.norm(ray)
        hits = tree.all_hits(points, points + length * direction)
        way = np.sign(whole.take(hits.triangle).area_vectors @ direction)
        counts.append(np.bincount(hits.segment, way, minlength=len(points)))
    result = counts[0].astype(np.float64)
    unsure = np.flatnonzero(counts[0] != counts[1])
    if len(unsure):
        around = winding_number(whole, points[unsure], tree=tree)
        whole_number = np.round(around)
        result[unsure] = np.where(np.abs(around - whole_number) < 0.1, whole_number, np.nan)
    return result


def _repeated(whole: Triangulation, found: MeshIntersection, cut: CutTriangles, deep: IntArray) -> BoolArray:
    """(r,) which of some pieces coincide with one of an earlier triangle with the same orientation."""
    again = np.zeros(len(deep), dtype=np.bool_)
    if not len(found.coplanar):
        return again
    low, high = found.coplanar.min(axis=1), found.coplanar.max(axis=1)
    same = np.einsum("ij,ij->i", whole.take(low).area_vectors, whole.take(high).area_vectors) > 0.0
    low, high = low[same], high[same]
    # every piece of the later triangle against the earlier triangle
    order = np.argsort(cut.parents[deep], kind="stable")
    parents = cut.parents[deep][order]
    start, stop = np.searchsorted(parents, high), np.searchsorted(parents, high, side="right")
    count = stop - start
    row = order[np.repeat(start - (np.cumsum(count) - count), count) + np.arange(int(count.sum()))]
    earlier = np.repeat(low, count)
    middle = cut.vertices[cut.triangles[deep[row]]].mean(axis=1)
    inside = _inside(whole.corners[earlier], middle)
    again[row[inside]] = True
    return again


def _inside(corners: Array, points: Array) -> BoolArray:
    """(k,) whether points in the planes of triangles (k, 3, 3) lie in them."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inside = np.ones(len(points), dtype=np.bool_)
    for k in range(3):
        side = np.cross(corners[:, (k + 1) % 3] - corners[:, k], points - corners[:, k])
        inside &= np.einsum("ij,ij->i", side, normal) > 0.0
    return inside
