"""Right-handed orthonormal frames, the checks of analytic surfaces' arguments, and derivatives of circles."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, frozen
from patchwright.models.errors import ParameterError
from patchwright.models.knots import ROUND_OFF, inside

Range = tuple[float, float]
TURN = 2.0 * math.pi


def point(values: npt.ArrayLike, name: str) -> Array:
    """A read-only, finite point of R^3."""
    p = frozen(values, np.float64)
    if p.shape != (3,) or not np.isfinite(p).all():
        raise ParameterError(f"{name} must be three finite numbers, got {values!r}")
    return p


def unit(values: npt.ArrayLike, name: str) -> Array:
    """A read-only unit vector along `values`."""
    d = point(values, name)
    size = float(np.abs(d).max())
    if size == 0.0:
        raise ParameterError(f"{name} must not be the zero vector")
    d = d / size
    length = math.sqrt(float(d @ d))
    return frozen(d if length == 1.0 else d / length, np.float64)


def across(axis: Array, xdir: npt.ArrayLike | None) -> Array:
    """The unit vector across `axis` nearest to `xdir`; without one, nearest to the coordinate axis most across it.

    Raises
    ------
    ParameterError : xdir runs along the axis.
    """
    x = np.eye(3)[int(np.argmin(np.abs(axis)))] if xdir is None else unit(xdir, "xdir")
    off = x - (x @ axis) * axis
    if math.sqrt(float(off @ off)) < math.sqrt(ROUND_OFF):
        raise ParameterError(f"xdir {x.tolist()} runs along the axis {axis.tolist()}")
    off = unit(off, "xdir")
    return unit(off - (off @ axis) * axis, "xdir")


def positive(value: float, name: str) -> float:
    """A positive, finite number."""
    number = float(value)
    if not (math.isfinite(number) and number > 0.0):
        raise ParameterError(f"{name} must be positive and finite, got {value}")
    return number


def interval(values: Range | None, natural: Range, name: str, longest: float = math.inf) -> Range:
    """The range (lo, hi), or the natural one for None; `longest` bounds its length."""
    if values is None:
        return natural
    low, high = (float(x) for x in values)
    if not low < high:
        raise ParameterError(f"the range of {name} must not be empty, got ({low}, {high})")
    if high - low > longest * (1.0 + ROUND_OFF) + ROUND_OFF * max(abs(low), abs(high)):
        raise ParameterError(f"the range of {name} is {high - low:.17g} long, more than {longest:.17g}")
    return low, high


def bounded(domain: tuple[Range, Range], what: str) -> None:
    """Refuse a domain that is infinite.

    Raises
    ------
    ParameterError : with the name of the surface.
    """
    if not np.isfinite(domain).all():
        raise ParameterError(f"an unbounded {what} has no NURBS form: give the ranges u and v")


def parameters(
    domain: tuple[Range, Range], u: npt.ArrayLike, v: npt.ArrayLike, nu: tuple[int, int]
) -> tuple[Array, Array]:
    """Broadcast parameters inside the domain; refuses negative orders."""
    if len(nu) != 2 or min(nu) < 0:
        raise ParameterError(f"the order of a derivative must be two integers of at least 0, got {nu}")
    us, vs = np.broadcast_arrays(inside(domain[0], u, "u"), inside(domain[1], v, "v"))
    return us, vs


def cosine(t: Array, order: int) -> Array:
    """(..., 1) the derivative of the given order of cos t."""
    return np.asarray((np.cos(t), -np.sin(t), -np.cos(t), np.sin(t))[order % 4][..., None])


def sine(t: Array, order: int) -> Array:
    """(..., 1) the derivative of the given order of sin t."""
    return np.asarray((np.sin(t), np.cos(t), -np.sin(t), -np.cos(t))[order % 4][..., None])


def line(t: Array, order: int) -> Array:
    """(..., 1) the derivative of the given order of t itself."""
    return np.asarray(t[..., None]) if order == 0 else np.full((*t.shape, 1), 1.0 if order == 1 else 0.0)
