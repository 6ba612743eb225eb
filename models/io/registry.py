"""The file formats: one module each, imported when a file of it is met."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType

from patchwright.models.errors import UnsupportedFormat


@dataclass(frozen=True, slots=True)
class Format:
    """One format: `module` has `read(path, unit) -> Assembly` when `reads` and `write(path, thing, **options)` when
    `writes`.

    `holds` names what survives a round trip: "triangles", "names", "surfaces", "topology", "units", "grid".
    """

    name: str
    suffixes: tuple[str, ...]
    module: str
    reads: bool
    writes: bool
    holds: frozenset[str]

    def load(self) -> ModuleType:
        """The format's module, imported now."""
        return import_module(f"patchwright.models.io.{self.module}")


FORMATS: tuple[Format, ...] = (
    Format("STL", (".stl", ".stl.gz"), "stl", True, True, frozenset({"triangles", "names"})),
    Format("OBJ", (".obj", ".obj.gz"), "obj", True, True, frozenset({"triangles", "names"})),
    Format("PLY", (".ply", ".ply.gz"), "ply", True, True, frozenset({"triangles"})),
    Format("OFF", (".off", ".off.gz"), "off", True, False, frozenset({"triangles"})),
    Format("Cart3D", (".tri", ".tri.gz"), "cart3d", True, False, frozenset({"triangles", "names"})),
    Format(
        "Plot3D",
        (".xyz", ".p3d", ".x", ".fmt", ".p3dfmt", ".xyz.gz", ".p3d.gz", ".fmt.gz"),
        "plot3d",
        True,
        True,
        frozenset({"grid"}),
    ),
    Format("VTK", (".vtk", ".vtp", ".vts", ".vtm"), "vtk", False, True, frozenset({"triangles", "names", "grid"})),
    Format("STEP", (".step", ".stp"), "step", True, True, frozenset({"surfaces", "topology", "names", "units"})),
    Format("IGES", (".igs", ".iges"), "iges", True, True, frozenset({"surfaces", "topology", "names", "units"})),
)


def format_of(path: Path) -> Format:
    """The format of a path by its suffix (".gz" counts with the suffix before it).

    Raises
    ------
    UnsupportedFormat : no format has the suffix; the text lists those that exist.
    """
    name = path.name.lower()
    for entry in FORMATS:
        if name.endswith(entry.suffixes):
            return entry
    known = " ".join(sorted(s for entry in FORMATS for s in entry.suffixes))
    raise UnsupportedFormat(f"{path}: the suffix {path.suffix or '(none)'} is not a known format; known are {known}")
