"""A triangulation cut along its intersections with itself: but for round-off, no two of the pieces cross any more.

Points on an edge are put into every triangle at it, points where segments of three sheets meet into all three, so the
pieces fit together by vertex numbers.

Limits: which of two segments comes first round a point is decided on rounded coordinates; where that does not give a
plane graph (sheets a few units of round-off apart) the triangle is named in an error. Three sheets through one point of
an edge of one of them must have that point as a vertex.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import GeometryError
from patchwright.models.triangulation import Triangulation
from patchwright.ssi.mesh_topology import MeshIntersection

ROUNDING = 64.0 * float(np.finfo(np.float64).eps)  # of the coordinates: what placing a point may be off


@dataclass(frozen=True, slots=True, eq=False)
class CutTriangles:
    """Pieces of triangles.

    Parameters
    ----------
    vertices : (n, 3) those of the input first
    triangles : (m, 3) int64
    parents : (m,) int64, the input triangle each is, or is a piece of
    whole : (m,) bool, whether it is that triangle
    seams : (s, 2) int64, edges along which the input met itself, lower vertex first
    """

    vertices: Array
    triangles: IntArray
    parents: IntArray
    whole: BoolArray
    seams: IntArray


def cut_triangles(mesh: Triangulation, found: MeshIntersection) -> CutTriangles:
    """Cut `mesh`, whose equal vertices are one, along its self-intersection `found`.

    Raises
    ------
    GeometryError : a triangle whose segments do not form a plane graph after rounding.
    """
    from patchwright.ssi import _cut_kernel as kernel

    number, points = _numbered(mesh, found)
    ends = number[found.segments]
    owner = np.concatenate([found.sources[:, 1], found.sources[:, 2]])
    segment = np.concatenate([found.sources[:, 0]] * 2)
    edge, member = _edge_points(mesh, found, points, number, owner, segment)
    lines, first, line = np.unique(np.sort(ends, axis=1), axis=0, return_index=True, return_inverse=True)
    beside = found.triangles[first]
    owner, segment = np.unique(np.stack([owner, line.reshape(-1)[segment]], axis=1), axis=0).T
    on = [_on_rim(mesh, edge, member, owner, lines[segment, k], len(points)) for k in range(2)]
    inner = ~(on[0] & on[1]).any(axis=1) & (lines[segment, 0] != lines[segment, 1])
    inner_owner, inner_segment = owner[inner], segment[inner]
    # points where segments of a triangle meet each other
    rows, first = np.unique(inner_owner, return_index=True)
    offsets = np.append(first, len(inner_owner))
    meet = kernel.crossings(points, mesh.triangles[rows], offsets, lines[inner_segment])
    points, pieces = _split(points, lines, beside, meet, rows, inner_segment)
    cut = np.unique(np.concatenate([rows, _touched(mesh, edge)]))
    rim_offsets, rims = _rims(mesh, points, cut, edge, member)
    # split segments stand for their pieces, pieces of segments that overlap for each other
    length = np.diff(pieces.offsets)[inner_segment]
    at = np.repeat(pieces.offsets[inner_segment] - (np.cumsum(length) - length), length)
    ends = np.sort(pieces.lines[at + np.arange(int(length.sum()))], axis=1)
    within = np.unique(
        np.concatenate([np.repeat(np.searchsorted(cut, inner_owner), length)[:, None], ends], axis=1), axis=0
    )
    inside = np.searchsorted(within[:, 0], np.arange(len(cut) + 1))
    small, source, bad = kernel.cut(points, rim_offsets, rims, inside, np.ascontiguousarray(within[:, 1:]))
    if len(bad):
        where = mesh.corners[cut[bad[0]]].mean(axis=0)
        raise GeometryError(
            f"{len(bad)} triangles cannot be cut, their segments are within round-off of each other; "
            f"the first is triangle {int(cut[bad[0]])} near {np.array2string(where, precision=6)}"
        )
    kept = np.ones(len(mesh), dtype=np.bool_)
    kept[cut] = False
    left = np.flatnonzero(kept)
    triangles = np.concatenate([mesh.triangles[left], small])
    parents = np.concatenate([left, cut[source]])
    order = np.argsort(parents, kind="stable")
    whole = np.concatenate([np.ones(len(left), dtype=np.bool_), np.zeros(len(small), dtype=np.bool_)])
    return CutTriangles(points, triangles[order], parents[order], whole[order], np.sort(pieces.lines, axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class _Lines:
    """Segments in pieces: those of segment i are `lines[offsets[i]:offsets[i + 1]]`."""

    offsets: IntArray
    lines: IntArray


def _numbered(mesh: Triangulation, found: MeshIntersection) -> tuple[IntArray, Array]:
    """The number of each point of `found` among all vertices, and those. What round-off cannot tell apart is one."""
    corner = found.names[:, 1] < 0
    number = np.empty(len(found.points), dtype=np.int64)
    number[corner] = found.names[corner, 0]
    number[~corner] = len(mesh.vertices) + np.arange(int(np.count_nonzero(~corner)))
    points = np.concatenate([mesh.vertices, found.points[~corner]])
    near = np.unique(np.concatenate([mesh.triangles[np.unique(found.sources[:, 1:])].reshape(-1), number]))
    return merged(points, near, len(mesh.vertices))[number], points


def merged(points: Array, near: IntArray, fixed: int) -> IntArray:
    """(n,) the lowest number within round-off of each point among `near`, rising; points below `fixed` stay."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    reach = float(np.abs(points[near]).max(initial=0.0))
    pairs = cKDTree(points[near]).query_pairs(ROUNDING * reach, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(near), len(near)))
    _, label = connected_components(graph, directed=False)
    _, first = np.unique(label, return_index=True)  # the lowest number: a vertex of the input where there is one
    number = np.arange(len(points))
    fresh = near >= fixed
    number[near[fresh]] = near[first[label[fresh]]]
    return number


