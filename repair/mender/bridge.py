"""Bridging: new triangles over holes and between rims that face each other; nothing that is there moves.

One loop gets the triangulation of least cost (area, and edge length squared times the turn of the normals across it)
by dynamic programming, after G. Barequet, M. Sharir, Filling gaps in the boundary of a polyhedron, Comput. Aided Geom.
Des. 12 (1995) 207, and P. Liepa, Filling holes in meshes, SGP 2003; their lexicographic (angle, area) weight is
replaced by a sum. A loop with too many points is cut at its narrowest places first. Two loops that face each other get
the strip of least cost between them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.triangulation import Triangulation

LOOP_LIMIT = 160  # points of a loop that are triangulated in one go; the work grows with their cube
FACING = 0.3  # cosine: rims face each other when the way across leaves both surfaces ahead
AGREE = 0.25  # cosine: normals across a gap agree
SHARE = 0.6  # of a rim's length that must face the other rim
ASKED = 600  # places of a rim that are asked what lies ahead
ONE = np.array([[0, 2, 1]])  # fills three points
WIDE = 0.5  # of the smaller rim's size: a wider void is not a gap


@dataclass(frozen=True, slots=True, eq=False)
class Bridge:
    """One filled void: the rims (vertex indices, the first along its triangles), its triangles, area, place and width.

    `width` is the mean way across for two rims, the square root of the area for one.
    """

    rims: tuple[IntArray, ...]
    triangles: IntArray
    area: float
    where: Array
    width: float


@dataclass(frozen=True, slots=True, eq=False)
class Bridged:
    """The triangulation with the new triangles at its end, the bridges, and the rims that could not be filled."""

    triangulation: Triangulation
    bridges: tuple[Bridge, ...]
    failed: tuple[IntArray, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Border:
    """A boundary loop with what lies along it.

    Parameters
    ----------
    vertices : (n,) int64, along the triangles' own winding
    points : (n, 3)
    normals : (n, 3) unit normal of the triangle at the edge from vertex i to i + 1
    outward : (n, 3) unit direction in that triangle's plane, perpendicular to the edge, away from the surface
    triangles : (n,) int64, that triangle
    """

    vertices: IntArray
    points: Array
    normals: Array
    outward: Array
    triangles: IntArray

    @property
    def size(self) -> float:
        """Diagonal of its bounding box."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @property
    def middles(self) -> Array:
        """(n, 3) midpoints of its edges."""
        return 0.5 * (self.points + np.roll(self.points, -1, axis=0))

    @property
    def lengths(self) -> Array:
        """(n,) lengths of its edges."""
        return np.asarray(np.linalg.norm(np.roll(self.points, -1, axis=0) - self.points, axis=1))

    @property
    def width(self) -> float:
        """Twice the area of its fan around the middle over the length: how wide it is on average."""
        local = self.points - self.points.mean(axis=0)
        area = 0.5 * np.linalg.norm(np.cross(local, np.roll(local, -1, axis=0)), axis=1).sum()
        return float(2.0 * area / max(float(self.lengths.sum()), np.finfo(float).tiny))

    @property
    def flatness(self) -> float:
        """Largest distance from the best plane, as a share of `size`."""
        local = self.points - self.points.mean(axis=0)
        _, _, axes = np.linalg.svd(local, full_matrices=False)
        return float(np.abs(local @ axes[2]).max() / max(self.size, np.finfo(float).tiny))


