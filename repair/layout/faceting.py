"""How far a triangulation's facets stray from the smooth surface they stand for: the data's own resolution.

A smooth patch cannot follow coarse facets closer than that without copying the facets themselves.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array
from patchwright.models.triangulation import Triangulation
from patchwright.repair.layout.tips import find_tips

SHARE = 99.0  # per cent of the area whose facets are within the stated distance


def facet_heights(body: Triangulation, angle: float) -> Array:
    """(m,) height of the smooth surface over each triangle.

    The smooth surface is the quadratic one with the corners' mean normals: over the middle of an edge it rises by
    (p_j - p_i) . (n_i - n_j) / 8 (exact for a circle to second order), over the centroid by 4/9 of the edges' sum.
    Edges sharper than `angle` degrees part the normals on either side; at a tip every triangle keeps its own.
    """
    normals = _corner_normals(body, angle)
    corners = body.corners
    edge = np.roll(corners, -1, axis=1) - corners
    rise = np.einsum("mkd,mkd->mk", edge, np.roll(normals, -1, axis=1) - normals) / 8.0
    centre = 4.0 / 9.0 * rise.sum(axis=1)
    return np.asarray(np.maximum(np.abs(centre), np.abs(rise).max(axis=1)))


def faceting(body: Triangulation, angle: float) -> float:
    """The height (model unit) that 99 % of the area stays below."""
    if not len(body):
        return 0.0
    height, area = facet_heights(body, angle), body.areas
    order = np.argsort(height)
    share = np.cumsum(area[order])
    return float(height[order][np.searchsorted(share, SHARE / 100.0 * share[-1])]) if share[-1] > 0 else 0.0


def _corner_normals(body: Triangulation, angle: float) -> Array:
    """(m, 3, 3) area-weighted mean normal at each corner over the triangles reached across smooth edges."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    adjacency, normal = Adjacency.of(body), body.normals
    triangle, side = np.nonzero(adjacency.neighbours >= 0)
    other = adjacency.neighbours[triangle, side]
    smooth = np.einsum("ij,ij->i", normal[triangle], normal[other]) > np.cos(np.radians(angle))
    creased = np.zeros(len(body.vertices), dtype=bool)
    creased[body.triangles[triangle[~smooth], side[~smooth]]] = True
    triangle, side, other = triangle[smooth], side[smooth], other[smooth]
    links = []
    for corner in (side, (side + 1) % 3):
        vertex = body.triangles[triangle, corner]
        place = np.argmax(body.triangles[other] == vertex[:, None], axis=1)
        links.append((3 * triangle + corner, 3 * other + place))
    i, j = (np.concatenate([link[k] for link in links]) for k in (0, 1))
    count = 3 * len(body)
    _, label = connected_components(coo_matrix((np.ones(len(i)), (i, j)), shape=(count, count)), directed=False)
    total = np.zeros((int(label.max()) + 1, 3))
    np.add.at(total, label, np.repeat(body.area_vectors, 3, axis=0))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    total = np.divide(total, length, out=np.zeros_like(total), where=length > 0)
    normals = total[label].reshape(-1, 3, 3)
    tip = find_tips(body, normal, creased, angle)[body.triangles]
    return np.asarray(np.where(tip[..., None], normal[:, None], normals))
