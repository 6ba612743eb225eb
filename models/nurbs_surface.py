"""`NurbsSurface`: a rational or plain tensor-product B-spline surface of any degree in R^3.

Reference: Piegl and Tiller, The NURBS Book, 2nd ed. 1997. Periodic surfaces are held unrolled, see `from_periodic`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import comb
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from patchwright.models import knots as knot_tools
from patchwright.models.arrays import Array, IntArray, frozen
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_curve import NurbsCurve, checked_weights

if TYPE_CHECKING:
    from collections.abc import Callable

    from patchwright.models.closest_point import ClosestOnSurface

Direction = Literal["u", "v"]
Side = Literal["u0", "u1", "v0", "v1"]
JET: tuple[tuple[int, int], ...] = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
"""Orders of the derivatives in a jet."""


@dataclass(frozen=True, slots=True, eq=False)
class NurbsSurface:
    """A NURBS surface in R^3; its arrays are own, read-only copies.

    Parameters
    ----------
    degree : (p, q), each at least 1
    knots : (U, V) of (n + p + 1,) and (m + q + 1,), non-decreasing, multiplicity at most degree + 1
    control_points : (n, m, 3) in the model's unit
    weights : (n, m) positive, or None for 1

    Raises
    ------
    KnotError : knots that do not fit; ParameterError : NaN or infinite points, weights that are not positive.
    """

    degree: tuple[int, int]
    knots: tuple[Array, Array]
    control_points: Array
    weights: Array | None = None
    homogeneous: Array = field(init=False, repr=False)
    """(n, m, 3) the control points, or (n, m, 4) their products with the weights and the weights."""

    def __post_init__(self) -> None:
        put = object.__setattr__
        points = frozen(self.control_points, np.float64)
        if points.ndim != 3 or points.shape[2] != 3:
            raise ParameterError(f"control points must be (n, m, 3), got shape {points.shape}")
        if not np.isfinite(points).all():
            at = np.argwhere(~np.isfinite(points).all(axis=2))[0]
            raise ParameterError(f"control point ({at[0]}, {at[1]}) is not finite")
        p, q = (int(d) for d in self.degree)
        U, V = self.knots
        put(self, "degree", (p, q))
        put(self, "control_points", points)
        U = knot_tools.checked_knots(p, U, points.shape[0], "knots in u")
        V = knot_tools.checked_knots(q, V, points.shape[1], "knots in v")
        put(self, "knots", (U, V))
        put(self, "homogeneous", points)
        if self.weights is not None:
            weights = checked_weights(self.weights, points.shape[:-1])
            put(self, "weights", weights)
            net = np.concatenate((points * weights[..., None], weights[..., None]), axis=2)
            net.flags.writeable = False
            put(self, "homogeneous", net)

    @classmethod
    def from_homogeneous(
        cls, degree: tuple[int, int], knots: tuple[Array, Array], net: Array, *, rational: bool
    ) -> NurbsSurface:
        """The surface of a net (n, m, 3), or (n, m, 4) with w x, w y, w z, w when `rational`."""
        if not rational:
            return cls(degree, knots, net)
        return cls(degree, knots, net[..., :-1] / net[..., -1:], net[..., -1])

    @classmethod
    def from_periodic(
        cls,
        degree: tuple[int, int],
        values: tuple[npt.ArrayLike, npt.ArrayLike],
        multiplicities: tuple[npt.ArrayLike, npt.ArrayLike],
        control_points: npt.ArrayLike,
        weights: npt.ArrayLike | None = None,
        *,
        periodic: tuple[bool, bool] = (True, True),
    ) -> NurbsSurface:
        """The clamped, unrolled form of a surface that is periodic in the directions marked.

        `values` and `multiplicities` are distinct knots; in a periodic direction of one period, both ends included,
        as in `knots.unrolled`.

        Raises
        ------
        KnotError, ParameterError : as for a surface.
        """
        points = np.asarray(control_points, dtype=np.float64)
        w = None if weights is None else checked_weights(weights, points.shape[:2])
        knots: list[Array] = []
        for axis in (0, 1):
            if periodic[axis]:
                full, index = knot_tools.unrolled(degree[axis], values[axis], multiplicities[axis], points.shape[axis])
                points = np.take(points, index, axis=axis)
                w = None if w is None else np.take(w, index, axis=axis)
            else:
                full = np.repeat(np.asarray(values[axis], dtype=np.float64), np.asarray(multiplicities[axis]))
            knots.append(full)
        return cls(degree, (knots[0], knots[1]), points, w).clamped()

    @property
    def rational(self) -> bool:
        """Whether the surface carries weights."""
        return self.weights is not None

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """((u0, u1), (v0, v1))."""
        (p, q), (U, V) = self.degree, self.knots
        return (float(U[p]), float(U[-p - 1])), (float(V[q]), float(V[-q - 1]))

    @property
    def breaks(self) -> tuple[Array, Array]:
        """Distinct knots of the domain in u and in v, its ends included."""
        return knot_tools.breaks(self.degree[0], self.knots[0]), knot_tools.breaks(self.degree[1], self.knots[1])

    def __call__(self, u: npt.ArrayLike, v: npt.ArrayLike, nu: tuple[int, int] = (0, 0)) -> Array:
        """(..., 3) the mixed derivative of order `nu` at broadcast parameters.

        Raises
        ------
        ParameterError : a parameter outside the domain by more than round-off, or a negative order.
        """
        return self._scattered(u, v, nu, nu)[..., 0, 0, :]

    def derivatives(self, u: npt.ArrayLike, v: npt.ArrayLike, order: tuple[int, int]) -> Array:
        """(..., a + 1, b + 1, 3) all derivatives of orders (0..a, 0..b) at broadcast parameters, order = (a, b)."""
        return self._scattered(u, v, (0, 0), order)

    def _scattered(self, u: npt.ArrayLike, v: npt.ArrayLike, low: tuple[int, int], high: tuple[int, int]) -> Array:
        _check_order(high)
        from patchwright.models._nurbs_kernel import bicubic_points, scattered

        (u_domain, v_domain), (U, V), (p, q) = self.domain, self.knots, self.degree
        us, vs = knot_tools.inside(u_domain, u, "u"), knot_tools.inside(v_domain, v, "v")
        if us.shape != vs.shape:
            us, vs = np.broadcast_arrays(us, vs)
        flat_u, flat_v = knot_tools.locked(us.ravel()), knot_tools.locked(vs.ravel())
        if self.rational and (p, q) == (3, 3) and tuple(high) == (0, 0):
            points = np.empty((flat_u.shape[0], 3))
            bicubic_points(U, V, self.homogeneous, flat_u, flat_v, points)
            return points.reshape(*us.shape, 1, 1, 3)
        low, high = (int(low[0]), int(low[1])), (int(high[0]), int(high[1]))
        out = np.empty((flat_u.shape[0], high[0] - low[0] + 1, high[1] - low[1] + 1, 3))
        scattered(U, p, V, q, self.homogeneous, flat_u, flat_v, low, high, out)
        return out.reshape(*us.shape, *out.shape[1:])

    def jet(self, u: npt.ArrayLike, v: npt.ArrayLike, order: int = 2) -> Array:
        """(..., c, 3) S, S_u, S_v, S_uu, S_uv, S_vv at broadcast parameters: all up to a total order of 0, 1 or 2, so
        c is 1, 3 or 6.

        Raises
        ------
        ParameterError : a parameter outside the domain by more than round-off, or another order.
        """
        members = _jet_members(order)
        if order == 0 or not self.rational or self.degree != (3, 3):
            d = self.derivatives(u, v, (order, order))
            return np.stack([d[..., a, b, :] for a, b in members], axis=-2)
        from patchwright.models._jet_kernel import bicubic_jets

        us, vs = knot_tools.inside(self.domain[0], u, "u"), knot_tools.inside(self.domain[1], v, "v")
        us, vs = np.broadcast_arrays(us, vs)
        out = np.empty((us.size, len(members), 3))
        flat = knot_tools.locked(us.ravel()), knot_tools.locked(vs.ravel())
        bicubic_jets(*self.knots, self.homogeneous, *flat, int(order), np.arange(len(members)), out)
        return out.reshape(*us.shape, *out.shape[1:])

    def grid_jet(self, u: npt.ArrayLike, v: npt.ArrayLike, order: int = 2) -> Array:
        """(k, l, c, 3) as `jet`, on the tensor grid of parameters u (k,) and v (l,)."""
        members = _jet_members(order)
        if order == 0 or not self.rational or self.degree[1] != 3:
            return np.stack([self.grid(u, v, nu) for nu in members], axis=-2)
        return self._grid_jets(u, v, int(order), np.arange(len(members)))

    def _grid_jets(self, u: npt.ArrayLike, v: npt.ArrayLike, order: int, wanted: IntArray) -> Array:
        from patchwright.models._jet_kernel import grid_jets
        from patchwright.models._nurbs_kernel import basis_table

        us = knot_tools.locked(knot_tools.inside(self.domain[0], np.ravel(u), "u"))
        vs = knot_tools.locked(knot_tools.inside(self.domain[1], np.ravel(v), "v"))
        tables = (basis_table(U, p, t, order) for U, p, t in zip(self.knots, self.degree, (us, vs), strict=True))
        (first_u, rows_u), (first_v, rows_v) = tables
        out = np.empty((us.size * vs.size, wanted.size, 3))
        grid_jets(first_u, rows_u, first_v, rows_v, self.homogeneous, wanted, out)
        return out.reshape(us.size, vs.size, wanted.size, 3)

    def grid(self, u: npt.ArrayLike, v: npt.ArrayLike, nu: tuple[int, int] = (0, 0)) -> Array:
        """(k, l, 3) the derivative of order `nu` on the tensor grid of parameters u (k,) and v (l,).

        Raises
        ------
        ParameterError : as for a call.
        """
        _check_order(nu)
        if self.rational and self.degree[1] == 3 and tuple(nu) in JET[1:]:
            return self._grid_jets(u, v, int(sum(nu)), np.array([JET.index(tuple(nu))]))[..., 0, :]
        from patchwright.models._nurbs_kernel import basis_table

        (u_domain, v_domain), (U, V), (p, q), net = self.domain, self.knots, self.degree, self.homogeneous
        us = knot_tools.locked(knot_tools.inside(u_domain, np.ravel(u), "u"))
        vs = knot_tools.locked(knot_tools.inside(v_domain, np.ravel(v), "v"))
        a1, b1 = int(nu[0]), int(nu[1])
        first_u, rows_u = basis_table(U, p, us, a1)
        first_v, rows_v = basis_table(V, q, vs, b1)
        if self.weights is None or (a1, b1) == (0, 0):
            return _grid_sums(first_u, rows_u[a1], first_v, rows_v[b1], net, self.rational)
        sums = {
            (a, b): _grid_sums(first_u, rows_u[a], first_v, rows_v[b], net, False)
            for a in range(a1 + 1)
            for b in range(b1 + 1)
        }
        w = sums[0, 0][..., 3:]
        out: dict[tuple[int, int], Array] = {}
        for (a, b), total in sums.items():
            value = total[..., :3]
            for e in range(a + 1):
                for f in range(b + 1):
                    if e + f:
                        value = value - comb(a, e) * comb(b, f) * sums[e, f][..., 3:] * out[a - e, b - f]  # 4.20
            out[a, b] = value / w
        return out[a1, b1]

    def _of(self, knots: tuple[Array, Array], net: Array, degree: tuple[int, int] | None = None) -> NurbsSurface:
        return NurbsSurface.from_homogeneous(degree or self.degree, knots, net, rational=self.rational)

    def to_nurbs(self) -> NurbsSurface:
        """The surface itself."""
        return self

    def insert_knots(self, us: npt.ArrayLike = (), vs: npt.ArrayLike = ()) -> NurbsSurface:
        """The same surface with the knots `us` and `vs` (repeats allowed) inserted."""
        (U, V), net = self.knots, self.homogeneous
        U, net = knot_tools.insert(self.degree[0], U, net, us)
        V, net = _along_v(knot_tools.insert, self.degree[1], V, net, vs)
        return self._of((U, V), net)

    def restricted(self, u: tuple[float, float] | None = None, v: tuple[float, float] | None = None) -> NurbsSurface:
        """The clamped piece on the ranges u and v (None: the whole range)."""
        (U, V), net = self.knots, self.homogeneous
        u0, u1 = knot_tools.inside(self.domain[0], self.domain[0] if u is None else u, "u")
        v0, v1 = knot_tools.inside(self.domain[1], self.domain[1] if v is None else v, "v")
        U, net = knot_tools.restrict(self.degree[0], U, net, u0, u1)
        V, net = _along_v(knot_tools.restrict, self.degree[1], V, net, v0, v1)
        return self._of((U, V), net)

    def clamped(self) -> NurbsSurface:
        """The same surface with full end multiplicities: its edges are the curves of its outer control points."""
        return self.restricted()

    def split(self, direction: Direction, t: float) -> tuple[NurbsSurface, NurbsSurface]:
        """The pieces before and after the parameter t of the direction, clamped."""
        if direction == "u":
            low, high = self.domain[0]
            return self.restricted(u=(low, t)), self.restricted(u=(t, high))
        low, high = self.domain[1]
        return self.restricted(v=(low, t)), self.restricted(v=(t, high))

    def bezier_nets(self) -> tuple[Array, Array, Array]:
        """Breaks in u (s + 1,), in v (r + 1,), and all Bezier nets (s, r, p + 1, q + 1, 3 or 4), homogeneous if
        rational."""
        ts_u, rows = knot_tools.bezier_nets(self.degree[0], self.knots[0], self.homogeneous)
        ts_v, nets = knot_tools.bezier_nets(self.degree[1], self.knots[1], np.moveaxis(rows, 2, 0))
        return ts_u, ts_v, np.ascontiguousarray(np.transpose(nets, (2, 0, 3, 1, 4)))

    def bezier_patches(self) -> tuple[tuple[NurbsSurface, ...], ...]:
        """[i][j] the single-span surface of span i in u and j in v, each on its part of the domain."""
        us, vs, nets = self.bezier_nets()
        p, q = self.degree
        ends_u = [np.repeat(us[i : i + 2], p + 1) for i in range(nets.shape[0])]
        ends_v = [np.repeat(vs[j : j + 2], q + 1) for j in range(nets.shape[1])]
        return tuple(tuple(self._of((a, b), nets[i, j]) for j, b in enumerate(ends_v)) for i, a in enumerate(ends_u))

    def elevated(self, times_u: int = 0, times_v: int = 0) -> NurbsSurface:
        """The same surface, clamped, with its degrees raised."""
        from patchwright.models.degree_elevation import elevated

        (p, q), (U, V), net = self.degree, self.knots, self.homogeneous
        U, net = elevated(p, U, net, times_u)
        V, net = _along_v(elevated, q, V, net, times_v)
        return self._of((U, V), net, (p + times_u, q + times_v))

    def normal(self, u: npt.ArrayLike, v: npt.ArrayLike) -> Array:
        """(..., 3) unit normals along S_u x S_v at broadcast parameters; at a pole their limit from inside."""
        from patchwright.models.differential import normals

        return normals(self, u, v)

    def closest(self, points: npt.ArrayLike) -> ClosestOnSurface:
        """The closest points of the surface to (k, 3) points, with a status each."""
        from patchwright.models.closest_point import closest_on_surface

        return closest_on_surface(self, points)

    def transposed(self) -> NurbsSurface:
        """The surface with u and v exchanged; its normal turns round."""
        weights = None if self.weights is None else self.weights.T
        return NurbsSurface(self.degree[::-1], self.knots[::-1], self.control_points.swapaxes(0, 1), weights)

    def reversed(self, direction: Direction = "u") -> NurbsSurface:
        """The surface run backwards in one direction over the same domain; its normal turns round."""
        axis = 0 if direction == "u" else 1
        knots = list(self.knots)
        knots[axis] = knot_tools.mirrored(knots[axis], *self.domain[axis])
        weights = None if self.weights is None else np.flip(self.weights, axis)
        return NurbsSurface(self.degree, (knots[0], knots[1]), np.flip(self.control_points, axis), weights)

    def iso_curve(self, direction: Direction, value: float) -> NurbsCurve:
        """The curve along `direction` where the other parameter is `value`: "u" gives u -> S(u, value)."""
        from patchwright.models._nurbs_kernel import banded_product, basis_table

        along, across = (0, 1) if direction == "u" else (1, 0)
        t = knot_tools.locked(knot_tools.inside(self.domain[across], np.array([value]), "v" if across else "u"))
        first, rows = basis_table(self.knots[across], self.degree[across], t, 0)
        net = knot_tools.locked(np.moveaxis(self.homogeneous, across, 0))
        line = banded_product(first, rows[0], net.reshape(net.shape[0], -1)).reshape(net.shape[1:])
        return NurbsCurve.from_homogeneous(self.degree[along], self.knots[along], line, rational=self.rational)

    def boundary(self, side: Side) -> NurbsCurve:
        """One of the edges: "u0" and "u1" run along v at the ends of u, "v0" and "v1" along u at the ends of v.

        On a clamped side the curve's control points are the surface's outer ones, bit for bit.
        """
        across, end = (0 if side[0] == "u" else 1), int(side[1])
        along = 1 - across
        U, p = self.knots[across], self.degree[across]
        edge = U[: p + 1] if end == 0 else U[-p - 1 :]
        if edge[0] != edge[-1]:
            return self.iso_curve("v" if across == 0 else "u", self.domain[across][end])
        points = np.take(self.control_points, -end, axis=across)
        weights = None if self.weights is None else np.take(self.weights, -end, axis=across)
        return NurbsCurve(self.degree[along], self.knots[along], points, weights)


def _grid_sums(first_u: IntArray, rows_u: Array, first_v: IntArray, rows_v: Array, net: Array, divide: bool) -> Array:
    from patchwright.models._nurbs_kernel import tensor_product

    out = np.empty((first_u.shape[0], first_v.shape[0], net.shape[2] - divide))
    tensor_product(first_u, rows_u, first_v, rows_v, net, divide, out)
    return out


def _jet_members(order: int) -> tuple[tuple[int, int], ...]:
    if order not in (0, 1, 2):
        raise ParameterError(f"a jet has the order 0, 1 or 2, got {order}")
    return JET[: (1, 3, 6)[order]]


def _check_order(nu: tuple[int, int]) -> None:
    if len(nu) != 2 or min(nu) < 0:
        raise ParameterError(f"the order of a derivative must be two integers of at least 0, got {nu}")


def _along_v(
    operation: Callable[..., tuple[Array, Array]], degree: int, knots: Array, net: Array, *arguments: object
) -> tuple[Array, Array]:
    """A net operation of `knots` along the second axis."""
    new_knots, out = operation(degree, knots, net.swapaxes(0, 1), *arguments)
    return new_knots, out.swapaxes(0, 1)