def borders_of(triangulation: Triangulation, adjacency: Adjacency | None = None) -> tuple[Border, ...]:
    """The boundary loops of a consistently oriented triangulation."""
    adjacency = Adjacency.of(triangulation) if adjacency is None else adjacency
    loops = [np.asarray(loop, dtype=np.int64) for loop in adjacency.boundary_loops() if len(loop) >= 3]
    if not loops:
        return ()
    triangles, points = triangulation.triangles, triangulation.vertices
    which, corner = np.nonzero(adjacency.free[adjacency.triangle_edges])
    start, end = triangles[which, corner], triangles[which, (corner + 1) % 3]
    key = start * len(points) + end
    order = np.argsort(key)
    sizes = np.array([len(loop) for loop in loops])
    stops = np.cumsum(sizes)
    flat = np.concatenate(loops)
    ahead = np.roll(flat, -1)
    ahead[stops - 1] = flat[stops - sizes]
    at = np.searchsorted(key[order], flat * len(points) + ahead)
    at = order[np.minimum(at, len(order) - 1)]
    owner = which[at]
    p, q = points[flat], points[ahead]
    apex = points[triangles[owner, (corner[at] + 2) % 3]]
    normal = _unit(np.cross(q - p, apex - p))
    outward = _unit(np.cross(q - p, normal))
    parts = [np.split(array, stops[:-1]) for array in (p, normal, outward, owner)]
    return tuple(Border(*row) for row in zip(loops, *parts, strict=True))


def facing_pairs(rims: tuple[Border, ...]) -> list[tuple[int, int]]:
    """Pairs of rims with a gap between them: most of each faces the other, and the normals agree across."""
    from scipy.spatial import cKDTree

    found: list[tuple[float, int, int]] = []
    trees = [cKDTree(rim.middles) for rim in rims]
    boxes = [(rim.points.min(axis=0), rim.points.max(axis=0)) for rim in rims]
    sizes = [rim.size for rim in rims]
    for i in range(len(rims)):
        for j in range(i + 1, len(rims)):
            reach = WIDE * min(sizes[i], sizes[j])
            apart = np.maximum(0.0, np.maximum(boxes[i][0] - boxes[j][1], boxes[j][0] - boxes[i][1]))
            if np.linalg.norm(apart) > reach or max(sizes[i], sizes[j]) > 3.0 * min(sizes[i], sizes[j]):
                continue
            there = _facing(rims[i], rims[j], trees[j], reach)
            back = _facing(rims[j], rims[i], trees[i], reach)
            if min(there[0], back[0]) >= SHARE:
                found.append((there[1] + back[1], i, j))
    taken: set[int] = set()
    pairs = []
    for _, i, j in sorted(found):
        if i not in taken and j not in taken:
            taken |= {i, j}
            pairs.append((i, j))
    return pairs


def bridge(
    triangulation: Triangulation, rims: tuple[Border, ...], singles: list[int], pairs: list[tuple[int, int]]
) -> Bridged:
    """Fill the rims `singles` each by itself and join each of `pairs` by a strip; indices count in `rims`."""
    used = _Edges.of(triangulation, [rims[i].vertices for i in singles])
    made: list[tuple[IntArray, IntArray, tuple[IntArray, ...], float | None]] = []  # triangles, parents, rims, width
    failed: list[IntArray] = []
    points, tags = triangulation.vertices, triangulation.tags
    for i, j in pairs:
        width = float(np.linalg.norm(rims[i].middles - _nearest(rims[j], rims[i].middles), axis=1).mean())
        made.append((*_strip(rims[i], rims[j]), (rims[i].vertices, rims[j].vertices), width))
    for i in singles:
        rim = rims[i]
        local = ONE if len(rim.vertices) == 3 else _fill(rim.points, rim.normals, used.chords(rim.vertices))
        if local is None:
            failed.append(rim.vertices)
            continue
        made.append((rim.vertices[local], np.full(len(local), _main(tags, rim.triangles)), (rim.vertices,), None))
    if not made:
        return Bridged(triangulation, (), tuple(failed))
    corners = np.concatenate([one[0] for one in made])
    parents = np.concatenate([one[1] for one in made])
    result = replace(
        triangulation,
        triangles=np.concatenate([triangulation.triangles, corners]),
        uv=None,
        tags=None if tags is None else np.concatenate([tags, tags[parents]]),
    )
    starts = np.cumsum([0] + [len(one[0]) for one in made])[:-1]
    areas = np.add.reduceat(_areas(points, corners), starts)
    widths = [float(np.sqrt(area)) if one[3] is None else one[3] for one, area in zip(made, areas, strict=True)]
    bridges = tuple(
        Bridge(one[2], one[0], float(area), points[np.concatenate(one[2])].mean(axis=0), width)
        for one, area, width in zip(made, areas, widths, strict=True)
    )
    return Bridged(result, bridges, tuple(failed))


