"""C2 cubic interpolation in blocks: not-a-knot between creases, a corner allowed at each.

One spline with triple knots at the inner breaks; every block needs four sites.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_surface import NurbsSurface

FEWEST = 4  # sites of a block


@dataclass(frozen=True, slots=True, eq=False)
class BlockCubic:
    """Interpolation at fixed sites: the knots, and what turns values into control values."""

    sites: Array
    """(k,) increasing, the breaks among them."""
    breaks: Array
    """(b + 1,) both ends and the inner breaks."""

    @property
    def blocks(self) -> list[tuple[int, int]]:
        """First and last site of every block."""
        at = np.searchsorted(self.sites, self.breaks)
        return list(pairwise(at.tolist()))

    @property
    def knots(self) -> Array:
        """Clamped, triple at inner breaks, simple at sites but the second and the last but one of each block."""
        inner = [np.concatenate((self.sites[a + 2 : b - 1], np.full(3, self.sites[b]))) for a, b in self.blocks]
        return np.concatenate((np.full(4, self.breaks[0]), *inner, self.breaks[-1:]))

    def controls(self, values: Array) -> Array:
        """(n, ...) control values of the spline through values (k, ...)."""
        from scipy.interpolate import make_interp_spline

        out: list[Array] = []
        for a, b in self.blocks:
            net = np.array(make_interp_spline(self.sites[a : b + 1], values[a : b + 1], k=3).c)
            net[0], net[-1] = values[a], values[b]  # neighbours meet there without round-off
            out.append(net if not out else net[1:])
        return np.concatenate(out)

    def __call__(self, values: Array, at: Array, nu: int = 0) -> Array:
        """(j, ...) the spline through values (k, ...) at parameters (j,), or its derivative nu."""
        from scipy.interpolate import BSpline

        return np.asarray(BSpline(self.knots, self.controls(values), 3)(at, nu))


def surface_through(along: tuple[BlockCubic, BlockCubic], points: Array) -> NurbsSurface:
    """The bicubic surface through points (k, l, 3) at the sites of both directions."""
    rows = along[0].controls(points)
    net = along[1].controls(rows.swapaxes(0, 1)).swapaxes(0, 1)
    return NurbsSurface((3, 3), (along[0].knots, along[1].knots), net)


def filled(sites: Array, breaks: Array) -> Array:
    """The sites with the breaks put in, and the widest gaps of every block halved until it has its four."""
    out = np.unique(np.concatenate((sites, breaks)))
    for low, high in pairwise(breaks):
        while True:
            own = out[(out >= low) & (out <= high)]
            if len(own) >= FEWEST:
                break
            widest = int(np.argmax(np.diff(own)))
            out = np.sort(np.append(out, 0.5 * (own[widest] + own[widest + 1])))
    return out
