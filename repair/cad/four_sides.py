"""A ring that has not four corners, filled by one four-sided patch all the same: which of its points are the corners.

With two corners or fewer, sides are cut in their middles. With more than four, and where patches about a centre fold
(a corner that opens by more than a straight angle), four of the corners are taken and the others lie within sides: the
patch has a crease from each of them. Taken are corners of near a right angle that leave the straightest and most even
sides.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.topology import Topology
from patchwright.repair.cad.coons_ring import coons_ring
from patchwright.repair.cad.draft import Limits
from patchwright.repair.cad.ring_patch import newell, points_along
from patchwright.repair.cad.ring_sides import Normals, Steps, ends_of, side_curve, sides
from patchwright.repair.cad.split_ring import SplitRing, halved

MOST = 16  # corners among which four are chosen
TRIED = 6  # choices
LEAST = 20.0  # degrees a ring turns, to the left, at a corner that is taken
RIGHT = 90.0  # degrees


def four_sided(
    topology: Topology, ring: Steps, normals_of: Callable[[Topology], Normals], limits: Limits
) -> SplitRing | str:
    """One patch over a ring that runs counter-clockwise as seen from outside; a sentence where none holds."""
    around = sides(topology, ring)
    outward = newell(np.concatenate([points_along(topology, step) for step in ring]))
    if not np.linalg.norm(outward):
        return "its edges enclose no area"
    outward = outward / np.linalg.norm(outward)
    if len(around) <= 2:
        topology, around = _cut(topology, around, limits)
        choices = [around]
    elif len(around) > 4:
        choices = _choices(topology, around, outward, limits)
    else:
        return f"its ring has {len(around)} corners"
    why = "no four of its corners make a four-sided patch"
    for choice in choices:
        made = coons_ring(
            topology, [side_curve(topology, side, limits) for side in choice], normals_of(topology), limits, outward
        )
        if not isinstance(made, str):
            return SplitRing(topology, (made,))
        why = f"with four of its points for corners {made}"
    return why


def _cut(topology: Topology, around: list[Steps], limits: Limits) -> tuple[Topology, list[Steps]]:
    """Each side in the middle, until there are four."""
    while len(around) < 4:
        parts: list[Steps] = []
        for side in around:
            topology, first, second = halved(topology, side, limits)
            parts += [first, second]
        around = parts
    return topology, around


def _choices(topology: Topology, around: list[Steps], outward: Array, limits: Limits) -> list[list[Steps]]:
    """The best ways to take four corners, the best one first, each as four sides."""
    count = len(around)
    if count > MOST:
        return []
    ends = [(ends_of(topology, side[0])[0], ends_of(topology, side[-1])[1]) for side in around]
    turn = np.array([_turn(ends[k - 1][1], ends[k][0], outward) for k in range(count)])  # where side k begins
    length = np.array([_length(topology, side) for side in around])
    rated = []
    for four in combinations(np.flatnonzero(turn >= LEAST).tolist(), 4):
        pairs = list(zip(four, [*four[1:], four[0] + count], strict=True))
        total = np.array([length[np.arange(a, b) % count].sum() for a, b in pairs])
        inner = np.delete(turn, list(four))
        uneven = np.log(total[:2] / total[2:])
        cost = float(((turn[list(four)] - RIGHT) ** 2).sum() + (inner**2).sum()) / RIGHT**2 + float((uneven**2).sum())
        rated.append((cost, pairs))
    rated.sort(key=lambda one: one[0])
    return [
        [tuple(step for k in range(a, b) for step in around[k % count]) for a, b in pairs] for _, pairs in rated[:TRIED]
    ]


def _turn(a: Array, b: Array, outward: Array) -> float:
    """Degrees from one direction to the other, positive to the left as seen from outside."""
    across = np.cross(a, b)
    angle = float(np.degrees(np.arctan2(np.linalg.norm(across), a @ b)))
    return angle if float(across @ outward) >= 0.0 else -angle


def _length(topology: Topology, side: Steps) -> float:
    points = np.concatenate([points_along(topology, step) for step in side])
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