@dataclass(frozen=True, slots=True, eq=False)
class _Edges:
    """Looks up which vertices of a loop are joined by an edge already; a look costs what the loop's own edges cost.

    `offsets` and `neighbours` list the vertices joined to each vertex; `place` (n,) is -1 between two looks.
    """

    offsets: IntArray
    neighbours: IntArray
    place: IntArray

    @classmethod
    def of(cls, triangulation: Triangulation, loops: list[IntArray]) -> _Edges:
        """Of the edges between vertices of some loops."""
        n = len(triangulation.vertices)
        asked = np.zeros(n, dtype=np.bool_)
        for loop in loops:
            asked[loop] = True
        near = asked[triangulation.triangles]
        ahead = np.roll(triangulation.triangles, -1, axis=1)
        both = near & asked[ahead]
        a, b = triangulation.triangles[both], ahead[both]
        start, end = np.concatenate([a, b]), np.concatenate([b, a])
        offsets = np.concatenate([[0], np.cumsum(np.bincount(start, minlength=n))]).astype(np.int64)
        return cls(offsets, end[np.argsort(start, kind="stable")], np.full(n, -1, dtype=np.int64))

    def chords(self, loop: IntArray) -> BoolArray:
        """(n, n) whether an edge joins two of the n vertices of a loop."""
        self.place[loop] = np.arange(len(loop))
        count = self.offsets[loop + 1] - self.offsets[loop]
        row = np.repeat(np.arange(len(loop)), count)
        local = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
        other = self.place[self.neighbours[self.offsets[loop][row] + local]]
        self.place[loop] = -1
        joined = np.zeros((len(loop), len(loop)), dtype=np.bool_)
        joined[row[other >= 0], other[other >= 0]] = True
        return joined


def _fill(points: Array, normals: Array, forbidden: BoolArray) -> IntArray | None:
    """Triangles of one loop as indices into it, or None when no triangulation avoids the edges already there."""
    from patchwright.repair.mender._bridge_kernel import fill_loop, narrowest

    if len(points) > LOOP_LIMIT:
        i, j = narrowest(points, forbidden)
        if i >= 0:
            inner = np.arange(i, j + 1)
            outer = np.concatenate([np.arange(j, len(points)), np.arange(0, i + 1)])
            parts = []
            for some in (inner, outer):
                facing = normals[some].copy()
                facing[-1] = 0.0
                ban = forbidden[np.ix_(some, some)]
                filled = _fill(points[some], facing, ban)
                if filled is None:
                    return None
                parts.append(some[filled])
            return np.concatenate(parts)
    if len(points) == 3:
        return ONE
    filled = fill_loop(np.ascontiguousarray(points), np.ascontiguousarray(normals), forbidden)
    return filled if len(filled) else None


