"""Kernels of the rims: which stretch of which rim each sample of a rim faces, boxes of components."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import filling, inner
from patchwright.models.arrays import Array, IntArray


def facing(
    points: Array,
    outward: Array,
    loop: IntArray,
    edge: IntArray,
    span: Array,
    place: Array,
    offsets: IntArray,
    begin: Array,
    start: Array,
    end: Array,
    edge_outward: Array,
    low: Array,
    high: Array,
    reach: Array,
    first: IntArray,
    others: IntArray,
    near: float,
    share: float,
    cosine: float,
    fold: float,
    bend: float,
    apart_share: float,
) -> tuple[IntArray, Array]:
    """The nearest rim edge each sample faces, -1 when none, and the distance to it.

    Samples: `points`, `outward` (s, 3), `loop`, `edge` (s,) the loop and rim edge each lies on, `span` (s,) the length
    of that edge, `place` (s,) the arc length up to it. Rim edges: `start`, `end`, `edge_outward` (e, 3), those of loop
    l are offsets[l]:offsets[l + 1]; `begin` (e + 1,) the arc length up to each.
    Loops: boxes `low`, `high` (l, 3), `reach` (l,) how far a sample of a loop looks for other loops, and which have
    boxes so near, its own among them: others[first[l]:first[l + 1]], rising.
    `near`: so close, edges of other places face each other whatever their directions; within `share` of the edges'
    length they do when the surface continues; else the way across must leave both surfaces within acos(`cosine`) of
    straight ahead, and the surface must not turn by more than acos(`fold`) across. Two places of one rim must be at
    least `bend` times farther apart along it than across, and `apart_share` of its length: the sides of a mere corner
    or of a saw's tooth do not face each other.
    """
    found, way = np.full(len(points), -1, dtype=np.int64), np.full(len(points), np.inf)
    _facing(
        points, outward, loop, edge, span, place, offsets, begin, start, end, edge_outward, low, high, reach, first,
        others, near, share, cosine, fold, bend, apart_share, found, way,
    )  # fmt: skip
    return found, way


@inner
def _box_distance(low: Array, high: Array, a_low: Array, a_high: Array, i: int, j: int) -> float:
    """Squared distance of box i of `a` from box j."""
    apart = 0.0
    for k in range(3):
        step = max(low[j, k] - a_high[i, k], a_low[i, k] - high[j, k])
        if step > 0.0:
            apart += step * step
    return apart


@filling
def _facing(
    points: Array,
    outward: Array,
    loop: IntArray,
    edge: IntArray,
    span: Array,
    place: Array,
    offsets: IntArray,
    begin: Array,
    start: Array,
    end: Array,
    edge_outward: Array,
    low: Array,
    high: Array,
    reach: Array,
    first: IntArray,
    others: IntArray,
    near: float,
    share: float,
    cosine: float,
    fold: float,
    bend: float,
    apart_share: float,
    found: IntArray,
    way: Array,
) -> None:
    for s in range(len(points)):
        own = loop[s]
        px = points[s, 0]
        py = points[s, 1]
        pz = points[s, 2]
        ox = outward[s, 0]
        oy = outward[s, 1]
        oz = outward[s, 2]
        size = offsets[own + 1] - offsets[own]
        around = begin[offsets[own + 1]] - begin[offsets[own]]
        for c in range(first[own], first[own + 1]):
            other = others[c]
            limit = min(way[s], reach[own]) if other != own else way[s]
            if _box_distance(low, high, points, points, s, other) > limit * limit:
                continue
            for e in range(offsets[other], offsets[other + 1]):
                if e == edge[s]:
                    continue
                ax = start[e, 0]
                ay = start[e, 1]
                az = start[e, 2]
                bx = end[e, 0] - ax
                by = end[e, 1] - ay
                bz = end[e, 2] - az
                square = bx * bx + by * by + bz * bz
                t = 0.0
                if square > 0.0:
                    t = min(1.0, max(0.0, ((px - ax) * bx + (py - ay) * by + (pz - az) * bz) / square))
                dx = ax + t * bx - px
                dy = ay + t * by - py
                dz = az + t * bz - pz
                distance = np.sqrt(dx * dx + dy * dy + dz * dz)
                if distance >= limit:
                    continue
                ux = edge_outward[e, 0]
                uy = edge_outward[e, 1]
                uz = edge_outward[e, 2]
                turn = -(ox * ux + oy * uy + oz * uz)
                beside = False
                if other == own:
                    steps = abs(e - edge[s])
                    beside = steps == 1 or steps == size - 1
                    along = abs(begin[e] + t * (begin[e + 1] - begin[e]) - place[s])
                    if min(along, around - along) < max(bend * distance, apart_share * around):
                        continue
                meets = False
                close = share * max(span[s], np.sqrt(square)) if turn >= 0.5 else 0.0
                if not beside and distance <= max(near, close):
                    meets = True
                elif turn >= fold:
                    ahead = ox * dx + oy * dy + oz * dz
                    met = -(ux * dx + uy * dy + uz * dz)
                    meets = ahead >= cosine * distance and met >= cosine * distance
                if meets:
                    limit = distance
                    way[s] = distance
                    found[s] = e


def nearest_other(
    points: Array, owner: IntArray, start: Array, end: Array, of: IntArray
) -> tuple[IntArray, Array, Array]:
    """The chord of another curve nearest to each point: its index, the place along it in [0, 1], the distance.

    `points` (k, 3) lie on curves `owner` (k,); chords `start`, `end` (c, 3) are of curves `of` (c,). Index -1 when
    there is no other curve.
    """
    count = len(points)
    chord, place, best = np.full(count, -1, dtype=np.int64), np.zeros(count), np.full(count, np.inf)
    _nearest_other(points, owner, start, end, of, chord, place, best)
    return chord, place, best


@filling
def _nearest_other(
    points: Array,
    owner: IntArray,
    start: Array,
    end: Array,
    of: IntArray,
    chord: IntArray,
    place: Array,
    best: Array,
) -> None:
    for s in range(len(points)):
        px, py, pz = points[s, 0], points[s, 1], points[s, 2]
        least = np.inf
        for e in range(len(of)):
            if of[e] == owner[s]:
                continue
            ax, ay, az = start[e, 0] - px, start[e, 1] - py, start[e, 2] - pz
            bx, by, bz = end[e, 0] - start[e, 0], end[e, 1] - start[e, 1], end[e, 2] - start[e, 2]
            square = bx * bx + by * by + bz * bz
            t = 0.0
            if square > 0.0:
                t = min(1.0, max(0.0, -(ax * bx + ay * by + az * bz) / square))
            dx, dy, dz = ax + t * bx, ay + t * by, az + t * bz
            distance = dx * dx + dy * dy + dz * dz
            if distance < least:
                least = distance
                chord[s] = e
                place[s] = t
        best[s] = np.sqrt(least)


def boxes_of(points: Array, triangles: IntArray, label: IntArray, count: int) -> Array:
    """(c, 6) lowest and highest corners of the triangles of each label; infinite the other way round without any."""
    boxes = np.repeat([[np.inf, -np.inf]], count, axis=0).repeat(3, axis=1)
    _boxes_of(points, triangles, label, boxes)
    return boxes


@filling
def _boxes_of(points: Array, triangles: IntArray, label: IntArray, boxes: Array) -> None:
    for t in range(len(triangles)):
        c = label[t]
        for k in range(3):
            for d in range(3):
                x = points[triangles[t, k], d]
                boxes[c, d] = min(boxes[c, d], x)
                boxes[c, d + 3] = max(boxes[c, d + 3], x)
