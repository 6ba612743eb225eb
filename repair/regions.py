"""Deviation region by region: how far each named part of the input lies from the output, and the other way round."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.tolerance import Tolerance
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.models.winding import winding_number
from patchwright.repair.deviation import SAMPLES, Spread, sample_area, spread

MOST = 500  # parts that are told one by one, the largest first


@dataclass(frozen=True, slots=True)
class Region:
    """One named part: its area and both distances, invented surface included in the latter.

    `enclosed` is the share of it that lies inside other parts and is gone from the output, as it should; no distance is
    taken from there. A part that is only in the output, or enclosed altogether, has no `input_to_output`, one that is
    gone no `output_to_input`.
    """

    name: str
    area: float
    enclosed: float
    input_to_output: Spread | None
    output_to_input: Spread | None


def regions(before: Triangulation, after: Triangulation, limits: Tolerance) -> tuple[Region, ...]:
    """The deviation of every named part, largest parts first.

    Parameters
    ----------
    before, after : input and output, tagged by part name
    limits : the fit tolerances coverage is counted against
    """
    there, enclosed = _seen(before, after, limits)
    back = _by_name(after, *_distances(after, before)[:3])
    areas = _areas(before)
    names = sorted({*there, *back, *enclosed}, key=lambda name: -areas.get(name, 0.0))[:MOST]
    own = dict(limits.parts)

    def figures(found: dict[str, tuple[Array, Array]], name: str) -> Spread | None:
        return spread(*found[name], own.get(name, limits.fit)) if name in found else None

    return tuple(
        Region(name, areas.get(name, 0.0), enclosed.get(name, 0.0), figures(there, name), figures(back, name))
        for name in names
    )


Figures = dict[str, tuple[Array, Array]]  # points and distances by the name of the part


def _seen(before: Triangulation, after: Triangulation, limits: Tolerance) -> tuple[Figures, dict[str, float]]:
    """Points of the input and their distances without those inside other parts, and the share of those, by name.

    A point far from the output lies inside another part where the whole input winds round both of its sides.
    """
    points, triangle, distance = _distances(before, after)
    hidden = np.zeros(len(points), dtype=bool)
    far = np.flatnonzero(distance > limits.fit)
    if len(far):
        aside = limits.fit * before.normals[triangle[far]]
        sides = [np.abs(winding_number(before, points[far] + step)) for step in (aside, -aside)]
        hidden[far] = np.minimum(*sides) > 0.5
    gone = {name: float(own[1].mean()) for name, own in _by_name(before, points, triangle, hidden).items()}
    kept = ~hidden
    return _by_name(before, points[kept], triangle[kept], distance[kept]), gone


def _distances(mesh: Triangulation, other: Triangulation) -> tuple[Array, IntArray, Array]:
    """Points spread by area, their triangles and distances."""
    if not len(mesh):
        return np.zeros((0, 3)), np.zeros(0, dtype=np.int64), np.zeros(0)
    points, triangle = sample_area(mesh, SAMPLES)
    distance = Tree.of(other).closest(points).distance if len(points) else np.zeros(0)
    return points, triangle, distance


def _by_name(mesh: Triangulation, points: Array, triangle: IntArray, values: Array) -> Figures:
    """Points and their values by the name of the part they lie in."""
    if not len(points):
        return {}
    tags, names = _tags(mesh)
    of = tags[triangle]
    return {names[k]: (points[of == k], values[of == k]) for k in np.unique(of)}


def _areas(mesh: Triangulation) -> dict[str, float]:
    if not len(mesh):
        return {}
    tags, names = _tags(mesh)
    return {name: float(a) for name, a in zip(names, np.bincount(tags, mesh.areas, minlength=len(names)), strict=True)}


def _tags(mesh: Triangulation) -> tuple[IntArray, tuple[str, ...]]:
    if mesh.tags is None or not mesh.tag_names:
        return np.zeros(len(mesh), dtype=np.int64), ("",)
    # parts of one name are one region
    names = tuple(dict.fromkeys(mesh.tag_names))
    return np.array([names.index(name) for name in mesh.tag_names], dtype=np.int64)[mesh.tags], names
