"""Borders: a side with the new parameter it is run through by, common to the surfaces on both sides of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array
from patchwright.reparam.block_cubic import BlockCubic
from patchwright.reparam.sides import ArcSide, chord_places


@dataclass(frozen=True, slots=True, eq=False)
class Pace:
    """Arc share as a function of the new parameter along one curve."""

    along: BlockCubic
    shares: Array
    """(k,) at the sites of `along`."""

    @classmethod
    def of(cls, side: ArcSide, nodes: Array, breaks: Array, fixed: Array) -> Pace:
        """Equal chords between the nodes of every block; the inner breaks (b - 1,) lie at the arc shares `fixed`."""
        at = np.searchsorted(nodes, breaks)
        ends = np.concatenate(([0.0], fixed, [1.0]))
        shares = np.zeros(len(nodes))
        for k in range(len(breaks) - 1):
            a, b = int(at[k]), int(at[k + 1])
            shares[a : b + 1] = chord_places(side, np.diff(nodes[a : b + 1]), (ends[k], ends[k + 1]))
        return cls(BlockCubic(nodes, breaks), shares)

    def __call__(self, s: Array) -> Array:
        """(k,) arc shares."""
        out = np.clip(self.along(self.shares, s), 0.0, 1.0)
        out[s == 0.0], out[s == 1.0] = 0.0, 1.0
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Border:
    """One side of a region with its pace.

    `leader` is the curve the points come from: the side itself, or the same side of a neighbour; `against` says that
    the leader and its pace run the other way.
    """

    side: ArcSide
    leader: ArcSide
    pace: Pace
    against: bool = False

    def _shares(self, s: Array) -> Array:
        return self.pace(1.0 - s if self.against else s)

    def uv(self, s: Array) -> Array:
        """(k, 2) parameters of the region's own surface."""
        x = self._shares(s)
        return self.side.uv(1.0 - x if self.against else x)

    def points(self, s: Array) -> Array:
        """(k, 3) points, the same for both neighbours."""
        return self.leader.points(self._shares(s))