def _on_rim(
    mesh: Triangulation, edge: IntArray, member: IntArray, owner: IntArray, vertex: IntArray, count: int
) -> BoolArray:
    """(k, 3) whether a vertex lies on side 0, 1, 2 of triangle `owner`, corners on two."""
    rows = mesh.triangles[owner]
    following = np.roll(rows, -1, axis=1)
    result: BoolArray = (rows == vertex[:, None]) | (following == vertex[:, None])
    if not len(edge):
        return result
    names, index = np.unique(_keys(mesh, edge), return_inverse=True)
    held = np.sort(index.reshape(-1) * count + member)
    keys = np.minimum(rows, following) * len(mesh.vertices) + np.maximum(rows, following)
    at = np.minimum(np.searchsorted(names, keys), len(names) - 1)
    wanted = at * count + vertex[:, None]
    found = held[np.minimum(np.searchsorted(held, wanted), len(held) - 1)] == wanted
    result |= found & (names[at] == keys)
    return result


def _edge_points(
    mesh: Triangulation,
    found: MeshIntersection,
    points: Array,
    number: IntArray,
    owner: IntArray,
    segment: IntArray,
) -> tuple[IntArray, IntArray]:
    """Edges (k, 2), lower vertex first, and a point on each; every pair of an edge and a point once."""
    from patchwright.ssi import _cut_kernel as kernel

    parts = []
    # points named by a side lie on it
    used = np.unique(found.segments)
    for column in (0, 2):
        names = found.names[used]
        side = (names[:, column + 1] >= 0) & ((names[:, 4] < 0) | (column == 0))
        parts.append(
            np.concatenate([np.sort(names[side, column : column + 2], axis=1), number[used[side], None]], axis=1)
        )
    # a vertex of another triangle may lie on a side
    for end in range(2):
        point = found.segments[segment, end]
        ask = np.flatnonzero(found.names[point, 1] < 0)
        vertex, of = number[point[ask]], owner[ask]
        rows = mesh.triangles[of]
        apart = (rows != vertex[:, None]).all(axis=1)
        vertex, of, rows = vertex[apart], of[apart], rows[apart]
        side = kernel.sides_of(points, mesh.triangles, of, vertex)
        hit = side >= 0
        a, b = rows[hit, side[hit]], rows[hit, (side[hit] + 1) % 3]
        parts.append(np.stack([np.minimum(a, b), np.maximum(a, b), vertex[hit]], axis=1))
    every = np.unique(np.concatenate(parts), axis=0)
    every = every[(every[:, 0] != every[:, 2]) & (every[:, 1] != every[:, 2])]
    return every[:, :2], every[:, 2]


def _keys(mesh: Triangulation, edges: IntArray) -> IntArray:
    return edges[:, 0] * len(mesh.vertices) + edges[:, 1]


def _touched(mesh: Triangulation, edge: IntArray) -> IntArray:
    """Triangles at any of the edges."""
    if not len(edge):
        return np.zeros(0, dtype=np.int64)
    wanted = np.unique(_keys(mesh, edge))
    at_vertex = np.zeros(len(mesh.vertices), dtype=np.bool_)
    at_vertex[edge[:, 0]] = True
    some = np.flatnonzero(at_vertex[mesh.triangles].any(axis=1))
    rows = mesh.triangles[some]
    following = np.roll(rows, -1, axis=1)
    keys = np.minimum(rows, following) * len(mesh.vertices) + np.maximum(rows, following)
    hit = wanted[np.minimum(np.searchsorted(wanted, keys), len(wanted) - 1)] == keys
    touched: IntArray = some[hit.any(axis=1)]
    return touched


