"""Smooth joins: one normal field per edge and vertex, and the inner control rows that follow it.

Source: Hamann, Jean, Razdan, section 3 (tangent-plane continuity after Faux & Pratt). Departure: instead of one
constant ratio per edge, both neighbours are made to have the edge's common normal at the collocation points, which
lets them differ in their number of pieces. Between the points the angle that is left falls with the cell size; it is
measured, never assumed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.patch_nets import PatchNets, normals_of
from patchwright.repair.quad_layout import QuadLayout
from patchwright.repair.spline_space import collocation, greville, uniform_collocation

FIELD_SAMPLES = 33  # parameters at which an edge's normal field is stored
OUTLIER = 0.0  # cosine: a corner turned from the mean of its sector by more than a right angle is a fold, not a bend
CUSP = 0.5  # mean cosine between the normals round a vertex and their mean, below which they have no common one
DAMPING = 0.02  # share of the wanted turn given up where the equations contradict each other

# corner k of a quad as index of u and v
CORNER_U, CORNER_V = np.array([0, 1, 1, 0]), np.array([0, 0, 1, 1])


def corner_normals(nets: PatchNets) -> Array:
    """(m, 4, 3) unit normal of every patch at its corners, extrapolated from a tenth and a fifth of a cell inside.

    At the corner itself the normal hangs on two edge tangents, which may be nearly parallel at an irregular vertex.
    """
    out = np.empty((len(nets), 4, 3))
    for (m, n), which, group in nets.groups():
        near, far = (_inner_normals(group, (m, n), share) for share in (0.1, 0.2))
        out[which] = _unit(2.0 * near - far)
    return out


def _inner_normals(group: Array, cells: tuple[int, int], share: float) -> Array:
    """(k, 4, 3) unit normals `share` of a cell inside each corner."""
    m, n = cells
    us, vs = np.array([share / m, 1 - share / m]), np.array([share / n, 1 - share / n])
    du = np.einsum("ai,kijd,bj->kabd", collocation(m, us, 1), group, collocation(n, vs), optimize=True)
    dv = np.einsum("ai,kijd,bj->kabd", collocation(m, us), group, collocation(n, vs, 1), optimize=True)
    return np.asarray(normals_of(du, dv)[:, CORNER_U, CORNER_V])


def sector_normals(layout: QuadLayout, at_corners: Array, weights: Array | None = None) -> Array:
    """(m, 4, 3) the mean normal of the smooth sector each quad corner belongs to.

    A sector is the set of corners round a vertex that reach each other across smooth edges; sharp edges and boundaries
    separate sectors, so a vertex on a crease has one normal per side. `weights` (m, 4) tell how far each corner's
    normal is to be trusted. A corner turned from the mean by more than `OUTLIER` has no part in the final mean, unless
    that leaves none. At a cusp, where the normals are spread over more than a cone of that opening, there is no common
    normal: zero.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    smooth = smooth_edges(layout)
    quads, sides = np.nonzero(smooth[layout.quad_edges])
    edge = layout.quad_edges[quads, sides]
    order = np.argsort(edge, kind="stable")
    quad, side = quads[order].reshape(-1, 2), sides[order].reshape(-1, 2)  # the two uses of each smooth edge
    # the uses run opposite ways: the start corner of one is the end corner of the other
    start = quad * 4 + side
    end = quad * 4 + (side + 1) % 4
    turned = layout.edge_reversed[quad[:, 0], side[:, 0]] == layout.edge_reversed[quad[:, 1], side[:, 1]]
    other_start = np.where(turned, start[:, 1], end[:, 1])
    other_end = np.where(turned, end[:, 1], start[:, 1])
    i = np.concatenate([start[:, 0], end[:, 0]])
    j = np.concatenate([other_start, other_end])
    count = 4 * len(layout.quads)
    _, label = connected_components(coo_matrix((np.ones(len(i)), (i, j)), shape=(count, count)), directed=False)
    normals = at_corners.reshape(-1, 3)
    trust = np.ones(count) if weights is None else weights.reshape(-1)

    def mean(share: Array) -> Array:
        total = np.zeros((label.max() + 1, 3))
        np.add.at(total, label, share[:, None] * normals)
        return _unit(total)

    first = mean(trust)
    second = mean(np.where((first[label] * normals).sum(axis=1) > OUTLIER, trust, 0.0))
    second = np.where((second == 0.0).all(axis=1, keepdims=True), first, second)
    along = np.bincount(label, trust * (first[label] * normals).sum(axis=1))
    second[along < CUSP * np.bincount(label, trust)] = 0.0
    return np.asarray(second[label].reshape(-1, 4, 3))


