"""The strain energy of a curve, the integral of its squared curvature over its length: what fairness is measured by."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.quadrature import refined

DEEPEST = 50  # halvings; a span that is still unsettled there has an infinite energy, as at a cusp


def curvature(curve: NurbsCurve, u: Array) -> Array:
    """(...,) curvature at parameters of any shape, not negative, in any dimension; NaN where the curve stands still."""
    d = curve.derivatives(u, 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(_area(d[1], d[2]) / np.linalg.norm(d[1], axis=-1) ** 3)


def turning(curve: NurbsCurve, u: Array) -> Array:
    """(...,) how fast the tangent turns, in radians by the parameter: curvature times speed; 0 where the curve stands
    still."""
    d = curve.derivatives(u, 2)
    square = (d[1] ** 2).sum(axis=-1)
    return np.asarray(np.divide(_area(d[1], d[2]), square, out=np.zeros_like(square), where=square > 0.0))


def strain_energy(curve: NurbsCurve, accuracy: float = 1e-9) -> float:
    """The integral of kappa^2 ds, in one over the length unit, to the relative accuracy.

    inf where the integral does not converge: at a cusp. A corner between spans (a triple knot of a cubic) adds
    nothing: compare energies of C1 curves only.
    """

    def rate(t: Array) -> Array:
        d = curve.derivatives(np.clip(t, *curve.domain), 2)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(_area(d[1], d[2]) ** 2 / np.linalg.norm(d[1], axis=-1) ** 5)

    found = refined(rate, curve.breaks, accuracy, deepest=DEEPEST)
    return float(found.integrals.sum()) if found.settled else float("inf")


def _area(a: Array, b: Array) -> Array:
    """|a x b| in any dimension, without the cancellation of |a|^2 |b|^2 - (a . b)^2."""
    size = np.linalg.norm(a, axis=-1, keepdims=True)
    along = np.divide(a, size, out=np.zeros_like(a), where=size > 0.0)
    across = b - along * np.einsum("...i,...i->...", along, b)[..., None]
    return np.asarray(size[..., 0] * np.linalg.norm(across, axis=-1))