def _split(
    points: Array,
    lines: IntArray,
    beside: IntArray,
    meet: IntArray,
    rows: IntArray,
    segment: IntArray,
) -> tuple[Array, _Lines]:
    """Points where three sheets meet, added; and every segment in the pieces they cut it into."""
    if not len(meet):
        return points, _Lines(np.arange(len(lines) + 1), lines)
    cross = meet[:, 3] < 0
    one, two = segment[meet[:, 1]], segment[meet[:, 2]]
    # the third triangle of each: the other one that has the segment
    owner = rows[meet[:, 0]]
    other = [np.where(beside[s, 0] == owner, beside[s, 1], beside[s, 0]) for s in (one, two)]
    triple = np.sort(np.stack([owner, *other], axis=1), axis=1)
    fresh, which = _meeting(points, np.concatenate([lines[one], lines[two]], axis=1)[cross], triple[cross])
    base = len(points)
    points = np.concatenate([points, fresh])
    new = merged(points, np.concatenate([np.unique(lines), np.arange(base, len(points))]), base)[base + which]
    on_line = np.concatenate([one[cross], two[cross], one[~cross]])
    vertex = np.concatenate([new, new, meet[~cross, 3]])
    pairs = np.unique(np.stack([on_line, vertex], axis=1), axis=0)
    on_line, vertex = pairs.T
    chains = np.concatenate([np.arange(len(lines)), on_line, np.arange(len(lines))])
    nodes = np.concatenate([lines[:, 0], vertex, lines[:, 1]])
    start, stop = points[lines[chains, 0]], points[lines[chains, 1]]
    along = np.einsum("ij,ij->i", points[nodes] - start, stop - start)
    along[: len(lines)], along[-len(lines) :] = -np.inf, np.inf
    order = np.lexsort((nodes, along, chains))
    chains, nodes = chains[order], nodes[order]
    step = (chains[1:] == chains[:-1]) & (nodes[1:] != nodes[:-1])
    pieces = np.stack([nodes[:-1], nodes[1:]], axis=1)[step]
    count = np.bincount(chains[:-1][step], minlength=len(lines))
    return points, _Lines(np.concatenate([[0], np.cumsum(count)]), pieces)


def _meeting(points: Array, ends: IntArray, name: IntArray) -> tuple[Array, IntArray]:
    """The points in which pairs of segments meet, and which of them each pair meets in.

    Three sheets are seen to meet in up to three triangles; these have one `name` (k, 3) and get one point. Sheets that
    share a plane or a side may meet in several points: what does not lie on the segments of a pair is not its point.
    `ends` (k, 4) are the ends of both segments.
    """
    a, b, c, d = np.moveaxis(points[ends], 1, 0)
    # nearest points of two segments that cross up to round-off
    normal = np.cross(b - a, d - c)
    square = np.maximum(np.einsum("ij,ij->i", normal, normal), np.finfo(np.float64).tiny)
    share = np.clip(np.einsum("ij,ij->i", np.cross(c - a, d - c), normal) / square, 0.0, 1.0)
    place = a + share[:, None] * (b - a)
    near = ROUNDING * float(np.abs(points[ends]).max(initial=0.0))
    group = np.unique(name, axis=0, return_inverse=True)[1].reshape(-1)
    which = np.full(len(name), -1)
    todo, made = np.arange(len(name)), 0
    chosen: list[IntArray] = []
    while len(todo):
        names, first, at = np.unique(group[todo], return_index=True, return_inverse=True)
        lead = todo[first][at.reshape(-1)]
        fits = (_away(place[lead], a[todo], b[todo]) <= near) & (_away(place[lead], c[todo], d[todo]) <= near)
        fits |= lead == todo
        which[todo[fits]] = made + at.reshape(-1)[fits]
        chosen.append(todo[first])
        made += len(names)
        todo = todo[~fits]
    return place[np.concatenate(chosen)] if chosen else place, which


def _away(points: Array, start: Array, stop: Array) -> Array:
    """(k,) distance of each point from its segment."""
    along = stop - start
    square = np.maximum(np.einsum("ij,ij->i", along, along), np.finfo(np.float64).tiny)
    share = np.clip(np.einsum("ij,ij->i", points - start, along) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - start - share[:, None] * along, axis=1))


def _rims(
    mesh: Triangulation, points: Array, cut: IntArray, edge: IntArray, member: IntArray
) -> tuple[IntArray, IntArray]:
    """Offsets and vertices of the borders of the triangles `cut`, with the points on their sides in order."""
    keys = _keys(mesh, edge)
    start, stop = points[edge[:, 0]], points[edge[:, 1]]
    along = np.einsum("ij,ij->i", points[member] - start, stop - start)
    order = np.lexsort((member, along, keys))
    keys, member = keys[order], member[order]
    rows = mesh.triangles[cut]
    following = np.roll(rows, -1, axis=1)
    side = (np.minimum(rows, following) * len(mesh.vertices) + np.maximum(rows, following)).reshape(-1)
    first, last = np.searchsorted(keys, side), np.searchsorted(keys, side, side="right")
    forward = (rows < following).reshape(-1)
    count = last - first
    total = count + 1
    begin = np.concatenate([[0], np.cumsum(total)])
    rims = np.empty(int(begin[-1]), dtype=np.int64)
    rims[begin[:-1]] = rows.reshape(-1)
    slot = np.repeat(np.arange(len(side)), count)
    step = np.arange(len(slot)) - np.repeat(np.cumsum(count) - count, count)
    rims[begin[slot] + 1 + step] = member[np.where(forward[slot], first[slot] + step, last[slot] - 1 - step)]
    return begin[::3], rims
