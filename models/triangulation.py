"""`Triangulation`: triangles over vertices stored once, with the surface and (u, v) each corner came from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, IntArray, frozen
from patchwright.models.errors import ParameterError

T = TypeVar("T", bound=np.generic)

CHUNK = 8192  # triangles whose areas or volumes are computed at a time


@dataclass(frozen=True, slots=True, eq=False)
class Triangulation:
    """Triangles in R^3; its arrays are own, read-only copies.

    A triangulation may be as dirty as its file: open, folded, duplicated. Only the indices are promised to be valid
    and the coordinates finite.

    Parameters
    ----------
    vertices : (n, 3) float64, model length unit
    triangles : (m, 3) int64, indices into `vertices`, counter-clockwise seen from outside
    uv : (m, 3, 2) float64 or None, parameters of each corner on the surface the triangle came from
    tags : (m,) int64 or None, which of `tag_names` (a solid, a group, a CAD face) each triangle belongs to
    tag_names : names of the tags

    Raises
    ------
    ParameterError : an index out of range, a coordinate that is not finite, arrays of the wrong shape.
    """

    vertices: Array
    triangles: IntArray
    uv: Array | None = None
    tags: IntArray | None = None
    tag_names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        vertices = np.asarray(self.vertices, dtype=np.float64)
        triangles = np.asarray(self.triangles)
        if vertices.size == 0:
            vertices = vertices.reshape(0, 3)
        if triangles.size == 0:
            triangles = triangles.reshape(0, 3).astype(np.int64)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
            raise ParameterError(
                f"vertices must be (n, 3) and triangles (m, 3), got {vertices.shape} and {triangles.shape}"
            )
        if not np.isfinite(vertices).all():
            bad = int(np.flatnonzero(~np.isfinite(vertices).all(axis=1))[0])
            raise ParameterError(f"vertex {bad} has a coordinate that is not finite: {vertices[bad].tolist()}")
        if len(triangles) and (triangles.min() < 0 or triangles.max() >= len(vertices)):
            raise ParameterError(
                f"triangle indices run from {triangles.min()} to {triangles.max()}, but {len(vertices)} vertices exist"
            )
        put(self, "vertices", frozen(self.vertices if vertices.base is None else vertices, np.float64))
        put(self, "triangles", frozen(triangles, np.int64))
        if self.uv is not None:
            uv = frozen(self.uv, np.float64)
            if uv.shape != (len(triangles), 3, 2):
                raise ParameterError(f"uv must be (m, 3, 2) = ({len(triangles)}, 3, 2), got {uv.shape}")
            put(self, "uv", uv)
        if self.tags is not None:
            tags = frozen(self.tags, np.int64)
            if tags.shape != (len(triangles),):
                raise ParameterError(f"tags must be (m,) = ({len(triangles)},), got {tags.shape}")
            put(self, "tags", tags)
        put(self, "tag_names", tuple(self.tag_names))

    def __len__(self) -> int:
        return len(self.triangles)

    @property
    def corners(self) -> Array:
        """(m, 3, 3) coordinates of each triangle's corners."""
        return self.vertices[self.triangles]

    @property
    def area_vectors(self) -> Array:
        """(m, 3) normals whose length is the triangle's area."""
        vectors = np.empty((len(self), 3))
        for first in range(0, len(self), CHUNK):  # what is in between stays small, and close to the processor
            a, b, c = self.vertices[self.triangles[first : first + CHUNK].T]
            u, v, out = b - a, c - a, vectors[first : first + CHUNK]
            for k in range(3):
                i, j = (k + 1) % 3, (k + 2) % 3
                out[:, k] = u[:, i] * v[:, j] - u[:, j] * v[:, i]
            out *= 0.5
        return vectors

    @property
    def areas(self) -> Array:
        """(m,) areas."""
        return np.asarray(np.linalg.norm(self.area_vectors, axis=1))

    @property
    def normals(self) -> Array:
        """(m, 3) unit normals; zero for a triangle without area."""
        vectors = self.area_vectors
        length = np.linalg.norm(vectors, axis=1, keepdims=True)
        return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0))

    @property
    def volume(self) -> float:
        """Signed enclosed volume (divergence theorem); meaningful only when the triangulation is closed."""
        if not len(self):
            return 0.0
        shift = self.vertices.mean(axis=0)
        a, b, c = np.moveaxis(self.corners - shift, 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)

    @property
    def bounds(self) -> Array:
        """(2, 3) lowest and highest coordinates of the vertices in use; zeros when there are none."""
        if not len(self):
            return np.zeros((2, 3))
        used = np.zeros(len(self.vertices), dtype=np.bool_)
        used[self.triangles] = True
        columns = [self.vertices[used, k] for k in range(3)]
        return np.array([[c.min() for c in columns], [c.max() for c in columns]])

    @property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal."""
        low, high = self.bounds
        return float(np.linalg.norm(high - low))

    def take(self, which: npt.ArrayLike) -> Triangulation:
        """The triangles of `which` (indices or a mask), over the same vertices."""
        index = np.asarray(which)
        return replace(
            self,
            triangles=_taken(self.triangles, index),
            uv=None if self.uv is None else _taken(self.uv, index),
            tags=None if self.tags is None else _taken(self.tags, index),
        )

    def compact(self) -> Triangulation:
        """The same triangles without the vertices no triangle uses; the vertices' order is kept."""
        used = np.zeros(len(self.vertices), dtype=np.bool_)
        used[self.triangles] = True
        number = np.cumsum(used) - 1
        return replace(self, vertices=_taken(self.vertices, used), triangles=_taken(number, self.triangles))


def _taken(rows: npt.NDArray[T], index: npt.NDArray[Any]) -> npt.NDArray[T]:
    """The rows of an index or a mask, read-only: nobody else has them, so that they need no copy."""
    own: npt.NDArray[T] = rows[index]
    if own.base is None:
        own.flags.writeable = False
    return own


def concatenate(parts: list[Triangulation] | tuple[Triangulation, ...]) -> Triangulation:
    """All triangles of `parts` in order, each part's vertices kept apart; equal tag names become one tag.

    A part without tags gives its triangles the tag "" when any other part has tags; uv survives only where all have it.
    """
    if not parts:
        return Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    offsets = np.cumsum([0] + [len(p.vertices) for p in parts])
    names: dict[str, int] = {}
    tags: list[IntArray] = []
    tagged = any(p.tags is not None for p in parts)
    if tagged:
        for part in parts:
            own = part.tag_names if part.tags is not None else ("",)
            lookup = np.array([names.setdefault(name, len(names)) for name in own], dtype=np.int64)
            tags.append(lookup[part.tags if part.tags is not None else np.zeros(len(part), dtype=np.int64)])
    whole_uv = all(p.uv is not None for p in parts)
    vertices = np.concatenate([p.vertices for p in parts])
    triangles = np.concatenate([p.triangles + offset for p, offset in zip(parts, offsets[:-1], strict=True)])
    vertices.flags.writeable = triangles.flags.writeable = False  # they are new: no copy is needed
    return Triangulation(
        vertices,
        triangles,
        uv=np.concatenate([p.uv for p in parts if p.uv is not None]) if whole_uv else None,
        tags=np.concatenate(tags) if tagged else None,
        tag_names=tuple(names),
    )
