"""The parameters of a conic on an analytic surface, as functions of the conic's own NURBS parameter.

Exact on planes (affine), on rulings (linear). Elsewhere a C4 spline of degree 9 through the exact Taylor series at its
knots, halved until the surface point at the fitted parameters is within the accuracy of the curve. With knots of
multiplicity k + 1 = 5 in degree p = 2 k + 1 each blossom has at most k arguments away from one knot b, so that the
control points need the Taylor coefficients at b alone:
    d = sum_j c_j(b) e_j(t_1 - b, ..., t_k - b) / binomial(p, j), e_j the elementary symmetric polynomials.
Reference for blossoms: Ramshaw, Blossoming: a connect-the-dots approach to splines, DEC SRC report 19, 1987.

A curve that crosses a seam or a pole has one polynomial piece each side; the parameters jump there at a knot of
multiplicity p + 1, so that they never leave the surface's domain.
"""

from __future__ import annotations

import math

import numpy as np

from patchwright.models import Cone, Cylinder, Plane, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.ssi.closed_forms import series
from patchwright.ssi.closed_forms.inversion import TURN, Analytic, inverted, place, side

ORDER = 4  # k
DEGREE = 2 * ORDER + 1
PROBES = 257  # samples that tell how far a curve strays from the ranges
MOST = 1000  # knots of one piece: a bound of the work where round-off keeps the accuracy out of reach
HALVINGS = 40  # from one radian to below float64's resolution of an angle
EPS = float(np.finfo(np.float64).eps)


def parameters(surface: Analytic, curve: NurbsCurve, accuracy: float) -> NurbsCurve:
    """The (u, v) curve of a line or conic that lies on the surface and crosses seams and poles at knots only.

    Parameters
    ----------
    curve : degree 1 (a line) or 2 (an arc of a conic), in space
    accuracy : length; how far the surface at the parameters may be from the curve, round-off apart
    """
    if isinstance(surface, Plane):
        origin, frame = place(surface)
        flat = (curve.control_points - origin) @ frame[:2].T
        return _within(surface, NurbsCurve(curve.degree, curve.knots, flat, curve.weights))
    if curve.degree == 1:
        return _ruling(surface, curve)
    pieces = [_piece(surface, bezier, accuracy) for bezier in curve.bezier_pieces()]
    knots, points = [pieces[0][0]], [pieces[0][1]]
    for U, Q in pieces[1:]:
        before = points[-1][-1]
        scale = np.abs(before) + 1.0
        if (np.abs(before - Q[0]) <= 1e-9 * scale).all():  # one knot less: continuous
            knots[-1], points[-1] = knots[-1][:-1], points[-1][:-1]
        knots.append(U[DEGREE + 1 :])
        points.append(Q)
    return _within(surface, NurbsCurve(DEGREE, np.concatenate(knots), np.concatenate(points)))


def _ruling(surface: Analytic, curve: NurbsCurve) -> NurbsCurve:
    """u is that of the end farthest from the axis, v is linear."""
    uv, _ = inverted(surface, curve.control_points)
    origin, frame = place(surface)
    far = int(np.argmax(np.hypot(*((curve.control_points - origin) @ frame[:2].T).T)))
    uv[:, 0] = uv[far, 0]
    return _within(surface, NurbsCurve(1, curve.knots, uv))


def _piece(surface: Analytic, bezier: NurbsCurve, accuracy: float) -> tuple[Array, Array]:
    """Clamped knots and control points of the fit on one rational quadratic."""
    s0, s1 = bezier.domain
    local = _Local(surface, bezier)
    nodes = np.linspace(s0, s1, 3)
    for _ in range(HALVINGS):
        table = local.taylor(nodes)
        knots, points = _hermite(nodes, table)
        fit = NurbsCurve(DEGREE, knots, points)
        gaps = np.diff(nodes)
        probes = nodes[:-1, None] + gaps[:, None] * np.array([0.25, 0.5, 0.75])
        bad = local.miss(fit, probes).max(axis=1) > accuracy
        bad &= gaps > 64.0 * EPS * max(abs(s0), abs(s1))
        if not bad.any() or nodes.size > MOST:
            break  # the residual is measured by the caller
        nodes = np.sort(np.concatenate((nodes, 0.5 * (nodes[:-1] + nodes[1:])[bad])))
    middle = float(fit(0.5 * (s0 + s1))[0])
    wanted = float(inverted(surface, bezier(0.5 * (s0 + s1)))[0][0])
    points = points.copy()
    points[:, 0] += TURN * round((wanted - middle) / TURN)
    if isinstance(surface, Torus):
        at = inverted(surface, bezier(0.5 * (s0 + s1)))[0][1]
        points[:, 1] += TURN * round((at - float(fit(0.5 * (s0 + s1))[1])) / TURN)
    return knots, points


