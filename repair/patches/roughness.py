"""Which patches need more pieces along their seams for the sake of smoothness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.tolerance import Tolerance
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.joins import regular_edges, seam_angles, side_normals, smooth_edges
from patchwright.repair.patches.patch_nets import PatchNets

REGULAR = 0.1  # degrees a smooth seam between regular vertices may turn by
IRREGULAR = 0.25  # degrees any other smooth seam may turn by
WORTH = 0.8  # twice the pieces must bring the angle below this share of what it was, or they count as barren
PATIENCE = 1  # barren doublings after which a seam is left as it is


@dataclass(frozen=True, slots=True, eq=False)
class Roughness:
    """Angles of the seams and what follows from them.

    Parameters
    ----------
    angle : (e,) degrees, the largest along each edge
    barren : (e,) doublings in a row that did not help
    along : (m, 2) directions in which each patch needs more pieces
    """

    angle: Array
    barren: IntArray
    along: BoolArray

    @classmethod
    def of(cls, layout: QuadLayout, nets: PatchNets, tolerance: Tolerance, barren: IntArray | None = None) -> Roughness:
        """Measured on the patches; seams that turn like creases are left: no number of pieces makes a fold smooth."""
        angle = seam_angles(layout, side_normals(layout, nets))
        count = np.zeros(len(angle), dtype=np.int64) if barren is None else barren
        limit = np.where(regular_edges(layout), REGULAR, IRREGULAR)
        rough = smooth_edges(layout) & (angle > limit) & (angle < tolerance.angle) & (count < PATIENCE)
        sides = rough[layout.quad_edges]
        return cls(angle, count, np.stack([sides[:, 0] | sides[:, 2], sides[:, 1] | sides[:, 3]], axis=1))

    def after(self, layout: QuadLayout, nets: PatchNets, tolerance: Tolerance) -> Roughness:
        """Measured again after a round of refinement."""
        asked = np.zeros(len(self.angle), dtype=bool)
        for k in range(4):
            asked[layout.quad_edges[self.along[:, k % 2], k]] = True
        angle = seam_angles(layout, side_normals(layout, nets))
        barren = np.where(asked & (angle > WORTH * self.angle), self.barren + 1, np.where(asked, 0, self.barren))
        return Roughness.of(layout, nets, tolerance, barren)
