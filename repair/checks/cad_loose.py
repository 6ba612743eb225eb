"""Loose pieces of a CAD model whose free edges run along those of another piece: faces that should be joined.

Round a rim as a whole such a piece may look like an open sheet, and the rim of its hole like part of an opening: a
displaced face that borders an opening of the file has only some of its edges in the hole. So edges are asked one by
one: whether an edge runs along edges of other pieces from end to end, much nearer to them than it is long, whichever
way the surfaces lead from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.topology import EdgeUse, Topology

PROBES = 33  # per edge
SLENDER = 0.1  # of an edge's length: what is farther away does not run along it
PARALLEL = 0.95  # cosine between an edge and what runs along it
ALONG = 0.9  # share of an edge's probes that decides
LEAST = 0.15  # share of a piece's free border that runs along another piece: less is a touch


@dataclass(frozen=True, slots=True, eq=False)
class Beside:
    """A loose piece and the edges that run along each other.

    Parameters
    ----------
    faces : of the loose piece's edges and of those they run along
    edges : of both
    points : (k, 3) on the edges that run along others
    width, widest : median and largest distance of those
    length : of the loose piece's border that has another beside it
    """

    faces: tuple[int, ...]
    edges: tuple[int, ...]
    points: Array
    width: float
    widest: float
    length: float


def loose_beside(topology: Topology, uses: list[tuple[int, EdgeUse]], piece: IntArray, reach: float) -> list[Beside]:
    """The pieces beside others, smallest first.

    Parameters
    ----------
    uses : free edges that coincide with no other, with their faces
    piece : (f,) label of each face's piece: faces connected through edges
    reach : what is farther away runs along nothing
    """
    from patchwright.repair.mender._rims_kernel import nearest_other

    own = np.array([piece[face] for face, _ in uses], dtype=np.int64)
    if len(np.unique(own)) < 2:
        return []
    share = np.linspace(0.0, 1.0, PROBES)
    curves = [topology.curves[use.edge] for _, use in uses]
    points = np.stack([c(c.domain[0] + share * (c.domain[1] - c.domain[0])) for c in curves])
    chords = np.diff(points, axis=1)
    length = np.linalg.norm(chords, axis=2).sum(axis=1)
    middle = 0.5 * (points[:, 1:] + points[:, :-1])
    count, per = chords.shape[:2]
    of = np.repeat(own, per)
    start, end = (np.ascontiguousarray(some.reshape(-1, 3)) for some in (points[:, :-1], points[:, 1:]))
    near, _, apart = nearest_other(np.ascontiguousarray(middle.reshape(-1, 3)), of, start, end, of)
    way = chords.reshape(-1, 3)
    size = np.linalg.norm(way, axis=1)
    cosine = np.abs(np.einsum("ij,ij->i", way, way[near])) / np.maximum(size * size[near], np.finfo(float).tiny)
    limit = np.repeat(np.minimum(SLENDER * length, reach), per)
    meets = ((apart <= limit) & (cosine >= PARALLEL) & (near >= 0)).reshape(count, per)
    along = np.flatnonzero(meets.mean(axis=1) >= ALONG)
    apart, near = apart.reshape(count, per), near.reshape(count, per)
    # an edge with all of one side against it counts for the pieces of both
    border = np.bincount(own, weights=length)
    found: dict[int, list[int]] = {}
    for edge in along.tolist():
        others = own[near[edge][meets[edge]] // per]
        pair = {int(own[edge]), int(np.bincount(others).argmax())}
        found.setdefault(min(pair, key=lambda k: (border[k], k)), []).append(edge)
    out = []
    for loose in sorted(found, key=lambda k: (border[k], k)):
        edges = found[loose]
        mine = own[edges] == loose
        total = float(max(length[edges][mine].sum(), length[edges][~mine].sum()))
        if total < LEAST * border[loose]:
            continue
        wide = np.concatenate([apart[edge][meets[edge]] for edge in edges])
        theirs = np.unique(np.concatenate([near[edge][meets[edge]] // per for edge in edges]))
        both = sorted({*edges, *theirs.tolist()})
        out.append(
            Beside(
                tuple(sorted({uses[k][0] for k in both})),
                tuple(uses[k][1].edge for k in both),
                points[edges].reshape(-1, 3),
                float(np.median(wide)),
                float(wide.max()),
                total,
            )
        )
    return out
