"""Parameters whose points spread along a curve, or along both directions of a surface, as a distribution wants.

Source: Yu and Soni, NURBS evaluation and utilization for grid generation, in Numerical grid generation in computational
field simulations (1995), as described by Hamann, Jean and Razdan, section 2: find s_1 whose normalised length s_2 is
the wanted one. Departures: they measure chords of the points and shift one parameter after another; here lengths are
arc lengths with error control, solved by Newton's method inside brackets. On a surface a point's share along u is
taken on its own iso-curve of constant v, and the other way round: two equations for each point, which is independent
of its neighbours. At any v one equation has exactly one solution u(v); the other then changes its sign between the
ends of v, so that a solution always exists and bisection always finds one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from patchwright.models.arc_length import ArcLength
from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.knots import divided
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.quadrature import gauss, inverted

MOST = 2**19  # surface points evaluated at once
STEPS = 100
POLE = 1e-13  # of the surface's size: an iso-curve shorter than this is a pole
HALVINGS = 6


def curve_parameters(curve: NurbsCurve, shares: npt.ArrayLike, accuracy: float = 1e-12) -> Array:
    """(n,) parameters at which the arc length from the start has the wanted shares (n,) of the whole.

    Raises
    ------
    ParameterError : shares that decrease or leave [0, 1], a curve of no length.
    """
    wanted = _shares(shares, 0, "shares")
    arc = ArcLength.of(curve, accuracy)
    if not arc.total > 4.0 * float(np.finfo(np.float64).eps) * float(np.abs(curve.control_points).max()):
        raise ParameterError("the curve has no length to share out")
    return arc.parameter(wanted * arc.total)


def surface_parameters(
    surface: NurbsSurface, shares_u: npt.ArrayLike, shares_v: npt.ArrayLike, accuracy: float = 1e-10
) -> tuple[Array, Array]:
    """u and v, each (n, m), of the points with the wanted shares of arc length along both directions.

    Parameters
    ----------
    shares_u : (n,) or (n, m), increasing along n, in [0, 1]; of the iso-curve of constant v through the point
    shares_v : (m,) or (n, m), increasing along m, in [0, 1]; of the iso-curve of constant u
    accuracy : of the shares reached

    A pole, where an iso-curve has no length, is given the limit of the shares beside it.

    Raises
    ------
    ParameterError : shares that decrease or leave [0, 1], an accuracy that is not in (0, 1), a surface without length
        in one direction.
    """
    if not 0.0 < accuracy < 1.0:
        raise ParameterError(f"the accuracy must lie in (0, 1), got {accuracy}")
    a, b = _shares(shares_u, 0, "shares along u"), _shares(shares_v, -1, "shares along v")
    a = a[:, None] if a.ndim == 1 else a
    try:
        a, b = np.broadcast_arrays(a, b)
    except ValueError as error:
        raise ParameterError(f"shares along u {a.shape} and along v {b.shape} make no grid") from error
    along_u, along_v = (_Direction.of(surface, axis, accuracy) for axis in (0, 1))
    flat_a, flat_b = a.ravel(), b.ravel()
    u, v = np.empty_like(flat_a), np.empty_like(flat_a)
    todo = np.arange(flat_a.shape[0])
    for _ in range(HALVINGS):
        finer_u, finer_v = along_u.halved(), along_v.halved()
        for some in _portions(todo, max(along_u.knots.shape[0], along_v.knots.shape[0])):
            u[some], v[some] = _solved(along_u, along_v, flat_a[some], flat_b[some], accuracy)
        missed = [
            np.maximum(np.abs(_share(finer_u, v[some], u[some]) - flat_a[some]),
                       np.abs(_share(finer_v, u[some], v[some]) - flat_b[some]))
            for some in _portions(todo, max(finer_u.knots.shape[0], finer_v.knots.shape[0]))
        ]  # fmt: skip
        todo = todo[np.concatenate(missed) > 4.0 * accuracy]
        if not todo.size:
            break
        along_u, along_v = finer_u, finer_v
    return u.reshape(a.shape), v.reshape(a.shape)


class _Table(NamedTuple):
    """Lengths along iso-curves, one row each, up to each knot; and how they change from iso-curve to iso-curve."""

    lengths: Array
    changes: Array
    pole: Array


class _Direction(NamedTuple):
    """The iso-curves along one axis, and knots between which one Gauss rule is accurate on all of them."""

    surface: NurbsSurface
    axis: int
    knots: Array
    size: float

    @classmethod
    def of(cls, surface: NurbsSurface, axis: int, accuracy: float) -> _Direction:
        across = divided(surface.breaks[1 - axis], 2)
        curves = [surface.iso_curve("u" if axis == 0 else "v", float(t)) for t in across]
        knots = np.unique(np.concatenate([ArcLength.of(curve, 0.1 * accuracy).knots for curve in curves]))
        net = surface.control_points.reshape(-1, 3)
        return cls(surface, axis, knots, float(np.linalg.norm(np.ptp(net, axis=0))))

    def halved(self) -> _Direction:
        return self._replace(knots=divided(self.knots, 2))

    def rates(self, across: Array, along: Array, pole: Array) -> Array:
        """(2, k, ...) speeds and their change across, at `along` (k, ...) of the iso-curves `across` (k,); at a pole
        the speed is replaced by the rate at which it grows from there."""
        other = across.reshape(-1, *(1,) * (along.ndim - 1))
        uv = (along, other) if self.axis == 0 else (other, along)
        d = self.surface.derivatives(*uv, (1, 1))
        first = d[..., 1, 0, :] if self.axis == 0 else d[..., 0, 1, :]
        mixed = d[..., 1, 1, :]
        speed = np.linalg.norm(first, axis=-1)
        change = np.einsum("...i,...i->...", first, mixed)
        change = np.divide(change, speed, out=np.zeros_like(speed), where=speed > 0.0)
        here = pole.reshape(other.shape)
        return np.stack((np.where(here, np.linalg.norm(mixed, axis=-1), speed), np.where(here, 0.0, change)))

    def table(self, across: Array) -> _Table:
        pole = np.zeros(across.shape[0], dtype=bool)
        found = self._panels(across, pole)
        pole = found[0].sum(axis=1) <= POLE * self.size
        if pole.any():
            found[:, pole] = self._panels(across[pole], pole[pole])
        sums = np.concatenate((np.zeros((2, across.shape[0], 1)), np.cumsum(found, axis=2)), axis=2)
        if not (sums[0, :, -1] > 0.0).all():
            name, at = "uv"[self.axis], float(across[int(np.argmin(sums[0, :, -1]))])
            raise ParameterError(f"the surface has no length along {name} where {'vu'[self.axis]} = {at:.17g}")
        return _Table(sums[0], sums[1], pole)

    def _panels(self, across: Array, pole: Array) -> Array:
        """(2, k, panels) integrals of the rates between neighbouring knots."""
        panels = self.knots.shape[0] - 1
        owner, flags = np.repeat(across, panels), np.repeat(pole, panels)
        a, b = np.tile(self.knots[:-1], across.shape[0]), np.tile(self.knots[1:], across.shape[0])
        return gauss(lambda t: self.rates(owner, t, flags), a, b).reshape(2, across.shape[0], panels)

    def parameters(self, table: _Table, across: Array, share: Array) -> Array:
        """Where the iso-curves have their shares (k,)."""
        rows = np.arange(share.shape[0])
        wanted = share * table.lengths[:, -1]
        k = self.interval(table.lengths, wanted)
        rest = wanted - table.lengths[rows, k]
        t = inverted(
            lambda live, at: self.rates(across[live], at, table.pole[live])[0], self.knots[k], self.knots[k + 1], rest
        )
        t = np.where(share <= 0.0, self.knots[0], t)
        return np.where(share >= 1.0, self.knots[-1], t)

    @staticmethod
    def interval(lengths: Array, wanted: Array) -> IntArray:
        return np.asarray(np.clip((lengths < wanted[:, None]).sum(axis=1) - 1, 0, lengths.shape[1] - 2))

    def share(self, table: _Table, across: Array, along: Array) -> tuple[Array, Array, Array]:
        """The share at `along` (k,) of each iso-curve, its derivative along, and its derivative across."""
        rows = np.arange(along.shape[0])
        k = np.clip(np.searchsorted(self.knots, along, side="right") - 1, 0, self.knots.shape[0] - 2)
        start = self.knots[k]
        part = gauss(lambda t: self.rates(across, t, table.pole), start, along)
        total, change = table.lengths[:, -1], table.changes[:, -1]
        share = (table.lengths[rows, k] + part[0]) / total
        by_across = (table.changes[rows, k] + part[1] - share * change) / total
        return share, self.rates(across, along, table.pole)[0] / total, by_across


def _share(direction: _Direction, across: Array, along: Array) -> Array:
    return direction.share(direction.table(across), across, along)[0]


def _solved(along_u: _Direction, along_v: _Direction, a: Array, b: Array, accuracy: float) -> tuple[Array, Array]:
    """u and v, each (k,), with the shares a and b, by Newton's method on v with u = u(v), kept in brackets of v."""
    first, last = along_v.knots[0], along_v.knots[-1]
    low, high = np.full_like(b, first), np.full_like(b, last)
    v = first + b * (last - first)
    u = np.empty_like(v)
    active = np.arange(v.shape[0])
    for _ in range(STEPS):
        x = v[active]
        rows = along_u.table(x)
        y = along_u.parameters(rows, x, a[active])
        u[active] = y
        _, U_u, U_v = along_u.share(rows, x, y)
        V, V_v, V_u = along_v.share(along_v.table(y), y, x)
        error = V - b[active]
        low[active] = np.where(error < 0.0, x, low[active])
        high[active] = np.where(error > 0.0, x, high[active])
        slope = V_v - np.divide(V_u * U_v, U_u, out=np.zeros_like(U_u), where=U_u > 0.0)  # along u = u(v)
        newton = x - np.divide(error, slope, out=np.full_like(error, np.inf), where=slope > 0.0)
        inside = (newton > low[active]) & (newton < high[active])
        new = np.where(inside, newton, 0.5 * (low[active] + high[active]))
        done = (np.abs(error) <= accuracy) | (np.abs(new - x) <= 2.0 * np.spacing(np.abs(x)))
        v[active] = np.where(done, x, new)
        active = active[~done]
        if not active.size:
            break
    return u, v


def _portions(todo: IntArray, panels: int) -> list[IntArray]:
    most = max(1, MOST // (15 * panels))
    return [todo[i : i + most] for i in range(0, todo.shape[0], most)]


def _shares(values: npt.ArrayLike, axis: int, name: str) -> Array:
    s = np.array(values, dtype=np.float64)
    if s.ndim not in (1, 2) or s.size == 0:
        raise ParameterError(f"{name} must be one row, or one for each grid line, got shape {s.shape}")
    if not np.isfinite(s).all() or s.min() < 0.0 or s.max() > 1.0:
        raise ParameterError(f"{name} must lie in [0, 1]")
    if (np.diff(s, axis=axis) < 0.0).any():
        raise ParameterError(f"{name} must not decrease")
    return s
