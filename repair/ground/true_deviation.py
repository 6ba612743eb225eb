"""Two-sided distance between fitted patches and the true surfaces behind a CAD tessellation."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.deviation import SAMPLES, Deviation, sample_area, sampled_limits, spread
from patchwright.repair.ground.true_ground import TrueGround


def true_deviation(
    ground: TrueGround,
    after: Triangulation,
    tolerance: float | tuple[Array, Array],
    skip_before: BoolArray,
    skip_after: BoolArray,
) -> Deviation:
    """Distances to and from the true surfaces; samples whose surface is not reached count from their triangle.

    Parameters
    ----------
    after : the patches' tessellation
    tolerance : the length coverage is counted against, or one for each triangle of the ground and of `after`
    skip_before, skip_after : triangles (invented surface) no distance is taken from
    """
    kept_before, kept_after = ~np.asarray(skip_before), ~np.asarray(skip_after)
    points, before = sample_area(ground.triangulation.take(kept_before), SAMPLES)
    there, here = np.zeros(0), np.zeros(0)
    if len(points):
        points = ground.closest(points).points
        there = Tree.of(after).closest(points).distance
    back, behind = sample_area(after.take(kept_after), SAMPLES)
    if len(back):
        here = ground.closest(back).distance
    return Deviation(
        spread(points, there, sampled_limits(tolerance, 0, kept_before, before)),
        spread(back, here, sampled_limits(tolerance, 1, kept_after, behind)),
    )
