"""Sharp edges, boundaries and corners of a triangulation, chained into curves that part it into smooth regions.

An edge is sharp where the triangles' normals, freed from noise and needles, turn by more than the angle; lines that
fade below it are followed down to `HYSTERESIS` of it as long as they go straight on. What no quad fits in is dropped:
specks, teeth that a line runs out and back along, pieces of next to no area, hooks at loose ends.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import GeometryError
from patchwright.models.triangulation import Triangulation

HYSTERESIS = 0.6  # of the angle: how far a sharp line may fade
CORNER_TURN = 40.0  # degrees a feature line turns at a corner
SPECK_EDGES = 5  # a line of fewer edges and shorter than SPECK_SHARE is noise unless both its ends are attached
SPECK_SHARE = 0.01  # of the diagonal
SLIT = 1e-3  # of the diagonal, a quarter of the smallest quad: lines between the same ends that are nearer are one
ROUNDS = 4  # of cutting teeth and joining specks: what is left after that is no chain of slivers
NOISY_HEIGHT = 20.0  # times the noise: a lower triangle's own normal is off by degrees
NEEDLE_HEIGHT = 6.0  # times the noise: a lower triangle has no normal of its own
FOLLOWED, SHARP, BOUNDARY = 1, 2, 3  # kinds of curves: only followed, sharp, boundary


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """A triangulation with its feature curves.

    Parameters
    ----------
    body : the triangulation; vertices where it only touches itself are doubled, the triangles' order is the input's
    neighbours : (m, 3) triangle across the side from corner k to k + 1, -1 at the boundary
    normals : (m, 3) unit normals freed from noise
    side_curve : (m, 3) curve each side lies on, -1 for a smooth side
    region : (m,) number of the smooth piece between curves
    offsets : (c + 1,) rows of the curve arrays that belong to each curve
    vertices : (k,) vertices along each curve, both ends included; a closed curve ends where it begins
    along : (k,) arc length from the curve's start
    beside : (k, 2) triangles beside the segment that starts here, the second -1 at a boundary; the last row is as the
        one before
    kind : (c,) FOLLOWED, SHARP or BOUNDARY
    corners : (f,) vertices in which curves end
    noise : estimated scatter of the vertices off a smooth surface, a length
    """

    body: Triangulation
    neighbours: IntArray
    normals: Array
    side_curve: IntArray
    region: IntArray
    offsets: IntArray
    vertices: IntArray
    along: Array
    beside: IntArray
    kind: IntArray
    corners: IntArray
    noise: float

    @property
    def lengths(self) -> Array:
        """(c,) arc length of each curve."""
        return np.asarray(self.along[self.offsets[1:] - 1])

    def curve_edges(self, kind: int) -> IntArray:
        """(k, 2) vertex pairs along the curves of one kind."""
        owner = np.repeat(np.arange(len(self.kind)), np.diff(self.offsets))
        here = np.flatnonzero((owner[:-1] == owner[1:]) & (self.kind[owner[:-1]] == kind))
        return np.stack([self.vertices[here], self.vertices[here + 1]], axis=1)


def find_features(triangulation: Triangulation, *, angle: float = 30.0, frozen: IntArray | None = None) -> Features:
    """The feature curves of an oriented 2-manifold.

    Parameters
    ----------
    triangulation : closed or with boundary
    angle : degrees; edges that turn more are sharp
    frozen : (k, 2) vertex pairs of further edges that curves must follow, or None

    Raises
    ------
    GeometryError : no triangles, edges used by more than two triangles or in the same direction by two.
    """
    from patchwright.repair import _feature_kernel as kernel

    if not len(triangulation):
        raise GeometryError("a layout needs at least one triangle")
    body, wanted = _split_touching(triangulation, frozen)
    adjacency = Adjacency.of(body)
    edges, sides = np.asarray(adjacency.edges), np.asarray(adjacency.triangle_edges)
    neighbours = np.ascontiguousarray(adjacency.neighbours, dtype=np.int64)
    free = np.asarray(adjacency.free)
    normals, noise = _normals(body, neighbours, edges)
    # both triangles of every inner edge
    first = np.zeros(len(edges), dtype=np.int64)
    second = np.zeros(len(edges), dtype=np.int64)
    t, k = np.nonzero(neighbours >= 0)
    first[sides[t, k]], second[sides[t, k]] = t, neighbours[t, k]
    cosine = np.einsum("ij,ij->i", normals[first], normals[second])
    cosine[free] = 1.0
    sharp = cosine < np.cos(np.radians(angle))
    weak = cosine < np.cos(np.radians(HYSTERESIS * angle))
    follow = np.isin(edges[:, 0] * len(body.vertices) + edges[:, 1], wanted)
    firm = free | follow
    points, length = body.vertices, np.linalg.norm(body.vertices[edges[:, 1]] - body.vertices[edges[:, 0]], axis=1)
    sharp &= _not_specks(edges, sharp | firm, firm, length, body.diagonal)
    grown = sharp | firm
    offsets, incident = _incident(edges, len(points))
    kernel.grow_ends(points, edges, offsets, incident, grown, weak & ~free)
    sharp |= grown & ~firm
    width = max(NOISY_HEIGHT * noise, SLIT * body.diagonal)
    for _ in range(2):
        sharp &= _not_slits(edges, sharp | firm, firm, length, cosine, points, width)
        sharp &= _not_specks(edges, sharp | firm, firm, length, body.diagonal)
    _cut_teeth(body, neighbours, normals, edges, sides, sharp, firm, length, width)
    if _merge_specks(body, neighbours, normals, sides, sharp, firm, length, width**2, np.cos(np.radians(angle))):
        sharp &= _not_specks(edges, sharp | firm, firm, length, body.diagonal)
    kind = np.where(free, BOUNDARY, np.where(sharp, SHARP, np.where(follow, FOLLOWED, 0)))
    return _chains(body, neighbours, normals, noise, edges, sides, kind, first, second, width)


def _chains(
    body: Triangulation,
    neighbours: IntArray,
    normals: Array,
    noise: float,
    edges: IntArray,
    sides: IntArray,
    kind: IntArray,
    first: IntArray,
    second: IntArray,
    width: float,
) -> Features:
    """Curves through the feature edges (`kind` > 0), broken at branches, changes of kind and sharp turns."""
    from patchwright.repair import _feature_kernel as kernel

    points = body.vertices
    picked = np.flatnonzero(kind > 0)
    ends = np.ascontiguousarray(edges[picked])
    offsets, incident = _incident(ends, len(points))
    degree = np.diff(offsets)
    low, high = np.full(len(points), 9), np.zeros(len(points), dtype=np.int64)
    for column in (0, 1):
        np.minimum.at(low, ends[:, column], kind[picked])
        np.maximum.at(high, ends[:, column], kind[picked])
    stop = (degree > 0) & ((degree != 2) | (low != high))
    starts, vertices, walked, _ = kernel.trace(ends, offsets, incident, stop)
    turn = np.ones(len(vertices))
    kernel.turning(points, starts, vertices, width, turn)
    owner, along = _arc_lengths(points, starts, vertices)
    rows = starts + np.arange(len(starts))
    length = along[rows[1:] - 1][owner]
    begin, finish = vertices[rows[:-1]][owner], vertices[rows[1:] - 1][owner]
    turns = turn < np.cos(np.radians(CORNER_TURN))
    # a line that turns just before its loose end is cut there
    hook = turns & (kind[picked[walked[starts[:-1]]]] == SHARP)[owner]
    tail = 0.5 * SPECK_SHARE * body.diagonal
    loose = _outside(
        owner, hook & (degree[begin] == 1) & (along < tail), hook & (degree[finish] == 1) & (length - along < tail)
    )
    if len(loose):
        kept = kind.copy()
        kept[picked[walked[loose - owner[loose]]]] = 0
        return _chains(body, neighbours, normals, noise, edges, sides, kept, first, second, width)
    # no corner right beside another end
    apart = (along > np.where(stop[begin], width, -1.0)) & (length - along > np.where(stop[finish], width, -1.0))
    stop[vertices[turns & apart]] = True
    lo, hi = starts[:-1] + np.arange(len(starts) - 1), starts[1:] + np.arange(len(starts) - 1)
    for c in np.flatnonzero(vertices[lo] == vertices[hi]) if len(lo) else ():
        ring = vertices[lo[c] : hi[c]]
        if not stop[ring].any():
            stop[ring[np.argmin(turn[lo[c] : hi[c]])]] = True
    starts, vertices, walked, chain = kernel.trace(ends, offsets, incident, stop)
    count = len(starts) - 1
    rows = starts + np.arange(count + 1)
    owner, along = _arc_lengths(points, starts, vertices)
    segment = np.minimum(np.arange(len(vertices)) - owner, starts[1:][owner] - 1)
    edge = picked[walked[segment]]
    left = np.full(len(edges), -1, dtype=np.int64)
    right = left.copy()
    t = np.repeat(np.arange(len(body)), 3)
    left[sides.reshape(-1)] = t
    inner = np.flatnonzero(kind != BOUNDARY)
    left[inner], right[inner] = first[inner], second[inner]
    side_curve = np.full(len(edges), -1, dtype=np.int64)
    side_curve[picked] = chain
    on_sides = np.ascontiguousarray(side_curve[sides])
    return Features(
        body,
        neighbours,
        normals,
        on_sides,
        kernel.regions(neighbours, on_sides),
        rows,
        vertices,
        along,
        np.ascontiguousarray(np.stack([left[edge], right[edge]], axis=1)),
        kind[picked[walked[starts[:-1]]]],
        np.flatnonzero(stop),
        noise,
    )


def _arc_lengths(points: Array, starts: IntArray, vertices: IntArray) -> tuple[IntArray, Array]:
    """The chain of every row of `vertices` and its arc length from the chain's start."""
    rows = starts + np.arange(len(starts))
    owner = np.repeat(np.arange(len(starts) - 1), np.diff(rows))
    step = np.zeros(len(vertices))
    step[1:] = np.linalg.norm(np.diff(points[vertices], axis=0), axis=1)
    total = np.cumsum(step)
    return owner, total - total[rows[:-1]][owner] if len(vertices) else total


