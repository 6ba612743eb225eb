"""Eight small cases, one defect each, that mesh repair tools are compared on; on four shapes, at any size and place."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.samples.blade import blade
from patchwright.models.samples.cutting import cut, push_apart
from patchwright.models.samples.sample import Sample
from patchwright.models.samples.simple import CUBE_FACES, cube, ellipsoid, sphere, torus
from patchwright.models.samples.soup import duplicated, flipped
from patchwright.models.samples.splitting import t_junctions
from patchwright.models.samples.truth import united
from patchwright.models.triangulation import Triangulation, concatenate

GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)  # its multiples spread evenly: other seeds cut elsewhere and move elsewhere
SHAPES: dict[str, tuple[Callable[..., Sample], int]] = {
    "sphere": (sphere, 2),
    "ellipsoid": (ellipsoid, 0),
    "torus": (torus, 0),
    "blade": (partial(blade, closed=True), 1),
}
"""Per shape how it is made and the axis across which it is cut."""


class DefectCase(NamedTuple):
    """A defective triangulation and what a repair should give back."""

    triangulation: Triangulation
    volume: float
    """that the undamaged triangulation encloses"""
    closed: bool
    """whether no edge is free once corners at the same place are merged"""
    kept: Triangulation
    """the undamaged part of the surface, which should come back where it is"""
    euler: int
    """Euler characteristic of the repaired surface, which is one component"""


def eight_defects(
    shape: str = "sphere", *, size: float = 1.0, place: npt.ArrayLike = (0.0, 0.0, 0.0), seed: int = 0
) -> dict[str, DefectCase]:
    """The cases by name.

    gap1, gap5, gap10 : the shape cut in two, the halves 1, 5, 10 % of its extent apart
    overlap5 : the halves pushed into each other by 5 % of the extent
    tjunc : one triangle in five split, its neighbour not; for "sphere" a unit cube whose faces are gridded 8, 8, 5, 5,
        3 and 3 cells wide and share no vertices
    selfx : the shape and a copy moved by half its extent, one soup
    missface : an end of 15 % of the extent cut off; for "sphere" a unit cube of 6 by 6 cells a face without its top
    flipdup : 40 % of the triangles flipped and 10 % doubled

    Parameters
    ----------
    shape : "sphere" (unit radius), "ellipsoid", "torus" or "blade"
    size, place : factor on all lengths, and the vector the scaled shape is moved by
    seed : picks the triangles; other seeds than 0 also cut beside the middle and move the copy another way

    Raises
    ------
    ParameterError : a shape without a name here.
    """
    if shape not in SHAPES:
        raise ParameterError(f"the shape must be one of {', '.join(SHAPES)}, got {shape!r}")
    make, axis = SHAPES[shape]
    whole = _bare(make(cells=48).assembly.triangulation if shape == "sphere" else make().assembly.triangulation)
    n = np.eye(3)[axis]
    extent = float(np.ptp(whole.bounds[:, axis]))
    aside = 0.2 * ((seed * GOLDEN + 0.5) % 1.0 - 0.5)  # of the extent
    middle = whole.bounds.mean(axis=0) + aside * extent * n
    cases = {}
    for percent in (1, 5, 10):
        cases[f"gap{percent}"] = _gap(whole, middle, n, percent / 100.0 * extent)
    cases["overlap5"] = _overlap(whole, middle, n, 0.05 * extent)
    cases["tjunc"] = _split(whole, seed) if shape != "sphere" else _unlike_faces()
    turn = 2.0 * np.pi * seed * GOLDEN
    across = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ np.array([0.015, 0.01])
    move = extent * np.insert(across, axis, 0.5) if shape != "sphere" else np.array([1.0, *(extent * across)])
    cases["selfx"] = _twice(whole, move)
    cases["missface"] = _end_off(whole, n, axis, extent) if shape != "sphere" else _lidless()
    small = whole if shape != "sphere" else _bare(sphere(cells=24).assembly.triangulation)
    turned = duplicated(flipped(small, 0.4, seed=seed).triangulation, 0.1, seed=seed + 1).triangulation
    cases["flipdup"] = DefectCase(turned, small.volume, True, small, _euler(small))
    return {name: _scaled(case, size, np.asarray(place, dtype=np.float64)) for name, case in cases.items()}


def _bare(triangulation: Triangulation) -> Triangulation:
    return Triangulation(triangulation.vertices, triangulation.triangles)


def _scaled(case: DefectCase, size: float, place: Array) -> DefectCase:
    def placed(triangulation: Triangulation) -> Triangulation:
        return Triangulation(size * triangulation.vertices + place, triangulation.triangles)

    return case._replace(triangulation=placed(case.triangulation), volume=size**3 * case.volume, kept=placed(case.kept))


def _gap(whole: Triangulation, middle: Array, n: Array, width: float) -> DefectCase:
    apart = push_apart(whole, middle, n, width).triangulation
    return DefectCase(apart, whole.volume + width * _section(whole, middle, n), False, apart, _euler(whole))


def _overlap(whole: Triangulation, middle: Array, n: Array, depth: float) -> DefectCase:
    """The truth encloses what is left without the slab that both halves claim; there, nothing is undamaged."""
    pieces, volume = [], 0.0
    for side in (1.0, -1.0):
        at = middle + side * 0.5 * depth * n
        step = cut(whole, at, n)
        outer = step.triangulation.take(step.side * side > 0)
        local = outer.corners - at  # seen from a point of the cut, its plane adds nothing
        volume += float(np.einsum("ij,ij->", local[:, 0], np.cross(local[:, 1], local[:, 2]))) / 6.0
        beyond = cut(outer, middle + side * depth * n, n)
        clear = beyond.triangulation.take(beyond.side * side > 0).compact()
        pieces.append(Triangulation(clear.vertices - side * 0.5 * depth * n, clear.triangles))
    together = push_apart(whole, middle, n, -depth).triangulation
    return DefectCase(together, volume, False, concatenate(pieces), _euler(whole))


def _section(whole: Triangulation, point: Array, n: Array) -> float:
    """Area of a closed surface's section: what the areas in front of the plane do not balance."""
    step = cut(whole, point, n)
    return float(abs(step.triangulation.area_vectors[step.side > 0].sum(axis=0) @ n))


