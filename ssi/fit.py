"""The spline of a branch: quintic, C1 (C2 inside a pair of pieces), one knot vector for space and both parameters.

Control points follow from the jets at the nodes; nothing is solved for. The residual is measured on ten times more
samples than nodes were used, between the three curves and both surfaces.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import cache

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.ssi.arcs import Arc
from patchwright.ssi.intersection import IntersectionCurve

DEGREE = 5


def fitted(arcs: Sequence[Arc], a: Surface, b: Surface) -> list[IntersectionCurve]:
    """The curves of arcs."""
    if not arcs:
        return []
    low, high = np.array([*a.domain, *b.domain]).T
    nets = [_pieces(arc, low, high) for arc in arcs]
    return [_curve(arc, net, far) for arc, net, far in zip(arcs, nets, _residuals(nets, a, b), strict=True)]


def _pieces(arc: Arc, low: Array, high: Array) -> Array:
    """(n, 6, 7) Bezier points of the Hermite pieces; parameters a round-off beyond their ranges are put on them."""
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
    slack = 1e-8 * (high - low)
    uv = net[..., 3:]
    near = (uv > low - slack) & (uv < high + slack)
    net[..., 3:] = np.where(near, np.clip(uv, low, high), uv)
    return net


def _curve(arc: Arc, net: Array, residual: float) -> IntersectionCurve:
    keep = np.flatnonzero(arc.lengths > 0.0)
    smooth = np.ones(keep.shape[0] + 1, dtype=bool)
    if arc.smooth is not None:
        smooth[1:-1] = arc.smooth[keep[1:]] * arc.smooth[keep[:-1] + 1] > 0.0
    # a smooth knot is four-fold: the control points beside it stay, the one at it follows from them
    count = np.where(smooth, 4, 5)
    count[0] = count[-1] = DEGREE + 1
    U = np.repeat(np.concatenate(([0.0], np.cumsum(arc.lengths[keep]))), count)
    stays = np.ones(net.shape[:2], dtype=bool)
    stays[1:, 0] = False
    stays[:-1, DEGREE] = ~smooth[1:-1]
    Q = net[stays]
    curve, uv_a, uv_b = (NurbsCurve(DEGREE, U, Q[:, c]) for c in (slice(0, 3), slice(3, 5), slice(5, 7)))
    points = np.concatenate((net[:, 0, :3], net[-1:, -1, :3]))
    return IntersectionCurve(curve, uv_a, uv_b, points, arc.kind, arc.closed, residual)


def _residuals(nets: Sequence[Array], a: Surface, b: Surface) -> list[float]:
    """The largest distance between each curve, its image on a and that on b on samples inside every piece."""
    at = np.concatenate([(_bernstein(_samples(net)) @ net).reshape(-1, 7) for net in nets])
    places = [at[:, :3]]
    for w, surface in ((at[:, 3:5], a), (at[:, 5:7], b)):
        (u0, u1), (v0, v1) = surface.domain
        places.append(surface(w[:, 0].clip(u0, u1), w[:, 1].clip(v0, v1)))
    worst = np.zeros(len(at))
    for one, other in itertools.combinations(places, 2):
        gap = one - other
        np.maximum(worst, np.einsum("ij,ij->i", gap, gap), out=worst)
    first = np.cumsum([0] + [_samples(net) * len(net) for net in nets[:-1]])
    return [float(far) for far in np.sqrt(np.maximum.reduceat(worst, first))]


def _samples(net: Array) -> int:
    """Samples per piece: over ten times more than the nodes, n + 1 for n pieces."""
    return 20 if len(net) < 10 else 11


@cache
def _bernstein(samples: int) -> Array:
    """(samples, DEGREE + 1) the Bernstein polynomials at the middles of equal parts of [0, 1]."""
    t, k = (np.arange(samples) + 0.5)[:, None] / samples, np.arange(DEGREE + 1)
    return np.array([math.comb(DEGREE, i) for i in k]) * t**k * (1.0 - t) ** (DEGREE - k)