def _outside(owner: IntArray, before: BoolArray, after: BoolArray) -> IntArray:
    """Rows whose segment lies before the last marked row of its chain in `before`, or behind the first in `after`."""
    count = int(owner.max()) + 1 if len(owner) else 0
    last, first = np.full(count, -1), np.full(count, len(owner))
    np.maximum.at(last, owner[before], np.flatnonzero(before))
    np.minimum.at(first, owner[after], np.flatnonzero(after))
    row = np.flatnonzero(owner[:-1] == owner[1:])
    return row[(row < last[owner[row]]) | (row >= first[owner[row]])]


def _split_touching(triangulation: Triangulation, frozen: IntArray | None) -> tuple[Triangulation, IntArray]:
    """One vertex per fan of triangles, unused vertices dropped; and the keys (lo * n + hi) of the frozen edges."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    adjacency = Adjacency.of(triangulation)
    if adjacency.non_manifold.any():
        bad = int(np.flatnonzero(adjacency.non_manifold)[0])
        where = triangulation.vertices[adjacency.edges[bad]].mean(axis=0).round(6).tolist()
        raise GeometryError(
            f"a layout needs a 2-manifold, but {int(adjacency.non_manifold.sum())} edges have more than two triangles, "
            f"one at {where}"
        )
    if adjacency.inconsistent.any():
        raise GeometryError(
            f"{int(adjacency.inconsistent.sum())} edges have triangles that disagree on which side is outside"
        )
    triangles = triangulation.triangles
    m = len(triangles)
    t, k = np.nonzero(np.asarray(adjacency.neighbours) >= 0)
    other = np.asarray(adjacency.neighbours)[t, k]
    i, j = [], []
    for corner in (k, (k + 1) % 3):
        match = triangles[other] == triangles[t, corner][:, None]
        i.append(3 * t + corner)
        j.append(3 * other + match.argmax(axis=1))
    rows, columns = np.concatenate(i), np.concatenate(j)
    graph = coo_matrix((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(3 * m, 3 * m))
    count, label = connected_components(graph, directed=False)
    vertices = np.empty((count, 3))
    vertices[label] = triangulation.vertices[triangles.reshape(-1)]
    body = replace(triangulation, vertices=vertices, triangles=label.reshape(-1, 3).astype(np.int64), uv=None)
    wanted = np.zeros(0, dtype=np.int64)
    if frozen is not None and len(frozen):
        old = np.sort(np.asarray(frozen, dtype=np.int64), axis=1)
        a = triangles.reshape(-1)
        b = np.roll(triangles, -1, axis=1).reshape(-1)
        n = len(triangulation.vertices)
        asked = np.isin(np.minimum(a, b) * n + np.maximum(a, b), old[:, 0] * n + old[:, 1])
        new = label.reshape(-1, 3)
        c, d = new.reshape(-1)[asked], np.roll(new, -1, axis=1).reshape(-1)[asked]
        wanted = np.minimum(c, d) * count + np.maximum(c, d)
    return body, wanted.astype(np.int64)


def _normals(body: Triangulation, neighbours: IntArray, edges: IntArray) -> tuple[Array, float]:
    """Unit normals freed from noise and needles, and the noise."""
    from patchwright.repair import _feature_kernel as kernel

    corners = body.corners
    side = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    longest = side.argmax(axis=1)
    areas = body.areas
    width = side.max(axis=1)
    height = np.divide(2.0 * areas, width, out=np.zeros_like(width), where=width > 0)
    normals = np.array(body.normals)
    noise = max(_noise(body, edges, normals), float(np.finfo(np.float64).eps) * float(np.abs(body.vertices).max()))
    order = np.argsort(-height, kind="stable")
    kernel.settle_needles(order, neighbours, longest, height, NEEDLE_HEIGHT * noise, normals)
    noisy = height < NOISY_HEIGHT * noise
    if noisy.any():
        flat = body.triangles.reshape(-1)
        fans = np.argsort(flat, kind="stable") // 3
        offsets = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=len(body.vertices)))])
        kernel.filter_normals(body.triangles, offsets, fans, areas, noisy, 0.5, 4, normals)
    return normals, noise


def _noise(body: Triangulation, edges: IntArray, normals: Array) -> float:
    """Scatter of the vertices: the double umbrella of a smooth surface is small, that of noise 1.36 times the noise."""
    n = len(body.vertices)
    flat = body.triangles.reshape(-1)
    mean = np.zeros((n, 3))
    np.add.at(mean, flat, np.repeat(body.area_vectors, 3, axis=0))
    size = np.linalg.norm(mean, axis=1, keepdims=True)
    mean = np.divide(mean, size, out=np.zeros_like(mean), where=size > 0)
    agree = np.full(n, 1.0)
    np.minimum.at(agree, flat, np.einsum("ij,ij->i", np.repeat(normals, 3, axis=0), mean[flat]))
    degree = np.bincount(edges.reshape(-1), minlength=n)

    def umbrella(x: Array) -> Array:
        total = np.zeros_like(x)
        np.add.at(total, edges[:, 0], x[edges[:, 1]])
        np.add.at(total, edges[:, 1], x[edges[:, 0]])
        return np.asarray(total / np.maximum(degree, 1)[:, None] - x)

    rough = np.abs(np.einsum("ij,ij->i", umbrella(umbrella(body.vertices)), mean))
    corners = body.triangles
    inner = np.bincount(flat, minlength=n) == degree
    calm = inner & (agree > 0.8)
    # a vertex counts only when its whole ring is calm as well
    restless = np.zeros(n, dtype=bool)
    restless[corners[~calm[corners].all(axis=1)].reshape(-1)] = True
    calm &= ~restless
    if calm.sum() < 12:
        return 0.0
    return float(np.median(rough[calm]) / 0.92)


def _incident(edges: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Edges at each vertex as (offsets, edges)."""
    flat = edges.reshape(-1)
    offsets = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=count))])
    return offsets.astype(np.int64), np.argsort(flat, kind="stable").astype(np.int64) // 2


