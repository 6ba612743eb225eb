"""`Decisions`: what a repair must leave alone, because the domain says so or a reviewed plan rejects it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from patchwright.models.arrays import Array
from patchwright.repair.fingerprint import Fingerprint, fingerprint, matched
from patchwright.repair.surroundings import Surroundings

CAPPED = "opening capped by a plane"
FILLED = "opening filled by a new surface"
TRIMMED = "face trimmed again by its neighbours' edges"
CROSSED = "trims moved to where the surfaces cross"
CARRIED_ON = "trims moved to edges that lie on the face"
STRIPS = "boundary strips moved onto one curve"
SIDE = "boundary strip moved onto the faces along it"
CARRIED = "surface carried on to its neighbours"
SEAM_CLOSING = (TRIMMED, CROSSED, CARRIED_ON, STRIPS, SIDE)
OPTIONAL = ("bridge", "close", "stray triangles", CAPPED, FILLED, *SEAM_CLOSING)
"""kinds of change that can be rejected: nothing later stands on them, so what they would mend just stays as it is"""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """One change about to be made: its kind, the points (n, 3) it concerns, and the parts they are of."""

    kind: str
    points: Array
    parts: tuple[str, ...] = ()

    @property
    def fingerprint(self) -> Fingerprint:
        """As the plan and the ledger know it."""
        size = float(np.linalg.norm(np.ptp(self.points, axis=0)))
        return fingerprint(self.kind, self.points.mean(axis=0), size, self.parts)


@dataclass(frozen=True, slots=True, eq=False)
class Decisions:
    """What stays as it is.

    Parameters
    ----------
    surroundings : symmetry planes, planned openings and parts whose gaps are kept
    rejected : fingerprints of the planned changes that were rejected
    diagonal : of the body, model length unit
    near : distance up to which a point is on a symmetry plane, model length unit
    """

    surroundings: Surroundings
    diagonal: float
    near: float
    rejected: tuple[Fingerprint, ...] = field(default_factory=tuple)

    def against(self, candidates: Sequence[Candidate]) -> list[str]:
        """Why each change is not to be made; "" for those that are free."""
        reasons = []
        pairs = matched(self.rejected, [c.fingerprint for c in candidates], self.diagonal)
        for i, candidate in enumerate(candidates):
            why = self.surroundings.planned(candidate.points, self.near)
            if not why and candidate.kind == "bridge":
                why = self.surroundings.keeps_gaps(candidate.parts)
            reasons.append(why or ("the plan rejects it" if i in pairs else ""))
        return reasons