def _split(whole: Triangulation, seed: int) -> DefectCase:
    return DefectCase(t_junctions(whole, 0.2, seed=seed).triangulation, whole.volume, False, whole, _euler(whole))


def _unlike_faces() -> DefectCase:
    return DefectCase(_faces((8, 8, 5, 5, 3, 3)), 1.0, False, _bare(cube().assembly.triangulation), 2)


def _lidless() -> DefectCase:
    return DefectCase(_faces((6, 0, 6, 6, 6, 6)), 1.0, False, _faces((6, 0, 6, 6, 6, 6)), 2)


def _twice(whole: Triangulation, move: Array) -> DefectCase:
    both = (whole, Triangulation(whole.vertices + move, whole.triangles))
    union = united(both).triangulation
    return DefectCase(concatenate(list(both)), union.volume, True, union, _euler(union))


def _end_off(whole: Triangulation, n: Array, axis: int, extent: float) -> DefectCase:
    at = whole.bounds.mean(axis=0) + 0.35 * extent * n
    step = cut(whole, at, n)
    rest = step.triangulation.take(step.side < 0).compact()
    local = rest.corners - at
    volume = float(np.einsum("ij,ij->", local[:, 0], np.cross(local[:, 1], local[:, 2]))) / 6.0
    rims = Adjacency.of(rest).boundary_loops()
    edges = len(Adjacency.of(rest).edges)
    return DefectCase(rest, volume, False, rest, len(rest.vertices) - edges + len(rest) + len(rims))


def _euler(closed: Triangulation) -> int:
    """Vertices - edges + triangles of a closed surface whose vertices are shared: three edges for two triangles."""
    return len(np.unique(closed.triangles)) - len(closed) // 2


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
