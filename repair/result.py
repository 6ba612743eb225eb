"""What a repair returns: verdict, faces with their origin, measured seams, deviation, ledger."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

from patchwright.models.assembly import Assembly
from patchwright.models.structured_grid import StructuredGrid
from patchwright.models.triangulation import Triangulation
from patchwright.repair.deviation import Deviation

if TYPE_CHECKING:
    from patchwright.repair.patches.network import PatchNetwork
    from patchwright.repair.regions import Region

Progress = Callable[[str, float], None]
Point = tuple[float, float, float]


class Verdict(StrEnum):
    """How a repair ended."""

    CLEAN = "clean"
    REPAIRED = "repaired"
    INVENTED = "repaired with invented surface"
    REFUSED = "refused"


class Rung(StrEnum):
    """The rungs of the least-change ladder, from nothing to everything; "weld" is also sewing of round-off."""

    KEEP = "keep"
    WELD = "weld"
    CUT = "re-trim"
    STRIP = "move a boundary strip"
    REALIGN = "put back"
    BRIDGE = "bridge"
    RESURFACE = "resurface"
    DROP = "drop"
    REFUSE = "refuse"


@dataclass(frozen=True, slots=True)
class Face:
    """One output face: a kept CAD face or a block of fitted patches.

    `origin` names the input parts it stands for, `deviation` is its largest distance from them (nan where everything
    is invented), `invented` the share of its area that gap filling made, `area` in square model units.
    """

    name: str
    origin: tuple[str, ...]
    rung: Rung
    deviation: float
    invented: float
    area: float


@dataclass(frozen=True, slots=True)
class Seam:
    """One edge of the output, measured surface to surface; where two patches meet inside a face, twice that face.

    `kind` is "smooth", "sharp" or "free"; `angle` in degrees, the largest between both normals along the edge.
    """

    faces: tuple[int, ...]
    gap: float
    angle: float
    kind: str
    length: float
    where: Point


@dataclass(frozen=True, slots=True)
class LedgerEntry:
    """One change, or one thing left alone: what, why, by how much, where, and the extent of the place."""

    what: str
    rung: Rung
    parts: tuple[str, ...]
    reason: str
    count: int = 1
    tolerance: float = 0.0
    largest_move: float = 0.0
    area: float = 0.0
    where: Point | None = None
    size: float = 0.0


@dataclass(frozen=True, slots=True)
class Problem:
    """Why something was refused, with its place."""

    kind: str
    where: Point
    size: float
    message: str


@dataclass(frozen=True, slots=True, eq=False)
class Repaired:
    """The outcome of `repair`.

    Parameters
    ----------
    verdict : see `Verdict`
    faces : output faces in the order of `to_assembly().parts`
    seams : every shared or free edge, measured
    triangulation : watertight (or open where openings are kept), tagged by part name
    ledger : everything that was done and left
    deviation : two-sided distance between input and output
    invented : share of the output's area that gap filling made
    problems : why it was refused, empty otherwise
    assembly : faces with topology, empty for a refusal
    grid : structured surface grid, None where no face is four-sided
    network : the fitted patches, one or more per face, None when CAD faces were kept
    regions : the deviation part by part, invented surface included; empty for a refusal
    """

    verdict: Verdict
    faces: tuple[Face, ...]
    seams: tuple[Seam, ...]
    triangulation: Triangulation
    ledger: tuple[LedgerEntry, ...]
    deviation: Deviation | None
    invented: float
    problems: tuple[Problem, ...]
    assembly: Assembly
    grid: StructuredGrid | None = None
    network: PatchNetwork | None = None
    figures: dict[str, float | int | str | bool] = field(default_factory=dict)
    regions: tuple[Region, ...] = ()

    @property
    def converged(self) -> bool:
        """Whether the fit reached its coverage; True where nothing was fitted."""
        return bool(self.figures.get("converged", True))

    def to_assembly(self) -> Assembly:
        """The repaired faces with shared edges, ready for `patchwright.models.io.write`."""
        return self.assembly
