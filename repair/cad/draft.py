"""What the rungs for CAD faces hand to each other: parts, the topology between them, and what was changed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly, Part
from patchwright.models.cad.capping import FreeLoop, free_loops
from patchwright.models.cad.seams import edge_uses
from patchwright.models.surface import Surface
from patchwright.models.topology import Topology
from patchwright.repair.cad.deadline import Deadline
from patchwright.repair.cad.vetoes import Vetoes
from patchwright.repair.result import Rung

T = TypeVar("T")

REACH_SHARE = 0.05  # of the diagonal: rims farther apart than this are no seam that came open
RIM_SHARE = 0.5  # of a rim's own diagonal: a gap as wide as this is an opening
ON_SHARE = 5e-7  # of the diagonal: an edge this near a surface lies on it; half of the widest seam that is closed
LOOSE_SHARE = 1e-4  # of the diagonal: a shared edge whose surfaces are farther apart is taken apart
FEWEST = 20.0  # seconds that a call of the kernel is given when it is begun at all
SECONDS = 150.0  # after which the rungs begin nothing new
FIT_SHARE = 1e-10  # of the diagonal: how near new edges and pcurves follow what they stand for


@dataclass(frozen=True, slots=True)
class Limits:
    """The lengths the rungs decide by, in the model's unit, when they are to end, and what they must leave."""

    diagonal: float
    on: float
    fit: float
    reach: float
    loose: float
    deadline: Deadline
    vetoes: Vetoes
    memory: dict[tuple[object, ...], tuple[tuple[object, ...], Any]] = field(
        default_factory=dict, compare=False, repr=False
    )

    @classmethod
    def of(cls, diagonal: float, seconds: float = SECONDS, vetoes: Vetoes | None = None) -> Limits:
        """The shares above of a diagonal; nothing new is begun after `seconds` of processor time."""
        on, fit, reach, loose = (share * diagonal for share in (ON_SHARE, FIT_SHARE, REACH_SHARE, LOOSE_SHARE))
        return cls(diagonal, on, fit, reach, loose, Deadline.after(seconds), vetoes or Vetoes())

    def remembered(
        self, what: str, objects: tuple[object, ...], numbers: tuple[object, ...], found: Callable[[], T]
    ) -> T:
        """What was found of the same objects and numbers before: rungs ask the same again at every reach."""
        key = (what, *map(id, objects), *numbers)
        if key not in self.memory:
            self.memory[key] = objects, found()  # the objects are held, so that no other gets their id
        made: T = self.memory[key][1]
        return made

    @property
    def expired(self) -> bool:
        """Whether the time is up."""
        return self.deadline.passed

    def left(self, at_most: float) -> float:
        """Seconds left for one call of the kernel, no more than a limit of its own, no fewer than it needs at all."""
        return self.deadline.left(at_most, FEWEST)


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """One thing a rung did: to which parts, by how much at most, where, how large the place is, and why it may."""

    what: str
    rung: Rung
    faces: tuple[int, ...]
    reason: str
    tolerance: float
    largest_move: float
    where: Array
    size: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """What was tried on which parts, why it came to nothing, and where."""

    what: str
    faces: tuple[int, ...]
    reason: str
    where: Array


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """An assembly with a topology that is being mended; its parts stay in order."""

    assembly: Assembly
    topology: Topology

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parts, in the order of `topology.loops`."""
        return self.assembly.parts

    def surface(self, face: int) -> Surface:
        """A part's surface."""
        surface = self.parts[face].surface
        assert surface is not None
        return surface

    def middle(self, face: int) -> Array:
        """(3,) a point in the middle of a face's edges, or of its triangles where it has none."""
        curves = [self.topology.curves[use.edge] for loop in self.topology.loops[face] for use in loop]
        if not curves:
            return np.asarray(self.parts[face].triangulation.bounds.mean(axis=0))
        return np.asarray(np.mean([curve(np.linspace(*curve.domain, 5)) for curve in curves], axis=(0, 1)))

    def rims(self) -> tuple[FreeLoop, ...]:
        """Rings and chains of free edges."""
        return free_loops(replace(self.assembly, topology=self.topology, native=None))

    def vetoed(self, change: Change, limits: Limits) -> bool:
        """Whether the plan rejects a change."""
        names = [self.parts[face].name for face in change.faces]
        return limits.vetoes.stop(change.where, change.size, names)

    def owners(self) -> dict[int, int]:
        """The face of every edge that is used once."""
        counts = self.topology.use_counts()
        return {int(e): int(f) for e, f, _, _ in edge_uses(self.topology) if counts[e] == 1}

    def with_surfaces(self, changed: dict[int, Surface], topology: Topology, *, same: bool) -> Draft:
        """Other surfaces for some parts; `same` says that they differ in their ranges only, so native faces stay."""
        parts = list(self.parts)
        for face, surface in changed.items():
            parts[face] = replace(parts[face], surface=surface, native=parts[face].native if same else None)
        return replace(self, assembly=replace(self.assembly, parts=tuple(parts)), topology=topology)


def apart(points: Array, others: Array) -> Array:
    """(k,) distance of each point from the nearest of `others`."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(others).query(points)[0])
