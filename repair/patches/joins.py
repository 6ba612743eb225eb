"""What the joins of patches are like: normals at corners and along sides, sectors, and the angles of the seams."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.patch_nets import PatchNets, normals_of
from patchwright.repair.patches.spline_space import uniform_collocation

FIELD_SAMPLES = 33  # parameters at which an edge's normal field is stored
OUTLIER = 0.0  # cosine: a corner turned from the mean of its sector by more than a right angle is a fold, not a bend
CUSP = 0.5  # mean cosine between the normals round a vertex and their mean, below which they have no common one
DAMPING = 0.02  # share of the wanted turn given up where the equations contradict each other


def sector_labels(layout: QuadLayout) -> IntArray:
    """(m, 4) number of the smooth sector each quad corner belongs to.

    A sector is the set of corners round a vertex that reach each other across smooth edges; sharp edges and boundaries
    separate sectors, so a vertex on a crease has one normal per side.
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
    return np.asarray(label.reshape(-1, 4), dtype=np.int64)


def sector_normals(layout: QuadLayout, at_corners: Array) -> Array:
    """(m, 4, 3) the mean normal of the smooth sector each quad corner belongs to.

    A corner turned from the mean by more than `OUTLIER` has no part in the final mean, unless that leaves none. At a
    cusp, where the normals are spread over more than a cone of that opening, there is no common normal: zero.
    """
    label = sector_labels(layout).reshape(-1)
    count = len(label)
    normals = at_corners.reshape(-1, 3)

    def mean(share: Array) -> Array:
        total = np.zeros((label.max() + 1, 3))
        np.add.at(total, label, share[:, None] * normals)
        return _unit(total)

    first = mean(np.ones(count))
    second = mean(((first[label] * normals).sum(axis=1) > OUTLIER).astype(np.float64))
    second = np.where((second == 0.0).all(axis=1, keepdims=True), first, second)
    along = np.bincount(label, (first[label] * normals).sum(axis=1))
    second[along < CUSP * np.bincount(label)] = 0.0
    return np.asarray(second[label].reshape(-1, 4, 3))


def smooth_edges(layout: QuadLayout) -> BoolArray:
    """(e,) edges with a patch on either side and no crease between them."""
    return np.asarray(~layout.sharp & ~layout.boundary)


def regular_edges(layout: QuadLayout) -> BoolArray:
    """(e,) smooth edges between two vertices with four edges each, all of them smooth."""
    smooth = smooth_edges(layout)
    count = len(layout.vertices)
    regular = np.bincount(layout.edges.reshape(-1), minlength=count) == 4
    regular[layout.edges[~smooth]] = False
    return np.asarray(smooth & regular[layout.edges].all(axis=1))


def edge_end_normals(layout: QuadLayout, sectors: Array) -> tuple[Array, Array]:
    """Two (e, 2, 3) arrays: the sector normals at the start and end of each edge on its first and on its second side.

    On a smooth edge and on a boundary both are the same. Any other values of the sectors, (m, 4, d), may be asked for.
    """
    e = len(layout.edges)
    out = np.zeros((2, e, 2, sectors.shape[-1]))
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


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))
