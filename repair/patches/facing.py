"""Which way a dirty geometry faces a patch: open sheets are turned to face as the patch does.

The thin-skin rule of the projection asks that a triangle faces as the patch; a closed body says itself where outside
is, a loose sheet does not. Votes are the facings of the triangles nearest along the patch's normals, either way.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation


def facing(body: Triangulation, points: Array, normals: Array, distance: float) -> tuple[Triangulation, int]:
    """The triangulation with its open sheets turned to the patch, and the patch's own sign.

    Parameters
    ----------
    points, normals : (n, 3) of the patch
    distance : half the length of each probe

    Returns
    -------
    The sign is -1 where the closed bodies under the patch face against its normals: then the patch runs clockwise.
    """
    tree = Tree.of(body)
    hits = tree.all_hits(points + distance * normals, points - distance * normals)
    if not len(hits.t):
        return body, 1
    ray = np.repeat(np.arange(len(points)), np.diff(hits.offsets))
    away = np.abs(hits.t - 0.5)
    order = np.lexsort((away, ray))
    nearest = order[np.searchsorted(ray[order], np.unique(ray))]
    triangle = hits.triangle[nearest]
    vote = np.sign(np.einsum("ij,ij->i", body.normals[triangle], normals[ray[nearest]]))
    adjacency = Adjacency.of(body)
    piece = adjacency.components()
    open_piece = np.zeros(piece.max() + 1, dtype=bool)
    open_piece[piece[adjacency.free[adjacency.triangle_edges].any(axis=1)]] = True
    total = np.zeros(len(open_piece))
    np.add.at(total, piece[triangle], vote)
    closed_votes = float(total[~open_piece].sum())
    sign = -1 if closed_votes < 0.0 else 1
    turned = (open_piece & (sign * total < 0.0))[piece]
    if not turned.any():
        return body, sign
    triangles = np.where(turned[:, None], body.triangles[:, ::-1], body.triangles)
    uv = None if body.uv is None else np.where(turned[:, None, None], body.uv[:, ::-1], body.uv)
    return replace(body, triangles=triangles, uv=uv), sign