def _not_specks(edges: IntArray, feature: BoolArray, firm: BoolArray, length: Array, diagonal: float) -> BoolArray:
    """(e,) False for edges of short lines: pieces on their own, and loose ends that hang on something longer."""
    from patchwright.repair import _feature_kernel as kernel

    keep = np.ones(len(edges), dtype=bool)
    for _ in range(2):
        picked = np.flatnonzero(feature & keep)
        if not len(picked):
            break
        ends = np.ascontiguousarray(edges[picked])
        offsets, incident = _incident(ends, int(edges.max()) + 1)
        degree = np.diff(offsets)
        starts, vertices, _, chain = kernel.trace(ends, offsets, incident, degree != 2)
        pieces = np.diff(starts)
        size = np.bincount(chain, weights=length[picked], minlength=len(pieces))
        rows = starts[:-1] + np.arange(len(pieces))
        begin, finish = vertices[rows], vertices[rows + pieces]
        loose = (degree[begin] == 1) | (degree[finish] == 1)
        ring = (begin == finish) & (degree[begin] == 2)
        short = (size < SPECK_SHARE * diagonal) & ((pieces < SPECK_EDGES) | (size < 0.5 * SPECK_SHARE * diagonal))
        poor = short & (loose | ring)
        drop = picked[poor[chain]]
        drop = drop[~firm[drop]]
        if not len(drop):
            break
        keep[drop] = False
    return keep


