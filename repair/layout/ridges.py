"""Ridge lines: narrow strips of strong curvature, such as leading edges, that edges of quads shall follow.

Where a surface turns within a small radius along a line, quads as small as the radius would be needed on both sides of
it; with the line as an edge of quads, each side turns by a quarter circle at most, which one patch of several pieces
takes. A ridge is the path through its strip that keeps to the strongest curvature.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.layout.features import Features

SLENDER = 4.0  # least length of a ridge, in radii of its bend and in mean widths of its strip
KEEP_TO_CREST = 2.0  # exponent: how much a detour costs against leaving the crest
REACH = 2.0  # widest radii: another ridge starts no nearer than this
MOST_RIDGES = 64


@dataclass(frozen=True, slots=True, eq=False)
class Ridges:
    """`edges` (k, 2) vertex pairs of the ridge lines; `radius` (n,) of the bend at ridge vertices, inf elsewhere."""

    edges: IntArray
    radius: Array


def find_ridges(features: Features, curvature: Array, widest: float) -> Ridges:
    """The ridge lines of a triangulation, made of its edges.

    Parameters
    ----------
    features : the triangulation; ridges end on its feature curves and never run along them
    curvature : (n,) largest principal curvature at its vertices, 1 / length
    widest : radius from which on a bend is no ridge
    """
    from scipy.sparse.csgraph import connected_components

    body = features.body
    n = len(body.vertices)
    bend = np.divide(1.0, curvature, out=np.full(n, np.inf), where=curvature > 0)
    free = (bend < widest) & (_distance_to(body.vertices[features.vertices], body.vertices) > widest)
    surface = Paths.over(features)
    strip = surface.between(free)
    area = np.bincount(body.triangles.reshape(-1), weights=np.repeat(body.areas / 3.0, 3), minlength=n)
    radius = np.full(n, np.inf)
    lines: list[Array] = []
    while len(lines) < MOST_RIDGES and free.any():
        strip = strip.between(free)
        inside = np.flatnonzero(free)
        label = connected_components(strip.graph(strip.length, inside), directed=False)[1]
        piece = inside[label == np.bincount(label, weights=area[inside]).argmax()]
        own = strip.between(_members(piece, n))
        spine = own.spine(piece, bend, widest)
        away = own.distance(spine, REACH * widest, piece)
        beside = piece[np.isfinite(away)]
        free[beside] = False
        span = float(np.linalg.norm(np.diff(body.vertices[spine], axis=0), axis=1).sum())
        if span < SLENDER * widest:
            if np.sqrt(float(area[piece].sum())) < widest:
                break  # what is left are specks
            continue
        if span > SLENDER * float(np.median(bend[spine])) and span**2 > SLENDER * float(area[beside].sum()):
            line = surface.attached(spine, np.unique(features.vertices), bend, body.vertices, REACH * widest)
            lines.append(np.stack([line[:-1], line[1:]], axis=1))
            radius[spine] = bend[spine]
    found = np.concatenate(lines) if lines else np.zeros((0, 2), dtype=np.int64)
    return Ridges(found.astype(np.int64), radius)


def flanks(features: Features, ridges: Ridges, curvature: Array, breadth: float) -> BoolArray:
    """(n,) whether a vertex lies on the flank of a ridge: nearer to it than the radius of its own bend.

    A patch that begins at the ridge takes the turn of the whole flank, so the flank asks for no smaller quads. No
    flank is broader than `breadth` radii of its ridge.
    """
    from scipy.spatial import cKDTree

    crest = np.flatnonzero(np.isfinite(ridges.radius))
    if not len(crest):
        return np.zeros(len(curvature), dtype=bool)
    points = features.body.vertices
    away, nearest = cKDTree(points[crest]).query(points)
    return np.asarray((away * curvature < 1.0) & (away < breadth * ridges.radius[crest[nearest]]))


def _distance_to(sites: Array, points: Array) -> Array:
    """(n,) distance of each point from the nearest site, inf without sites."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(sites).query(points)[0]) if len(sites) else np.full(len(points), np.inf)


def _members(which: IntArray, count: int) -> BoolArray:
    out = np.zeros(count, dtype=bool)
    out[which] = True
    return out


