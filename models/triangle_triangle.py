"""Which triangles meet and which cross: exact tests of pairs, self-intersections, the stretches they share.

Two triangles *meet* when they have a point in common. They *cross* when they have more than a point in common and not
only border with border: one runs through the other, an edge of one lies in the face of the other, or they overlap
with area in one plane (a triangle and its duplicate do). Neighbours that share a corner or an edge, and triangles that
meet in a T-junction, therefore do not cross, however the vertices are numbered. All decisions are those of exact
arithmetic on the given coordinates. Triangles without area neither meet nor cross anything: find them beforehand.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.tree import Tree, shares_of, side_by_side
from patchwright.models.triangulation import Triangulation


def pairs_intersect(a: Triangulation, b: Triangulation, pairs: npt.ArrayLike, *, proper: bool = False) -> BoolArray:
    """Whether the triangles of each pair meet or, with `proper`, cross.

    Parameters
    ----------
    pairs : (k, 2) int, a triangle of `a` and one of `b`

    Returns
    -------
    (k,) bool

    Raises
    ------
    ParameterError : a pair names a triangle that does not exist.
    """
    from patchwright.models._triangle_triangle_kernel import meeting, with_area

    index = _checked(a, b, pairs)
    good = with_area(a.vertices, a.triangles)
    other = good if b is a else with_area(b.vertices, b.triangles)
    found: BoolArray = meeting(a.vertices, a.triangles, good, b.vertices, b.triangles, other, index, proper)
    return found


def self_intersections(triangulation: Triangulation, tree: Tree | None = None) -> IntArray:
    """(k, 2) pairs of triangles that cross, lower number first, in lexicographic order.

    Cost: linear in the pairs whose boxes touch, about ten per triangle of a surface.

    Parameters
    ----------
    tree : the triangulation's tree, if it is there already
    """
    from patchwright.models._triangle_triangle_kernel import meeting, with_area

    tree = Tree.of(triangulation) if tree is None else tree
    candidates = tree.touching()
    vertices, triangles = triangulation.vertices, triangulation.triangles
    good = with_area(vertices, triangles)
    test = partial(meeting, vertices, triangles, good, vertices, triangles, good)
    crossing = side_by_side([partial(test, share, True) for share in shares_of(candidates)])
    found: IntArray = candidates[np.concatenate(crossing)]
    ordered: IntArray = found[np.lexsort((found[:, 1], found[:, 0]))]
    return ordered


def intersection_segments(a: Triangulation, b: Triangulation, pairs: npt.ArrayLike) -> Array:
    """(k, 2, 3) ends of the stretch in which the triangles of each pair cross, model length unit, in float64.

    NaN where they do not cross, or where they overlap in one plane.

    Raises
    ------
    ParameterError : a pair names a triangle that does not exist.
    """
    from patchwright.models._triangle_triangle_kernel import segments

    index, cross = _checked(a, b, pairs), pairs_intersect(a, b, pairs, proper=True)
    found: Array = segments(a.vertices, a.triangles, b.vertices, b.triangles, index, cross)
    return found


def _checked(a: Triangulation, b: Triangulation, pairs: npt.ArrayLike) -> IntArray:
    """`pairs` as (k, 2) int64, every index in range."""
    index = np.ascontiguousarray(np.asarray(pairs, dtype=np.int64).reshape(-1, 2))
    if len(index) and (index.min() < 0 or (index.max(axis=0) >= (len(a), len(b))).any()):
        raise ParameterError(
            f"pairs run from {index.min(axis=0).tolist()} to {index.max(axis=0).tolist()}, "
            f"but there are {len(a)} and {len(b)} triangles"
        )
    return index
