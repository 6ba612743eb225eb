"""`Assembly` and `Part`: what a file holds, with names, units and the file it came from."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.topology import Topology
from patchwright.models.triangulation import Triangulation, concatenate

if TYPE_CHECKING:
    from patchwright.models.nurbs_curve import NurbsCurve
    from patchwright.models.surface import Surface


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One named piece: a solid of an STL file, a group of an OBJ file, a face of a CAD file, a fitted patch.

    Parameters
    ----------
    name : the part's own name ("" when the file gives none)
    triangulation : the piece itself for a mesh, the tessellation (with uv) of a CAD face
    surface : the true surface of a CAD face, None for a mesh
    trims : loops of (u, v) curves that bound the face on its surface, the outer first; None means its natural bounds
    body : solid or shell a CAD face belongs to, "" otherwise
    native : the CAD kernel's own face, opaque; kept so that an untouched face is written back unchanged
    """

    name: str
    triangulation: Triangulation
    surface: Surface | None = None
    trims: tuple[tuple[NurbsCurve, ...], ...] | None = None
    body: str = ""
    native: Any = None


@dataclass(frozen=True, slots=True, eq=False)
class Assembly:
    """Parts in the file's order.

    Parameters
    ----------
    parts : the pieces
    unit : "mm", "m", "in", ... or "unknown" (STL and most mesh formats carry none; coordinates are kept as they are)
    source : the path or the sample's name
    topology : the shared edges of all parts (index i of `topology.loops` is part i), when known; None otherwise
    native : the CAD kernel's own sewn shape of all parts, opaque, when it exists
    """

    parts: tuple[Part, ...]
    unit: str = "unknown"
    source: str = ""
    topology: Topology | None = None
    native: Any = None

    @classmethod
    def of(
        cls, things: Triangulation | Surface | Part | Iterable[Any], *, unit: str = "unknown", source: str = ""
    ) -> Assembly:
        """An assembly of triangulations, surfaces or parts; surfaces are given an empty triangulation."""
        items: list[Any] = list(things) if isinstance(things, list | tuple) else [things]
        parts = []
        for i, item in enumerate(items):
            if isinstance(item, Part):
                parts.append(item)
            elif isinstance(item, Triangulation):
                parts.append(Part(f"part{i + 1}", item))
            else:
                empty = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
                parts.append(Part(f"part{i + 1}", empty, surface=item))
        return cls(tuple(parts), unit=unit, source=source)

    @property
    def is_cad(self) -> bool:
        """True when every part has a true surface."""
        return bool(self.parts) and all(p.surface is not None for p in self.parts)

    @property
    def triangulation(self) -> Triangulation:
        """All parts' triangles, tagged by part (tag i is part i, its name in `tag_names`)."""
        merged = concatenate([p.triangulation for p in self.parts])
        tags = np.repeat(np.arange(len(self.parts)), [len(p.triangulation) for p in self.parts])
        return Triangulation(merged.vertices, merged.triangles, uv=merged.uv, tags=tags, tag_names=self.names)

    @property
    def names(self) -> tuple[str, ...]:
        """The parts' names."""
        return tuple(p.name for p in self.parts)

    @property
    def bounds(self) -> Array:
        """(2, 3) box of the tessellated parts."""
        boxes = [p.triangulation.bounds for p in self.parts if len(p.triangulation)]
        if not boxes:
            return np.zeros((2, 3))
        return np.stack([np.min([b[0] for b in boxes], axis=0), np.max([b[1] for b in boxes], axis=0)])

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of `bounds`."""
        low, high = self.bounds
        return float(np.linalg.norm(high - low))
