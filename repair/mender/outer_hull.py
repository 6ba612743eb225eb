"""Outer hull: closed bodies that overlap become one closed surface; what lies inside others goes, with a label.

The bodies are cut along the exact curves in which they meet each other and themselves (`ssi.outer_hull`): vertices of
the input keep their coordinates, triangles that nothing crosses stay as they are, and every piece knows the triangle it
was cut from. Where the cuts are too near each other for that, manifold3d unites the bodies; it takes no body that
passes through itself. Bodies that touch no other are handed through untouched. A body inside another that came facing
inward is a cavity and stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import GeometryError
from patchwright.models.triangulation import Triangulation
from patchwright.repair.mender.untangle import winding
from patchwright.ssi.outer_hull import outer_pieces

LOST = 1e-9  # of a triangle: what cutting it up may lose to round-off


@dataclass(frozen=True, slots=True, eq=False)
class Inside:
    """A connected piece of one body that the union dropped: which body, inside which other (-1 unknown)."""

    body: int
    inside: int
    triangles: IntArray  # of the input; those at the rim of the piece are dropped in part only
    area: float
    where: Array


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """The union's outer surface.

    Parameters
    ----------
    triangulation : pieces in the order of the triangles they come from
    parents : (m,) int64, the input triangle each is or was cut from
    cut : (m,) whether it is a piece only
    inside : what was dropped
    failed : one sentence for every group of bodies the union could not take; they are handed through as they came
    """

    triangulation: Triangulation
    parents: IntArray
    cut: BoolArray
    inside: tuple[Inside, ...]
    failed: tuple[str, ...]


Pieces = tuple[Array, IntArray, IntArray]
"""Points (n, 3), triangles (m, 3) and the input triangle each is or was cut from."""


def outer_hull(
    triangulation: Triangulation,
    body: IntArray,
    inward: BoolArray | None = None,
    tangled: IntArray | None = None,
) -> Hull:
    """Unite the closed, outward bodies.

    Parameters
    ----------
    body : (m,) the body of each triangle, 0..b-1
    inward : (b,) those that came facing inward
    tangled : the bodies that pass through themselves
    """
    bodies = int(body.max(initial=-1)) + 1
    inward = np.zeros(bodies, dtype=np.bool_) if inward is None else inward
    crossed = np.zeros(bodies, dtype=np.bool_)
    if tangled is not None:
        crossed[tangled] = True
    groups = _groups(triangulation, body, bodies)
    own = _by_body(body, bodies)
    made: list[Pieces | None] = []
    failed: list[str] = []
    for group in groups:
        united = None
        if len(group) > 1 or crossed[group].any():
            try:
                united = _cut(triangulation, own, group, inward)
            except GeometryError as error:
                try:
                    united = _united_or_told(triangulation, own, group, inward, crossed, error)
                except _Refused as refusal:
                    failed.append(str(refusal))
        made.append(united)
    return _joined(triangulation, own, groups, made, tuple(failed))


def _cut(triangulation: Triangulation, bodies: list[IntArray], group: IntArray, inward: BoolArray) -> Pieces:
    """The outer hull of some bodies, cut along exact curves.

    Raises
    ------
    GeometryError : sheets so near each other that the cuts or the sides cannot be told.
    """
    own = np.concatenate([bodies[b] for b in group])
    turned = np.concatenate([np.full(len(bodies[b]), inward[b]) for b in group])
    some = triangulation.take(own)
    rows = np.where(turned[:, None], some.triangles[:, ::-1], some.triangles)
    hull, parent = outer_pieces(replace(some, triangles=rows, uv=None))
    if not len(hull):
        raise GeometryError("nothing of them bounds anything from outside")
    return hull.vertices, hull.triangles, own[parent]


def _united_or_told(
    triangulation: Triangulation,
    bodies: list[IntArray],
    group: IntArray,
    inward: BoolArray,
    crossed: BoolArray,
    error: GeometryError,
) -> Pieces:
    """The union by manifold3d, where that takes the bodies."""
    if crossed[group].any():
        raise _Refused(f"{len(group)} bodies, some of which pass through themselves, cannot be united: {error}")
    return _unite(triangulation, bodies, group, inward)


def _by_body(body: IntArray, bodies: int) -> list[IntArray]:
    """The triangles of each body."""
    order = np.argsort(body, kind="stable")
    return np.split(order, np.cumsum(np.bincount(body, minlength=bodies))[:-1]) if bodies else []


def _joined(
    triangulation: Triangulation,
    bodies: list[IntArray],
    groups: Sequence[IntArray],
    made: Sequence[Pieces | None],
    failed: tuple[str, ...],
) -> Hull:
    """The pieces made of some groups of bodies beside the bodies of the others as they came."""
    vertices = [triangulation.vertices]
    base = len(triangulation.vertices)
    rows: list[IntArray] = []
    parents: list[IntArray] = []
    cuts: list[BoolArray] = []
    inside: list[Inside] = []
    for group, pieces in zip(groups, made, strict=True):
        own = np.sort(np.concatenate([bodies[b] for b in group]))
        if pieces is None:
            rows.append(triangulation.triangles[own])
            parents.append(own)
            cuts.append(np.zeros(len(own), dtype=np.bool_))
            continue
        points, triangles, parent = pieces
        new_rows, new_points, cut = _rejoin(triangulation, points, triangles, parent, base)
        vertices.append(new_points)
        base += len(new_points)
        rows.append(new_rows)
        parents.append(parent)
        cuts.append(cut)
        inside += _dropped(triangulation, bodies, group, own, points, triangles, parent)
    parent = np.concatenate(parents) if parents else np.zeros(0, dtype=np.int64)
    order = np.argsort(parent, kind="stable")
    parent = parent[order]
    result = replace(
        triangulation,
        vertices=np.concatenate(vertices),
        triangles=np.concatenate(rows)[order] if rows else np.zeros((0, 3), dtype=np.int64),
        uv=None,
        tags=None if triangulation.tags is None else triangulation.tags[parent],
    )
    cut = np.concatenate(cuts)[order] if cuts else np.zeros(0, dtype=np.bool_)
    return Hull(result, parent, cut, tuple(inside), failed)


class _Refused(Exception):
    """The union does not take these bodies."""


def _groups(triangulation: Triangulation, body: IntArray, bodies: int) -> list[IntArray]:
    """Bodies whose bounding boxes chain together, in the order of their first body."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    from patchwright.repair.mender._rims_kernel import boxes_of

    if not bodies:
        return []
    low, high = np.hsplit(boxes_of(triangulation.vertices, triangulation.triangles, body, bodies), 2)
    meets = ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
    i, j = np.nonzero(meets)
    _, label = connected_components(coo_array((np.ones(len(i)), (i, j)), shape=(bodies, bodies)), directed=False)
    return [np.flatnonzero(label == k) for k in range(int(label.max()) + 1)]