def smooth_edges(layout: QuadLayout) -> BoolArray:
    """(e,) edges with a patch on either side and no crease between them."""
    return np.asarray(~layout.sharp & ~layout.boundary)


def edge_end_normals(layout: QuadLayout, sectors: Array) -> tuple[Array, Array]:
    """Two (e, 2, 3) arrays: the sector normals at the start and end of each edge on its first and on its second side.

    On a smooth edge and on a boundary both are the same.
    """
    e = len(layout.edges)
    out = np.zeros((2, e, 2, 3))
    seen = np.zeros(e, dtype=np.int64)
    for k in range(4):
        edge = layout.quad_edges[:, k]
        start, end = sectors[:, k], sectors[:, (k + 1) % 4]
        flip = layout.edge_reversed[:, k, None]
        slot = seen[edge]
        # two quads may reach one edge by the same side number: the second use goes to the second slot
        first_use = np.zeros(len(edge), dtype=bool)
        first_use[np.unique(edge, return_index=True)[1]] = True
        slot = np.minimum(slot + ~first_use, 1)
        out[slot, edge, 0] = np.where(flip, end, start)
        out[slot, edge, 1] = np.where(flip, start, end)
        np.add.at(seen, edge, 1)
    single = seen == 1
    out[1, single] = out[0, single]
    return out[0], out[1]


def side_normals(layout: QuadLayout, nets: PatchNets, count: int = FIELD_SAMPLES) -> Array:
    """(m, 4, count, 3) unit normals along each side at equidistant parameters of its edge, in the edge's direction."""
    out = np.empty((len(nets), 4, count, 3))
    for (m, n), which, group in nets.groups():
        bu, bv = uniform_collocation(m, count), uniform_collocation(n, count)
        du, dv = uniform_collocation(m, count, 1), uniform_collocation(n, count, 1)
        for k, (ends_u, ends_v) in enumerate(((None, 0), (-1, None), (None, -1), (0, None))):
            if ends_v is not None:
                tu = np.einsum("ai,kid->kad", du, group[:, :, ends_v])
                tv = np.einsum("ai,kijd,j->kad", bu, group, dv[ends_v], optimize=True)
            else:
                tu = np.einsum("aj,kijd,i->kad", bv, group, du[ends_u], optimize=True)
                tv = np.einsum("ai,kid->kad", dv, group[:, ends_u])
            out[which, k] = normals_of(tu, tv)
    # sides 0 and 1 are sampled along +u, +v, which is the quad's own way round; 2 and 3 against it
    backward = layout.edge_reversed != np.array([False, False, True, True])
    out[backward] = out[backward][:, ::-1]
    return out


def edge_uses(layout: QuadLayout) -> IntArray:
    """(e, 2) the first and the last side 4 q + k that runs along each edge; equal on a boundary."""
    sides = layout.quad_edges.reshape(-1)
    order = np.argsort(sides, kind="stable")
    numbers = np.arange(len(layout.edges))
    return np.stack(
        [order[np.searchsorted(sides[order], numbers)], order[np.searchsorted(sides[order], numbers, "right") - 1]],
        axis=1,
    )


def seam_angles(layout: QuadLayout, sides: Array) -> Array:
    """(e,) degrees, the largest angle between the normals of both patches along each edge (`side_normals`)."""
    one, two = sides.reshape(-1, *sides.shape[2:])[edge_uses(layout)].swapaxes(0, 1)
    half = np.clip(np.linalg.norm(one - two, axis=2) / 2.0, 0.0, 1.0)
    return np.asarray(np.degrees(2.0 * np.arcsin(half)).max(axis=1))


def edge_fields(layout: QuadLayout, sides: Array, sectors: Array) -> Array:
    """(e, FIELD_SAMPLES, 3) the common unit normal along every edge, in the edge's direction.

    The mean of both sides' normals (`side_normals`), running to the sector normals at the vertices. Only the smooth
    edges' rows mean anything.
    """
    total = np.zeros((len(layout.edges), sides.shape[2], 3))
    for k in range(4):
        np.add.at(total, layout.quad_edges[:, k], sides[:, k])
    start, _ = edge_end_normals(layout, sectors)
    total = _unit(total)
    # the ends jump to the sector normal; the jump is spread linearly along the edge, so the field stays smooth
    t = np.linspace(0.0, 1.0, sides.shape[2])[:, None]
    there = np.any(start != 0.0, axis=2, keepdims=True)  # at a cusp every edge keeps its own normal
    jump = np.where(there, start - total[:, [0, -1]], 0.0)
    total = total + (1 - t) * jump[:, :1] + t * jump[:, 1:]
    return _unit(total)


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))


