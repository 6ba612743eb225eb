"""`Topology`: which faces share which edges, so that a shell written to STEP or IGES is sewn by construction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from patchwright.models.arrays import Array, IntArray, frozen
from patchwright.models.errors import ParameterError

if TYPE_CHECKING:
    from patchwright.models.nurbs_curve import NurbsCurve


@dataclass(frozen=True, slots=True, eq=False)
class EdgeUse:
    """One face's use of an edge.

    `pcurve` is the edge in the face's (u, v), a 2-D curve with the *same parameter* as the edge's 3-D curve (never
    reversed); `reversed` says that the face's loop runs along it backwards.
    """

    edge: int
    reversed: bool
    pcurve: NurbsCurve


@dataclass(frozen=True, slots=True, eq=False)
class Topology:
    """Vertices, edges and the loops of every face.

    Parameters
    ----------
    vertices : (n, 3) corner points, model length unit
    curves : one 3-D curve per edge
    ends : (e, 2) int64, the vertices at each curve's start and end (equal for a closed edge)
    loops : per face, per loop (the first is the outer one, counter-clockwise in (u, v)), the edge uses in order
    flipped : per face, whether its outward normal is against the surface's own u × v normal
    """

    vertices: Array
    curves: tuple[NurbsCurve, ...]
    ends: IntArray
    loops: tuple[tuple[tuple[EdgeUse, ...], ...], ...]
    flipped: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "vertices", frozen(self.vertices, np.float64))
        put(self, "ends", frozen(np.asarray(self.ends, dtype=np.int64).reshape(-1, 2), np.int64))
        if len(self.curves) != len(self.ends):
            raise ParameterError(f"{len(self.curves)} edge curves but {len(self.ends)} pairs of end vertices")
        if not self.flipped:
            put(self, "flipped", (False,) * len(self.loops))

    def use_counts(self) -> IntArray:
        """(e,) how many times the faces use each edge: 1 is free, 2 is shared or a seam, more is non-manifold."""
        edges = [use.edge for face in self.loops for loop in face for use in loop]
        return np.bincount(np.asarray(edges, dtype=np.int64), minlength=len(self.curves))
