"""Points where surfaces meet, found from points nearby by Newton's method on tangent planes.

Two surfaces and a plane across a guide meet in one point: the auxiliary planes of Hamann, Jean and Razdan, section 4.
Any number of surfaces and curves meet in the point of least distance from their tangent planes and tangent lines that
is nearest to the start; where two of them touch, the direction they leave free is not moved along.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.closest_point import closest_on_curve, closest_on_surface
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface
from patchwright.repair.cad.draft import Limits
from patchwright.repair.cad.pcurves import parameters, widened

STEPS = 30
CROSSING = 0.05  # sine of the least angle at which two surfaces cross well enough to be trimmed there
TOUCH = 0.02  # singular values below this share of the largest are directions that surfaces touching leave free


def feet(surface: Surface, points: Array, near: Array | None = None) -> tuple[Array, Array, Array]:
    """Feet (k, 3) of points on the surface carried on, unit normals and parameters (k, 2) there.

    Parameters
    ----------
    near : (k, 2) parameters to start from; only a NURBS needs them, and only to be quick
    """
    if isinstance(surface, NurbsSurface):
        found = closest_on_surface(surface, points, start=near)
        uv = np.stack([found.u, found.v], axis=1)
    else:
        uv = parameters(surface, points)
    wide = widened(surface, uv)
    low, high = np.array(wide.domain).T
    u, v = np.clip(uv, low, high).T
    normal = np.cross(wide(u, v, (1, 0)), wide(u, v, (0, 1)))
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    return wide(u, v), np.divide(normal, size, out=np.zeros_like(normal), where=size > 0.0), uv


def farthest(surface: Surface, points: Array) -> float:
    """The largest distance of points (k, 3) from a surface."""
    return float(np.linalg.norm(feet(surface, points)[0] - points, axis=1).max())


def across(a: Surface, b: Surface, points: Array) -> Array:
    """(k,) sines of the angles at which two surfaces cross beside points."""
    return np.asarray(np.linalg.norm(np.cross(feet(a, points)[1], feet(b, points)[1]), axis=1))


def on_both(a: Surface, b: Surface, start: Array, along: Array, limits: Limits) -> Array | None:
    """(k, 3) points on both surfaces in the planes square to `along` (k, 3) through `start` (k, 3).

    None where the surfaces do not cross there within reach.
    """
    size = np.linalg.norm(along, axis=1, keepdims=True)
    if (size == 0.0).any():
        return None
    along = along / size
    x, near_a, near_b = start.copy(), None, None
    for _ in range(STEPS):
        feet_a, normal_a, near_a = feet(a, x, near_a)
        feet_b, normal_b, near_b = feet(b, x, near_b)
        rows = np.stack([normal_a, normal_b, along], axis=1)
        if np.abs(np.linalg.det(rows)).min() < CROSSING:
            return None
        right = np.stack(
            [
                np.einsum("ij,ij->i", feet_a - x, normal_a),
                np.einsum("ij,ij->i", feet_b - x, normal_b),
                np.einsum("ij,ij->i", start - x, along),
            ],
            axis=1,
        )
        step = np.linalg.solve(rows, right[..., None])[..., 0]
        x += step
        if np.linalg.norm(x - start, axis=1).max() > limits.reach:
            return None
        if np.linalg.norm(step, axis=1).max() <= 1e-3 * limits.fit:
            break
    far = max(np.linalg.norm(feet(s, x, n)[0] - x, axis=1).max() for s, n in ((a, near_a), (b, near_b)))
    return x if float(far) <= limits.fit else None


def on_all(surfaces: Sequence[Surface], curves: Sequence[NurbsCurve], start: Array, limits: Limits) -> Array:
    """(3,) the point on surfaces and curves near `start`; how near it came is the caller's to measure."""
    x = np.array(start, dtype=np.float64)
    near: list[Array | None] = [None] * len(surfaces)
    for _ in range(STEPS):
        rows, right = [], []
        for k, surface in enumerate(surfaces):
            foot, normal, near[k] = feet(surface, x[None], near[k])
            rows.append(normal[0])
            right.append(float((foot[0] - x) @ normal[0]))
        for curve in curves:
            found = closest_on_curve(curve, x[None])
            slope = curve(found.t, 1)[0]
            length = float(np.linalg.norm(slope))
            if length == 0.0:
                continue
            slope /= length
            first = np.cross(slope, np.eye(3)[int(np.argmin(np.abs(slope)))])
            first /= np.linalg.norm(first)
            for axis in (first, np.cross(slope, first)):
                rows.append(axis)
                right.append(float((found.points[0] - x) @ axis))
        if not rows:
            return x
        step = np.linalg.lstsq(np.array(rows), np.array(right), rcond=TOUCH)[0]
        size = float(np.linalg.norm(step))
        x += step if size <= limits.reach else step * (limits.reach / size)
        if size <= 1e-3 * limits.fit:
            break
    return x
