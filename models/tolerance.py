"""`Tolerance`: every length a decision is measured against, born from the model's own size and precision."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from patchwright.models.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from patchwright.models.arrays import Array, IntArray
    from patchwright.models.assembly import Assembly
    from patchwright.models.triangulation import Triangulation

ROUND_OFF_SHARE = 1e-6  # of the diagonal: cracks below it are round-off
FIT_SHARE = 1e-4  # of the diagonal: the promise of the fitted surfaces unless told otherwise
SMOOTH_ANGLE = 30.0  # degrees: edges that turn more are sharp


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Lengths in the model's unit, the angle in degrees.

    `gap` is the round-off below which two points are the same; `fit` is how far a fitted surface may stray; `angle`
    separates smooth from sharp edges. `given` says that somebody asked for this fit tolerance, so that it is not to be
    widened to what the data can carry. `parts` are names of parts that have a fit tolerance of their own, and those.
    """

    gap: float
    fit: float
    angle: float = SMOOTH_ANGLE
    given: bool = False
    parts: tuple[tuple[str, float], ...] = ()

    @property
    def tightest(self) -> float:
        """The least fit tolerance of all: what no part may be moved by without looking."""
        return min([self.fit, *(length for _, length in self.parts)])

    @property
    def careful(self) -> Tolerance:
        """The same with the least fit tolerance for everything: for what does not tell parts apart."""
        return replace(self, fit=self.tightest)

    def of_tags(self, names: Sequence[str], tags: IntArray) -> Array:
        """(n,) the fit tolerances of the parts that `tags` (n,) number, by their `names`."""
        own = dict(self.parts)
        if not own:
            return np.full(len(tags), self.fit)
        return np.array([own.get(name, self.fit) for name in names or ("",)])[tags]

    @classmethod
    def of(cls, thing: Assembly | Triangulation, *, fit: float | None = None, angle: float = SMOOTH_ANGLE) -> Tolerance:
        """The tolerances of a model: `gap` from its size and distance to the origin, `fit` 1e-4 of its diagonal.

        Raises
        ------
        ParameterError : a fit tolerance that is not positive and finite.
        """
        diagonal = thing.diagonal
        reach = float(np.abs(thing.bounds).max())
        single_precision = 4.0 * float(np.finfo(np.float32).eps) * reach
        if fit is not None and not (np.isfinite(fit) and fit > 0.0):
            raise ParameterError(f"the fit tolerance must be a positive length, got {fit}")
        return cls(
            max(ROUND_OFF_SHARE * diagonal, single_precision),
            FIT_SHARE * diagonal if fit is None else fit,
            angle,
            fit is not None,
        )
