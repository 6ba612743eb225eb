"""What the CAD route has come to so far: the assembly, what was sewn, mended, filled and left, and the words for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly
from patchwright.models.cad.sewing import SewnResult
from patchwright.repair.cad.draft import Attempt, Change
from patchwright.repair.cad.heal import Healed
from patchwright.repair.decisions import Candidate
from patchwright.repair.diagnosis import Defect
from patchwright.repair.fingerprint import Fingerprint
from patchwright.repair.result import Point

OPEN = ("gap", "open-edge", "seam-gap")  # kinds of defect that stay where a change is left out


@dataclass(frozen=True, slots=True, eq=False)
class Filled:
    """A further part that closes an opening or bridges a gap: which, the faces along it, what it is and how made."""

    part: int
    around: tuple[int, ...]
    what: str
    how: str


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """The assembly after keeping, sewing, healing and filling, with the words for the ledger.

    `filled` are its invented parts; `left` the openings and gaps decided to stay; `failed` what was tried in vain after
    healing; `undone` what the time did not suffice for; `rejected` the seams that a plan leaves as they are.
    """

    assembly: Assembly
    sewn: SewnResult | None
    reason: str
    healed: Healed | None = None
    filled: tuple[Filled, ...] = ()
    left: tuple[tuple[Candidate, str], ...] = ()
    failed: tuple[Attempt, ...] = ()
    undone: tuple[str, ...] = ()
    rejected: tuple[Fingerprint, ...] = ()

    def decided(self, defect: Defect) -> bool:
        """Whether a defect was decided to stay: a gap along the parts, and at the place, of what was left out."""
        if defect.kind not in OPEN:
            return False
        spared = (*self.rejected, *(candidate.fingerprint for candidate, _ in self.left))
        low, high = defect.box
        return any(
            set(one.parts) & set(defect.parts)
            and (np.maximum(low - one.where, one.where - high) <= 0.5 * one.size).all()
            for one in spared
        )

    @property
    def changes(self) -> tuple[Change, ...]:
        """What healing changed."""
        return self.healed.changes if self.healed is not None else ()

    @property
    def in_vain(self) -> tuple[Attempt, ...]:
        """All that was tried in vain."""
        return (*(self.healed.failed if self.healed is not None else ()), *self.failed)


def point(where: Array | Point) -> Point:
    """Three numbers."""
    x, y, z = np.asarray(where, dtype=np.float64).tolist()
    return x, y, z
