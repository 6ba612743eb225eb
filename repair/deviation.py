"""Two-sided distance between what came in and what goes out, by part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation

SAMPLES = 60_000


@dataclass(frozen=True, slots=True)
class Spread:
    """Area-weighted figures of a set of distances, model units.

    `coverage` is the share within the tolerance of its part, `tolerance` the widest of those.
    """

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


def spread(points: Array, distances: Array, tolerance: float | Array) -> Spread:
    """Figures of equally weighted distances (n,) measured at points (n, 3); zeros when there are none.

    `tolerance` is a length, or one for each distance.
    """
    if not len(distances):
        return Spread(0.0, 0.0, 0.0, (0.0, 0.0, 0.0), 1.0, float(np.max(tolerance, initial=0.0)))
    worst = int(np.argmax(distances))
    x, y, z = points[worst].tolist()
    median, p99 = np.percentile(distances, [50.0, 99.0])
    return Spread(
        float(median), float(p99), float(distances[worst]), (x, y, z), float((distances <= tolerance).mean()),
        float(np.max(tolerance)),
    )  # fmt: skip


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


def sampled_limits(
    tolerance: float | tuple[Array, Array], side: int, kept: BoolArray, triangle: IntArray
) -> float | Array:
    """What counts as within tolerance at samples: `triangle` (n,) numbers the `kept` ones of one of two meshes.

    `tolerance` is a length, or one for each triangle of the meshes before (side 0) and after (side 1).
    """
    return np.asarray(tolerance[side][kept][triangle]) if isinstance(tolerance, tuple) else tolerance


def two_sided(
    before: Triangulation,
    after: Triangulation,
    tolerance: float | tuple[Array, Array],
    *,
    skip_before: BoolArray | None = None,
    skip_after: BoolArray | None = None,
    before_tree: Tree | None = None,
    hidden: Callable[[Array], BoolArray] | None = None,
) -> Deviation:
    """Distances between two triangulations.

    Parameters
    ----------
    tolerance : the length coverage is counted against, or one for each triangle of both
    skip_before, skip_after : (m,) bool, triangles no distance is taken *from* (invented surface)
    hidden : tells which points (n, 3) of `before` no distance is taken from (what was meant to go)
    """

    def one_way(source: Triangulation, skip: BoolArray | None, tree: Tree, side: int) -> Spread:
        kept = np.ones(len(source), dtype=bool) if skip is None else ~np.asarray(skip, dtype=bool)
        points, triangle = sample_area(source.take(kept), SAMPLES)
        if hidden is not None and side == 0:
            seen = ~hidden(points)
            points, triangle = points[seen], triangle[seen]
        own = sampled_limits(tolerance, side, kept, triangle)
        return spread(points, tree.closest(points).distance if len(points) else np.zeros(0), own)

    return Deviation(
        one_way(before, skip_before, Tree.of(after), 0),
        one_way(after, skip_after, before_tree or Tree.of(before), 1),
    )