@dataclass(frozen=True, slots=True, eq=False)
class Paths:
    """Edges of a triangulation of `count` vertices that are on no feature curve, for walks along them."""

    edges: IntArray
    length: Array
    count: int

    @classmethod
    def over(cls, features: Features) -> Paths:
        """All edges off the feature curves."""
        body = features.body
        t, k = np.nonzero(features.side_curve < 0)
        edges = np.stack([body.triangles[t, k], body.triangles[t, (k + 1) % 3]], axis=1)
        edges = edges[(edges[:, 0] < edges[:, 1]) | (features.neighbours[t, k] < 0)]
        length = np.linalg.norm(body.vertices[edges[:, 1]] - body.vertices[edges[:, 0]], axis=1)
        return cls(edges, length, len(body.vertices))

    def between(self, allowed: BoolArray) -> Paths:
        """The edges both ends of which are allowed."""
        keep = allowed[self.edges].all(axis=1)
        return Paths(self.edges[keep], self.length[keep], self.count)

    def graph(self, weight: Array, vertices: IntArray) -> Any:
        """The edges as a sparse matrix over some vertices, which must hold all their ends."""
        from scipy.sparse import coo_matrix

        place = np.full(self.count, -1, dtype=np.int64)
        place[vertices] = np.arange(len(vertices))
        ends = place[self.edges]
        return coo_matrix((weight, (ends[:, 0], ends[:, 1])), shape=(len(vertices), len(vertices))).tocsr()

    def distance(self, sources: IntArray, limit: float, vertices: IntArray) -> Array:
        """Length of the shortest way from each of `vertices` to any source, inf beyond the limit."""
        from scipy.sparse.csgraph import dijkstra

        start = np.flatnonzero(np.isin(vertices, sources))
        graph = self.graph(self.length, vertices)
        return np.asarray(dijkstra(graph, directed=False, indices=start, min_only=True, limit=limit))

    def spine(self, piece: IntArray, bend: Array, aside: float) -> IntArray:
        """Vertices along a piece's crest, between the steepest places nearer than `aside` to its ends."""
        from scipy.sparse.csgraph import dijkstra

        def onto_crest(place: int) -> int:
            near = np.isfinite(self.distance(piece[place : place + 1], aside, piece))
            return int(np.where(near, bend[piece], np.inf).argmin())

        begin = int(self.distance(piece[:1], np.inf, piece).argmax())
        end = int(self.distance(piece[begin : begin + 1], np.inf, piece).argmax())
        begin, end = onto_crest(begin), onto_crest(end)
        steep = bend[self.edges].max(axis=1) / float(bend[piece].min())
        graph = self.graph(self.length * steep**KEEP_TO_CREST, piece)
        came = dijkstra(graph, directed=False, indices=np.array([begin]), return_predecessors=True)[1]
        return piece[_walk_back(came[0], end)]

    def attached(self, spine: IntArray, curve: IntArray, bend: Array, points: Array, limit: float) -> IntArray:
        """A spine with its ends led on along the crest to the feature curves nearer than `limit` and a step."""
        from scipy.sparse.csgraph import dijkstra

        steepest = float(bend[spine].min())
        for _ in range(2):
            tip = spine[-1]
            step = float(self.length[(self.edges == tip).any(axis=1)].max())
            near = np.linalg.norm(points - points[tip], axis=1) < limit + step
            near[spine[:-1]] = False
            inside = np.flatnonzero(near)
            ways = self.between(near)
            steep = np.minimum(bend[ways.edges].max(axis=1), limit) / steepest
            graph = ways.graph(ways.length * steep**KEEP_TO_CREST, inside)
            start = np.flatnonzero(inside == tip)
            away, came = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
            ends = np.flatnonzero(np.isin(inside, curve))
            if len(ends) and np.isfinite(away[0, ends]).any():
                way = _walk_back(came[0], int(ends[away[0, ends].argmin()]))
                spine = np.concatenate([spine, inside[way[1:]]])
            spine = spine[::-1]
        return spine


def _walk_back(came: IntArray, end: int) -> IntArray:
    """The way to `end`, first vertex first; `came` holds each vertex's predecessor, negative at the start."""
    way = [end]
    while came[way[-1]] >= 0:
        way.append(int(came[way[-1]]))
    return np.asarray(way[::-1], dtype=np.int64)
