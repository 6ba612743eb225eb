"""Reading and writing files: `read(path)` gives an `Assembly`, `write(path, thing)` picks the format by the suffix."""

from __future__ import annotations

from inspect import Parameter, signature
from os import PathLike
from pathlib import Path
from typing import Any

from patchwright.models.assembly import Assembly
from patchwright.models.errors import UnsupportedFormat
from patchwright.models.io.opening import source
from patchwright.models.io.registry import FORMATS, Format, format_of
from patchwright.models.structured_grid import StructuredGrid

__all__ = ["FORMATS", "Format", "format_of", "read", "read_grid", "write"]


def read(path: str | PathLike[str], *, unit: str | None = None) -> Assembly:
    """The file's parts, with their names and unit.

    Parameters
    ----------
    path : the file; its suffix picks the format (`FORMATS`), gzip is seen by content
    unit : the unit of the coordinates of a format that stores none; kept as a label, nothing is scaled

    Raises
    ------
    UnsupportedFormat : the suffix is unknown, or its format can only be written.
    CorruptFile : no such file, no permission, empty, or not what its suffix says.
    UnsupportedEntity : well-formed, but patchwright cannot represent what it holds.
    """
    place = Path(path)
    with source(place):  # a missing file or a directory is told before an unknown suffix
        entry = format_of(place)
    if not entry.reads:
        raise UnsupportedFormat(
            f"{place}: {entry.name} files are written but not read; known for reading: {_suffixes('reads')}"
        )
    assembly: Assembly = entry.load().read(place, unit)
    return assembly


def read_grid(path: str | PathLike[str]) -> StructuredGrid:
    """The blocks of a Plot3D file.

    Raises
    ------
    UnsupportedFormat : another format.
    CorruptFile : as `read`.
    """
    place = Path(path)
    with source(place):
        entry = format_of(place)
    if not (entry.reads and "grid" in entry.holds):
        raise UnsupportedFormat(f"{place}: {entry.name} files hold no structured grid; read it with read()")
    grid: StructuredGrid = entry.load().read_grid(place)
    return grid


def write(path: str | PathLike[str], thing: Any, **options: Any) -> None:
    """Writes `thing` whole or not at all: beside its place first, then renamed.

    Parameters
    ----------
    path : the file; its suffix picks the format (`FORMATS`); ".gz" packs
    thing : Assembly, Triangulation or StructuredGrid; parts and surfaces, one or a list, for CAD formats
    options : the format's own, see `write` of its module

    Raises
    ------
    UnsupportedFormat : the suffix is unknown, its format cannot be written, or cannot hold `thing` or an option.
    ParameterError : the place cannot be written.

    Warns
    -----
    RepairWarning : the format cannot hold something `thing` has; once for each kind.
    """
    place = Path(path)
    entry = format_of(place)
    if not entry.writes:
        raise UnsupportedFormat(
            f"{place}: {entry.name} files are read but not written; known for writing: {_suffixes('writes')}"
        )
    module = entry.load()
    takes = signature(module.write).parameters.values()
    known = {p.name for p in takes if p.kind is Parameter.KEYWORD_ONLY}
    if not set(options) <= known and all(p.kind is not Parameter.VAR_KEYWORD for p in takes):
        odd = ", ".join(sorted(set(options) - known))
        raise UnsupportedFormat(
            f"{place}: {entry.name} has no option {odd}; it has {', '.join(sorted(known)) or 'none'}"
        )
    module.write(place, thing, **options)


def _suffixes(does: str) -> str:
    return " ".join(sorted(s for entry in FORMATS for s in entry.suffixes if getattr(entry, does)))
