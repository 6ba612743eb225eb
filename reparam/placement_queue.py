"""The paper's way to place the inner points: by penalty, one point at a time.

Hamann, Jean and Razdan (1999), section 2: the points are sorted by penalty and moved in the domain in that order; in
the next iteration only those are looked at of which a neighbour has moved; the end is reached when none moves. First
every point meets its own two shares, as in the paper. Where E (see `penalty`) cannot vanish that is not yet its
minimum: then points go on to lower all of E they have part in. This is coordinate descent; `placement` finds the same
points all at once and is what `reparametrize` uses.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.knots import locked
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.reparam.penalty import penalty, step_shares
from patchwright.reparam.placement import Placement, Status

VANISHED = 1e-16  # of E per point: there is nothing left to descend


def place_by_queue(
    surface: NurbsSurface, uv: Array, s: Array, t: Array, *, still: float = 1e-11, most: int = 20_000_000
) -> Placement:
    """Move the inner points of a grid one by one until none moves by more than `still` of the domain.

    Parameters
    ----------
    uv : (m + 1, n + 1, 2) parameters to start from, without folds; those on the border stay
    s, t : (m + 1,) and (n + 1,) increasing, the new parameters of the grid's rows and columns
    most : moves in each of the two rounds
    """
    from patchwright.reparam._queue_kernel import run_queue

    (p, q), (U, V) = surface.degree, surface.knots
    net, limits = surface.homogeneous, np.array(surface.domain)
    shares = locked(step_shares(s)), locked(step_shares(t))
    at = np.array(uv, dtype=np.float64, order="C")
    moves, settled = 0, False
    energy = penalty(surface(at[..., 0], at[..., 1]), s, t)
    for parts in (2, 6):
        new, own, done = run_queue(U, p, V, q, net, at, *shares, limits, parts, still, most)
        after = penalty(surface(new[..., 0], new[..., 1]), s, t)
        moves += own
        if after <= energy:
            at, energy, settled = new, after, done
        if energy <= VANISHED * at[..., 0].size:
            break
    return Placement(at, energy, moves, Status.CONVERGED if settled else Status.LIMIT)
