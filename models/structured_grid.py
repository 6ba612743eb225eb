"""`StructuredGrid`: a multi-block grid of points, surface blocks having one plane of nodes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from patchwright.models.arrays import Array, IntArray, frozen
from patchwright.models.errors import ParameterError


@dataclass(frozen=True, slots=True, eq=False)
class StructuredGrid:
    """Blocks of points; its arrays are own, read-only copies.

    Parameters
    ----------
    blocks : one (ni, nj, nk, 3) float64 array per block; a surface block has nk = 1
    names : one name per block, or empty
    invented : one (ni, nj, nk) int64 array per block, 1 where a node lies on surface that gap filling invented (Plot3D
        writes it as IBLANK), or empty
    """

    blocks: tuple[Array, ...]
    names: tuple[str, ...] = ()
    invented: tuple[IntArray, ...] = field(default=())

    def __post_init__(self) -> None:
        put = object.__setattr__
        blocks = tuple(frozen(b, np.float64) for b in self.blocks)
        for i, block in enumerate(blocks):
            if block.ndim != 4 or block.shape[3] != 3 or min(block.shape[:3]) < 1:
                raise ParameterError(f"block {i} must be (ni, nj, nk, 3), got {block.shape}")
        put(self, "blocks", blocks)
        put(self, "names", tuple(self.names))
        invented = tuple(frozen(m, np.int64) for m in self.invented)
        if invented and [m.shape for m in invented] != [b.shape[:3] for b in blocks]:
            raise ParameterError("invented must hold one (ni, nj, nk) array per block")
        put(self, "invented", invented)

    @property
    def bounds(self) -> Array:
        """(2, 3) lowest and highest coordinates."""
        points = [b.reshape(-1, 3) for b in self.blocks]
        if not points:
            return np.zeros((2, 3))
        return np.stack(
            [np.min([p.min(axis=0) for p in points], axis=0), np.max([p.max(axis=0) for p in points], axis=0)]
        )
