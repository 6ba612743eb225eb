"""What `intersect` accepts, taken apart: every surface, face and mesh of the inputs with its box and its trims."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.assembly import Assembly, Part
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.structured_grid import StructuredGrid
from patchwright.models.surface import Surface
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation

Input: TypeAlias = Surface | Triangulation | StructuredGrid | Part | Assembly
Loops: TypeAlias = tuple[tuple[NurbsCurve, ...], ...]


@dataclass(frozen=True, slots=True, eq=False)
class Operand:
    """One surface or mesh.

    Parameters
    ----------
    thing : a bounded or unbounded surface, or a triangulation
    name : of the part, "" when it has none
    source : number of the input it comes from
    trims : loops of (u, v) curves that bound a face, None for natural bounds
    box : (2, 3) holds it; infinite where it is unbounded
    edges : the edges of the input's topology that bound it
    """

    thing: Surface | Triangulation
    name: str
    source: int
    trims: Loops | None
    box: Array
    edges: frozenset[int] = frozenset()

    @property
    def size(self) -> float:
        """Diagonal of the box."""
        return float(np.linalg.norm(self.box[1] - self.box[0]))


def operands(inputs: Sequence[Input]) -> tuple[Operand, ...]:
    """The inputs' surfaces and meshes in order, an assembly's parts one by one.

    Raises
    ------
    ParameterError : an input of another kind, or one without triangles.
    """
    out: list[Operand] = []
    for source, item in enumerate(inputs):
        if isinstance(item, Assembly):
            loops = item.topology.loops if item.topology is not None else ((),) * len(item.parts)
            for part, own in zip(item.parts, loops, strict=True):
                out.append(_of_part(part, source, frozenset(use.edge for loop in own for use in loop)))
        elif isinstance(item, Part):
            out.append(_of_part(item, source, frozenset()))
        else:
            out.append(_of(item, "", source))
    return tuple(out)


def _of_part(part: Part, source: int, edges: frozenset[int]) -> Operand:
    if part.surface is None:
        return _of(part.triangulation, part.name, source)
    return Operand(part.surface, part.name, source, part.trims, box_of(part.surface), edges)


def _of(item: Input, name: str, source: int) -> Operand:
    from patchwright.ssi.grid_triangles import grid_triangulation

    if isinstance(item, StructuredGrid):
        item = grid_triangulation(item)
    if isinstance(item, Triangulation):
        if not len(item):
            raise ParameterError(f"input {source + 1} {name!r} has no triangles")
        return Operand(item, name, source, None, item.bounds)
    if isinstance(item, Surface):
        return Operand(item, name, source, None, box_of(item))
    raise ParameterError(f"input {source + 1} is a {type(item).__name__}; surfaces, meshes, grids and assemblies meet")


def box_of(surface: Surface) -> Array:
    """(2, 3) box of a surface by its control points; infinite for an unbounded one."""
    if not np.isfinite(surface.domain).all():
        return np.array([[-np.inf] * 3, [np.inf] * 3])
    net = surface.to_nurbs().control_points.reshape(-1, 3)
    return np.stack([net.min(axis=0), net.max(axis=0)])


def meeting(items: Sequence[Operand], alone: bool, margin: float) -> IntArray:
    """(k, 2) pairs of operands whose boxes, widened by `margin`, meet; lower number first.

    Parts of one input are paired only when it is `alone`; faces that share an edge are neighbours, not a pair.
    """
    if len(items) < 2:
        return np.zeros((0, 2), dtype=np.int64)
    boxes = np.stack([item.box for item in items])
    finite = np.isfinite(boxes).all(axis=(1, 2))
    limit = boxes[finite].reshape(-1, 3) if finite.any() else np.zeros((1, 3))
    boxes = np.clip(boxes, limit.min(axis=0) - 1.0, limit.max(axis=0) + 1.0)
    low, high = boxes[:, 0] - margin, boxes[:, 1] + margin
    # a triangle from corner to corner of a box has that box
    corners = np.stack([low, high, low], axis=1).reshape(-1, 3)
    pairs = Tree.of(Triangulation(corners, np.arange(len(corners)).reshape(-1, 3))).pairs()
    source = np.array([item.source for item in items])
    if not alone:
        pairs = pairs[source[pairs[:, 0]] != source[pairs[:, 1]]]
    apart = [items[i].source != items[j].source or not items[i].edges & items[j].edges for i, j in pairs.tolist()]
    return np.asarray(pairs[np.array(apart, dtype=bool)])
