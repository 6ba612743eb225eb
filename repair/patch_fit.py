"""Coons grid -> projection -> filling -> bicubic least squares, for all patches of one size at once.

Source: Hamann, Jean, Razdan, section 3. Departure: inside a block the approximant is the C2 least-squares bicubic with
few knots (a ninth of the control points of the paper's C1 form); its four boundary rows are the shared edge curves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.models.tree import Tree
from patchwright.repair.coons import coons_grid, offset_distance, offset_normals
from patchwright.repair.filling import FillStatus, fill
from patchwright.repair.patch_nets import evaluate
from patchwright.repair.projection import project
from patchwright.repair.spline_space import interior_fit, uniform_collocation

SAMPLES_PER_CELL = 4
FEWEST_SAMPLES = 8


def samples_for(cells: int) -> int:
    """Grid intervals along a side of `cells` pieces."""
    return max(FEWEST_SAMPLES, SAMPLES_PER_CELL * cells)


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """The surface patches are projected onto.

    `tree` spans the mended triangulation; `invented` (t,) says which of its triangles gap filling made: they bound the
    body but carry no data, so a hit on one is a miss.
    """

    tree: Tree
    invented: BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class FittedGroup:
    """Patches of one size.

    `nets` (k, M + 3, N + 3, 3); `grid` (k, m + 1, n + 1, 3) the points they approximate; `data` (k, m + 1, n + 1)
    where those came from the input and not from gap filling; `status` one per patch.
    """

    nets: Array
    grid: Array
    data: BoolArray
    status: tuple[FillStatus, ...]


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
    hits = project(coons[inner], normal[inner], distance[inner], target.tree)
    known = hits.hit & ~target.invented[hits.triangle]
    offset = np.zeros(coons.shape[:3])
    given = np.ones(coons.shape[:3], dtype=np.bool_)
    given[:, 1:-1, 1:-1] = False
    found = given.copy()  # the boundary curves are given, wherever they run
    found[inner] = known
    offset[inner] = (1.0 - 2.0 * hits.t) * distance[inner]  # signed height of p above the Coons patch
    data = found.copy()
    data[given] = ~target.invented[target.tree.closest(coons[given]).triangle]
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
    return FittedGroup(_least_squares(rows, grid, cells), grid, data, tuple(status))


def _least_squares(rows: tuple[Array, Array, Array, Array], grid: Array, cells: tuple[int, int]) -> Array:
    """Interior control points by tensor-product least squares, the boundary rows held."""
    south, north, west, east = rows
    nets = np.zeros((len(grid), cells[0] + 3, cells[1] + 3, 3))
    nets[:, :, 0], nets[:, :, -1] = south, north
    nets[:, 0], nets[:, -1] = west, east
    m, n = grid.shape[1] - 1, grid.shape[2] - 1
    held = evaluate(nets, uniform_collocation(cells[0], m + 1), uniform_collocation(cells[1], n + 1))
    rest = (grid - held)[:, 1:-1, 1:-1]
    nets[:, 1:-1, 1:-1] = evaluate(rest, interior_fit(cells[0], m + 1), interior_fit(cells[1], n + 1))
    return nets
