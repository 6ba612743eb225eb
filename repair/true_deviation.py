"""Two-sided distance between fitted patches and the true surfaces behind a CAD tessellation."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import BoolArray
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.deviation import SAMPLES, Deviation, sample_area, spread
from patchwright.repair.true_ground import TrueGround


def true_deviation(
    ground: TrueGround, after: Triangulation, tolerance: float, skip_before: BoolArray, skip_after: BoolArray
) -> Deviation:
    """Distances to and from the true surfaces; samples whose surface is not reached count from their triangle.

    Parameters
    ----------
    after : the patches' tessellation
    tolerance : the length coverage is counted against
    skip_before, skip_after : triangles (invented surface) no distance is taken from
    """
    points, _ = sample_area(ground.triangulation.take(~np.asarray(skip_before)), SAMPLES)
    there, here = np.zeros(0), np.zeros(0)
    if len(points):
        points = ground.closest(points).points
        there = Tree.of(after).closest(points).distance
    back, _ = sample_area(after.take(~np.asarray(skip_after)), SAMPLES)
    if len(back):
        here = ground.closest(back).distance
    return Deviation(spread(points, there, tolerance), spread(back, here, tolerance))
