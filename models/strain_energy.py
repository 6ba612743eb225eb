"""The strain energy of a curve, the integral of its squared curvature over its length: what fairness is measured by."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve

NODES = 15
DEEPEST = 50  # halvings; a span that is still unsettled there has an infinite energy, as at a cusp


def curvature(curve: NurbsCurve, u: Array) -> Array:
    """(...,) curvature at parameters of any shape, not negative, in any dimension; NaN where the curve stands still."""
    d = curve.derivatives(u, 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(_area(d[1], d[2]) / np.linalg.norm(d[1], axis=-1) ** 3)


def strain_energy(curve: NurbsCurve, accuracy: float = 1e-9) -> float:
    """The integral of kappa^2 ds, in one over the length unit, to the relative accuracy.

    inf where the integral does not converge: at a cusp. A corner between spans (a triple knot of a cubic) adds
    nothing: compare energies of C1 curves only.
    """
    a, b = curve.breaks[:-1], curve.breaks[1:]
    whole = _rule(curve, a, b)
    total = float(whole.sum())
    span = float(b[-1] - a[0])
    for _ in range(DEEPEST):
        middle = 0.5 * (a + b)
        left, right = _rule(curve, a, middle), _rule(curve, middle, b)
        error = left + right - whole
        if not np.isfinite(error).all():
            return float("inf")
        total += float(error.sum())
        bad = np.abs(error) > accuracy * np.maximum(total * np.maximum((b - a) / span, 2.0**-10), left + right) * 0.1
        a, middle, b = a[bad], middle[bad], b[bad]
        if not a.size:
            return total
        a, b = np.concatenate((a, middle)), np.concatenate((middle, b))
        whole = np.concatenate((left[bad], right[bad]))
    return float("inf")


def _area(a: Array, b: Array) -> Array:
    """|a x b| in any dimension, without the cancellation of |a|^2 |b|^2 - (a . b)^2."""
    size = np.linalg.norm(a, axis=-1, keepdims=True)
    along = np.divide(a, size, out=np.zeros_like(a), where=size > 0.0)
    across = b - along * np.einsum("...i,...i->...", along, b)[..., None]
    return np.asarray(size[..., 0] * np.linalg.norm(across, axis=-1))


def _rule(curve: NurbsCurve, a: Array, b: Array) -> Array:
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    half = 0.5 * (b - a)
    at = 0.5 * (a + b)[:, None] + half[:, None] * nodes
    d = curve.derivatives(np.clip(at, *curve.domain), 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        values = _area(d[1], d[2]) ** 2 / np.linalg.norm(d[1], axis=-1) ** 5
    return np.asarray(half * (values @ weights))