def _unite(triangulation: Triangulation, bodies: list[IntArray], group: IntArray, inward: BoolArray) -> Pieces:
    """The union of some bodies."""
    import manifold3d

    solids: list[Any] = []
    cavities: list[Any] = []
    index: dict[int, IntArray] = {}
    for b in group:
        own = bodies[b]
        used, local = np.unique(triangulation.triangles[own], return_inverse=True)
        local = local.reshape(-1, 3)
        number = int(manifold3d.Manifold.reserve_ids(1))
        index[number] = own
        mesh = manifold3d.Mesh64(
            np.ascontiguousarray(triangulation.vertices[used]),
            np.ascontiguousarray(local.astype(np.uint64)),
            run_index=np.array([0, 3 * len(own)], dtype=np.uint64),
            run_original_id=np.array([number], dtype=np.uint32),
            face_id=np.arange(len(own), dtype=np.uint64),
        )
        solid = manifold3d.Manifold(mesh)
        if solid.status() != manifold3d.Error.NoError:
            raise _Refused(
                f"body {int(b)} with {len(own)} triangles is not a closed 2-manifold ({solid.status().name})"
            )
        (cavities if inward[b] else solids).append(solid)
    whole = manifold3d.Manifold.batch_boolean(solids or cavities, manifold3d.OpType.Add)
    if solids and cavities:
        hollow = manifold3d.Manifold.batch_boolean(cavities, manifold3d.OpType.Add)
        whole = manifold3d.Manifold.batch_boolean([whole, hollow], manifold3d.OpType.Subtract)
    if whole.status() != manifold3d.Error.NoError or whole.num_tri() == 0:
        raise _Refused(f"the union of {len(group)} bodies failed ({whole.status().name})")
    mesh = whole.to_mesh64()
    triangles = np.asarray(mesh.tri_verts).astype(np.int64)
    runs = np.asarray(mesh.run_index).astype(np.int64) // 3
    numbers = np.asarray(mesh.run_original_id)
    face = np.asarray(mesh.face_id).astype(np.int64)
    parent = np.empty(len(triangles), dtype=np.int64)
    for number, start, stop in zip(numbers, runs[:-1], runs[1:], strict=True):
        parent[start:stop] = index[int(number)][face[start:stop]]
    return np.asarray(mesh.vert_properties)[:, :3].copy(), triangles, parent


