"""An assembly built by the CAD kernel out of its topology: new edges and loops, kept faces on their own surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly, Part
from patchwright.models.cad import contained
from patchwright.models.cad.seams import edge_deviation
from patchwright.models.topology import Topology
from patchwright.models.triangulation import Triangulation

SECONDS, SECONDS_PER_FACE = 120.0, 1.0
NOTHING = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))


def rebuilt(
    assembly: Assembly, parts: tuple[Part, ...], topology: Topology, *, time_limit: float | None = None
) -> Assembly:
    """The parts with the edges of `topology`, tessellated anew, with native handles; unit and source of `assembly`.

    A part that keeps its native face keeps the kernel's own surface; one whose `native` is None is built from ours.

    Raises
    ------
    EngineError : the kernel refuses a face, crashed or took longer.
    """
    light = tuple(replace(p, triangulation=NOTHING, trims=None) for p in parts)
    model = replace(assembly, parts=light, topology=topology, native=None)
    limit = SECONDS + SECONDS_PER_FACE * len(parts) if time_limit is None else time_limit
    made: Assembly = contained.call_named(
        "patchwright.models.cad.rebuild:build_here", model, edge_deviation(model),
        time_limit=limit, what=f"building {len(parts)} faces with new edges",
    )  # fmt: skip
    return made


def build_here(assembly: Assembly, deviation: Array) -> Assembly:
    """The assembly built by the kernel out of its topology, in this process, with triangles and native handles."""
    from patchwright.models.cad.reading import assembly_of
    from patchwright.models.cad.writing import shape_of

    shape, faces = shape_of(assembly, deviation)
    names, bodies = [p.name for p in assembly.parts], [p.body for p in assembly.parts]
    return replace(assembly_of(shape, names, bodies, assembly.source, faces=faces), unit=assembly.unit)
