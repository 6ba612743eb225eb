"""Slow, exact definitions of B-splines and NURBS in rational arithmetic: the Cox-de Boor recursion as it is written."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from math import comb

import numpy as np


def basis(knots: Sequence[float], p: int, i: int, t: float, order: int = 0) -> Fraction:
    """The derivative of the given order of N_{i,p} at t; the last span of the domain is closed on the right."""
    U = [Fraction(x) for x in knots]
    n = len(U) - p - 1
    if not U[i] <= Fraction(t) <= U[i + p + 1]:
        return Fraction(0)
    x = Fraction(t)
    domain_end = U[n]
    last = max(k for k in range(n) if U[k] < domain_end)

    @cache
    def value(k: int, d: int) -> Fraction:
        if d == 0:
            return Fraction(k == last if x == domain_end else U[k] <= x < U[k + 1])
        total = Fraction(0)
        if U[k + d] > U[k]:
            total += (x - U[k]) / (U[k + d] - U[k]) * value(k, d - 1)
        if U[k + d + 1] > U[k + 1]:
            total += (U[k + d + 1] - x) / (U[k + d + 1] - U[k + 1]) * value(k + 1, d - 1)
        return total

    @cache
    def derivative(k: int, d: int, r: int) -> Fraction:
        if r == 0:
            return value(k, d)
        if d == 0:
            return Fraction(0)
        total = Fraction(0)
        if U[k + d] > U[k]:
            total += d / (U[k + d] - U[k]) * derivative(k, d - 1, r - 1)
        if U[k + d + 1] > U[k + 1]:
            total -= d / (U[k + d + 1] - U[k + 1]) * derivative(k + 1, d - 1, r - 1)
        return total

    return derivative(i, p, order)


def surface_derivative(degree, knots, control_points, weights, u, v, nu) -> np.ndarray:
    """(3,) the derivative `nu` of a NURBS surface at one parameter pair, exact up to the final rounding."""
    (p, q), (U, V) = degree, knots
    n, m = control_points.shape[:2]
    sums = {}
    for a in range(nu[0] + 1):
        Nu = [basis(U, p, i, u, a) for i in range(n)]
        for b in range(nu[1] + 1):
            Nv = [basis(V, q, j, v, b) for j in range(m)]
            total = [Fraction(0)] * 4
            for i in range(n):
                for j in range(m):
                    c = Nu[i] * Nv[j]
                    if c:
                        w = Fraction(1) if weights is None else Fraction(float(weights[i, j]))
                        for x in range(3):
                            total[x] += c * w * Fraction(float(control_points[i, j, x]))
                        total[3] += c * w
            sums[a, b] = total
    out = {}
    for (a, b), total in sums.items():
        value = list(total[:3])
        for e in range(a + 1):
            for f in range(b + 1):
                if e + f:
                    c = comb(a, e) * comb(b, f) * sums[e, f][3]
                    value = [value[x] - c * out[a - e, b - f][x] for x in range(3)]
        out[a, b] = [x / sums[0, 0][3] for x in value]
    return np.array([float(x) for x in out[tuple(nu)]])


def curve_derivative(degree, knots, control_points, weights, t, nu) -> np.ndarray:
    """(d,) the derivative of a NURBS curve of one, two or three dimensions, exact up to the final rounding."""
    points = np.zeros((len(control_points), 2, 3))
    points[:, :, : control_points.shape[1]] = control_points[:, None]
    w = None if weights is None else np.repeat(weights[:, None], 2, axis=1)
    line = ([0.0, 0.0, 1.0, 1.0], 1)
    value = surface_derivative((degree, line[1]), (knots, line[0]), points, w, t, 0.5, (nu, 0))
    return value[: control_points.shape[1]]
