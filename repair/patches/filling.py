"""Gap filling: offsets for the patch points whose projection found no surface.

Two methods share one signature. "smooth" (default) solves one cubic radial basis per connected gap over the found
projections around it, smoothed by the data's own noise. "hardy" is the paper's: per missing point, Hardy's reciprocal
multiquadric through the K found projections nearest by index (HJR 11-13).

Both, and general interpolators beside them, are judged in `benchmarks/table_filling.py`. A thin-plate spline in place
of the cubic basis makes about twice its error there, a quintic one overshoots beside creases.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import ParameterError

HARDY_EXPONENT = 0.001  # gamma of HJR 12
HARDY_NEIGHBOURS = 8  # K of HJR 12, 5 to 10 in the paper
RING = 4  # grid rows of found projections around a gap that carry the smooth fill, or the gap's own width if more
OVERSHOOT = 1.0  # spreads of the found projections: how far beyond them a smooth fill may go
MOST_SITES = 4000  # of one spline: solving it costs the cube of its sites
ENOUGH = 3  # fewest found projections a radial basis with its linear part can stand on
SMOOTHING = 1e-2  # of the smooth fill, per site and relative noise variance; 1e-3 to 1e-1 differ little


class FillStatus(Enum):
    """How the missing offsets of one patch were found."""

    NOTHING_MISSING = "every point was found"
    FILLED = "gaps filled from the found projections around them"
    TOO_FEW = "too few projections found; the mean offset was used"
    NONE_FOUND = "no projection found; the Coons patch itself was used"


def fill(offsets: Array, found: BoolArray, *, method: str = "smooth", noise: float = 0.0) -> tuple[Array, FillStatus]:
    """The offsets of one patch with the missing ones filled in.

    Parameters
    ----------
    offsets : (M + 1, N + 1) signed distance of each projection from the Coons patch along its normal
    found : (M + 1, N + 1) where `offsets` is known; the boundary of a patch always is, its curves lie on the surface
    method : "smooth" or "hardy"
    noise : scatter of the known offsets, same unit; the smooth method does not chase it

    Returns
    -------
    (offsets, status); never NaN.

    Raises
    ------
    ParameterError : an unknown method.
    """
    if method not in METHODS:
        raise ParameterError(f"unknown filling method {method!r}; known are {', '.join(sorted(METHODS))}")
    if found.all():
        return offsets.copy(), FillStatus.NOTHING_MISSING
    if not found.any():
        return np.zeros_like(offsets), FillStatus.NONE_FOUND
    if found.sum() < ENOUGH or _collinear(np.argwhere(found)):
        return np.where(found, offsets, offsets[found].mean()), FillStatus.TOO_FEW
    return METHODS[method](offsets, found, noise), FillStatus.FILLED


def _collinear(sites: IntArray) -> bool:
    centred = sites - sites.mean(axis=0)
    return bool(np.linalg.matrix_rank(centred) < 2)


def _smooth(offsets: Array, found: BoolArray, noise: float) -> Array:
    """One cubic radial basis with a linear part per gap, through (or, with noise, near) the projections round it.

    Such a surface grows without bound away from its data: it is cut off `OVERSHOOT` spreads beyond them. Of very many
    projections every k-th is taken, first of those that do not touch the gap.
    """
    from scipy.interpolate import RBFInterpolator
    from scipy.ndimage import binary_dilation, distance_transform_cdt, find_objects, label

    m, n = offsets.shape
    scale = np.array([max(m - 1, 1), max(n - 1, 1)], dtype=np.float64)
    whole = np.ones((3, 3), dtype=bool)
    gaps, count = label(~found, structure=whole)
    depth = distance_transform_cdt(~found, metric="chessboard")
    out = offsets.copy()
    for number, window in enumerate(find_objects(gaps, count), start=1):
        reach = max(RING, 2 * int(depth[window][gaps[window] == number].max()))
        low = [max(w.start - reach, 0) for w in window]
        near = tuple(slice(a, w.stop + reach) for a, w in zip(low, window, strict=True))
        gap = gaps[near] == number
        rim = found[near] & binary_dilation(gap, structure=whole)
        ring = found[near] & ~rim & binary_dilation(gap, structure=whole, iterations=reach)
        sites = np.concatenate([_thinned(np.argwhere(part)) for part in (rim, ring)]) + low
        if len(sites) < ENOUGH or _collinear(sites):
            sites = _thinned(np.argwhere(found))
        missing = np.argwhere(gap) + low
        values = offsets[tuple(sites.T)]
        centre, spread = values.mean(), float(np.ptp(values))
        if spread == 0.0:
            out[tuple(missing.T)] = centre
            continue
        # the smoothing parameter is the noise variance in units of the values' own variance
        smoothing = SMOOTHING * len(sites) * (noise / spread) ** 2
        spline = RBFInterpolator(sites / scale, (values - centre) / spread, kernel="cubic", smoothing=smoothing)
        least, most = values.min() - OVERSHOOT * spread, values.max() + OVERSHOOT * spread
        out[tuple(missing.T)] = np.clip(spline(missing / scale) * spread + centre, least, most)
    return out


def _thinned(sites: IntArray) -> IntArray:
    """Every k-th of the sites, so that no more than half of `MOST_SITES` remain."""
    return sites[:: max(1, -(-2 * len(sites) // MOST_SITES))]


def _hardy(offsets: Array, found: BoolArray, noise: float) -> Array:
    """The paper's local reciprocal multiquadrics, all systems of the patch solved as one batch (HJR 11-13)."""
    m, n = offsets.shape
    known = np.argwhere(found)
    missing = np.argwhere(~found)
    k = min(HARDY_NEIGHBOURS, len(known))
    near = np.abs(missing[:, None, :] - known[None, :, :]).sum(axis=2)
    neighbour = np.argsort(near, axis=1, kind="stable")[:, :k]
    step = np.array([1.0 / max(m - 1, 1), 1.0 / max(n - 1, 1)])
    radius = float(step.sum())  # R = (delta_u + delta_v) / 2 in units of twice the mean spacing
    radius *= 0.5
    sites = known[neighbour] * step  # (missing, k, 2)

    def kernel(difference: Array) -> Array:
        return np.asarray((radius + (difference**2).sum(axis=-1)) ** (-HARDY_EXPONENT))

    matrix = kernel(sites[:, :, None, :] - sites[:, None, :, :])
    values = offsets[found][neighbour]
    # gamma is tiny, so all entries are close to 1 and the systems nearly singular: a pseudo-inverse never gives NaN
    weights = np.einsum("mij,mj->mi", np.linalg.pinv(matrix, rcond=1e-13, hermitian=True), values)
    out = offsets.copy()
    out[~found] = np.einsum("mi,mi->m", weights, kernel(sites - (missing * step)[:, None, :]))
    return out


METHODS: dict[str, Callable[[Array, BoolArray, float], Array]] = {"smooth": _smooth, "hardy": _hardy}
