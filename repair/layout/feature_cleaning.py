"""What no quad fits in, taken from the sharp lines of a triangulation: specks, slits, teeth and tiny pieces.

All work on arrays over the edges (e,): `sharp` lines may be changed, `firm` ones (boundaries, given lines) may not.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.triangulation import Triangulation

CORNER_TURN = 40.0  # degrees a feature line turns at a corner
SPECK_SHARE = 0.01  # of the diagonal: a shorter line with a loose end fades away and is let go
SPECK_EDGES = 5  # a ring as short is noise when it has fewer edges or is shorter than half of that
FACET_BORDER = 0.04  # of the diagonal: a triangle on its own, shorter round, is a facet and no piece between lines
ROUNDS = 4  # of cutting teeth and joining specks: what is left after that is no chain of slivers


def not_specks(edges: IntArray, feature: BoolArray, firm: BoolArray, length: Array, diagonal: float) -> BoolArray:
    """(e,) False for edges of short lines: pieces on their own, and loose ends that hang on something longer."""
    from patchwright.repair.layout import _feature_kernel as kernel

    keep = np.ones(len(edges), dtype=bool)
    for _ in range(2):
        picked = np.flatnonzero(feature & keep)
        if not len(picked):
            break
        ends = np.ascontiguousarray(edges[picked])
        offsets, incident = incident_edges(ends, int(edges.max()) + 1)
        degree = np.diff(offsets)
        starts, vertices, _, chain = kernel.trace(ends, offsets, incident, degree != 2)
        pieces = np.diff(starts)
        size = np.bincount(chain, weights=length[picked], minlength=len(pieces))
        rows = starts[:-1] + np.arange(len(pieces))
        begin, finish = vertices[rows], vertices[rows + pieces]
        loose = (degree[begin] == 1) | (degree[finish] == 1)
        ring = (begin == finish) & (degree[begin] == 2)
        short = size < SPECK_SHARE * diagonal
        poor = short & (loose | (ring & ((pieces < SPECK_EDGES) | (size < 0.5 * SPECK_SHARE * diagonal))))
        drop = picked[poor[chain]]
        drop = drop[~firm[drop]]
        if not len(drop):
            break
        keep[drop] = False
    return keep


def not_slits(
    edges: IntArray, feature: BoolArray, firm: BoolArray, length: Array, cosine: Array, points: Array, width: float
) -> BoolArray:
    """(e,) False for the blunter of two lines between the same two ends that run nearer than `width` side by side."""
    from patchwright.repair.layout import _feature_kernel as kernel

    keep = np.ones(len(edges), dtype=bool)
    picked = np.flatnonzero(feature)
    if not len(picked):
        return keep
    ends = np.ascontiguousarray(edges[picked])
    offsets, incident = incident_edges(ends, len(points))
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


def cut_teeth(
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


def merge_specks(
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
    from patchwright.repair.layout import _feature_kernel as kernel

    joined = False
    for _ in range(ROUNDS):
        region = kernel.regions(neighbours, np.where((sharp | firm)[sides], 0, -1))
        area = np.bincount(region, weights=body.areas)
        t, k = np.nonzero((sharp | firm)[sides])
        border = np.bincount(region[t], weights=length[sides[t, k]], minlength=len(area))
        facet = (np.bincount(region) == 1) & (border < FACET_BORDER * body.diagonal)
        small = ((area < least) | facet)[region]
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


def incident_edges(edges: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Edges at each vertex as (offsets, edges)."""
    flat = edges.reshape(-1)
    offsets = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=count))])
    return offsets.astype(np.int64), np.argsort(flat, kind="stable").astype(np.int64) // 2
