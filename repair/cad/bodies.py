"""The bodies of a CAD model: which faces make one, which bodies are closed, and how much of one lies inside another."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.cad.connectivity import components, is_closed
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation, concatenate
from patchwright.models.winding import winding_number
from patchwright.repair.deviation import sample_area


def body_labels(model: Assembly) -> IntArray:
    """(f,) label of the body of each face: faces connected by edges, or by the file's own bodies."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    parts, topology = model.parts, model.topology
    names = {part.body: i for i, part in enumerate(parts) if part.body}
    rows = [(i, len(parts) + names[part.body]) for i, part in enumerate(parts) if part.body]
    for face, loops in enumerate(topology.loops if topology else ()):
        rows += [(face, 2 * len(parts) + use.edge) for loop in loops for use in loop]
    size = 2 * len(parts) + (len(topology.curves) if topology else 0)
    i, j = np.array(rows, dtype=np.int64).reshape(-1, 2).T
    graph = coo_array((np.ones(len(i), dtype=np.int8), (i, j)), shape=(size, size))
    return np.asarray(connected_components(graph, directed=False)[1][: len(parts)], dtype=np.int64)


def closed_bodies(model: Assembly) -> list[list[int]]:
    """The faces of every closed body; a solid with a void has the faces of both shells."""
    if model.topology is None:
        return []
    label = body_labels(model)
    open_ = {int(label[g[0]]) for g in components(model.topology) if not is_closed(model.topology, g)}
    return [np.flatnonzero(label == k).tolist() for k in np.unique(label).tolist() if k not in open_]


def shell_of(model: Assembly, body: list[int]) -> Triangulation:
    """The triangles of a body's faces."""
    return concatenate([model.parts[i].triangulation for i in body])


def inside(shell: Triangulation, tree: Tree, points: Array, depth: float) -> BoolArray:
    """(n,) points in a closed shell and farther than `depth` from it; where that is negative, or no farther outside."""
    within = np.abs(winding_number(shell, points, tree=tree)) > 0.5
    distance = tree.closest(points).distance
    return np.asarray(within & (distance > depth) if depth >= 0.0 else within | (distance < -depth))


def engulfed(
    model: Assembly, bodies: list[list[int]], pairs: set[tuple[int, int]], depth: float, samples: int
) -> dict[tuple[int, int], tuple[Array, float]]:
    """Of each pair of closed bodies the points of the first inside the second, and their share of its surface.

    Parameters
    ----------
    bodies : faces of each
    pairs : not looked at, in either order
    depth : nearer to the other's surface a point does not count, model length unit
    samples : points per body, spread by area
    """
    shells = [shell_of(model, body) for body in bodies]
    boxes = np.array([shell.bounds for shell in shells]).reshape(-1, 2, 3)
    known = pairs | {(b, a) for a, b in pairs}
    found = {}
    for b, shell in enumerate(shells):
        near = (boxes[:, 0] < boxes[b, 1] - depth).all(axis=1) & (boxes[:, 1] > boxes[b, 0] + depth).all(axis=1)
        others = [a for a in np.flatnonzero(near).tolist() if a != b and (a, b) not in known]
        if not others:
            continue
        tree = Tree.of(shell)
        for a in others:
            points, _ = sample_area(shells[a], samples)
            own = inside(shell, tree, points, depth)
            if own.any():
                found[a, b] = points[own], float(own.mean())
    return found
