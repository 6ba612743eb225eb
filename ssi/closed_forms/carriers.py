"""What a closed form consists of before it is clipped: whole conics and points of the unbounded surfaces."""

from __future__ import annotations

from dataclasses import dataclass, field

from patchwright.models.arrays import Array
from patchwright.ssi.closed_forms.conic import Conic
from patchwright.ssi.intersection import CurveKind


@dataclass(frozen=True, slots=True, eq=False)
class Carrier:
    """A whole conic that lies on both unbounded surfaces."""

    conic: Conic
    kind: CurveKind = "transversal"


@dataclass(frozen=True, slots=True, eq=False)
class Carriers:
    """All that two unbounded surfaces share: conics, isolated contacts with their gaps, points where branches meet."""

    curves: tuple[Carrier, ...] = ()
    touches: tuple[tuple[Array, float], ...] = ()
    branches: tuple[Array, ...] = field(default=())


@dataclass(frozen=True, slots=True)
class Coincident:
    """The unbounded surfaces are one within the tolerance."""


NOTHING = Carriers()


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """Where and how finely a pair is judged.

    Parameters
    ----------
    pivot : (3,) the middle of the part of space both bounded surfaces can reach
    extent : the diagonal of that part, or of the smaller surface's box if that is longer: an angle t moves a surface
        there by at most t * extent
    tolerance : length; surfaces this near touch, this deep inside each other cross
    """

    pivot: Array
    extent: float
    tolerance: float
