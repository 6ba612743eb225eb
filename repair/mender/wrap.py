"""Wrapping: a closed 2-manifold around whatever is there, the last resort before a refusal.

The level set of the unsigned distance at a small offset, by marching tetrahedra on the cells near the surface (six
tetrahedra per cell, H. W. Kuhn's split, so that neighbours agree), its outer shells only, then drawn back onto the
input. Every triangle is new; edges sharper than the cell are rounded, gaps narrower than two offsets are closed, and
slots as narrow go with them. An open sheet comes back as a thin body around it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.mender.crossings import crossing_pairs

OFFSET = 1.0  # cells
LEAVE = 0.05  # of the offset that stays between the wrap and the input, so that thin parts keep a thickness
BACK = 0.05  # of the way: how far vertices go back at least where the wrap would pass through itself
TOUCH = 1e-9  # of the diagonal: what passes through by less touches
MOST_CELLS = 4_000_000

CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
TETRAHEDRA = np.array(
    [[0, *np.cumsum([4 >> axis for axis in order]).tolist()] for order in permutations(range(3))], dtype=np.int64
)


@dataclass(frozen=True, slots=True, eq=False)
class Wrapped:
    """The wrap, the edge of its cells, the offset it was taken at, and per triangle the nearest input triangle."""

    triangulation: Triangulation
    cell: float
    offset: float
    nearest: IntArray


def wrap(triangulation: Triangulation, cell: float, leave: float | None = None) -> Wrapped:
    """Wrap the triangles at a resolution of `cell` (model length unit), drawn back to `leave` from them.

    The default of `leave` is `LEAVE` of the offset. An open sheet comes back twice as thick.

    Raises
    ------
    ParameterError : no triangles, a cell that is not a positive length, or one so small that more than four million
        cells would lie near the surface.
    """
    if not len(triangulation):
        raise ParameterError("there are no triangles to wrap")
    if not (np.isfinite(cell) and cell > 0.0):
        raise ParameterError(f"the wrap's cell must be a positive length, got {cell}")
    tree = Tree.of(triangulation)
    offset = OFFSET * cell
    origin = triangulation.bounds[0] - 3.0 * cell - offset
    cells = _near_cells(tree, triangulation, origin, cell, offset)
    size = cells.max(axis=0) + 2
    nodes, local = np.unique(_key(cells[:, None] + CORNERS[None], size), return_inverse=True)
    local = local.reshape(-1, 8)
    place = origin + cell * np.stack(np.unravel_index(nodes, size), axis=1)
    level = np.asarray(tree.closest(place).distance) - offset
    level[level == 0.0] = np.finfo(float).tiny
    points, triangles = _march(place, level, local)
    shell = _outer(Triangulation(points, triangles))
    closest = tree.closest(shell.vertices)
    away = np.linalg.norm(shell.vertices - closest.points, axis=1, keepdims=True)
    share = np.full_like(away, LEAVE)
    if leave is not None:
        share = np.minimum(1.0, leave / np.maximum(away, np.finfo(float).tiny))
    drawn = _drawn(shell, closest.points, share)
    middle = tree.closest(drawn[shell.triangles].mean(axis=1))
    nearest = np.asarray(middle.triangle, dtype=np.int64)
    tags = None if triangulation.tags is None else triangulation.tags[nearest]
    result = Triangulation(drawn, shell.triangles, tags=tags, tag_names=triangulation.tag_names)
    return Wrapped(result, cell, offset, nearest)


def _drawn(shell: Triangulation, foot: Array, share: Array) -> Array:
    """Vertices drawn from the shell towards their feet, to a `share` (n, 1) of the way that is left.

    Where triangles pass through each other there (the feet lie on folds of the input), theirs go back towards the
    shell, which does not cross itself, until nothing does.
    """
    while True:
        drawn = foot + share * (shell.vertices - foot)
        pairs = crossing_pairs(replace(shell, vertices=drawn), TOUCH * shell.diagonal)
        back = np.unique(shell.triangles[np.unique(pairs)])
        back = back[share[back, 0] < 1.0]
        if not len(back):
            return np.asarray(drawn)
        share = share.copy()
        share[back] = np.minimum(1.0, 2.0 * share[back] + BACK)


def _near_cells(tree: Tree, triangulation: Triangulation, origin: Array, cell: float, offset: float) -> IntArray:
    """(c, 3) cells the level set may pass through, by halving coarse ones and keeping those near enough."""
    extent = float((triangulation.bounds[1] + 3.0 * cell + offset - origin).max())
    levels = max(0, int(np.ceil(np.log2(extent / cell))) - 3)
    edge = cell * 2**levels
    count = np.ceil((triangulation.bounds[1] + 3.0 * cell + offset - origin) / edge).astype(np.int64)
    cells = np.stack(np.meshgrid(*[np.arange(n) for n in count], indexing="ij"), axis=-1).reshape(-1, 3)
    for level in range(levels + 1):
        reach = 0.5 * np.sqrt(3.0) * edge
        away = np.asarray(tree.closest(origin + edge * (cells + 0.5)).distance)
        cells = cells[np.abs(away - offset) <= reach * (1.0 + 1e-9)]
        if len(cells) * (8 if level < levels else 1) > MOST_CELLS:
            raise ParameterError(
                f"a cell of {cell:.3g} puts more than {MOST_CELLS} cells near the surface; use a larger one"
            )
        if level < levels:
            cells = (2 * cells[:, None] + CORNERS[None]).reshape(-1, 3)
            edge *= 0.5
    return cells


def _key(cells: IntArray, size: IntArray) -> IntArray:
    return np.asarray((cells[..., 0] * size[1] + cells[..., 1]) * size[2] + cells[..., 2], dtype=np.int64)


def _march(place: Array, level: Array, local: IntArray) -> tuple[Array, IntArray]:
    """Points and triangles of the zero level in all tetrahedra, facing the positive side."""
    tets = local[:, TETRAHEDRA].reshape(-1, 4)
    inside = level[tets] < 0.0
    tets = tets[inside.any(axis=1) & ~inside.all(axis=1)]
    # inside nodes first
    order = np.argsort(level[tets] >= 0.0, axis=1, kind="stable")
    tets = np.take_along_axis(tets, order, axis=1)
    number = (level[tets] < 0.0).sum(axis=1)
    pairs = []
    for inner, rows in ((1, [[(0, 1), (0, 2), (0, 3)]]), (3, [[(0, 3), (1, 3), (2, 3)]]),
                        (2, [[(0, 2), (0, 3), (1, 3)], [(0, 2), (1, 3), (1, 2)]])):  # fmt: skip
        some = tets[number == inner]
        pairs += [np.stack([some[:, pair] for pair in row], axis=1) for row in rows]
    edges = np.sort(np.concatenate(pairs), axis=2)  # (t, 3, 2)
    key, triangles = np.unique(edges[..., 0] * len(place) + edges[..., 1], return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    a, b = key // len(place), key % len(place)
    share = level[a] / (level[a] - level[b])
    share = np.clip(share, 1e-3, 1.0 - 1e-3)  # no two points of one tetrahedron coincide
    points = place[a] + share[:, None] * (place[b] - place[a])
    # turn each triangle to face the outside node of its first edge
    first = edges[:, 0]
    out = np.where((level[first[:, 0]] >= 0.0)[:, None], place[first[:, 0]] - place[first[:, 1]],
                   place[first[:, 1]] - place[first[:, 0]])  # fmt: skip
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    against = np.einsum("ij,ij->i", normal, out) < 0.0
    triangles = np.where(against[:, None], triangles[:, ::-1], triangles)
    return points, np.asarray(triangles, dtype=np.int64)


def _outer(shells: Triangulation) -> Triangulation:
    """The shells that enclose: those around a cavity have negative volume."""
    label = np.asarray(Adjacency.of(shells).components())
    local = shells.corners - shells.bounds.mean(axis=0)
    volume = np.bincount(label, np.einsum("ij,ij->i", local[:, 0], np.cross(local[:, 1], local[:, 2])))
    return shells.take(np.flatnonzero(volume[label] > 0.0)).compact()
