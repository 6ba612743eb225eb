"""`Domain`: what the user says about the flow domain, the value that commands and recipes build."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from patchwright.models.errors import ParameterError

AXES = ("x", "y", "z")
POLICIES = ("close", "keep")


@dataclass(frozen=True, slots=True)
class Domain:
    """The flow domain round a model; what is None is guessed, with reasons, where `repair` and `diagnose` need it.

    Parameters
    ----------
    far_field : names of the parts that bound the domain from outside; () says that there are none
    symmetry : "x", "y" or "z" for the plane where that coordinate is 0, or the name of a planar part; () for none
    fluid : (x, y, z) a point in the fluid, model length unit: bodies round it bound the fluid from outside
    openings : (x, y, z) places of planned openings: the one whose rim is round or next to a place stays open
    gaps : part name -> "keep" or "close": whether gaps along that part are mended ("close" unless said otherwise)
    tolerances : part name -> fit tolerance of that part, model length unit

    Raises
    ------
    ParameterError : a policy, tolerance or place without meaning.
    """

    far_field: tuple[str, ...] | None = None
    symmetry: tuple[str, ...] | None = None
    fluid: tuple[float, float, float] | None = None
    openings: tuple[tuple[float, float, float], ...] = ()
    gaps: Mapping[str, str] = field(default_factory=dict)
    tolerances: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for part, policy in self.gaps.items():
            if policy not in POLICIES:
                raise ParameterError(f"the gap policy of {part!r} must be one of {', '.join(POLICIES)}, got {policy!r}")
        for part, length in self.tolerances.items():
            if isinstance(length, bool) or not isinstance(length, int | float) or not 0.0 < length < np.inf:
                raise ParameterError(f"the tolerance of {part!r} must be a positive length, got {length!r}")
        if self.fluid is not None:
            object.__setattr__(self, "fluid", place_of(self.fluid, "the fluid point"))
        object.__setattr__(self, "openings", tuple(place_of(p, "a planned opening") for p in self.openings))

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> Domain:
        """From a recipe's [domain] table; a single name may stand for a list of one.

        Raises
        ------
        ParameterError : a key or value without meaning.
        """
        known = [f.name for f in fields(cls)]
        unknown = sorted(set(table) - set(known))
        if unknown:
            raise ParameterError(f"a domain has no {', '.join(unknown)}; it has: {', '.join(known)}")
        given = dict(table)
        for key in ("far_field", "symmetry"):
            if key in given:
                names = [given[key]] if isinstance(given[key], str) else given[key]
                if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
                    raise ParameterError(f"{key} of a domain must be a name or a list of names, got {given[key]!r}")
                given[key] = tuple(names)
        for key in ("gaps", "tolerances"):
            if not isinstance(given.get(key, {}), Mapping):
                raise ParameterError(f"{key} of a domain must be a table with one line per part, got {given[key]!r}")
        if not isinstance(given.get("openings", []), list | tuple):
            raise ParameterError(f"openings of a domain must be a list of places, got {given['openings']!r}")
        return cls(**given)


def place_of(value: Any, what: str) -> tuple[float, float, float]:
    """Three finite coordinates, from a sequence or from "X,Y,Z".

    Raises
    ------
    ParameterError : anything else.
    """
    words: Sequence[Any] = value.split(",") if isinstance(value, str) else value
    try:
        x, y, z = (float(word) for word in words)
    except (TypeError, ValueError):
        raise ParameterError(f"{what} must be three coordinates X,Y,Z, got {value!r}") from None
    if not np.isfinite((x, y, z)).all():
        raise ParameterError(f"{what} must have finite coordinates, got {value!r}")
    return x, y, z
