"""Eight small cases, one defect each, that mesh repair tools are compared on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from patchwright.models.samples.cutting import push_apart
from patchwright.models.samples.simple import CUBE_FACES, sphere, two_spheres
from patchwright.models.samples.soup import duplicated, flipped
from patchwright.models.triangulation import Triangulation, concatenate


class DefectCase(NamedTuple):
    """A defective triangulation and what a repair should enclose."""

    triangulation: Triangulation
    volume: float
    """of the repaired shape; of the smooth one where the case is made of spheres"""
    closed: bool
    """whether no edge is free once corners at the same place are merged"""


def eight_defects(*, seed: int = 0) -> dict[str, DefectCase]:
    """The cases by name.

    gap1, gap5, gap10 : two unit hemispheres, the distance between their rims 1, 5, 10 % of the diameter
    overlap5 : the hemispheres pushed into each other by 5 % of the diameter
    tjunc : a unit cube whose faces are gridded 8, 8, 5, 5, 3 and 3 cells wide and share no vertices
    selfx : two unit spheres about one radius apart
    missface : a unit cube of 6 by 6 cells a face, the top face missing
    flipdup : a sphere with 40 % of its triangles flipped and 10 % doubled
    """
    ball = sphere(cells=48).assembly.triangulation
    whole = 4.0 / 3.0 * np.pi
    cases = {}
    for percent in (1, 5, 10):
        gap = 2.0 * percent / 100.0
        apart = push_apart(ball, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), gap).triangulation
        cases[f"gap{percent}"] = DefectCase(apart, whole + np.pi * gap, False)
    together = push_apart(ball, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), -0.1).triangulation
    cap = 2.0 * np.pi * (0.05 - 0.05**3 / 3.0)  # the slice |z| < 0.05 of the ball, which the overlap takes away
    cases["overlap5"] = DefectCase(together, whole - cap, False)
    cases["tjunc"] = DefectCase(_faces((8, 8, 5, 5, 3, 3)), 1.0, False)
    moved = np.array([1.0, 0.03, 0.02])
    crossing = concatenate([ball, Triangulation(ball.vertices + moved, ball.triangles)])
    cases["selfx"] = DefectCase(crossing, two_spheres(float(np.linalg.norm(moved))).truth.volume, True)
    cases["missface"] = DefectCase(_faces((6, 0, 6, 6, 6, 6)), 1.0, False)
    small = sphere(cells=24).assembly.triangulation
    turned = flipped(small, 0.4, seed=seed).triangulation
    cases["flipdup"] = DefectCase(duplicated(turned, 0.1, seed=seed + 1).triangulation, small.volume, True)
    return cases


def _faces(cells: tuple[int, ...]) -> Triangulation:
    """The unit cube's faces, each with its own vertices and its own number of cells; none for 0."""
    parts = []
    for n, (corner, along_u, along_v) in zip(cells, CUBE_FACES.values(), strict=True):
        if not n:
            continue
        t = np.linspace(0.0, 1.0, n + 1)
        u, v = np.meshgrid(t, t, indexing="ij")
        points = np.array(corner) + u[..., None] * np.array(along_u) + v[..., None] * np.array(along_v)
        index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
        a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
        triangles = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2)
        parts.append(Triangulation(points.reshape(-1, 3), triangles.reshape(-1, 3)))
    return concatenate(parts)
