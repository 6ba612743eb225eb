"""One new parameter direction, common to all surfaces whose sides hang together along it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from patchwright.models.arrays import Array
from patchwright.reparam.block_cubic import FEWEST, BlockCubic
from patchwright.reparam.defect import STEPS

SHIFT = 0.05  # of the shorter neighbouring block: a crease moves by no more to fall on one of the equal steps
CLOSE = 1e-3  # breaks closer than this are one


@dataclass(frozen=True, slots=True, eq=False)
class Direction:
    """Breaks, nodes and sites of a parameter on [0, 1].

    `breaks` (b + 1,) are the creases and both ends, `nodes` where the inner points are placed, `sites` where the new
    surface interpolates.
    """

    breaks: Array
    nodes: Array
    sites: Array

    @classmethod
    def of(cls, creases: Array) -> Direction:
        """The direction of creases at mean arc shares inside (0, 1); its sites are still the fewest."""
        inner: list[float] = []
        for x in np.sort(creases).tolist():
            if min(x, 1.0 - x) > CLOSE and (not inner or x - inner[-1] > CLOSE):
                inner.append(x)
        breaks = np.array([0.0, *inner, 1.0])
        nearest = np.round(breaks * STEPS) / STEPS
        room = np.minimum(np.diff(breaks)[:-1], np.diff(breaks)[1:])
        near = np.abs(nearest - breaks)[1:-1] <= SHIFT * room
        breaks[1:-1] = np.where(near, nearest[1:-1], breaks[1:-1])
        pieces = [np.linspace(a, b, max(FEWEST - 1, round(STEPS * (b - a))) + 1) for a, b in pairwise(breaks)]
        nodes = np.concatenate([pieces[0], *(p[1:] for p in pieces[1:])])
        sites = np.concatenate([np.linspace(a, b, FEWEST)[:-1] for a, b in pairwise(breaks)] + [[1.0]])
        return cls(breaks, nodes, sites)

    def flipped(self) -> Direction:
        """Run through backwards."""
        return Direction(1.0 - self.breaks[::-1], 1.0 - self.nodes[::-1], 1.0 - self.sites[::-1])

    def with_sites(self, sites: Array) -> Direction:
        """With other sites, the breaks among them."""
        return replace(self, sites=sites)

    @property
    def cubic(self) -> BlockCubic:
        """Interpolation at the sites."""
        return BlockCubic(self.sites, self.breaks)
