"""Two-sided distance between what came in and what goes out, by part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation

SAMPLES = 60_000


@dataclass(frozen=True, slots=True)
class Spread:
    """Area-weighted figures of a set of distances, model units; `coverage` is the share within `tolerance`."""

    median: float
    p99: float
    largest: float
    where: tuple[float, float, float]
    coverage: float
    tolerance: float


@dataclass(frozen=True, slots=True)
class Deviation:
    """Input to output and output to input; invented surface is left out of the latter, it has nothing to be near to."""

    input_to_output: Spread
    output_to_input: Spread

    @property
    def coverage(self) -> float:
        """The lesser of both coverages."""
        return min(self.input_to_output.coverage, self.output_to_input.coverage)


def spread(points: Array, distances: Array, tolerance: float) -> Spread:
    """Figures of equally weighted distances (n,) measured at points (n, 3); zeros when there are none."""
    if not len(distances):
        return Spread(0.0, 0.0, 0.0, (0.0, 0.0, 0.0), 1.0, tolerance)
    worst = int(np.argmax(distances))
    x, y, z = points[worst].tolist()
    median, p99 = np.percentile(distances, [50.0, 99.0])
    return Spread(
        float(median), float(p99), float(distances[worst]), (x, y, z), float((distances <= tolerance).mean()), tolerance
    )


def sample_area(triangulation: Triangulation, count: int, seed: int = 0) -> tuple[Array, IntArray]:
    """`count` points spread evenly by area: (n, 3) points and (n,) their triangles (stratified, reproducible)."""
    areas = triangulation.areas
    total = np.cumsum(areas)
    if not len(total) or total[-1] == 0.0:
        return np.zeros((0, 3)), np.zeros(0, dtype=np.int64)
    rng = np.random.default_rng(seed)
    triangle = np.searchsorted(total, (np.arange(count) + rng.random(count)) / count * total[-1], side="right")
    triangle = np.minimum(triangle, len(areas) - 1)
    r, s = np.sqrt(rng.random(count)), rng.random(count)
    weight = np.stack([1 - r, r * (1 - s), r * s], axis=1)
    return np.einsum("ij,ijk->ik", weight, triangulation.corners[triangle]), triangle


def two_sided(
    before: Triangulation,
    after: Triangulation,
    tolerance: float,
    *,
    skip_before: BoolArray | None = None,
    skip_after: BoolArray | None = None,
    before_tree: Tree | None = None,
) -> Deviation:
    """Distances between two triangulations.

    Parameters
    ----------
    tolerance : the length coverage is counted against
    skip_before, skip_after : (m,) bool, triangles no distance is taken *from* (invented surface)
    """

    def one_way(source: Triangulation, skip: BoolArray | None, tree: Tree) -> Spread:
        kept = source if skip is None else source.take(~np.asarray(skip, dtype=bool))
        points, _ = sample_area(kept, SAMPLES)
        return spread(points, tree.closest(points).distance if len(points) else np.zeros(0), tolerance)

    return Deviation(
        one_way(before, skip_before, Tree.of(after)),
        one_way(after, skip_after, before_tree or Tree.of(before)),
    )