def follow_fields(layout: QuadLayout, nets: PatchNets, fields: Array) -> PatchNets:
    """The patches with their first inner rows moved along the normal until they have the edges' common normals.

    At the Greville points of every smooth side the cross-boundary derivative is made perpendicular to the edge's
    normal; the twist control points serve two sides and take the least-squares compromise.
    """
    smooth = smooth_edges(layout)
    groups = []
    for (m, n), which, group in nets.groups():
        groups.append((which, _follow(layout, which, group, (m, n), fields, smooth)))
    return PatchNets.pack(np.asarray(nets.cells), groups)


@dataclass(frozen=True, slots=True, eq=False)
class _Side:
    """One side of k patches: its conditions and the inner control points that may move.

    `slots` (n,) numbers them on the ring; `basis` (n, n) their weights at the Greville points; `normal` and `leg`
    (k, n, 3) the edge's normal and the cross-boundary difference there; `active` (k,) sides that are smooth.
    """

    slots: IntArray
    basis: Array
    normal: Array
    leg: Array
    active: BoolArray


def _follow(
    layout: QuadLayout, which: IntArray, nets: Array, cells: tuple[int, int], fields: Array, smooth: BoolArray
) -> Array:
    """Moved copies of nets (k, M + 3, N + 3, 3) of one size."""
    m, n = cells
    ring = -np.ones((m + 3, n + 3), dtype=np.int64)  # numbers of the inner control points next to the boundary
    ring[1 : m + 2, [1, n + 1]] = ring[[1, m + 1], 1 : n + 2] = 0
    i, j = np.nonzero(ring == 0)
    ring[i, j] = np.arange(len(i))
    rows = (nets[:, :, 0], nets[:, -1], nets[:, :, -1], nets[:, 0])
    inner = (nets[:, :, 1], nets[:, -2], nets[:, :, -2], nets[:, 1])
    slots = (ring[1:-1, 1], ring[m + 1, 1:-1], ring[1:-1, n + 1], ring[1, 1:-1])
    sides = []
    for k in range(4):
        edge = layout.quad_edges[which, k]
        field = fields[edge]
        backward = layout.edge_reversed[which, k] != (k >= 2)
        field[backward] = field[backward][:, ::-1]
        sides.append(_side(cells[k % 2], slots[k], rows[k], inner[k] - rows[k], field, smooth[edge]))
    direction = np.zeros((len(which), len(i), 3))
    for side in sides:
        direction[:, side.slots] += np.where(side.active[:, None, None], side.normal, 0.0)
    direction = _unit(direction)
    matrix, value, legs = [], [], []
    for side in sides:
        scale = np.linalg.norm(side.leg, axis=-1)
        scale[scale == 0.0] = 1.0
        turn = np.zeros((len(which), len(side.slots), len(i)))
        turn[:, :, side.slots] = side.basis * np.einsum("kad,ksd->kas", side.normal, direction[:, side.slots])
        weight = np.where(side.active[:, None], 1.0 / scale, 0.0)
        matrix.append(turn * weight[..., None])
        value.append(-np.einsum("kad,kad->ka", side.leg, side.normal) * weight)
        legs.append(scale)
    # damped least squares in units of the patch's own legs: where two sides want contradicting twists, nobody gets far
    leg = np.concatenate(legs, axis=1).mean(axis=1)[:, None, None]
    equations, wanted = np.concatenate(matrix, axis=1) * leg, np.concatenate(value, axis=1)[..., None]
    transposed = np.swapaxes(equations, 1, 2)
    move = np.linalg.solve(transposed @ equations + DAMPING**2 * np.eye(len(i)), transposed @ wanted) * leg
    moved = nets.copy()
    moved[:, i, j] += move * direction
    return moved


def _side(own: int, slots: IntArray, border: Array, leg: Array, field: Array, active: BoolArray) -> _Side:
    """The conditions along a side of `own` pieces: from its control row, the legs to the next, and the edge's field."""
    from scipy.interpolate import CubicSpline

    sites = greville(own)[1:-1]
    basis = collocation(own, sites)
    normal = _unit(CubicSpline(np.linspace(0.0, 1.0, field.shape[1]), field, axis=1)(sites))
    # the shared boundary's own tangent stays perpendicular to the normal
    tangent = _unit(np.einsum("ai,kid->kad", collocation(own, sites, 1), border))
    normal = _unit(normal - (normal * tangent).sum(-1, keepdims=True) * tangent)
    return _Side(slots, basis[:, 1:-1], normal, np.einsum("ai,kid->kad", basis, leg), active)
