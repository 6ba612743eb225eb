"""STEP (AP203, AP214, AP242) boundary models through the CAD kernel, in a child process.

Read: every face with its true surface, loops, tessellation, name and body. Not read: points, curves, colours, layers,
dimensions, tessellated (AP242) shapes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from patchwright.models.assembly import Assembly
from patchwright.models.cad.files import check_step, read_contained, write_contained

ANGLE = 0.25  # radians between neighbouring facets unless told otherwise


def read(
    path: Path,
    unit: str | None = None,
    *,
    deflection: float | None = None,
    angle: float = ANGLE,
    time_limit: float | None = None,
) -> Assembly:
    """One part per face; coordinates in mm whatever the file's unit.

    Parameters
    ----------
    unit : not needed, the file carries its own
    deflection : largest distance between a face and its triangles in mm; None means 2e-4 of the diagonal
    angle : radians between neighbouring facets
    time_limit : seconds; None means 120 and 60 more for every megabyte

    Raises
    ------
    CorruptFile : not STEP, cut off, or the kernel crashed or hung on it.
    UnsupportedEntity : it holds no face.
    """
    check_step(path)
    return read_contained(path, "STEP", unit, deflection=deflection, angle=angle, time_limit=time_limit)


def write(path: Path, thing: Any, *, unit: str | None = None, time_limit: float | None = None) -> None:
    """The faces of an assembly, a part or a surface, sharing their edges; solids where they close.

    A part's native face is written as it came (surface type and parameters equal to 1e-12); the topology gives the rest
    their edges; surfaces without either are loose faces with natural bounds.

    Parameters
    ----------
    unit : the unit the file is in ("mm", "m", "in", ...); None means mm with unchanged coordinates when the assembly's
        unit is unknown, the assembly's own unit otherwise
    time_limit : seconds; None means 120 and a tenth more for every face

    Raises
    ------
    UnsupportedFormat : a part has no surface. EngineError : the kernel failed; nothing is written then.
    """
    write_contained(path, "STEP", thing, unit=unit, time_limit=time_limit)
