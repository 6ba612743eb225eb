"""Normals and curvatures of any surface with the call protocol; poles and creases have the limit from inside the
domain.

Reference: do Carmo, Differential Geometry of Curves and Surfaces, 1976, chapters 2 and 3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.surface import Surface

SINE_OF_NONE = 1e-9  # S_u and S_v count as parallel below this sine: round-off of the derivatives divided by their size
STEP_INSIDE = 1e-4  # of the domain: where the limit is taken when the first-order one vanishes too


@dataclass(frozen=True, slots=True, eq=False)
class Curvature:
    """Curvatures at parameters of any shape; positive where the surface bends towards its normal S_u x S_v."""

    maximum: Array
    """(...) larger principal curvature, 1 / length."""
    minimum: Array
    """(...) smaller principal curvature, 1 / length."""
    maximum_direction: Array
    """(..., 3) unit tangent of the larger one; any tangent where both agree."""
    minimum_direction: Array
    """(..., 3) unit tangent of the smaller one."""
    normal: Array
    """(..., 3) unit normal."""

    @property
    def gauss(self) -> Array:
        """(...) product of the principal curvatures."""
        return self.maximum * self.minimum

    @property
    def mean(self) -> Array:
        """(...) half the sum of the principal curvatures."""
        return 0.5 * (self.maximum + self.minimum)


def normals(surface: Surface, u: npt.ArrayLike, v: npt.ArrayLike) -> Array:
    """(..., 3) unit normals S_u x S_v / |S_u x S_v| at broadcast parameters.

    Where the cross product vanishes (a pole, a collapsed edge, parallel tangents) the limit along the way to the
    middle of the domain is given; NaN where the surface has no normal there either.
    """
    us, vs = (np.array(x, dtype=np.float64) for x in np.broadcast_arrays(u, v))
    shape = us.shape
    us, vs = us.ravel(), vs.ravel()
    su, sv = surface(us, vs, (1, 0)), surface(us, vs, (0, 1))
    out, good = _unit_cross(surface, su, sv)
    if not good.all():
        bad = np.flatnonzero(~good)
        out[bad] = _limit(surface, us[bad], vs[bad])
    return out.reshape(*shape, 3)


def _inward(surface: Surface, u: Array, v: Array) -> tuple[Array, Array]:
    """Steps towards the middle of the domain in the directions whose end is near, of the size of the domain."""
    steps = []
    for t, (low, high) in zip((u, v), surface.domain, strict=True):
        if not np.isfinite(high - low):
            steps.append(np.zeros_like(t))
            continue
        place = (t - low) / (high - low)
        edge = STEP_INSIDE
        steps.append(np.where(place < edge, 1.0, np.where(place > 1.0 - edge, -1.0, 0.0)) * (high - low))
    lost = (steps[0] == 0.0) & (steps[1] == 0.0)
    for k, (low, high) in enumerate(surface.domain):
        if np.isfinite(high - low):
            steps[k] = np.where(lost, np.where((u, v)[k] < 0.5 * (low + high), 1.0, -1.0) * (high - low), steps[k])
    return steps[0], steps[1]


def _limit(surface: Surface, u: Array, v: Array) -> Array:
    du, dv = (s[:, None] for s in _inward(surface, u, v))
    su, sv = surface(u, v, (1, 0)), surface(u, v, (0, 1))
    suu, suv, svv = surface(u, v, (2, 0)), surface(u, v, (1, 1)), surface(u, v, (0, 2))
    # the first-order change of S_u x S_v on the way inside
    change_u, change_v = suu * du + suv * dv, suv * du + svv * dv
    first = np.cross(change_u, sv) + np.cross(su, change_v)
    size = np.linalg.norm(first, axis=1)
    scale = np.linalg.norm(change_u, axis=1) * np.linalg.norm(sv, axis=1)
    scale += np.linalg.norm(change_v, axis=1) * np.linalg.norm(su, axis=1)
    good = size > SINE_OF_NONE * scale
    out = np.full((u.shape[0], 3), np.nan)
    out[good] = first[good] / size[good, None]
    if not good.all():
        left = np.flatnonzero(~good)
        (low_u, high_u), (low_v, high_v) = surface.domain
        at_u = np.clip(u[left] + STEP_INSIDE * du[left, 0], low_u, high_u)
        at_v = np.clip(v[left] + STEP_INSIDE * dv[left, 0], low_v, high_v)
        near, found = _unit_cross(surface, surface(at_u, at_v, (1, 0)), surface(at_u, at_v, (0, 1)))
        out[left[found]] = near[found]
    return out


def _unit_cross(surface: Surface, su: Array, sv: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Unit cross products and where they are to be trusted: not parallel, and no tangent lost in the other's
    round-off."""
    (low_u, high_u), (low_v, high_v) = surface.domain
    width = high_u - low_u if np.isfinite(high_u - low_u) else 1.0
    height = high_v - low_v if np.isfinite(high_v - low_v) else 1.0
    cross = np.cross(su, sv)
    size = np.linalg.norm(cross, axis=1)
    length_u, length_v = np.linalg.norm(su, axis=1), np.linalg.norm(sv, axis=1)
    across, along = length_u * width, length_v * height
    good = (size > SINE_OF_NONE * length_u * length_v) & (
        np.minimum(across, along) > SINE_OF_NONE * np.maximum(across, along)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        return cross / size[:, None], good


def curvature(surface: Surface, u: npt.ArrayLike, v: npt.ArrayLike) -> Curvature:
    """Principal curvatures and directions at broadcast parameters.

    Where the tangents vanish or are parallel the values are those of a point 1e-4 of the domain further inside; NaN
    where that has none either.
    """
    us, vs = (np.array(x, dtype=np.float64) for x in np.broadcast_arrays(u, v))
    shape = us.shape
    us, vs = us.ravel(), vs.ravel()
    _, good = _unit_cross(surface, surface(us, vs, (1, 0)), surface(us, vs, (0, 1)))
    if not good.all():
        bad = np.flatnonzero(~good)
        du, dv = _inward(surface, us[bad], vs[bad])
        us[bad] += STEP_INSIDE * du
        vs[bad] += STEP_INSIDE * dv
    su, sv = surface(us, vs, (1, 0)), surface(us, vs, (0, 1))
    normal = normals(surface, us, vs)
    # an orthonormal tangent frame (e1, e2) and the coordinates of S_u, S_v in it: S_u = a e1, S_v = b e1 + c e2
    with np.errstate(divide="ignore", invalid="ignore"):
        a = np.linalg.norm(su, axis=1)
        e1 = su / a[:, None]
        e2 = np.cross(normal, e1)
        b, c = _dot(sv, e1), _dot(sv, e2)
        second = [_dot(surface(us, vs, nu), normal) for nu in ((2, 0), (1, 1), (0, 2))]
        # the shape operator in that frame is symmetric: [[x, y], [y, z]]
        x = second[0] / a**2
        y = (second[1] - b * x * a) / (a * c)
        z = (second[2] - b * b * x - 2.0 * b * c * y) / c**2
        half, spread = 0.5 * (x + z), np.hypot(0.5 * (x - z), y)
        angle = 0.5 * np.arctan2(2.0 * y, x - z)
    one = np.cos(angle)[:, None] * e1 + np.sin(angle)[:, None] * e2
    two = np.cross(normal, one)
    return Curvature(
        (half + spread).reshape(shape),
        (half - spread).reshape(shape),
        one.reshape(*shape, 3),
        two.reshape(*shape, 3),
        normal.reshape(*shape, 3),
    )


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", a, b))