def _rejoin(
    triangulation: Triangulation, points: Array, triangles: IntArray, parent: IntArray, base: int
) -> tuple[IntArray, Array, BoolArray]:
    """Triangles over the input's vertices where the union kept them, over new vertices from `base` on elsewhere."""
    # a corner is the parent's own vertex when it has its coordinates
    own = triangulation.triangles[parent]
    old = np.full(len(points), -1, dtype=np.int64)
    for k in range(3):
        for j in range(3):
            same = (points[triangles[:, k]] == triangulation.vertices[own[:, j]]).all(axis=1)
            old[triangles[same, k]] = own[same, j]
    # two vertices of the union at one place stay two
    back = np.flatnonzero(old >= 0)[::-1]
    first = np.full(len(triangulation.vertices), -1, dtype=np.int64)
    first[old[back]] = back  # of several, the last one written stays: the first
    old[back[first[old[back]] != back]] = -1
    fresh = old < 0
    number = old.copy()
    number[fresh] = base + np.arange(int(np.count_nonzero(fresh)))
    rows = number[triangles]
    uncut = (np.sort(rows, axis=1) == np.sort(own, axis=1)).all(axis=1)
    rows[uncut] = own[uncut]
    turned = np.zeros(len(rows), dtype=np.bool_)
    if uncut.any():
        # a cavity's triangles are reversed by the subtraction
        lead = np.argmax(own[uncut][:, :, None] == number[triangles[uncut]][:, None, :1], axis=1)[:, 0]
        second = own[uncut][np.arange(int(uncut.sum())), (lead + 1) % 3]
        turned[uncut] = second != number[triangles[uncut]][:, 1]
    rows[turned] = rows[turned][:, ::-1]
    return rows, points[fresh], ~uncut


def _dropped(
    triangulation: Triangulation,
    bodies: list[IntArray],
    group: IntArray,
    own: IntArray,
    points: Array,
    triangles: IntArray,
    parent: IntArray,
) -> list[Inside]:
    """The pieces the union dropped, one for each connected region of a body."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    a, b, c = points[triangles[:, 0]], points[triangles[:, 1]], points[triangles[:, 2]]
    at = np.searchsorted(own, parent)
    left = np.bincount(at, 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1), minlength=len(own))
    some = triangulation.take(own)
    areas = some.areas
    index = np.flatnonzero(areas - left > LOST * areas + np.finfo(float).eps * some.diagonal**2)
    if not len(index):
        return []
    body = np.empty(len(own), dtype=np.int64)
    local_of = {int(k): np.searchsorted(own, bodies[k]) for k in group}
    for k, mine in local_of.items():
        body[mine] = k
    used, local = np.unique(some.triangles[index], return_inverse=True)
    local = local.reshape(-1, 3)
    graph = coo_array(
        (np.ones(2 * len(local)), (np.repeat(local[:, 0], 2), local[:, 1:].reshape(-1))), shape=(len(used), len(used))
    )
    _, label = connected_components(graph, directed=False)
    piece = label[local[:, 0]]
    lost = areas[index] - left[index]
    corners = some.corners
    middle = corners[index].mean(axis=1)
    weight = np.maximum(lost, np.finfo(float).tiny)
    area = np.bincount(piece, lost)
    moment = np.stack([np.bincount(piece, weight * middle[:, k]) for k in range(3)], axis=1)
    where = moment / np.bincount(piece, weight)[:, None]
    # the triangle that lost most of itself tells which body the piece is of and where it lies
    order = np.lexsort((-lost / np.maximum(areas[index], np.finfo(float).tiny), piece))
    deep = order[np.searchsorted(piece[order], np.arange(len(area)))]
    around = _containers(corners, local_of, middle[deep], body[index[deep]])
    members = np.split(own[index[np.argsort(piece, kind="stable")]], np.cumsum(np.bincount(piece))[:-1])
    return [
        Inside(int(body[index[deep[k]]]), int(around[k]), members[k], float(area[k]), where[k])
        for k in range(len(area))
    ]


def _containers(corners: Array, bodies: dict[int, IntArray], points: Array, own: IntArray) -> IntArray:
    """(k,) the body with the largest winding number round each point, its own aside; -1 when none is near 1.

    `bodies` are the triangles of each; only bodies whose boxes hold the point are asked.
    """
    best, found = np.full(len(points), 0.5), np.full(len(points), -1, dtype=np.int64)
    for b, triangles in bodies.items():
        mine = corners[triangles]
        low, high = mine.min(axis=(0, 1)), mine.max(axis=(0, 1))
        for k in np.flatnonzero(((points >= low) & (points <= high)).all(axis=1) & (own != b)):
            around = winding(mine, points[k])
            if around > best[k]:
                best[k], found[k] = around, b
    return found
