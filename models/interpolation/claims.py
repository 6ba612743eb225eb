"""What an interpolation scheme claims, and the registry of all schemes.

A claim is data, so that the same table drives the tests, the documentation and the choices of a user: the tests show
that each claim holds and that the next stronger one fails.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from inspect import Parameter, signature
from typing import Any, TypeAlias

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_curve import NurbsCurve


@dataclass(frozen=True, slots=True, eq=False)
class Interpolated:
    """A curve with the parameters at which it passes through the points, and what the user should know about it."""

    curve: NurbsCurve
    parameters: Array
    """(n + 1,) curve(parameters[i]) is the point i."""
    notes: tuple[str, ...] = ()
    """One sentence for each wish that could not be met; empty when all were."""


Build: TypeAlias = Callable[..., Interpolated]  # (points (n + 1, d), parameters (n + 1,), **options)


@dataclass(frozen=True, slots=True, eq=False)
class Scheme:
    """An interpolation scheme and its claims, for its default options and any increasing parameters."""

    name: str
    build: Build
    exact_degree: int | None
    """The highest degree of polynomials, in the curve's parameter, that are reproduced; None: not even constants."""
    continuity: int
    """k of the C^k that holds for all data."""
    reach: int | None
    """Spans on either side of a point that feel it; None: all of them."""
    interpolates: bool = True
    monotone: bool = False
    """Whether every coordinate that is monotone in the points is monotone along the curve."""
    dimension: int | None = None
    """2: planar points of increasing x only; None: any."""
    linear: bool = True
    """Whether the curve is a linear function of the points: what a tensor product needs."""
    least: int = 2
    """The smallest number of points."""
    parameters: str = "centripetal"
    """The parametrisation used when none is asked for."""
    fixed: bool = False
    """Whether the parametrisation is part of the scheme, and no other is accepted."""
    source: str = ""

    @property
    def local(self) -> bool:
        """Whether a point moves only a part of the curve."""
        return self.reach is not None

    @property
    def options(self) -> tuple[str, ...]:
        """Names of the options the scheme takes."""
        found = signature(self.build).parameters.values()
        return tuple(p.name for p in found if p.kind is Parameter.KEYWORD_ONLY)

    def __call__(self, points: Array, parameters: Array, options: dict[str, Any]) -> Interpolated:
        """Build the curve.

        Raises
        ------
        ParameterError : an option the scheme does not have, too few points, points of the wrong dimension.
        """
        unknown = sorted(set(options) - set(self.options))
        if unknown:
            known = ", ".join(self.options) or "none"
            raise ParameterError(f"{self.name} has no option {unknown[0]!r}; its options: {known}")
        if len(points) < self.least:
            raise ParameterError(f"{self.name} needs at least {self.least} points, got {len(points)}")
        if self.dimension is not None and points.shape[1] != self.dimension:
            raise ParameterError(f"{self.name} takes points in {self.dimension}-D, got {points.shape[1]}-D")
        return self.build(points, parameters, **options)


SCHEMES: dict[str, Scheme] = {}
"""All schemes by name."""


def scheme(name: str, **claims: Any) -> Callable[[Build], Build]:
    """Register a build function under a name with its claims."""

    def register(build: Build) -> Build:
        SCHEMES[name] = Scheme(name, build, **claims)
        return build

    return register


def scheme_named(name: str) -> Scheme:
    """The scheme of the name.

    Raises
    ------
    ParameterError : there is none.
    """
    if name not in SCHEMES:
        raise ParameterError(f"there is no interpolation scheme {name!r}; there are: {', '.join(sorted(SCHEMES))}")
    return SCHEMES[name]
