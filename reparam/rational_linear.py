"""Monotone rational linear functions, and curves and surfaces reparametrised by them at no cost in degree.

Source: Fuhr and Kallay, Monotone linear rational spline interpolation, CAGD 9 (1992) 313-319. A function of this kind
is held as a `NurbsCurve` of degree 1 in R^1, two pieces for each step of the data: f(x)[..., 0]. It is C1 and
increasing, its inverse is of the same kind, and C(f(x)) is a NURBS curve of C's own degree: exactly the same shape, run
through at another speed. The map is C1 where C is, but the homogeneous net is only C0 at the breaks of f, so that knots
there have the multiplicity of the degree.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from patchwright.models import knots as knot_tools
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface


def rational_linear(
    x: npt.ArrayLike, y: npt.ArrayLike, slopes: npt.ArrayLike | None = None, *, split: float = 0.5
) -> NurbsCurve:
    """The C1 increasing function with f(x) = y and f'(x) = slopes.

    Parameters
    ----------
    x, y : (n,) increasing, n of at least 2
    slopes : (n,) positive; None: those of the rational linear function through each three neighbours, so that any
        one such function is reproduced
    split : in (0, 1), where each step of x is divided between its two pieces

    Raises
    ------
    ParameterError : numbers that do not increase or are not finite, a slope that is not positive.
    """
    X, Y = _increasing(x, "x"), _increasing(y, "y")
    if X.shape != Y.shape:
        raise ParameterError(f"x and y must be of one length, got {X.shape[0]} and {Y.shape[0]}")
    if not 0.0 < split < 1.0:
        raise ParameterError(f"the split must lie in (0, 1), got {split}")
    d = _moebius_slopes(X, Y) if slopes is None else np.array(slopes, dtype=np.float64)
    if d.shape != X.shape or not (np.isfinite(d) & (d > 0.0)).all():
        raise ParameterError(f"slopes must be {X.shape[0]} positive, finite numbers")
    h, rise = np.diff(X), np.diff(Y)
    w = 1.0 / np.sqrt(d)
    a, b = w[:-1], w[1:]
    inner = (1.0 - split) * a + split * b
    middle_y = ((1.0 - split) * a * Y[:-1] + split * b * Y[1:]) / inner
    middle_w = h / rise * (split * a * d[:-1] + (1.0 - split) * b * d[1:])
    middle_x = X[:-1] + split * h
    x_all, y_all, w_all = (_woven(*pair) for pair in ((X, middle_x), (Y, middle_y), (w, middle_w)))
    knots = np.concatenate((x_all[:1], x_all, x_all[-1:]))
    return NurbsCurve(1, knots, y_all[:, None], w_all)


def inverted(f: NurbsCurve) -> NurbsCurve:
    """The inverse function, of the same kind and exact."""
    x, y, w = _parts(f)
    return NurbsCurve(1, np.concatenate((y[:1], y, y[-1:])), x[:, None], 1.0 / w)


def compose_curve(curve: NurbsCurve, f: NurbsCurve) -> NurbsCurve:
    """curve(f(x)) over f's domain: the same points, the same degree, rational.

    Raises
    ------
    ParameterError : f is not an increasing function of degree 1, or its values leave the curve's domain.
    """
    net = _weighted(curve.homogeneous, curve.rational)
    knots, new = _composed(curve.degree, curve.knots, net, f)
    return NurbsCurve.from_homogeneous(curve.degree, knots, new, rational=True)


def compose_surface(
    surface: NurbsSurface, along_u: NurbsCurve | None = None, along_v: NurbsCurve | None = None
) -> NurbsSurface:
    """surface(f(x), g(y)) with f along u and g along v (None: left alone); errors as for a curve."""
    (p, q), (U, V) = surface.degree, surface.knots
    net = _weighted(surface.homogeneous, surface.rational)
    if along_u is not None:
        U, net = _composed(p, U, net, along_u)
    if along_v is not None:
        V, rows = _composed(q, V, net.swapaxes(0, 1), along_v)
        net = rows.swapaxes(0, 1)
    return NurbsSurface.from_homogeneous((p, q), (U, V), net, rational=True)


def _composed(p: int, U: Array, net: Array, f: NurbsCurve) -> tuple[Array, Array]:
    """Knots and homogeneous net (m, ..., d + 1) of the composition along the first axis."""
    x, y, w = _parts(f)
    low, high = float(U[p]), float(U[-p - 1])
    y = knot_tools.inside((low, high), y, "of the curve, a value of the function,")
    breaks = knot_tools.breaks(p, U)
    breaks = breaks[(breaks > y[0]) & (breaks < y[-1])]
    at = np.clip(np.searchsorted(y, breaks), 1, y.shape[0] - 1)
    at -= breaks - y[at - 1] < y[at] - breaks  # the nearest
    same = np.abs(breaks - y[at]) <= knot_tools.ROUND_OFF * max(abs(low), abs(high))
    y = y.copy()
    y[at[same]] = breaks[same]
    others = breaks[~same]
    if others.size:
        x_others = inverted(f)(others)[:, 0]
        order = np.argsort(np.concatenate((y, others)), kind="stable")
        w = np.concatenate((w, np.interp(x_others, x, w)))[order]
        x, y = np.concatenate((x, x_others))[order], np.concatenate((y, others))[order]
    knots, cut = knot_tools.restrict(p, U, net, y[0], y[-1])
    if y.shape[0] > 2:
        knots, cut = knot_tools.insert(p, knots, cut, knot_tools.missing(p, knots, y[1:-1]))
    pieces = cut[p * np.arange(y.shape[0] - 1)[:, None] + np.arange(p + 1)]
    i = np.arange(p + 1)
    factor = w[:-1, None] ** (p - i) * w[1:, None] ** i  # the Bernstein form of D^p C(f), D the denominator of f
    pieces = pieces * factor.reshape(*factor.shape, *(1,) * (net.ndim - 1))
    new = np.concatenate((pieces[:1, 0], pieces[:, 1:].reshape(-1, *net.shape[1:])))
    return np.concatenate((x[:1], np.repeat(x, p), x[-1:])), new


def _parts(f: NurbsCurve) -> tuple[Array, Array, Array]:
    """Breaks, values there and weights, of geometric mean 1 at their extremes."""
    y = f.control_points[:, 0]
    if f.degree != 1 or f.dimension != 1 or not (y[1:] > y[:-1]).all():
        raise ParameterError("the function must be an increasing NURBS curve of degree 1 in one dimension")
    x = f.knots[1:-1]
    if not (x[1:] > x[:-1]).all():
        raise ParameterError("the function must be continuous: its knots must be simple")
    w = np.ones_like(y) if f.weights is None else f.weights
    return x, y, w / np.sqrt(w.min() * w.max())


def _moebius_slopes(X: Array, Y: Array) -> Array:
    """A rational linear f has (f(a) - f(b))^2 = f'(a) f'(b) (a - b)^2, which gives its slopes from three points."""
    chord = np.diff(Y) / np.diff(X)
    if X.shape[0] == 2:
        return np.repeat(chord, 2)
    wide = (Y[2:] - Y[:-2]) / (X[2:] - X[:-2])
    inner = chord[:-1] * chord[1:] / wide
    first, last = chord[0] * wide[0] / chord[1], chord[-1] * wide[-1] / chord[-2]
    return np.concatenate(([first], inner, [last]))


def _woven(ends: Array, middles: Array) -> Array:
    out = np.empty(2 * ends.shape[0] - 1)
    out[::2], out[1::2] = ends, middles
    return out


def _weighted(net: Array, rational: bool) -> Array:
    return net if rational else np.concatenate((net, np.ones((*net.shape[:-1], 1))), axis=-1)


def _increasing(values: npt.ArrayLike, name: str) -> Array:
    v = np.array(values, dtype=np.float64)
    if v.ndim != 1 or v.shape[0] < 2 or not np.isfinite(v).all() or not (v[1:] > v[:-1]).all():
        raise ParameterError(f"{name} must be at least two finite, increasing numbers, got shape {v.shape}")
    return v
