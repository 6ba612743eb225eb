"""Labelled damage: `Injected` says what was broken and where, `Damaged` holds the result, `damage` chains injectors.

An injector takes a `Triangulation`, its own parameters and a `seed`, and returns a `Damaged`. The kinds are those of a
diagnosis; a hole of missing triangles is a "gap".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, IntArray, frozen
from patchwright.models.assembly import Assembly, Part
from patchwright.models.triangulation import Triangulation


@dataclass(frozen=True, slots=True, eq=False)
class Injected:
    """One injected defect.

    Parameters
    ----------
    kind : a kind of `Diagnosis`
    where : (3,) the defect's centre
    box : (2, 3) its extent
    size : its length: a gap's width, a hole's diameter, a jitter's radius
    area : surface removed, doubled or turned; 0 where that has no meaning
    triangles : indices in the damaged triangulation of the triangles at fault; none where surface is missing
    points : (k, 3) the defect itself: the corners of what is missing or at fault, in no order
    """

    kind: str
    where: Array
    box: Array
    size: float
    area: float
    triangles: IntArray
    points: Array

    @classmethod
    def of(
        cls, kind: str, points: Array, *, size: float | None = None, area: float = 0.0, triangles: npt.ArrayLike = ()
    ) -> Injected:
        """A defect at `points`, centred in their box; its size is the box's diagonal unless given."""
        box = np.stack([points.min(axis=0), points.max(axis=0)])
        size = float(np.linalg.norm(box[1] - box[0])) if size is None else float(size)
        index = frozen(np.asarray(triangles, dtype=np.int64), np.int64)
        return cls(
            kind,
            frozen(box.mean(axis=0), np.float64),
            frozen(box, np.float64),
            size,
            float(area),
            index,
            frozen(points, np.float64),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Damaged:
    """A damaged triangulation, its labels, and the input triangle each triangle is a piece of (-1 for an added one)."""

    triangulation: Triangulation
    defects: tuple[Injected, ...]
    origin: IntArray

    @property
    def assembly(self) -> Assembly:
        """One part per tag, named."""
        return Assembly(tuple(Part(name, t) for name, t in by_tag(self.triangulation).items()))


class Injector(Protocol):
    """What `damage` chains; `functools.partial` binds an injector's own parameters."""

    def __call__(self, triangulation: Triangulation, /, *, seed: int) -> Damaged: ...


def damage(triangulation: Triangulation, injectors: Sequence[Injector], *, seed: int = 0) -> Damaged:
    """Apply injectors in order, each with a seed of its own; earlier labels follow their triangles."""
    seeds = np.random.SeedSequence(seed).generate_state(len(injectors))
    current = Damaged(triangulation, (), np.arange(len(triangulation)))
    for injector, own in zip(injectors, seeds, strict=True):
        step = injector(current.triangulation, seed=int(own))
        kept = tuple(_follow(defect, step.origin) for defect in current.defects)
        origin = np.where(step.origin < 0, -1, current.origin[step.origin])
        current = Damaged(step.triangulation, kept + step.defects, origin)
    return current


def _follow(defect: Injected, origin: IntArray) -> Injected:
    if not len(defect.triangles):
        return defect
    return replace(defect, triangles=frozen(np.flatnonzero(np.isin(origin, defect.triangles)), np.int64))


def by_tag(triangulation: Triangulation) -> dict[str, Triangulation]:
    """The triangles of each tag by its name, compact and without tags; all of them under "" when there are none."""
    if triangulation.tags is None:
        return {"": triangulation}
    out = {}
    for i, name in enumerate(triangulation.tag_names):
        piece = triangulation.take(triangulation.tags == i).compact()
        out[name] = Triangulation(piece.vertices, piece.triangles, uv=piece.uv)
    return out


def groups(triangulation: Triangulation, chosen: IntArray) -> list[IntArray]:
    """`chosen` triangles grouped by common edges; corners at the same place count as one."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    if not len(chosen):
        return []
    corners = triangulation.corners[chosen].reshape(-1, 3)
    _, same = np.unique(corners, axis=0, return_inverse=True)
    vertex = same.reshape(-1, 3)
    edges = np.sort(np.stack([vertex, np.roll(vertex, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    _, edge = np.unique(edges, axis=0, return_inverse=True)
    edge = edge.reshape(-1)
    owner = np.repeat(np.arange(len(chosen)), 3)
    order = np.argsort(edge, kind="stable")
    joined = edge[order][1:] == edge[order][:-1]
    a, b = owner[order][:-1][joined], owner[order][1:][joined]
    _, label = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(len(chosen),) * 2), directed=False)
    order = np.argsort(label, kind="stable")
    return np.split(chosen[order], np.flatnonzero(np.diff(label[order])) + 1)


def drawn(triangulation: Triangulation, share: float, seed: int) -> IntArray:
    """Sorted indices of a random `share` of the triangles."""
    count = round(share * len(triangulation))
    return np.sort(np.random.default_rng(seed).choice(len(triangulation), count, replace=False)).astype(np.int64)


def removed(triangulation: Triangulation, gone: IntArray, *, size: float | None = None) -> Damaged:
    """Without the triangles `gone`; one "gap" per group of them joined by edges, its area exactly what went."""
    keep = np.setdiff1d(np.arange(len(triangulation)), gone)
    areas, corners = triangulation.areas, triangulation.corners
    labels = [
        Injected.of("gap", corners[g].reshape(-1, 3), size=size, area=areas[g].sum())
        for g in groups(triangulation, gone)
    ]
    return Damaged(triangulation.take(keep), tuple(labels), keep)
