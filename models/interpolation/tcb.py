"""Kochanek-Bartels (TCB) splines after Eberly, Kochanek-Bartels Cubic Splines, Geometric Tools 2023; equation numbers
are his.

C1 where the continuity parameter is 0, and for general data only there. His ends (20)-(21) halve the end chord's
velocity, so that not even straight lines are reproduced at constant speed: pass tangents where that matters.
Departure: (18) is 0/0 where both tangents vanish; the adjusted tangents are then zero, as their limits are.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.interpolation.claims import Interpolated, scheme
from patchwright.models.interpolation.hermite import cubic_from_tangents
from patchwright.models.interpolation.splines import tangent

Values = float | npt.ArrayLike


def tcb_tangents(
    P: Array, s: Array, tension: Values = 0.0, continuity: Values = 0.0, bias: Values = 0.0,
    start_tangent: npt.ArrayLike | None = None, end_tangent: npt.ArrayLike | None = None,
) -> tuple[Array, Array]:  # fmt: skip
    """Incoming and outgoing tangents, each (n + 1, d); the two at an end are equal.

    Parameters
    ----------
    tension, continuity, bias : numbers in [-1, 1], one for all points or one for each

    Raises
    ------
    ParameterError : a number outside [-1, 1], a wrong count, a tangent of the wrong shape.
    """
    tau = _per_point(tension, len(P), "tension")
    gamma = _per_point(continuity, len(P), "continuity")
    beta = _per_point(bias, len(P), "bias")
    velocity = np.diff(P, axis=0) / np.diff(s)[:, None]
    before, after = velocity[:-1], velocity[1:]
    t, g, b = tau[1:-1, None], gamma[1:-1, None], beta[1:-1, None]
    incoming, outgoing = np.empty_like(P), np.empty_like(P)
    incoming[1:-1] = (1 - t) * (1 + g) * (1 - b) / 2 * after + (1 - t) * (1 - g) * (1 + b) / 2 * before  # 17
    outgoing[1:-1] = (1 - t) * (1 - g) * (1 - b) / 2 * after + (1 - t) * (1 + g) * (1 + b) / 2 * before  # 17
    first = (1 - tau[0]) * (1 - gamma[0]) * (1 - beta[0]) / 2 * velocity[0]  # 20
    last = (1 - tau[-1]) * (1 - gamma[-1]) * (1 + beta[-1]) / 2 * velocity[-1]  # 21
    incoming[0] = outgoing[0] = tangent(start_tangent, first, "start_tangent")
    incoming[-1] = outgoing[-1] = tangent(end_tangent, last, "end_tangent")
    return incoming, outgoing


def equal_speeds(incoming: Array, outgoing: Array, speed: Values = 1.0) -> tuple[Array, Array]:
    """Tangents of the same directions and, at each point, of equal length, times the positive speed factors.

    Raises
    ------
    ParameterError : a factor that is not positive, or a wrong count.
    """
    factor = _per_point(speed, len(incoming), "speed", (0.0, np.inf))[:, None]
    i, o = (np.linalg.norm(x, axis=1, keepdims=True) for x in (incoming, outgoing))
    total = i + o
    both = (i > 0.0) & (o > 0.0)
    common = np.divide(2.0 * factor * i * o, total, out=np.zeros_like(total), where=both)
    adjusted = tuple(
        common * np.divide(x, size, out=np.zeros_like(x), where=both) for x, size in ((incoming, i), (outgoing, o))
    )  # 18, 19; and 22 at the ends, where both are equal
    return adjusted[0], adjusted[1]


@scheme("tcb", exact_degree=0, continuity=1, reach=2, source="Kochanek, Bartels 1984; Eberly 2023")
def tcb(
    P: Array, s: Array, *, tension: Values = 0.0, continuity: Values = 0.0, bias: Values = 0.0,
    start_tangent: npt.ArrayLike | None = None, end_tangent: npt.ArrayLike | None = None,
) -> Interpolated:  # fmt: skip
    """Tension, continuity and bias in [-1, 1], for all points or each; C1 where the continuity is 0."""
    incoming, outgoing = tcb_tangents(P, s, tension, continuity, bias, start_tangent, end_tangent)
    return Interpolated(cubic_from_tangents(s, P, incoming, outgoing), s)


@scheme("tcb-equal-speed", exact_degree=0, continuity=1, reach=2, linear=False, source="Eberly 2023, (18), (19), (22)")
def tcb_equal_speed(
    P: Array, s: Array, *, tension: Values = 0.0, continuity: Values = 0.0, bias: Values = 0.0, speed: Values = 1.0,
    start_tangent: npt.ArrayLike | None = None, end_tangent: npt.ArrayLike | None = None,
) -> Interpolated:  # fmt: skip
    """As `tcb`, with equal speeds before and after each point, times a positive factor for all points or each."""
    tangents = tcb_tangents(P, s, tension, continuity, bias, start_tangent, end_tangent)
    incoming, outgoing = equal_speeds(*tangents, speed)
    smooth = (tangents[0] == tangents[1]).all(axis=1)  # C1 stays C1, free of the round-off of the two norms
    incoming[smooth] = outgoing[smooth]
    return Interpolated(cubic_from_tangents(s, P, incoming, outgoing), s)


def _per_point(values: Values, count: int, name: str, bounds: tuple[float, float] = (-1.0, 1.0)) -> Array:
    given = np.asarray(values, dtype=np.float64)
    if given.shape not in ((), (count,)):
        raise ParameterError(f"{name} must be one number or one for each of the {count} points, got {given.shape}")
    low, high = bounds
    good = (given >= low) & (given <= high) if np.isfinite(high) else (given > low) & np.isfinite(given)
    if not good.all():
        at = int(np.argmin(good.ravel()))
        wanted = f"lie in [{low:g}, {high:g}]" if np.isfinite(high) else "be positive and finite"
        raise ParameterError(f"{name} must {wanted}, got {given.ravel()[at]:g} at point {at}")
    return np.broadcast_to(given, (count,))
