"""What STEP and IGES have in common: checks before the kernel sees a file, units, and the contained calls."""

from __future__ import annotations

import os
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from patchwright.models.assembly import Assembly
from patchwright.models.cad import contained
from patchwright.models.cad.seams import edge_deviation
from patchwright.models.cad.volumes import closed_volumes
from patchwright.models.errors import (
    CorruptFile,
    EngineError,
    ParameterError,
    RepairWarning,
    UnsupportedEntity,
    UnsupportedFormat,
)
from patchwright.models.io.atomic import replacing
from patchwright.models.triangulation import Triangulation

SECONDS, SECONDS_PER_MEGABYTE = 120.0, 60.0  # default time limit: some hundred times what a healthy file takes
SECONDS_PER_FACE = 0.1
UNITS = ("mm", "cm", "m", "km", "in", "ft", "um")
_NOTHING = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))


def check_step(path: Path) -> None:
    """Refuse what is no STEP file before the kernel sees it.

    Raises
    ------
    CorruptFile : empty, binary, without the STEP header, or cut off before its end.
    """
    head, tail = _ends(path)
    if b"ISO-10303-21" not in head:
        raise CorruptFile(f"{path}: not a STEP file (it does not start with ISO-10303-21)")
    if b"END-ISO-10303-21" not in tail:
        raise CorruptFile(f"{path}: the STEP file is cut off (no END-ISO-10303-21 at its end)")


def check_iges(path: Path) -> None:
    """Refuse what is no IGES file before the kernel sees it.

    Raises
    ------
    CorruptFile : empty, without start and global section, or cut off before the terminate section.
    UnsupportedEntity : the compressed or binary form of IGES.
    """
    head, tail = _ends(path)
    first = head.split(b"\n", 1)[0].rstrip(b"\r")
    flag = first[72:73]
    if flag in (b"B", b"C") and first[73:80].strip().isdigit():
        form = "binary" if flag == b"B" else "compressed"
        raise UnsupportedEntity(f"{path}: the {form} form of IGES is not supported, save it as fixed ASCII")
    if flag not in (b"S", b"G") or b"\0" in head:
        raise CorruptFile(f"{path}: not an IGES file (no start section in column 73 of the first line)")
    lines = [line.rstrip(b"\r") for line in tail.split(b"\n") if line.strip(b" \r\x1a\0")]
    if not lines or lines[-1][72:73] != b"T":
        raise CorruptFile(f"{path}: the IGES file is cut off (no terminate section at its end)")


def read_contained(
    path: Path, kind: str, unit: str | None, *, deflection: float | None, angle: float, time_limit: float | None
) -> Assembly:
    """The assembly of a checked file, read in the worker, in mm; a `unit` is not needed and only warned about."""
    megabytes = path.stat().st_size / 2**20
    limit = SECONDS + SECONDS_PER_MEGABYTE * megabytes if time_limit is None else time_limit
    name = "patchwright.models.cad.reading:read_file"
    try:
        assembly: Assembly = contained.call_named(
            name, path, kind, deflection, angle, time_limit=limit, what=f"reading {path}"
        )
    except EngineError as error:
        raise CorruptFile(f"{path}: {error}") from error
    if unit not in (None, assembly.unit):
        text = f"{path}: {kind} files carry their own unit: the coordinates are in {assembly.unit}, not {unit}"
        warnings.warn(RepairWarning(text), stacklevel=3)
    return assembly


def _ends(path: Path) -> tuple[bytes, bytes]:
    """The first and the last 4 kB."""
    with path.open("rb") as file:
        head = file.read(4096)
        size = file.seek(0, os.SEEK_END)
        if not head.strip():
            raise CorruptFile(f"{path}: the file is empty" if not size else f"{path}: the file starts with blanks only")
        file.seek(max(0, size - 4096))
        return head, file.read()


def write_contained(path: Path, kind: str, thing: Any, *, unit: str | None, time_limit: float | None) -> None:
    """The parts with surfaces of `thing`, written in the worker beside `path`, then renamed."""
    assembly = thing if isinstance(thing, Assembly) else Assembly.of(thing, unit="unknown")
    bare = [p.name for p in assembly.parts if p.surface is None]
    if bare or not assembly.parts:
        what = (
            f"{len(bare)} of {len(assembly.parts)} parts have no surface, the first is {bare[0]!r}"
            if bare
            else "it is empty"
        )
        raise UnsupportedFormat(
            f"{path}: {kind} holds surfaces, not triangles ({what}); repair the model first or write STL"
        )
    limit = SECONDS + SECONDS_PER_FACE * len(assembly.parts) if time_limit is None else time_limit
    own_unit, file_unit = _units(assembly.unit, unit)
    bare_assembly = replace(
        assembly, parts=tuple(replace(p, triangulation=_NOTHING, trims=None) for p in assembly.parts)
    )
    with replacing(path) as part:
        contained.call_named(
            "patchwright.models.cad.writing:write_file", part, kind, bare_assembly, own_unit, file_unit,
            edge_deviation(assembly), closed_volumes(assembly),
            time_limit=limit, what=f"writing {path}",
        )  # fmt: skip


def _units(own: str, wanted: str | None) -> tuple[str, str]:
    """The unit the coordinates are in and the file's; coordinates of unknown unit are taken to be in the file's."""
    for name in (own, wanted):
        if name not in (None, "unknown", *UNITS):
            raise ParameterError(f"the unit {name!r} is not known; known are {' '.join(UNITS)}")
    asked = None if wanted == "unknown" else wanted
    return (asked or "mm",) * 2 if own == "unknown" else (own, asked or own)
