"""The demonstration case: a transport aircraft with everything a bad export does to it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from patchwright.models.assembly import Assembly
from patchwright.models.samples.aircraft import aircraft
from patchwright.models.samples.cutting import slit
from patchwright.models.samples.defects import Damaged, Injected, damage
from patchwright.models.samples.sample import Sample
from patchwright.models.samples.soup import missing_triangles, unmerged
from patchwright.models.samples.truth import Truth

STATION, WIDTH = 0.22, 0.0075
"""Where the slit runs round the fuselage and its width, in fuselage lengths: on the cylinder, ahead of the wing."""


@dataclass(frozen=True, slots=True, eq=False)
class DirtySample:
    """A clean sample and what became of it."""

    sample: Sample
    damaged: Damaged
    assembly: Assembly
    """one part per body, dirty; `sample.assembly` is the clean one"""

    @property
    def name(self) -> str:
        """The sample's name."""
        return self.sample.name

    @property
    def truth(self) -> Truth:
        """The clean outer surface."""
        return self.sample.truth

    @property
    def defects(self) -> tuple[Injected, ...]:
        """What was injected."""
        return self.damaged.defects


def demo_aircraft(seed: int = 1, triangles: int = 50_000) -> DirtySample:
    """Four overlapping bodies (fuselage, wing, tail, fin), about `triangles` triangles, 10 m long.

    A slit all round the fuselage of 0.75 % of its length, 1 % of the triangles missing at random, every triangle with
    corners of its own, each moved within a ball of 1e-4 of the length. Labels give the places before the jitter.
    """
    sample = aircraft(triangles=triangles)
    length = float(np.ptp(sample.assembly.parts[0].triangulation.bounds[:, 0]))
    steps = (
        partial(
            slit, point=(STATION * length, 0.0, 0.0), normal=(1.0, 0.0, 0.0), width=WIDTH * length, only=("fuselage",)
        ),
        partial(missing_triangles, share=0.01),
        partial(unmerged, radius=1e-4 * length),
    )
    damaged = damage(sample.assembly.triangulation, steps, seed=seed)
    parts = damaged.assembly.parts
    return DirtySample(sample, damaged, Assembly(parts, unit=sample.assembly.unit, source="demo aircraft"))
