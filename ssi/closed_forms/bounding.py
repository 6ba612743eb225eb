"""Unbounded planes, cylinders and cones cut down to what another surface can reach."""

from __future__ import annotations

import math

import numpy as np

from patchwright.models import Cone, Cylinder, Plane
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.surface import Surface
from patchwright.ssi.closed_forms.extents import EPS
from patchwright.ssi.closed_forms.inversion import place

MARGIN = 0.01  # of the box' diagonal: any positive share keeps the artificial ends off the other surface

Pair = tuple[Surface, Surface]


def clip(a: Surface, b: Surface) -> Pair:
    """Both surfaces with finite ranges.

    An unbounded one gets the ranges that hold the other's box (the hull of its control points) and a margin. Two
    unbounded ones are cut to the box of what they share, where that is finite: cylinders and planes across them,
    cylinders that are not parallel, cones and planes that meet in an ellipse, cones and cylinders none of whose
    rulings run alike.

    Raises
    ------
    ParameterError : both are unbounded and so may be what they share.
    """
    if _bounded(a) and _bounded(b):
        return a, b
    if _bounded(a):
        return a, _cut(b, _corners(a.to_nurbs().control_points.reshape(-1, 3)))
    if _bounded(b):
        return _cut(a, _corners(b.to_nurbs().control_points.reshape(-1, 3))), b
    first, second = (a, b) if _rank(a) >= _rank(b) else (b, a)
    near, far = _shared(first, second)
    assert isinstance(first, Cylinder | Cone)
    one = _ranged(first, (near, far))
    other = _cut(second, _corners(one.to_nurbs().control_points.reshape(-1, 3)))
    return (one, other) if first is a else (other, one)


def clip_to(surface: Surface, box: Array) -> Surface:
    """The surface with finite ranges: of an unbounded one what reaches beyond a box (2, 3) by a margin."""
    return surface if _bounded(surface) else _cut(surface, _corners(box))


def _bounded(surface: Surface) -> bool:
    return bool(np.isfinite(surface.domain).all())


def _rank(surface: Surface) -> int:
    return 0 if isinstance(surface, Plane) else 1 if isinstance(surface, Cone) else 2


def _corners(points: Array) -> Array:
    low, high = points.min(axis=0), points.max(axis=0)
    spread = np.stack((low, high))
    return np.stack(np.meshgrid(*spread.T, indexing="ij"), axis=-1).reshape(-1, 3)


def _cut(surface: Surface, corners: Array) -> Surface:
    """Finite ranges that hold the corners of a box; those that are finite already stay."""
    assert isinstance(surface, Plane | Cylinder | Cone)
    margin = MARGIN * float(np.linalg.norm(corners[-1] - corners[0]))
    origin, frame = place(surface)
    local = (corners - origin) @ frame.T
    if isinstance(surface, Plane):
        u, v = (_finite(r, local[:, i], margin) for i, r in enumerate(surface.domain))
        return Plane(surface.origin, surface.normal, surface.xdir, u, v)
    return _ranged(surface, _finite(surface.v, local[:, 2], margin))


def _finite(old: tuple[float, float], values: Array, margin: float) -> tuple[float, float]:
    low, high = float(values.min()) - margin, float(values.max()) + margin
    low, high = (old[0] if math.isfinite(old[0]) else low), (old[1] if math.isfinite(old[1]) else high)
    if low < high:
        return low, high
    return (low, low + margin) if math.isfinite(old[0]) else (high - margin, high)  # the box lies beyond the finite end


def _ranged(surface: Cylinder | Cone, v: tuple[float, float]) -> Cylinder | Cone:
    if isinstance(surface, Cylinder):
        return Cylinder(surface.origin, surface.axis, surface.radius, surface.xdir, surface.u, v)
    return Cone(surface.origin, surface.axis, surface.half_angle, surface.ref_radius, surface.xdir, surface.u, v)


def _shared(one: Surface, other: Surface) -> tuple[float, float]:
    """The range of v of the first that holds all it shares with the other.

    A ruling p + t g of the first meets the other where A t^2 + 2 B t + C = 0 (a plane: A = 0 and B t = C), so that
    |t| <= (|B| + sqrt(B^2 + |A C|)) / |A| with A the least and B, C the largest over all rulings.
    """
    if not isinstance(one, Cylinder | Cone):
        raise _refusal()
    z = one.axis
    if isinstance(one, Cylinder):
        start, spread, alpha = one.origin, one.radius, 0.0
    else:
        start, spread, alpha = one.apex, 0.0, abs(one.half_angle)
    if isinstance(other, Plane):
        steep = math.asin(min(1.0, abs(float(other.normal @ z)))) - alpha
        if steep <= 64.0 * EPS:
            raise _refusal()
        c = abs(float(other.normal @ (other.origin - start))) + spread
        t = c / math.sin(steep)
    else:
        assert isinstance(other, Cylinder | Cone)
        beta = 0.0 if isinstance(other, Cylinder) else abs(other.half_angle)
        base = other.origin if isinstance(other, Cylinder) else other.apex
        angle = math.atan2(float(np.linalg.norm(np.cross(z, other.axis))), abs(float(z @ other.axis)))
        # angles between the second axis and the rulings of the first, both directions of the axis alike
        least, most = max(0.0, angle - alpha) if angle > alpha else 0.0, min(angle + alpha, 0.5 * math.pi)
        if angle <= alpha:
            least = alpha - angle
        if least <= beta <= most and most - least >= 0.0:
            apart = 0.0
        else:
            apart = min(abs(math.cos(e) ** 2 - math.cos(beta) ** 2) for e in (least, most))
        if apart <= 64.0 * EPS:
            raise _refusal()
        d = float(np.linalg.norm(start - base)) + spread
        b, c = d, d * d + (other.radius**2 if isinstance(other, Cylinder) else 0.0)
        t = (b + math.sqrt(b * b + apart * c)) / apart
    middle = float((start - one.origin) @ z)
    reach = t * (1.0 + MARGIN) * math.cos(alpha)
    low, high = one.v
    low, high = (low if math.isfinite(low) else middle - reach), (high if math.isfinite(high) else middle + reach)
    if not low < high:
        raise _refusal()
    return low, high


def _refusal() -> ParameterError:
    return ParameterError("both surfaces are unbounded and what they share may be too: give one of them finite ranges")
