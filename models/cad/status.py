"""Whether the CAD kernel calls each face valid, within a time limit (its check may take minutes on one face)."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly
from patchwright.models.cad import contained
from patchwright.models.cad.seams import edge_deviation
from patchwright.models.errors import EngineError, ParameterError
from patchwright.models.triangulation import Triangulation

_GRACE = 2.0  # seconds beyond the limit before the worker is ended: it stops by itself between two faces
_NOTHING = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))


class FaceStatus(Enum):
    """The kernel's verdict on one face."""

    VALID = "valid"
    INVALID = "invalid: its edges, wires or pcurves contradict its surface"
    UNCHECKED = "not checked within the time limit"


@dataclass(frozen=True, slots=True)
class BrepStatus:
    """One status per part and, where the check stopped early, why."""

    faces: tuple[FaceStatus, ...]
    stopped: str = ""

    @property
    def invalid(self) -> tuple[int, ...]:
        """The parts the kernel calls invalid."""
        return tuple(i for i, s in enumerate(self.faces) if s is FaceStatus.INVALID)


def brep_status(assembly: Assembly, *, time_limit: float = 60.0) -> BrepStatus:
    """The kernel's check of every face, as far as the time goes.

    Raises
    ------
    ParameterError : a part has no surface.
    """
    if not assembly.is_cad:
        raise ParameterError("only faces with surfaces can be checked by the CAD kernel")
    light = replace(assembly, parts=tuple(replace(p, triangulation=_NOTHING, trims=None) for p in assembly.parts))
    try:
        verdicts: list[bool | None] = contained.call_named(
            "patchwright.models.cad.status:check_here", light, edge_deviation(assembly), time_limit,
            time_limit=time_limit + _GRACE, what="checking faces",
        )  # fmt: skip
    except EngineError as error:
        return BrepStatus((FaceStatus.UNCHECKED,) * len(assembly.parts), str(error))
    known = {True: FaceStatus.VALID, False: FaceStatus.INVALID, None: FaceStatus.UNCHECKED}
    left = sum(v is None for v in verdicts)
    stopped = f"{left} of {len(verdicts)} faces were not checked within {time_limit:.0f} s" if left else ""
    return BrepStatus(tuple(known[v] for v in verdicts), stopped)


def check_here(assembly: Assembly, deviation: Array, seconds: float) -> list[bool | None]:
    """`brep_status` in this process: True, False or None per part."""
    from patchwright.models.cad import kernel
    from patchwright.models.cad.writing import shape_of

    end = time.process_time() + seconds
    _, faces = shape_of(assembly, deviation)
    out: list[bool | None] = []
    for face in faces:
        out.append(None if time.process_time() > end else bool(kernel.BRepCheck_Analyzer(face).IsValid()))
    return out