def _cut_teeth(
    body: Triangulation,
    neighbours: IntArray,
    normals: Array,
    edges: IntArray,
    sides: IntArray,
    sharp: BoolArray,
    firm: BoolArray,
    length: Array,
    width: float,
) -> None:
    """Where a sharp line runs out along one side of a triangle and back along the next, take the third side instead.

    `sharp` and `normals` are changed in place. Only teeth narrower than `width` whose line turns back by less than
    `CORNER_TURN` are cut, and the triangle takes the normal of the surface it joins.
    """
    for _ in range(ROUNDS):
        feature = sharp | firm
        degree = np.bincount(edges[feature].reshape(-1), minlength=len(body.vertices))
        # side k is the one not sharp, k + 1 and k + 2 meet at corner k + 2
        third = (
            ~feature[sides] & (sharp & ~firm)[np.roll(sides, -1, axis=1)] & (sharp & ~firm)[np.roll(sides, -2, axis=1)]
        )
        t, k = np.nonzero(third & (length[sides] < width))
        apex = body.triangles[t, (k + 2) % 3]
        one = body.vertices[body.triangles[t, k]] - body.vertices[apex]
        two = body.vertices[body.triangles[t, (k + 1) % 3]] - body.vertices[apex]
        cosine = np.einsum("ij,ij->i", one, two)
        arms = np.linalg.norm(one, axis=1) * np.linalg.norm(two, axis=1)
        tooth = (degree[apex] == 2) & (cosine > np.cos(np.radians(CORNER_TURN)) * arms)
        t, k = t[tooth], k[tooth]
        # no two that share a side in one round
        first = np.full(len(edges), len(t))
        np.minimum.at(first, sides[t].reshape(-1), np.repeat(np.arange(len(t)), 3))
        alone = (first[sides[t]] == np.arange(len(t))[:, None]).all(axis=1)
        t, k = t[alone], k[alone]
        if not len(t):
            break
        sharp[sides[t, k]] = True
        for step in (1, 2):
            sharp[sides[t, (k + step) % 3]] = False
        joined = neighbours[t[:, None], (k[:, None] + np.array([1, 2])) % 3]
        largest = body.areas[joined].argmax(axis=1)
        normals[t] = normals[joined[np.arange(len(t)), largest]]


