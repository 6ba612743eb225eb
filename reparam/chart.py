"""Charts: the new parameters (s, t) of a region in its old ones, as a smooth map without folds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.differential import normals
from patchwright.reparam.block_cubic import BlockCubic
from patchwright.reparam.border import Border
from patchwright.reparam.direction import Direction
from patchwright.reparam.region import Region
from patchwright.reparam.straightening import Straightened


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """(s, t) -> (u, v), interpolated between the nodes of both directions and exact on the sides.

    Parameters
    ----------
    places : (m + 1, n + 1, 2) of the straightened unit square, at the nodes
    borders : south, north, west, east
    corners : (2, 2, 3) points at s = 0, 1 and t = 0, 1, common to all regions that meet there
    """

    region: Region
    straight: Straightened
    places: Array
    nodes: tuple[BlockCubic, BlockCubic]
    borders: tuple[Border, Border, Border, Border]
    corners: Array

    @classmethod
    def of(
        cls,
        region: Region,
        straight: Straightened,
        places: Array,
        directions: tuple[Direction, Direction],
        borders: tuple[Border, Border, Border, Border],
        corners: Array,
    ) -> Chart:
        """Through places at the nodes of the directions."""
        along = [BlockCubic(d.nodes, d.breaks) for d in directions]
        return cls(region, straight, places, (along[0], along[1]), borders, corners)

    def parameters(self, s: Array, t: Array) -> Array:
        """(k, l, 2) parameters (u, v) on the tensor grid of s (k,) and t (l,)."""
        rows = self.nodes[0](self.places, s)
        at = self.nodes[1](rows.swapaxes(0, 1), t).swapaxes(0, 1)
        at = at + self._correction(at, s, t)
        return self.straight.parameters(np.clip(at, 0.0, 1.0))

    def _correction(self, at: Array, s: Array, t: Array) -> Array:
        """What brings the sides onto their curves, blended linearly inside."""
        ends = np.array([0.0, 1.0])
        along_s = self.nodes[1](self.nodes[0](self.places, s).swapaxes(0, 1), ends)  # (2, k, 2)
        along_t = self.nodes[0](self.nodes[1](self.places.swapaxes(0, 1), t).swapaxes(0, 1), ends)
        south, north, west, east = (
            np.zeros(spline.shape) if border.side.is_pole else self.straight.places(border.uv(x)) - spline
            for border, x, spline in zip(self.borders, (s, s, t, t), (*along_s, *along_t), strict=True)
        )
        x, y = s[:, None, None], t[None, :, None]
        return np.asarray((1 - y) * south[:, None] + y * north[:, None] + (1 - x) * west[None] + x * east[None])

    def points(self, s: Array, t: Array) -> Array:
        """(k, l, 3) points; those of the sides are the borders' own, so that neighbours agree bit for bit."""
        uv = self.parameters(s, t)
        out = self.region.surface(uv[..., 0], uv[..., 1])
        for border, index, x in zip(
            self.borders,
            ((slice(None), t == 0.0), (slice(None), t == 1.0), (s == 0.0, slice(None)), (s == 1.0, slice(None))),
            (s, s, t, t),
            strict=True,
        ):
            along = border.points(x)
            out[index] = along[:, None] if isinstance(index[0], slice) else along[None]
        for a, at_s in enumerate((s == 0.0, s == 1.0)):
            for b, at_t in enumerate((t == 0.0, t == 1.0)):
                out[np.ix_(at_s, at_t)] = self.corners[a, b]
        return out

    def normals(self, s: Array, t: Array) -> Array:
        """(k, l, 3) unit normals of the region's surface; zero where it has none."""
        uv = self.parameters(s, t)
        return np.nan_to_num(normals(self.region.surface, uv[..., 0], uv[..., 1]))
