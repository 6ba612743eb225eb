"""Parameters for data points: what share of the curve's parameter each step from point to point gets.

Sources: Lee, Choosing nodes in parametric curve interpolation, CAD 21 (1989) 363-370 (centripetal, exponent); Foley and
Nielson, Knot selection for parametric spline interpolation, in Mathematical Methods in CAGD (1989) 261-271, with the
affine-invariant metric of Nielson. The metric there is the inverse covariance; points that span less than their space
make it singular, and its pseudo-inverse is used.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError

Wanted: TypeAlias = str | float | npt.ArrayLike


def checked_points(points: npt.ArrayLike) -> Array:
    """(n + 1, d) float64 points, finite, no two neighbours at the same place.

    Raises
    ------
    ParameterError : otherwise; the sentence names the index.
    """
    P = numbers(points)
    if P.ndim != 2 or P.shape[0] < 2 or P.shape[1] < 1:
        raise ParameterError(f"points must be (n, d) with n of at least 2, got shape {P.shape}")
    if not np.isfinite(P).all():
        raise ParameterError(f"point {int(np.argmin(np.isfinite(P).all(axis=1)))} is not finite")
    same = (P[1:] == P[:-1]).all(axis=1)
    if same.any():
        at = int(np.argmax(same))
        raise ParameterError(f"points {at} and {at + 1} coincide; leave one of them out")
    return P


def numbers(points: npt.ArrayLike) -> Array:
    """A float64 copy.

    Raises
    ------
    ParameterError : rows of unequal length, or what is not a real number.
    """
    try:
        return np.array(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ParameterError("points must be real numbers in rows of equal length") from error


def parametrize(points: npt.ArrayLike, wanted: Wanted = "centripetal") -> Array:
    """(n + 1,) increasing parameters of points (n + 1, d).

    Parameters
    ----------
    wanted : "uniform", "chord", "centripetal" or "foley-nielson", from 0 to 1; a number: the exponent of the chord
        length (0 uniform, 1/2 centripetal, 1 chord); "abscissa": the first coordinate itself; or the parameters.

    Raises
    ------
    ParameterError : an unknown name, parameters that do not increase, an exponent that is not finite; points as in
        `checked_points`.
    """
    if not isinstance(wanted, str) and np.ndim(wanted) > 0:
        return _increasing(np.array(wanted, dtype=np.float64), len(numbers(points)), "given parameters")
    P = checked_points(points)
    if isinstance(wanted, str):
        if wanted == "abscissa":
            return _increasing(P[:, 0], len(P), "x")
        if wanted not in STEPS:
            names = ", ".join((*STEPS, "abscissa"))
            raise ParameterError(f"there are no parameters {wanted!r}; there are: {names}, an exponent, or given ones")
        return normalised(STEPS[wanted](P))
    exponent = float(wanted)  # type: ignore[arg-type]
    if not np.isfinite(exponent):
        raise ParameterError(f"the exponent of the chord length must be finite, got {exponent}")
    return normalised(chords(P) ** exponent)


def _increasing(t: Array, count: int, name: str) -> Array:
    if t.shape != (count,):
        raise ParameterError(f"{name}: {count} points need as many parameters, got shape {t.shape}")
    if not np.isfinite(t).all():
        raise ParameterError(f"{name}: number {int(np.argmin(np.isfinite(t)))} is not finite")
    if not (t[1:] > t[:-1]).all():
        at = int(np.argmin(t[1:] > t[:-1]))
        raise ParameterError(f"{name} must increase, but {t[at]:.17g} is followed by {t[at + 1]:.17g} at {at + 1}")
    return np.array(t)


def normalised(steps: Array) -> Array:
    """(n + 1,) sums of positive steps (n,), divided by the whole: exactly 0 and 1 at the ends.

    Raises
    ------
    ParameterError : a step lost in the round-off of the whole.
    """
    t = np.concatenate(([0.0], np.cumsum(steps)))
    t = t / t[-1] if 0.0 < t[-1] < np.inf else np.zeros_like(t)
    t[-1] = 1.0
    if not (t[1:] > t[:-1]).all():
        at = int(np.argmin(t[1:] > t[:-1]))
        raise ParameterError(f"points {at} and {at + 1} are too close for parameters of their own in double precision")
    return t


def chords(points: Array) -> Array:
    """(n,) distances from each point to the next."""
    steps = np.diff(points, axis=0)
    size = np.abs(steps).max()  # tiny and huge coordinates have squares beyond the range of doubles
    return np.asarray(size * np.linalg.norm(steps / size, axis=1))


def _foley_nielson(points: Array) -> Array:
    white = _whitened(points)
    D = np.linalg.norm(np.diff(white, axis=0), axis=1)
    if not (D > 0.0).all():
        at = int(np.argmin(D > 0.0))
        raise ParameterError(f"points {at} and {at + 1} coincide in the affine-invariant metric of the points")
    a, b = white[:-2] - white[1:-1], white[2:] - white[1:-1]
    cosine = np.einsum("ij,ij->i", a, b) / (D[:-1] * D[1:])
    turn = np.zeros(len(points))
    turn[1:-1] = np.minimum(np.pi - np.arccos(np.clip(cosine, -1.0, 1.0)), np.pi / 2.0)
    before, after = np.concatenate(([0.0], D[:-1])), np.concatenate((D[1:], [0.0]))
    return np.asarray(D * (1.0 + 1.5 * turn[:-1] * before / (before + D) + 1.5 * turn[1:] * after / (D + after)))


def _whitened(points: Array) -> Array:
    """The points in coordinates in which the inverse (pseudo-inverse) covariance metric is the Euclidean one."""
    centred = points - points.mean(axis=0)
    left, sizes, _ = np.linalg.svd(centred, full_matrices=False)
    lost = np.finfo(np.float64).eps * max(points.shape) * (sizes[0] + np.abs(points).max() * np.sqrt(len(points)))
    return np.asarray(left[:, sizes > lost])


STEPS: dict[str, Callable[[Array], Array]] = {
    "uniform": lambda points: np.ones(len(points) - 1),
    "chord": chords,
    "centripetal": lambda points: np.sqrt(chords(points)),
    "foley-nielson": _foley_nielson,
}
"""Parameter steps (n,) of points (n + 1, d), up to a common factor."""
