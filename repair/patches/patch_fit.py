"""Coons grid -> projection -> filling -> bicubic least squares, for all patches of one size at once.

Source: Hamann, Jean, Razdan, section 3. Departure: inside a block the approximant is the C2 least-squares bicubic with
few knots (a ninth of the control points of the paper's C1 form); its four boundary rows are the shared edge curves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.ground.true_surface import Outcome
from patchwright.repair.patches.coons import coons_grid, offset_distance, offset_normals
from patchwright.repair.patches.fair_fit import fit_patches
from patchwright.repair.patches.filling import FillStatus, fill
from patchwright.repair.patches.projection import Ground, project
from patchwright.repair.patches.spline_space import uniform_collocation

SAMPLES_PER_CELL = 4
FEWEST_SAMPLES = 8


def samples_for(cells: int) -> int:
    """Grid intervals along a side of `cells` pieces."""
    return max(FEWEST_SAMPLES, SAMPLES_PER_CELL * cells)


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """The surface patches are projected onto.

    `tree` spans the mended triangulation, as a `TrueGround` where the true surfaces behind it are known; `invented`
    (t,) says which of its triangles gap filling made: they bound the body but carry no data, so a hit on one is a miss.
    `region` (t,) labels the triangles: a patch only takes hits of the label its border lies on; None takes any. The
    label to give is the connected piece: sheets that face the same way behind one another are then told apart, which
    neither facing nor thickness does.
    """

    tree: Ground
    invented: BoolArray
    region: IntArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class FittedGroup:
    """Patches of one size.

    `nets` (k, M + 3, N + 3, 3); `grid` (k, m + 1, n + 1, 3) the points they approximate; `data` (k, m + 1, n + 1)
    where the input has surface there, found or missed, and not gap filling; `status` one per patch; `outcomes` (5,) how
    many of the inner points that hit data ended in each `Outcome` (without true surfaces all are NO_SURFACE).
    """

    nets: Array
    grid: Array
    data: BoolArray
    status: tuple[FillStatus, ...]
    outcomes: IntArray


def fit_group(
    rows: tuple[Array, Array, Array, Array],
    cells: tuple[int, int],
    target: Target,
    *,
    method: str = "smooth",
    noise: float = 0.0,
) -> FittedGroup:
    """Fit the patches whose boundary control rows (south, north, west, east) are given."""
    south, north, west, east = rows
    m, n = samples_for(cells[0]), samples_for(cells[1])
    along_u, along_v = uniform_collocation(cells[0], m + 1), uniform_collocation(cells[1], n + 1)
    coons = coons_grid(along_u @ south, along_u @ north, along_v @ west, along_v @ east)
    normal = offset_normals(coons)
    k = len(coons)
    distance = np.broadcast_to(offset_distance(coons)[:, None, None], coons.shape[:3])
    inner = np.zeros(coons.shape[:3], dtype=bool)
    inner[:, 1:-1, 1:-1] = True
    given = np.asarray(~inner)
    border = target.tree.closest(coons[given]).triangle
    on_data = ~target.invented[border]
    allowed = None
    if target.region is not None:
        patch = np.broadcast_to(np.arange(k)[:, None, None], inner.shape)
        allowed = _most_frequent(patch[given], target.region[border], k)[patch[inner]]
    hits = project(coons[inner], normal[inner], distance[inner], target.tree, region=target.region, allowed=allowed)
    known = hits.hit & ~target.invented[hits.triangle]
    offset = np.zeros(coons.shape[:3])
    found = given.copy()  # the boundary curves are given, wherever they run
    found[inner] = known
    offset[inner] = (1.0 - 2.0 * hits.t) * distance[inner]  # signed height of p above the Coons patch
    data = found.copy()
    data[given] = on_data
    # no data under the whole patch: its guide is the bridging surface itself
    bare = np.asarray(~found[:, 1:-1, 1:-1].any(axis=(1, 2)))
    guided = inner & bare[:, None, None]
    guided[inner] &= hits.hit
    status = []
    for i in range(k):
        if bare[i]:
            status.append(FillStatus.NONE_FOUND)
            continue
        offset[i], one = fill(offset[i], found[i], method=method, noise=noise)
        status.append(one)
    offset[bare[:, None, None] & ~guided] = 0.0
    grid = coons + offset[..., None] * normal  # HJR 10 and 13
    missed = ~found
    if missed.any():
        # a ray may miss surface that is there: only what lies over gap filling is invented, the rest is judged as data
        data[missed] = ~target.invented[target.tree.closest(grid[missed]).triangle]
    outcomes = np.bincount(hits.outcome[known], minlength=len(Outcome))
    return FittedGroup(_least_squares(rows, grid, cells), grid, data, tuple(status), outcomes)


def _most_frequent(group: IntArray, label: IntArray, count: int) -> IntArray:
    """(count,) the label most often met in each group, the lowest of equals, -1 for an empty group."""
    width = int(label.max(initial=0)) + 1
    keys, times = np.unique(group * width + label, return_counts=True)
    order = np.lexsort((-keys, times))  # the last one written wins: most often met, lowest label
    out = np.full(count, -1, dtype=np.int64)
    out[keys[order] // width] = keys[order] % width
    return out


def _least_squares(rows: tuple[Array, Array, Array, Array], grid: Array, cells: tuple[int, int]) -> Array:
    """Interior control points by fair least squares, the boundary rows held."""
    south, north, west, east = rows
    nets = np.zeros((len(grid), cells[0] + 3, cells[1] + 3, 3))
    nets[:, :, 0], nets[:, :, -1] = south, north
    nets[:, 0], nets[:, -1] = west, east
    return fit_patches(nets, grid)