class _Local:
    """A rational quadratic in the frame of a surface: coefficients in powers of s - s0, poles divided out."""

    def __init__(self, surface: Analytic, bezier: NurbsCurve) -> None:
        origin, frame = place(surface)
        self.surface, self.bezier = surface, bezier
        self.s0, self.s1 = bezier.domain
        w = np.ones(3) if bezier.weights is None else bezier.weights
        net = np.concatenate(((bezier.control_points - origin) @ frame.T * w[:, None], w[:, None]), axis=1)
        reach = float(np.abs(bezier.control_points).max() + np.abs(origin).max())
        self.first = self.last = False
        if isinstance(surface, Sphere):
            off = np.hypot(net[:, 0], net[:, 1]) / w <= 64.0 * EPS * reach
            self.first, self.last = bool(off[0]), bool(off[2])
            net[0, :2] *= not self.first
            net[2, :2] *= not self.last
        h = self.s1 - self.s0
        b0, b1, b2 = net
        self.power = np.stack((b0, 2.0 * (b1 - b0) / h, (b0 - 2.0 * b1 + b2) / h**2))
        self.ring = self.power[:, :2].copy()  # x and y, divided by (s - s0) and (s1 - s) at poles
        if self.first and self.last:
            self.ring = np.stack((2.0 * b1[:2] / h**2, np.zeros(2), np.zeros(2)))
        elif self.first:
            self.ring = np.stack((2.0 * b1[:2] / h, (b2[:2] - 2.0 * b1[:2]) / h**2, np.zeros(2)))
        elif self.last:
            self.ring = np.stack((b0[:2] / h, (2.0 * b1[:2] - b0[:2]) / h**2, np.zeros(2)))
        middle = bezier(0.5 * (self.s0 + self.s1))
        x, y, z = (middle - origin) @ frame.T
        self.sign = float(side(surface, np.asarray(np.hypot(x, y)), np.asarray(z)))

    def taylor(self, s: Array) -> Array:
        """(k + 1, n, 2) the Taylor coefficients of u and v, angles unwrapped along s."""
        d = s - self.s0

        def at(coefficients: Array) -> Array:
            c0, c1, c2 = coefficients
            out = np.zeros((ORDER + 1, s.size))
            out[0], out[1], out[2] = c0 + d * (c1 + d * c2), c1 + 2.0 * d * c2, c2
            return out

        x, y = at(self.ring[:, 0]) * self.sign, at(self.ring[:, 1]) * self.sign
        u = series.angle(y, x)
        u[0] = np.unwrap(u[0])
        z, w = at(self.power[:, 2]), at(self.power[:, 3])
        surface = self.surface
        if isinstance(surface, Cylinder | Cone):
            return np.stack((u, series.quotient(z, w)), axis=-1)
        rho = series.root(series.product(x, x) + series.product(y, y))
        if self.first:
            rho = series.product(rho, at(np.array([0.0, 1.0, 0.0])))
        if self.last:
            rho = series.product(rho, at(np.array([self.s1 - self.s0, -1.0, 0.0])))
        if isinstance(surface, Sphere):
            return np.stack((u, series.angle(z, rho)), axis=-1)
        assert isinstance(surface, Torus)
        v = series.angle(z, self.sign * rho - surface.major_radius * w)
        v[0] = np.unwrap(v[0])
        return np.stack((u, v), axis=-1)

    def miss(self, fit: NurbsCurve, s: Array) -> Array:
        """Distance between the surface at the fitted parameters, continued over the ranges, and the curve."""
        uv = fit(s)
        origin, (x, y, z) = place(self.surface)
        u, v = uv[..., :1], uv[..., 1:]
        surface = self.surface
        if isinstance(surface, Cylinder | Cone):
            radius = surface.radius if isinstance(surface, Cylinder) else surface.radius(v)
            rho, height = np.asarray(radius), v
        elif isinstance(surface, Sphere):
            rho, height = surface.radius * np.cos(v), surface.radius * np.sin(v)
        else:
            assert isinstance(surface, Torus)
            rho = surface.major_radius + surface.minor_radius * np.cos(v)
            height = surface.minor_radius * np.sin(v)
        at = origin + rho * (np.cos(u) * x + np.sin(u) * y) + height * z
        return np.asarray(np.linalg.norm(at - self.bezier(s), axis=-1))


def _hermite(nodes: Array, table: Array) -> tuple[Array, Array]:
    """Knots and control points of the C^k spline of degree 2 k + 1 with the Taylor coefficients at the nodes."""
    n = nodes.size
    gaps = np.diff(nodes)
    left, right = np.concatenate(([0.0], -gaps)), np.concatenate((gaps, [0.0]))  # t - b of the neighbours
    points = np.zeros((n, ORDER + 1, table.shape[2]))
    for row, m in enumerate(range(ORDER, -1, -1)):  # m arguments at the knot before, k - m at the one after
        for j in range(ORDER + 1):
            e = sum(
                math.comb(m, i) * math.comb(ORDER - m, j - i) * left**i * right ** (j - i)
                for i in range(max(0, j - ORDER + m), min(m, j) + 1)
            )
            points[:, row] += (e / math.comb(DEGREE, j))[:, None] * table[j]
    knots = np.concatenate(([nodes[0]] * (ORDER + 1), np.repeat(nodes, ORDER + 1), [nodes[-1]] * (ORDER + 1)))
    return knots, points.reshape(-1, table.shape[2])


def _within(surface: Analytic, uv: NurbsCurve) -> NurbsCurve:
    """The curve brought inside the ranges where it leaves them: by round-off, or by the tolerance of the clipping.

    Control points are moved only as far as the curve itself strays; others may well lie outside.
    """
    low, high = np.array(surface.domain).T
    points = uv.control_points
    held = np.clip(points, low, high)
    if (held == points).all():
        return uv
    at = uv(np.append(np.linspace(*uv.domain, PROBES), uv.breaks))
    astray = np.abs(np.clip(at, low, high) - at).max(axis=0)
    slack = 4.0 * astray + 64.0 * EPS * np.maximum(np.abs(low), np.abs(high))
    moved = np.where(np.abs(held - points) <= slack, held, points)
    return NurbsCurve(uv.degree, uv.knots, moved, uv.weights)
