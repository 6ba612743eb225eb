"""How far fitted patches lie from their data: the discrete error of Hamann, Jean, Razdan, section 3 (HJR 17)."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.patches.patch_fit import Target, samples_for
from patchwright.repair.patches.patch_nets import PatchNets, evaluate
from patchwright.repair.patches.spline_space import uniform_collocation

LEAST_POINTS = 60_000  # looked at in all, however few the patches are: the facets below do not get fewer with them


def patch_errors(nets: PatchNets, which: IntArray, target: Target, invented: BoolArray) -> tuple[Array, Array]:
    """Distances from the data at corners, edge midpoints and centres of the fit's cells, denser where these are few.

    Parameters
    ----------
    which : (k,) the patches to look at
    invented : (m, 8, 8) marks of gap filling; samples on gaps are left out: there is nothing they should be near to

    Returns
    -------
    (m,) the largest distance of each patch, a length, and (m, 2) the mean squares of its change from sample to sample
    along u and along v; nan for patches that were not looked at.
    """
    out, change = np.full(len(nets), np.nan), np.full((len(nets), 2), np.nan)
    fewest = int(np.sqrt(LEAST_POINTS / max(1, len(nets))))
    for m, n in np.unique(nets.cells[which], axis=0).tolist():
        some = which[(nets.cells[which] == (m, n)).all(axis=1)]
        nu, nv = (2 * max(samples_for(cells), fewest // 2) + 1 for cells in (m, n))
        points = evaluate(nets.nets(some), uniform_collocation(m, nu), uniform_collocation(n, nv))
        closest = target.tree.closest(points.reshape(-1, 3))
        away = points - closest.points.reshape(points.shape)
        blank = np.asarray(target.invented[closest.triangle]).reshape(points.shape[:3])
        rows, columns = (np.minimum(np.arange(count) * 8 // (count - 1), 7) for count in (nu, nv))
        away[blank | invented[some][:, rows][:, :, columns]] = 0.0
        out[some] = np.linalg.norm(away, axis=-1).max(axis=(1, 2))
        change[some, 0] = (np.diff(away, axis=1) ** 2).sum(axis=-1).mean(axis=(1, 2))
        change[some, 1] = (np.diff(away, axis=2) ** 2).sum(axis=-1).mean(axis=(1, 2))
    return out, change
