"""Deviation region by region: how far each named part of the input lies from the output, and the other way round."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.tolerance import Tolerance
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.deviation import SAMPLES, Spread, sample_area, spread

MOST = 500  # parts that are told one by one, the largest first


@dataclass(frozen=True, slots=True)
class Region:
    """One named part: the share of the input's area and both distances, invented surface included in the latter.

    A part that is only in the output has no `input_to_output`, one that is gone no `output_to_input`.
    """

    name: str
    area: float
    input_to_output: Spread | None
    output_to_input: Spread | None


def regions(before: Triangulation, after: Triangulation, limits: Tolerance) -> tuple[Region, ...]:
    """The deviation of every named part, largest parts first.

    Parameters
    ----------
    before, after : input and output, tagged by part name
    limits : the fit tolerances coverage is counted against
    """
    there = _by_name(before, Tree.of(after))
    back = _by_name(after, Tree.of(before))
    areas = _areas(before)
    names = sorted({*there, *back}, key=lambda name: -areas.get(name, 0.0))[:MOST]
    own = dict(limits.parts)

    def figures(found: dict[str, tuple[Array, Array]], name: str) -> Spread | None:
        return spread(*found[name], own.get(name, limits.fit)) if name in found else None

    return tuple(Region(name, areas.get(name, 0.0), figures(there, name), figures(back, name)) for name in names)


def _by_name(mesh: Triangulation, other: Tree) -> dict[str, tuple[Array, Array]]:
    """Points spread by area and their distances, by the name of the part they lie in."""
    if not len(mesh):
        return {}
    points, triangle = sample_area(mesh, SAMPLES)
    if not len(points):
        return {}
    distance = other.closest(points).distance
    tags, names = _tags(mesh)
    of = tags[triangle]
    return {names[k]: (points[of == k], distance[of == k]) for k in np.unique(of)}


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
