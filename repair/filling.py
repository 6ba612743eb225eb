"""Gap filling: offsets for the patch points whose projection found no surface.

Two methods share one signature. "smooth" (default) solves one thin-plate spline per patch over the found projections
around the gaps, smoothed by the data's own noise. "hardy" is the paper's: per missing point, Hardy's reciprocal
multiquadric through the K found projections nearest by index (HJR 11-13).

Measured on the test function of the design notes: see `benchmarks/bench_filling.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import ParameterError

HARDY_EXPONENT = 0.001  # gamma of HJR 12
HARDY_NEIGHBOURS = 8  # K of HJR 12, 5 to 10 in the paper
RING = 4  # grid rows of found projections around a gap that carry the smooth fill
OVERSHOOT = 1.0  # spreads of the found projections: how far beyond them a smooth fill may go
ENOUGH = 3  # fewest found projections a thin-plate spline can stand on


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
    """One thin-plate spline through (or, with noise, near) the projections within `RING` rows of a gap.

    Such a spline grows without bound away from its data: it is cut off `OVERSHOOT` spreads beyond them.
    """
    from scipy.interpolate import RBFInterpolator
    from scipy.ndimage import binary_dilation

    m, n = offsets.shape
    ring = found & binary_dilation(~found, structure=np.ones((3, 3), dtype=bool), iterations=RING)
    if ring.sum() < ENOUGH or _collinear(np.argwhere(ring)):
        ring = found
    scale = np.array([max(m - 1, 1), max(n - 1, 1)], dtype=np.float64)
    sites, missing = np.argwhere(ring) / scale, np.argwhere(~found) / scale
    values = offsets[ring]
    centre, spread = values.mean(), float(np.ptp(values))
    out = offsets.copy()
    if spread == 0.0:
        out[~found] = centre
        return out
    # the smoothing parameter is the noise variance in units of the values' own variance
    smoothing = len(sites) * (noise / spread) ** 2 * 1e-3
    spline = RBFInterpolator(sites, (values - centre) / spread, kernel="thin_plate_spline", smoothing=smoothing)
    low, high = values.min() - OVERSHOOT * spread, values.max() + OVERSHOOT * spread
    out[~found] = np.clip(spline(missing) * spread + centre, low, high)
    return out


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
