"""The spline of a branch: quintic, C1 (C2 inside a pair of pieces), one knot vector for space and both parameters.

Control points follow from the jets at the nodes; nothing is solved for. The residual is measured on ten times more
samples than nodes were used, between the three curves and both surfaces.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.knots import between
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.ssi.arcs import Arc
from patchwright.ssi.intersection import IntersectionCurve

SAMPLES = 20  # per piece; a piece has two nodes


def fitted(arc: Arc, a: Surface, b: Surface) -> IntersectionCurve:
    """The curve of an arc."""
    jets, lengths = arc.jets, arc.lengths
    keep = np.flatnonzero(lengths > 0.0)
    L = lengths[keep][:, None]
    p, q = jets[keep], jets[keep + 1]
    net = np.stack(
        (
            p[:, 0],
            p[:, 0] + L / 5.0 * p[:, 1],
            p[:, 0] + 0.4 * L * p[:, 1] + L * L / 20.0 * p[:, 2],
            q[:, 0] - 0.4 * L * q[:, 1] + L * L / 20.0 * q[:, 2],
            q[:, 0] - L / 5.0 * q[:, 1],
            q[:, 0],
        ),
        axis=1,
    )
    s = np.concatenate(([0.0], np.cumsum(L[:, 0])))
    smooth = np.ones(keep.shape[0] + 1, dtype=bool)
    if arc.smooth is not None:
        smooth[1:-1] = arc.smooth[keep[1:]] * arc.smooth[keep[:-1] + 1] > 0.0
    knots, control = [np.repeat(s[0], 6)], [net[0, :1]]
    for i in range(keep.shape[0]):
        last = i == keep.shape[0] - 1
        control.append(net[i, 1:5])
        if last or not smooth[i + 1]:
            control.append(net[i, 5:])
        knots.append(np.repeat(s[i + 1], 6 if last else 4 if smooth[i + 1] else 5))
    U, Q = np.concatenate(knots), np.concatenate(control)
    for side, surface in enumerate((a, b)):
        for axis in (0, 1):
            low, high = surface.domain[axis]
            column = Q[:, 3 + 2 * side + axis]
            slack = 1e-8 * (high - low)
            near = (column > low - slack) & (column < high + slack)
            column[near] = np.clip(column[near], low, high)
    curve, uv_a, uv_b = (NurbsCurve(5, U, Q[:, c]) for c in (slice(0, 3), slice(3, 5), slice(5, 7)))
    points = np.concatenate((p[:, 0, :3], q[-1:, 0, :3]))
    return IntersectionCurve(curve, uv_a, uv_b, points, arc.kind, arc.closed, measured(curve, uv_a, uv_b, a, b))


def measured(curve: NurbsCurve, uv_a: NurbsCurve, uv_b: NurbsCurve, a: Surface, b: Surface) -> float:
    """The largest distance between a curve, uv_a on a and uv_b on b on samples inside every piece."""
    t = between(curve.breaks, SAMPLES)
    x = curve(t)
    on = []
    for uv, surface in ((uv_a, a), (uv_b, b)):
        w = uv(t)
        (u0, u1), (v0, v1) = surface.domain
        on.append(surface(np.clip(w[:, 0], u0, u1), np.clip(w[:, 1], v0, v1)))
    gaps: Array = np.stack((x - on[0], x - on[1], on[0] - on[1]))
    return float(np.sqrt((gaps * gaps).sum(axis=-1)).max())
