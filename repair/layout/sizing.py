"""Wanted size of quads over a triangulation: from curvature, feature lines and their distances, graded.

Curvature is the tensor of Cohen-Steiner and Morvan (SCG 2003): signed dihedral angles times edge lengths, summed over a
neighbourhood and divided by its area; noise cancels in the sum, sharp edges are left out.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.layout.features import Features
from patchwright.repair.layout.ridges import Ridges, flanks

ANGLE_PER_QUAD = 30.0  # degrees of turn one bicubic piece takes
LARGEST, SMALLEST = 0.15, 0.004  # of the diagonal: quads
RIDGE_SIZE = 12.0  # radii of the bend: quads that begin at a ridge; sixteen pieces then follow the bend within r / 1000
GRADING = 0.45  # growth of the size per length
STRIP_ASPECT = 3.0  # longest quad in a strip between features against the strip's width
MOST_QUADS = 1500  # where no number is asked for, besides those that features ask for
MOST_FEATURED = 4500  # quads that features may ask for: bends, lengths and strips of curves alone
AREA_PER_QUAD = 0.85  # mean area of a quad against its size squared, measured on graded layouts


def size_field(
    features: Features, ridges: Ridges | None = None, *, target: int | None = None, factor: float = 1.0
) -> tuple[Array, float]:
    """Wanted edge length of quads at every vertex of `features.body`, and the number of quads it stands for.

    Parameters
    ----------
    ridges : ridge lines of the same triangulation, followed by `features`; None for none
    target : wanted number of quads, None for what the shape asks for (at most MOST_QUADS, and besides as many as the
        feature curves alone ask for, at most MOST_FEATURED)
    factor : further scale of the sizes, to correct the number that came out
    """
    body = features.body
    diagonal = body.diagonal
    quad_angle = np.radians(ANGLE_PER_QUAD)
    curvature = surface_curvature(features)
    size = np.full(len(body.vertices), LARGEST * diagonal)
    if ridges is not None:
        curvature[flanks(features, ridges, curvature, RIDGE_SIZE)] = 0.0
        size = np.minimum(size, RIDGE_SIZE * ridges.radius)
    np.minimum(size, np.divide(quad_angle, curvature, out=np.full_like(size, np.inf), where=curvature > 0), out=size)
    on_curve, limit = _curve_sizes(features, quad_angle)
    np.minimum.at(size, on_curve, limit)
    size = np.maximum(size, SMALLEST * diagonal)
    graded = _grade(features, size)
    number = _count(features, graded)
    if target is None and number > MOST_QUADS:
        alone = np.full(len(size), LARGEST * diagonal)
        np.minimum.at(alone, on_curve, limit)
        featured = _count(features, _grade(features, np.maximum(alone, SMALLEST * diagonal)))
        most = MOST_QUADS + min(featured, MOST_FEATURED)
        target = round(most) if number > most else None
    if target is not None:
        for _ in range(4):
            scale = np.sqrt(number / target)
            size = np.minimum(size * scale, 2.0 * LARGEST * diagonal) if scale > 1.0 else size * scale
            graded = _grade(features, size)
            number = _count(features, graded)
            if abs(number / target - 1.0) < 0.02:
                break
    return graded * factor, number


def widest_ridge(features: Features) -> float:
    """Radius below which a bend asks for quads smaller than the smallest there are."""
    return SMALLEST * features.body.diagonal / float(np.radians(ANGLE_PER_QUAD))


def surface_curvature(features: Features) -> Array:
    """(n,) largest absolute principal curvature at the vertices, averaged over a neighbourhood, 1 / length."""
    body, neighbours = features.body, features.neighbours
    points, normals, areas = body.vertices, features.normals, body.areas
    n = len(points)
    t, k = np.nonzero((neighbours >= 0) & (features.side_curve < 0))
    once = t < neighbours[t, k]
    t, k = t[once], k[once]
    other = neighbours[t, k]
    a, b = body.triangles[t, k], body.triangles[t, (k + 1) % 3]
    edge = points[b] - points[a]
    length = np.linalg.norm(edge, axis=1)
    direction = np.divide(edge, length[:, None], out=np.zeros_like(edge), where=length[:, None] > 0)
    cross = np.cross(normals[t], normals[other])
    angle = np.arctan2(np.einsum("ij,ij->i", cross, direction), np.einsum("ij,ij->i", normals[t], normals[other]))
    i, j = np.triu_indices(3)
    share = 0.5 * (angle * length)[:, None] * direction[:, i] * direction[:, j]
    total = np.zeros((n, 7))
    for end in (a, b):
        for c in range(6):
            total[:, c] += np.bincount(end, weights=share[:, c], minlength=n)
    for c in range(3):
        total[:, 6] += np.bincount(body.triangles[:, c], weights=areas / 3.0, minlength=n)
    mean_edge = float(np.median(length)) if len(length) else body.diagonal
    reach = 2.0 * np.sqrt(features.noise * body.diagonal)
    total = _diffuse(total, a, b, n, int(np.clip((reach / mean_edge) ** 2, 2, 12)))
    tensor = np.zeros((n, 3, 3))
    tensor[:, i, j] = total[:, :6]
    tensor[:, j, i] = total[:, :6]
    tensor = np.divide(tensor, total[:, 6, None, None], out=np.zeros_like(tensor), where=total[:, 6, None, None] > 0)
    return np.asarray(np.abs(np.linalg.eigvalsh(tensor)).max(axis=1))


def _diffuse(values: Array, a: IntArray, b: IntArray, n: int, rounds: int) -> Array:
    """Sums over growing neighbourhoods: each round adds the mean of the edge neighbours."""
    from scipy.sparse import coo_matrix

    ones = np.ones(2 * len(a))
    graph = coo_matrix((ones, (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(n, n)).tocsr()
    degree = np.maximum(np.asarray(graph.sum(axis=1)).reshape(-1, 1), 1.0)
    for _ in range(rounds):
        values = 0.5 * values + 0.5 * (graph @ (values / degree))
    return values


def _curve_sizes(features: Features, quad_angle: float) -> tuple[IntArray, Array]:
    """Vertices on curves and the size each allows: by the curve's bend, its length and the next curve's distance."""
    from scipy.spatial import cKDTree

    if not len(features.vertices):
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    points = features.body.vertices[features.vertices]
    count = np.diff(features.offsets)
    owner = np.repeat(np.arange(len(count)), count)
    length = features.lengths[owner]
    s = features.along
    # bend: second difference over a step of several segments that noise does not reach
    segments = 2.0 * length / np.maximum(count - 1, 1)[owner]
    step = np.minimum(
        np.maximum(segments, np.maximum(0.01 * features.body.diagonal, 10.0 * features.noise)), 0.25 * length
    )
    at = np.clip(s, step, length - step)
    shift = np.concatenate([[0.0], np.cumsum(features.lengths + 1.0)])[owner]

    def place(x: Array) -> Array:
        return np.stack([np.interp(shift + x, shift + s, points[:, d]) for d in range(3)], axis=1)

    bend = np.linalg.norm(place(at - step) - 2.0 * place(at) + place(at + step), axis=1)
    bend = np.divide(bend, step**2, out=np.zeros_like(bend), where=step > 0)
    size = np.divide(quad_angle, bend, out=np.full_like(bend, np.inf), where=bend > 0)
    # a curve below the smallest size must be there but asks for nothing round it
    least = SMALLEST * features.body.diagonal
    size = np.where(length > 2.0 * least, np.minimum(size, 0.5 * length), np.inf)
    # strips: the nearest point of another curve, unless both run into the same corner
    nearest = np.full(len(points), np.inf)
    tree = cKDTree(points)
    many = min(12, len(points))
    found = tree.query(points, k=many)
    gap, which = (np.asarray(x).reshape(len(points), -1) for x in found)
    foreign = owner[which] != owner[:, None]
    first = np.where(foreign.any(axis=1), foreign.argmax(axis=1), -1)
    rows = np.flatnonzero(first >= 0)
    nearest[rows] = gap[rows, first[rows]]
    ends = np.minimum(s, length - s)
    strip = (nearest > 0.25 * least) & (ends > 1.5 * nearest)
    size = np.where(strip, np.minimum(size, STRIP_ASPECT * nearest), size)
    return features.vertices, size


def _grade(features: Features, size: Array) -> Array:
    """The largest field below `size` that grows by at most GRADING per length along edges."""
    from patchwright.repair.layout import _sizing_kernel as kernel

    graded = np.ascontiguousarray(size, dtype=np.float64).copy()
    kernel.grade(features.body.vertices, features.body.triangles, GRADING, graded)
    return graded


def _count(features: Features, size: Array) -> float:
    """Number of quads of a size field."""
    mean = (1.0 / size**2)[features.body.triangles].mean(axis=1)
    return float((features.body.areas * mean).sum() / AREA_PER_QUAD)
