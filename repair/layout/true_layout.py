"""A quad layout found on a tessellation moved onto the CAD model itself: creases onto its edge curves, the rest onto
its surfaces.

A tessellation's creases are chords of the true edges, and the layout's vertices lie on facets. Paths along sharp and
boundary edges get more points, so that chords between them stay within the wanted distance, and each point goes to the
nearest edge curve; vertices elsewhere go to the surface below them (the patch chain does so with the smooth paths).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.models.knots import divided
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.repair.ground.true_ground import TrueGround
from patchwright.repair.layout.quad_layout import QuadLayout

CHORDS = 32  # per span of an edge curve, where its nearest curve is looked for
MOST_PIECES = 16  # a chord of the tessellation is cut into at most this many


def onto_true(
    layout: QuadLayout, ground: TrueGround, curves: tuple[NurbsCurve, ...], chord: float, reach: float
) -> QuadLayout:
    """The layout with vertices and crease paths on the true model.

    Parameters
    ----------
    curves : the model's edge curves
    chord : the distance new chords may keep from the edge curves
    reach : how far a point may move (the tessellation's own deflection); farther points stay
    """
    crease = layout.sharp | layout.boundary
    on_crease = np.zeros(len(layout.vertices), dtype=bool)
    on_crease[layout.edges[crease].reshape(-1)] = True
    vertices = layout.vertices.copy()
    free = ~on_crease
    if free.any():
        vertices[free] = _within(vertices[free], ground.closest(vertices[free]).points, reach)
    pieces = int(np.clip(np.ceil(np.sqrt(reach / chord)), 1, MOST_PIECES))  # a chord's height falls with its square
    paths = [_refined(layout.path(e), pieces) if crease[e] else layout.path(e).copy() for e in range(len(layout.edges))]
    offsets = np.concatenate([[0], np.cumsum([len(p) for p in paths])])
    points = np.concatenate(paths)
    along = np.repeat(crease, np.diff(offsets))
    if curves and along.any():
        own = np.concatenate([points[along], vertices[on_crease]])
        moved = _within(own, onto_curves(own, curves), reach)
        points[along], vertices[on_crease] = moved[: along.sum()], moved[along.sum() :]
    points[offsets[:-1]] = vertices[layout.edges[:, 0]]
    points[offsets[1:] - 1] = vertices[layout.edges[:, 1]]
    return replace(layout, vertices=vertices, path_offsets=offsets, path_points=points)


def onto_curves(points: Array, curves: tuple[NurbsCurve, ...]) -> Array:
    """(n, 3) the nearest points of the curves."""
    from scipy.spatial import cKDTree

    from patchwright.models.closest_point import closest_on_curve

    parameters = [divided(curve.breaks, CHORDS) for curve in curves]
    owner = np.repeat(np.arange(len(curves)), [len(t) for t in parameters])
    t = np.concatenate(parameters)
    samples = np.concatenate([curve(at) for curve, at in zip(curves, parameters, strict=True)])
    nearest = np.asarray(cKDTree(samples).query(points)[1], dtype=np.int64)
    out = points.copy()
    for number in np.unique(owner[nearest]):
        some = np.flatnonzero(owner[nearest] == number)
        out[some] = closest_on_curve(curves[number], points[some], start=t[nearest[some]]).points
    return out


def _within(points: Array, moved: Array, reach: float) -> Array:
    """`moved` where that is no farther than `reach` from `points`, these elsewhere."""
    near: BoolArray = np.linalg.norm(moved - points, axis=1) <= reach
    return np.where(near[:, None], moved, points)


def _refined(path: Array, pieces: int) -> Array:
    """The polyline with every segment cut into equal pieces."""
    share = np.arange(pieces)[:, None] / pieces
    inner = path[:-1, None] + share * np.diff(path, axis=0)[:, None]
    return np.concatenate([inner.reshape(-1, 3), path[-1:]])
