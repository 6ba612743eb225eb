"""Orientation: neighbouring triangles run their common edge opposite ways, and closed bodies face outward.

Each component (triangles connected through edges shared by two) is made consistent by walking over its neighbours.
Then the sign: a closed component gets positive volume. An open one that came consistent is left as it came; one that
came mixed takes the sign of the volume enclosed when every rim is closed by a fan, or, when that volume is next to
nothing (a sheet), the side most of its area already faces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import BoolArray, IntArray
from patchwright.models.triangulation import Triangulation

SOLID = 1e-2  # a component whose volume is below this share of area^(3/2) is a sheet


@dataclass(frozen=True, slots=True, eq=False)
class Oriented:
    """The same triangles in the same order, some of them reversed.

    Parameters
    ----------
    triangulation : consistently oriented, component by component
    flipped : (m,) which triangles were reversed
    components : (m,) int64 label of each triangle's component
    one_sided : (c,) which components cannot be oriented (Möbius bands); they are left as the walk found them
    """

    triangulation: Triangulation
    flipped: BoolArray
    components: IntArray
    one_sided: BoolArray


def orient(triangulation: Triangulation, adjacency: Adjacency | None = None) -> Oriented:
    """Reverse as few triangles as a consistent, outward orientation takes; `adjacency` of the same, where at hand."""
    from patchwright.repair.mender._orient_kernel import volumes, walk

    count = len(triangulation)
    if not count:
        empty = np.zeros(0, dtype=np.bool_)
        return Oriented(triangulation, empty, np.zeros(0, dtype=np.int64), empty)
    adjacency = Adjacency.of(triangulation) if adjacency is None else adjacency
    triangles = triangulation.triangles
    component, turn, bad = walk(triangles, adjacency.neighbours)
    parts = int(component.max()) + 1
    one_sided = np.bincount(component, weights=bad, minlength=parts) > 0
    areas = triangulation.areas
    turned_area = np.bincount(component, weights=areas * turn, minlength=parts)
    area = np.bincount(component, weights=areas, minlength=parts)
    mixed = (turned_area > 0.0) & (turned_area < area)
    rims = (adjacency.use_count != 2)[adjacency.triangle_edges]
    closed = np.bincount(component, weights=rims.any(axis=1), minlength=parts) == 0
    volume = volumes(triangulation.vertices, triangles, turn, component, parts, rims & ~closed[component, None])
    solid = np.abs(volume) > SOLID * area**1.5
    reverse = np.where(closed | (mixed & solid), volume < 0.0, turned_area > 0.5 * area)
    flipped = turn ^ reverse[component]
    if not flipped.any():
        return Oriented(triangulation, flipped, component, one_sided)
    result = np.where(flipped[:, None], triangles[:, ::-1], triangles)
    uv = triangulation.uv
    if uv is not None:
        uv = np.where(flipped[:, None, None], uv[:, ::-1], uv)
    return Oriented(replace(triangulation, triangles=result, uv=uv), flipped, component, one_sided)