def _merge_specks(
    body: Triangulation,
    neighbours: IntArray,
    normals: Array,
    sides: IntArray,
    sharp: BoolArray,
    firm: BoolArray,
    length: Array,
    least: float,
    cosine: float,
) -> bool:
    """Join pieces of less area than `least` to the neighbour they share the longest border with.

    Their triangles take that neighbour's normal; borders that are not sharp then, by `cosine`, are dropped as well.
    `sharp` and `normals` are changed in place; whether anything was joined.
    """
    from patchwright.repair import _feature_kernel as kernel

    joined = False
    for _ in range(ROUNDS):
        region = kernel.regions(neighbours, np.where((sharp | firm)[sides], 0, -1))
        area = np.bincount(region, weights=body.areas)
        small = (area < least)[region]
        t, k = np.nonzero(small[:, None] & (neighbours >= 0) & (sharp & ~firm)[sides])
        other = neighbours[t, k]
        # a small piece goes to a larger one, so that two do not swap
        grows = (area[region[other]] > area[region[t]]) | (
            (area[region[other]] == area[region[t]]) & (region[other] > region[t])
        )
        t, k, other = t[grows], k[grows], other[grows]
        if not len(t):
            break
        joined = True
        count = len(area)
        pairs, which = np.unique(region[t] * count + region[other], return_inverse=True)
        border = np.bincount(which, weights=length[sides[t, k]])
        order = np.lexsort((-border, pairs // count))
        best = order[np.unique(pairs[order] // count, return_index=True)[1]]
        # the border's mean normal on the larger side
        chosen = np.isin(which, best)
        total = np.zeros((count, 3))
        np.add.at(total, region[t[chosen]], length[sides[t[chosen], k[chosen]]][:, None] * normals[other[chosen]])
        size = np.linalg.norm(total, axis=1)
        moved = np.flatnonzero((size > 0)[region] & small)
        normals[moved] = total[region[moved]] / size[region[moved], None]
        sharp[sides[t[chosen], k[chosen]]] = False
        inside = np.zeros(len(body), dtype=bool)
        inside[moved] = True
        t, k = np.nonzero(inside[:, None] & (neighbours >= 0) & (sharp & ~firm)[sides])
        blunt = np.einsum("ij,ij->i", normals[t], normals[neighbours[t, k]]) > cosine
        sharp[sides[t[blunt], k[blunt]]] = False
    return joined


def _not_slits(
    edges: IntArray, feature: BoolArray, firm: BoolArray, length: Array, cosine: Array, points: Array, width: float
) -> BoolArray:
    """(e,) False for the blunter of two lines between the same two ends that run nearer than `width` side by side."""
    from patchwright.repair import _feature_kernel as kernel

    keep = np.ones(len(edges), dtype=bool)
    picked = np.flatnonzero(feature)
    if not len(picked):
        return keep
    ends = np.ascontiguousarray(edges[picked])
    offsets, incident = _incident(ends, len(points))
    starts, vertices, _, chain = kernel.trace(ends, offsets, incident, np.diff(offsets) != 2)
    pieces = np.diff(starts)
    count = len(pieces)
    rows = starts[:-1] + np.arange(count)
    begin, finish = vertices[rows], vertices[rows + pieces]
    size = np.bincount(chain, weights=length[picked], minlength=count)
    blunt = np.bincount(chain, weights=(cosine * length)[picked], minlength=count) / np.where(size > 0, size, 1.0)
    middle = np.zeros((count, 3))
    for d in range(3):
        mean = points[edges[picked], d].mean(axis=1) * length[picked]
        middle[:, d] = np.bincount(chain, weights=mean, minlength=count) / np.where(size > 0, size, 1.0)
    key = np.minimum(begin, finish) * len(points) + np.maximum(begin, finish)
    order = np.lexsort((blunt, key))
    one, two = order[:-1], order[1:]
    near = np.linalg.norm(middle[one] - middle[two], axis=1) < width
    alike = np.abs(size[one] - size[two]) < 0.3 * np.maximum(size[one], size[two]) + width
    drop = np.zeros(count, dtype=bool)
    drop[two] = (key[one] == key[two]) & near & alike & (begin[two] != finish[two])
    drop |= (begin == finish) & (np.diff(offsets)[begin] > 2) & (size < 4.0 * width)
    which = picked[drop[chain]]
    keep[which[~firm[which]]] = False
    return keep
