"""What a reviewed plan rejects of the changes that close seams between CAD faces: re-trims and boundary strips.

A gap may be closed by one rung or by another. So a rejection stops every such change of the same parts at the same
place, whatever its kind: what it would have closed stays as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from patchwright.models.arrays import Array
from patchwright.repair.decisions import SEAM_CLOSING, Decisions
from patchwright.repair.fingerprint import EXTENT, NEAR, Fingerprint


@dataclass(frozen=True, slots=True, eq=False)
class Vetoes:
    """Rejected changes of seams, the model's diagonal, and which of them have stopped something so far."""

    rejected: tuple[Fingerprint, ...] = ()
    diagonal: float = 0.0
    met: set[int] = field(default_factory=set)

    @classmethod
    def of(cls, decisions: Decisions | None) -> Vetoes:
        """Those of a plan's decisions."""
        if decisions is None:
            return cls()
        some = tuple(f for f in decisions.rejected if f.kind in SEAM_CLOSING)
        return cls(some, decisions.diagonal)

    def stop(self, where: Array, size: float, parts: Sequence[str]) -> bool:
        """Whether a change at a place is rejected; it is noted then."""
        stopped = False
        for k, one in enumerate(self.rejected):
            near = max(NEAR * self.diagonal, EXTENT * max(size, one.size))
            shared = not one.parts or bool(set(one.parts) & set(parts))
            if shared and float(np.linalg.norm(np.asarray(one.where) - where)) <= near:
                self.met.add(k)
                stopped = True
        return stopped

    @property
    def left(self) -> tuple[Fingerprint, ...]:
        """The rejected changes that a run came upon."""
        return tuple(self.rejected[k] for k in sorted(self.met))
