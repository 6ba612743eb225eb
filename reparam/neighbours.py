"""Which sides of several regions are one curve, and which of their parameters must therefore be one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.reparam.region import Region

SAMPLES = 17
SAME = 1e-6  # of the size: sides this near are one
AXES = (0, 0, 1, 1)  # the parameter that runs along south, north, west, east
_ALL = slice(None)
BORDER: tuple[tuple[slice | int, slice | int], ...] = ((_ALL, 0), (_ALL, -1), (0, _ALL), (-1, _ALL))
"""Where south, north, west and east are in a grid."""


@dataclass(frozen=True, slots=True)
class SharedSide:
    """Side `second` of region `follower` is side `first` of region `leader`, run backwards where `against`."""

    leader: int
    first: int
    follower: int
    second: int
    against: bool


@dataclass(frozen=True, slots=True, eq=False)
class Neighbourhood:
    """Shared sides, and the direction every region uses along s and along t.

    `direction` (r, 2) numbers the directions, `backwards` (r, 2) says who runs through them the other way; `vertex`
    (r, 4) numbers the corners (south-west, south-east, north-west, north-east), `vertices` are their places.
    """

    shared: tuple[SharedSide, ...]
    direction: IntArray
    backwards: Array
    vertex: IntArray
    vertices: Array
    dropped: tuple[SharedSide, ...]
    """Shared sides that would have a direction run against itself, as round a Moebius strip: left alone."""


def neighbourhood(regions: Sequence[Region], gap: float) -> Neighbourhood:
    """Sides are shared where they agree within `gap` at equal arc shares, all along."""
    root = np.arange(2 * len(regions))
    parity = np.zeros(2 * len(regions), dtype=bool)
    shared, dropped = [], []
    for pair in _pairs(regions, gap):
        a, b = 2 * pair.leader + AXES[pair.first], 2 * pair.follower + AXES[pair.second]
        turned = bool(parity[a] ^ parity[b] ^ pair.against)
        if root[a] == root[b]:
            if turned:
                dropped.append(pair)
                continue
        else:
            group = root == root[b]
            root[group], parity[group] = root[a], parity[group] ^ turned
        shared.append(pair)
    direction = np.unique(root, return_inverse=True)[1].reshape(-1, 2)
    corners = np.stack([_corners(r) for r in regions]).reshape(-1, 3)
    vertex, vertices = _merged(corners, gap)
    return Neighbourhood(
        tuple(shared), direction, parity.reshape(-1, 2), vertex.reshape(-1, 4), vertices, tuple(dropped)
    )


def shared_within(regions: Sequence[Region], tolerance: float) -> float:
    """How near sides must be to count as one: round-off of the size, and no more than the tolerance."""
    return min(tolerance, SAME * max(r.size for r in regions))


def components(regions: Sequence[Region], tolerance: float) -> list[list[int]]:
    """The numbers of the regions that hang together by shared sides, group by group."""
    if not regions:
        return []
    group = np.arange(len(regions))
    for pair in _pairs(regions, shared_within(regions, tolerance)):
        group[group == group[pair.follower]] = group[pair.leader]
    return [np.flatnonzero(group == g).tolist() for g in np.unique(group)]


def _pairs(regions: Sequence[Region], gap: float) -> list[SharedSide]:
    """Every side but the first of each group of equal ones, with that first one."""
    x = np.linspace(0.0, 1.0, SAMPLES)
    keys = [(i, k) for i, r in enumerate(regions) for k in range(4) if not r.sides[k].is_pole]
    points = np.stack([regions[i].sides[k].points(x) for i, k in keys])
    taken = np.zeros(len(keys), dtype=bool)
    found = []
    for first, (i, k) in enumerate(keys):
        if taken[first]:
            continue
        for against in (False, True):
            mine = points[first, ::-1] if against else points[first]
            apart = np.linalg.norm(points[first + 1 :] - mine, axis=2).max(axis=1, initial=0.0)
            same = np.flatnonzero((apart <= gap) & ~taken[first + 1 :]) + first + 1
            taken[same] = True
            found += [SharedSide(i, k, *keys[j], against) for j in same.tolist()]
    return found


def _corners(region: Region) -> Array:
    """(4, 3) south-west, south-east, north-west, north-east."""
    ends = np.array([0.0, 1.0])
    south, north = (region.sides[k].points(ends) for k in (0, 1))
    if region.sides[0].is_pole or region.sides[1].is_pole:
        west, east = (region.sides[k].points(ends) for k in (2, 3))
        south, north = np.stack((west[0], east[0])), np.stack((west[1], east[1]))
    return np.concatenate((south, north))


def _merged(points: Array, gap: float) -> tuple[IntArray, Array]:
    """The number of each point's vertex, and the first point of each."""
    number = np.full(len(points), -1)
    places: list[Array] = []
    for k, point in enumerate(points):
        if number[k] < 0:
            near = (number < 0) & (np.linalg.norm(points - point, axis=1) <= gap)
            number[near] = len(places)
            places.append(point)
    return number, np.array(places)
