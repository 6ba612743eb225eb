"""Interpolation points of a curve from its arc length and curvature, as few as the tolerance allows.

Hamann, Jean and Razdan (1999), section 2, choose them dense where the curvature varies. The error of a C2 cubic on
steps h of the arc length is h^4 |x''''| / 384 inside (up to 16 times that at its ends, which are not-a-knot), and
x'''' is made of the curvature and its changes (Frenet: kappa^3, kappa kappa', kappa'', and the torsion). So the points
here divide the integral of |x''''|^(1/4) evenly, and their number is the smallest that keeps the deviation within the
tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from patchwright.models.arc_length import ArcLength
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.knots import between
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.reparam.block_cubic import FEWEST, BlockCubic

SAMPLES = 257  # of the density, in a block
STRIDE = 4  # samples in a step of the differences: shorter steps would measure round-off
FLOOR = 0.2  # of its mean: the least density
NOISE = 1e-8  # of the extent: fourth differences well below are the curve's tables', and the density stays even
SHARES = 8192  # sites are multiples of its inverse, so that round-off does not move them
MOST = 400  # points of a block
PER_SPAN = 10  # samples of the deviation

Along = Callable[[Array], Array]
"""From shares x (k,) in [0, 1] to points (k, d)."""


@dataclass(frozen=True, slots=True, eq=False)
class CurveApproximation:
    """A curve through points of another."""

    curve: NurbsCurve
    """C2 cubic over the arc share, domain [0, 1]."""
    shares: Array
    """(k,) arc shares of the interpolation points."""
    deviation: float
    """Largest distance found between the curves."""


def approximate_curve(curve: NurbsCurve, tolerance: float) -> CurveApproximation:
    """A C2 cubic within the tolerance of a smooth curve, over its arc share, through as few points as that takes.

    Raises
    ------
    ParameterError : a tolerance that is not positive, a curve without length, one with a corner or a cusp (400 points
    did not reach the tolerance).
    """
    if not (np.isfinite(tolerance) and tolerance > 0.0):
        raise ParameterError(f"the tolerance must be a positive length, got {tolerance}")
    arc = ArcLength.of(curve)
    if not arc.total > 0.0:
        raise ParameterError("the curve has no length: there is nothing to approximate")

    def along(x: Array) -> Array:
        return curve(arc.parameter(np.clip(x, 0.0, 1.0) * arc.total))

    ends = np.array([0.0, 1.0])
    sites = fewest_sites(along, tolerance, ends)
    cubic = BlockCubic(sites, ends)
    values = along(sites)
    deviation = curve_deviation(cubic, values, along)
    if deviation > tolerance:
        raise ParameterError(
            f"{len(sites)} points leave a deviation of {deviation:.3g}: the curve has a corner or cusp, split it there"
        )
    return CurveApproximation(NurbsCurve(3, cubic.knots, cubic.controls(values)), sites, deviation)


def fewest_sites(along: Along, tolerance: float, breaks: Array) -> Array:
    """Shares at which a blockwise C2 cubic through the points of `along` keeps within the tolerance.

    The number doubles until it does, then is halved in between; at most 400 in a block, whether that suffices or not.
    """
    blocks: list[Array] = []
    for a, b in pairwise(breaks.tolist()):
        ends = np.array([0.0, 1.0])

        def piece(x: Array, a: float = a, b: float = b) -> Array:
            return along(a + (b - a) * x)

        density = _density(piece)

        def good(count: int, piece: Along = piece, density: Array = density, ends: Array = ends) -> bool:
            sites = _spread(density, count)
            return curve_deviation(BlockCubic(sites, ends), piece(sites), piece) <= tolerance

        low, high = FEWEST - 1, FEWEST
        while high < MOST and not good(high):
            low, high = high, min(2 * high, MOST)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if good(middle) else (middle, high)
        sites = a + (b - a) * _spread(density, high)
        sites[0], sites[-1] = a, b
        blocks.append(sites if not blocks else sites[1:])
    return np.concatenate(blocks)


def curve_deviation(cubic: BlockCubic, values: Array, along: Along) -> float:
    """Largest distance of the points of `along` from the spline through `values`, found near the same share."""
    from patchwright.models.closest_point import closest_on_curve

    curve = NurbsCurve(3, cubic.knots, cubic.controls(values))
    x = between(cubic.sites, PER_SPAN)
    return float(closest_on_curve(curve, along(x), start=x).distance.max())


def _density(along: Along) -> Array:
    """(SAMPLES,) |x''''|^(1/4) over the share, from fourth differences, with a floor."""
    points = along(np.linspace(0.0, 1.0, SAMPLES))
    inner = SAMPLES - 4 * STRIDE
    differences = np.zeros((inner, points.shape[1]))
    for k, weight in enumerate((1.0, -4.0, 6.0, -4.0, 1.0)):
        differences += weight * points[k * STRIDE : k * STRIDE + inner]
    fourth = np.pad(np.linalg.norm(differences, axis=1), 2 * STRIDE, mode="edge")
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    least = np.hypot((FLOOR * (fourth**0.25).mean()) ** 4, NOISE * extent)
    return np.asarray(np.hypot(fourth, least) ** 0.25 if least > 0.0 else np.ones(SAMPLES))


def _spread(density: Array, count: int) -> Array:
    """(count,) shares, fewer where they fall together, between which the integral of the density is the same."""
    integral = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))))
    x = np.interp(np.linspace(0.0, integral[-1], count), integral, np.linspace(0.0, 1.0, len(density)))
    return np.unique(np.round(x * SHARES) / SHARES)
