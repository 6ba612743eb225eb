"""The shape of the surface at the vertices of a layout: one normal and one second fundamental form per smooth sector.

Round a vertex with unit normal N the surface is a height h = g x + x B x / 2 + cubic terms over the tangent plane; all
are found by least squares from points of the patches round the vertex, and N is turned by the tilt g. Edges whose
normal curvatures and patches whose mixed derivatives all come from one form B can be smooth together, however many
edges meet there.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.joins import sector_labels
from patchwright.repair.patches.patch_fit import Target
from patchwright.repair.patches.patch_nets import PatchNets, evaluate
from patchwright.repair.patches.spline_space import collocation

STEP = 0.2  # of a side, on a patch of two pieces; less by the root of the pieces where there are more
REACH = 2  # steps are looked at from each corner
NEAR = np.array([0.01, 0.02, 0.04, 0.06])  # the same for the target's triangles beside a corner
MOST_TILT = 0.94  # cosine of 20 degrees: what the data may turn a guess by; beyond, the surface is no height over it
RIDGE = 1e-6  # of the mean weight: what the points do not tell is zero
CUBIC_RIDGE = 1e-3  # the same for the cubic terms


def facing(nets: PatchNets, target: Target) -> Array:
    """(m, 4, 3) unit mean normal of the target beside each corner of each patch, zero where it has none.

    The target's triangles nearest to points of the patch are asked. A patch's own normal is worth nothing where its
    edges leave the corner in one direction or where it folds; these still tell which side is out.
    """
    out = np.empty((len(nets), 4, 3))
    for (cells_u, cells_v), which, group in nets.groups():
        near_u, near_v = NEAR * np.sqrt(2.0 / cells_u), NEAR * np.sqrt(2.0 / cells_v)
        for k in range(4):
            u = 1.0 - near_u if k in (1, 2) else near_u
            v = 1.0 - near_v if k >= 2 else near_v
            points = evaluate(group, collocation(cells_u, u), collocation(cells_v, v)).reshape(-1, 3)
            triangle = target.tree.closest(points).triangle
            normals = np.asarray(target.tree.triangulation.normals)[triangle]
            out[which, k] = normals.reshape(len(which), -1, 3).mean(axis=1)
    length = np.linalg.norm(out, axis=2, keepdims=True)
    return np.asarray(np.divide(out, length, out=np.zeros_like(out), where=length > 0.0))


def vertex_normals(layout: QuadLayout, nets: PatchNets, sectors: Array, target: Target) -> Array:
    """(m, 4, 3) the unit normals at the corners, told by the data.

    Parameters
    ----------
    nets : patches near the data; their points round the vertices, put onto the target, are looked at
    sectors : (m, 4, 3) first guesses, the same on all corners of a sector (`joins.sector_normals`); zero stays zero,
        and a guess that the data would turn by more than 20 degrees stays as it is
    """
    around = _around(nets)
    points = around[:, :, 1:].reshape(-1, 3)
    around[:, :, 1:] = target.tree.closest(points).points.reshape(around[:, :, 1:].shape)
    label, normal, axes, terms = _least_squares(layout, around, sectors, tilted=True)
    turned = normal - terms[:, :1] * axes[0] - terms[:, 1:2] * axes[1]
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    turned = np.divide(turned, length, out=np.zeros_like(turned), where=length > 0)
    turned = np.where((turned * normal).sum(axis=1, keepdims=True) < MOST_TILT, normal, turned)
    return np.asarray(turned[label].reshape(sectors.shape))


def vertex_forms(layout: QuadLayout, nets: PatchNets, sectors: Array) -> Array:
    """(m, 4, 3, 3) symmetric tensors B at the corners: a tangent vector x has the normal curvature x B x / x x.

    Parameters
    ----------
    sectors : (m, 4, 3) unit normals at the corners; zero at cusps, where B is zero

    The corners of one sector have the same B, and B N = 0.
    """
    label, normal, (x, y), terms = _least_squares(layout, _around(nets), sectors, tilted=False)
    e, f, g = terms.T[:3, :, None, None]
    xx, yy, xy = x[:, :, None] * x[:, None, :], y[:, :, None] * y[:, None, :], x[:, :, None] * y[:, None, :]
    form = e * xx + f * (xy + np.swapaxes(xy, 1, 2)) + g * yy
    form[(normal == 0.0).all(axis=1)] = 0.0
    return np.asarray(form[label].reshape(*sectors.shape, 3))


def _around(nets: PatchNets) -> Array:
    """(m, 4, (REACH + 1)^2, 3) the corners of every patch and its points near them, the corner first."""
    out = np.empty((len(nets), 4, (REACH + 1) ** 2, 3))
    for (cells_u, cells_v), which, group in nets.groups():
        near_u, near_v = (np.arange(REACH + 1) * STEP * np.sqrt(2.0 / cells) for cells in (cells_u, cells_v))
        for k in range(4):
            u = 1.0 - near_u if k in (1, 2) else near_u
            v = 1.0 - near_v if k >= 2 else near_v
            points = evaluate(group, collocation(cells_u, u), collocation(cells_v, v))
            out[which, k] = points.reshape(len(which), -1, 3)
    return out


def _least_squares(
    layout: QuadLayout, around: Array, sectors: Array, *, tilted: bool
) -> tuple[IntArray, Array, tuple[Array, Array], Array]:
    """Per corner its sector's number; per sector normal, two tangent axes, and the terms of the height over them.

    The terms are [g_x, g_y,] B_xx, B_xy, B_yy, the first two if `tilted`.
    """
    label = sector_labels(layout).reshape(-1)
    count = int(label.max()) + 1
    normal = np.zeros((count, 3))
    normal[label] = sectors.reshape(-1, 3)
    axes = _frames(normal)
    ahead = (around[:, :, 1:] - around[:, :, :1]).reshape(len(label), -1, 3)
    x, y, h = (np.einsum("csd,cd->cs", ahead, axis[label]) for axis in (*axes, normal))
    away = np.sqrt(x * x + y * y)
    scale = np.bincount(label, away.mean(axis=1)) / np.bincount(label)
    scale[scale == 0.0] = 1.0
    size = scale[label][:, None]
    x, y, h, away = x / size, y / size, h / size, away / size
    first = [x, y] if tilted else []
    terms = np.stack([*first, 0.5 * x * x, x * y, 0.5 * y * y, x**3, x * x * y, x * y * y, y**3], axis=-1)
    weight = np.maximum(away, 1e-3) ** (-1.0 if tilted else -2.0)
    weight[away == 0.0] = 0.0
    rows, values = terms * weight[..., None], h * weight
    n = terms.shape[-1]
    matrix, right = np.zeros((count, n, n)), np.zeros((count, n))
    np.add.at(matrix, label, np.einsum("csi,csj->cij", rows, rows))
    np.add.at(right, label, np.einsum("csi,cs->ci", rows, values))
    trace = np.einsum("cii->c", matrix) / n
    ridge = np.repeat([RIDGE, CUBIC_RIDGE], [n - 4, 4])
    matrix += (trace + (trace == 0.0))[:, None, None] * np.diag(ridge)
    found = np.linalg.solve(matrix, right[..., None])[..., 0]
    found[:, n - 7 :] /= scale[:, None]
    return label, normal, axes, np.asarray(found[:, : n - 4], dtype=np.float64)


def _frames(normal: Array) -> tuple[Array, Array]:
    """Two (n, 3) unit vectors that make a right-handed frame with each normal."""
    least = np.eye(3)[np.abs(normal).argmin(axis=1)]
    x = np.cross(least, normal)
    length = np.linalg.norm(x, axis=1, keepdims=True)
    x = np.divide(x, length, out=np.zeros_like(x), where=length > 0)
    return x, np.cross(normal, x)
