"""Points where two surfaces agree to second order: branches cross there in three directions, one of them perhaps twice.

Over the common tangent plane the difference f of the heights starts with a cubic. Its second derivatives vanish at the
point, its third do not: Newton's method for f_xx = f_xy = f_yy = 0 (three equations, two unknowns, least squares) finds
the point to round-off, where the equations f = 0 and grad f = 0 leave only the cube root of that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array

STEP = 1e-4  # of the size: for third derivatives by central differences
REACH = 5e-3  # of the size: a point farther from the guess is another one
FULL = 1e-6  # ratio of singular values: below, the cubic is that of a line only


@dataclass(frozen=True, slots=True, eq=False)
class Osculation:
    """The point (3,), its parameters (4,) on both pieces, and the distance of the surfaces there."""

    point: Array
    w: Array
    gap: float


def osculation(net_a: Array, net_b: Array, w: Array, tol: float) -> Osculation | None:
    """The point of second-order contact of two pieces next to the parameters w (4,), None where there is none.

    What the cubic does not explain must stay below the tolerance where the cubic does: within (tol / |cubic|)^(1/3).
    """
    from patchwright.ssi._graph_kernel import differences
    from patchwright.ssi._tracing_kernel import surface_jets

    jet = surface_jets(net_a, w[None, :2].copy())[0]
    normal = np.cross(jet[1], jet[2])
    if not np.linalg.norm(normal) > 0.0:
        return None
    normal /= np.linalg.norm(normal)
    along = jet[1] / np.linalg.norm(jet[1])
    F, c = np.stack((along, np.cross(normal, along), normal)), jet[0].copy()
    cross = STEP * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    at = np.zeros(2)
    for _ in range(10):
        f = differences(net_a, net_b, w, F, c, at + cross)
        if np.isnan(f).any():
            return None
        w = f[0, 6:].copy()
        J = np.stack((f[1, 3:6] - f[2, 3:6], f[3, 3:6] - f[4, 3:6]), axis=1) / (2.0 * STEP)
        spread = np.linalg.svd(J, compute_uv=False)
        if not spread[1] > FULL * spread[0]:
            return None
        step = np.linalg.lstsq(J, -f[0, 3:6], rcond=None)[0]
        at = at + step
        if np.linalg.norm(at) > REACH:
            return None
        if np.abs(step).max() < 1e-12:
            break
    near = np.cbrt(tol / spread[0])
    rest = abs(f[0, 0]) + np.linalg.norm(f[0, 1:3]) * near + np.linalg.norm(f[0, 3:6]) * near**2
    if rest > 2.0 * tol:
        return None
    x = c + at[0] * F[0] + at[1] * F[1]
    x += (surface_jets(net_a, w[None, :2].copy())[0, 0] - c) @ normal * normal
    return Osculation(x, w, abs(float(f[0, 0])))
