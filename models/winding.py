"""How often a triangulation winds around points: 1 inside, 0 outside, and a fair fraction near holes and overlaps.

The generalised winding number of Jacobson, Kavan & Sorkine-Hornung (ACM TOG 32(4), 2013), summed over a tree as in
Barill, Dickson, Schmidt, Levin & Jacobson, "Fast winding numbers for soups and clouds" (ACM TOG 37(4), 2018): a node
far enough away counts by its dipole and first moments, triangles nearby by their exact solid angle. Here the expansion
ends with the first moments; the tree is the one of `Tree`.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.tree import Tree, in_shares, query_points
from patchwright.models.triangulation import Triangulation


def winding_number(
    triangulation: Triangulation, points: npt.ArrayLike, *, tree: Tree | None = None, accuracy: float = 1e-2
) -> Array:
    """The generalised winding number of the triangulation around each point.

    Positive around points inside outward-facing triangles; zero everywhere if there are no triangles. On a triangle
    itself the value is one of the two sides' or their mean.

    Parameters
    ----------
    points : (n, 3), model length unit
    tree : the triangulation's tree, if it is there already
    accuracy : aimed-at error, not a bound: nodes are taken whole from (accuracy / 1.5)^(-1/3) radii away on, as
        the error was measured to stay below 1.5 / radii^3; 0 sums every triangle. Cost: log n times accuracy^(-2/3)

    Returns
    -------
    (n,) float64

    Raises
    ------
    ParameterError : a coordinate that is not finite, an accuracy that is negative or NaN.
    """
    from patchwright.models._winding_kernel import moments, winding

    query = query_points(points, "points")
    if not accuracy >= 0.0:
        raise ParameterError(f"the accuracy must be zero or positive, got {accuracy}")
    result = np.zeros(len(query))
    if not len(triangulation):
        return result
    tree = Tree.of(triangulation) if tree is None else tree
    beta = np.inf if accuracy == 0.0 else max(1.5, (1.5 / accuracy) ** (1.0 / 3.0))
    about = moments(tree.boxes, tree.child, tree.corners, tree.center)
    in_shares(
        winding, (tree.child, tree.corners, tree.center, about, query, float(beta)), tree.coherent(query), (result,)
    )
    return result