def _strip(first: Border, second: Border) -> tuple[IntArray, IntArray]:
    """Triangles of the strip between two rims and the triangle each hangs on."""
    from patchwright.repair.mender._bridge_kernel import strip

    p, q = first.points, second.points[::-1]
    p_normals, q_normals = first.normals, np.roll(second.normals[::-1], -1, axis=0)
    p_owner, q_owner = first.triangles, np.roll(second.triangles[::-1], -1)
    p_index, q_index = first.vertices, second.vertices[::-1]
    n, m = len(p), len(q)
    # start at the nearest pair, and at the nearest partners of two other places; the cheapest strip wins
    best: tuple[float, IntArray, int, int] | None = None
    nearest = np.linalg.norm(p[:, None] - q[None], axis=2) if n * m < 4_000_000 else None
    if nearest is None:
        starts = [0, n // 3, 2 * n // 3]
        partners = [int(np.argmin(np.linalg.norm(q - p[i], axis=1))) for i in starts]
    else:
        i0 = int(np.argmin(nearest.min(axis=1)))
        starts = [i0, (i0 + n // 3) % n, (i0 + 2 * n // 3) % n]
        partners = [int(np.argmin(nearest[i])) for i in starts]
    for i, j in zip(starts, partners, strict=True):
        around_p = np.concatenate([np.arange(i, n), np.arange(0, i + 1)])
        around_q = np.concatenate([np.arange(j, m), np.arange(0, j + 1)])
        cost, moves = strip(p[around_p], q[around_q], p_normals[around_p[:-1]], q_normals[around_q[:-1]])
        if best is None or cost < best[0]:
            best = cost, moves, i, j
    assert best is not None
    _, moves, i, j = best
    on_q = np.asarray(moves, dtype=np.int64)
    at_p = np.concatenate([[0], np.cumsum(1 - on_q)])[:-1]
    at_q = np.concatenate([[0], np.cumsum(on_q)])[:-1]
    p_now, p_next = p_index[(i + at_p) % n], p_index[(i + at_p + 1) % n]
    q_now, q_next = q_index[(j + at_q) % m], q_index[(j + at_q + 1) % m]
    by_p = np.stack([p_next, p_now, q_now], axis=1)
    by_q = np.stack([q_now, q_next, p_now], axis=1)
    owner = np.where(on_q == 0, p_owner[(i + at_p) % n], q_owner[(j + at_q) % m])
    return np.where((on_q == 0)[:, None], by_p, by_q), owner


def _facing(rim: Border, other: Border, tree, reach: float) -> tuple[float, float]:  # type: ignore[no-untyped-def]
    """Share of the rim's length that faces the other rim, and the mean way across."""
    way, at = tree.query(rim.middles)
    across = other.middles[at] - rim.middles
    length = np.maximum(way, np.finfo(float).tiny)
    ahead = np.einsum("ij,ij->i", across, rim.outward) / length
    met = -np.einsum("ij,ij->i", across, other.outward[at]) / length
    agree = np.einsum("ij,ij->i", rim.normals, other.normals[at])
    faces = (ahead >= FACING) & (met >= FACING) & (agree >= AGREE) & (way <= reach)
    weight = rim.lengths
    return float(weight[faces].sum() / max(weight.sum(), np.finfo(float).tiny)), float(way.mean())


def _nearest(rim: Border, points: Array) -> Array:
    from scipy.spatial import cKDTree

    return np.asarray(rim.middles[cKDTree(rim.middles).query(points)[1]])


def _main(tags: IntArray | None, triangles: IntArray) -> int:
    """A triangle of the rim with the tag most of the rim has."""
    if tags is None:
        return int(triangles[0])
    if (tags[triangles] == tags[triangles[0]]).all():
        return int(triangles[0])
    values, counts = np.unique(tags[triangles], return_counts=True)
    return int(triangles[np.flatnonzero(tags[triangles] == values[np.argmax(counts)])[0]])


def _areas(points: Array, triangles: IntArray) -> Array:
    a, b, c = points[triangles[:, 0]], points[triangles[:, 1]], points[triangles[:, 2]]
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0))


def inner_share(rim: Border) -> float:
    """Share of the rim's length from which the surface would go on into the void towards another stretch of the rim.

    Near 1 for a hole or a slit within a surface, near 0 for the end of a tube or the outer border of a sheet.
    """
    middles, lengths = rim.middles, rim.lengths
    n = len(middles)
    some = np.unique(np.linspace(0, n - 1, min(n, ASKED)).astype(np.int64))
    across = middles[None] - middles[some, None]
    way = np.linalg.norm(across, axis=2)
    ahead = np.einsum("ijk,ik->ij", across, rim.outward[some])
    met = -np.einsum("ijk,jk->ij", across, rim.outward)
    agree = rim.normals[some] @ rim.normals.T
    faces = ((ahead > FACING * way) & (met > FACING * way) & (agree > AGREE) & (way > 0.0)).any(axis=1)
    return float(lengths[some][faces].sum() / max(lengths[some].sum(), np.finfo(float).tiny))
