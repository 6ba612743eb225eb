"""Pinch points: where a curve of self-intersection ends inside a surface, and the proof that only that curve is there.

With p = m + r e and q = m - r e, e at the angle t, S(p) = S(q) becomes F(m, r, t) = (S(p) - S(q)) / 2r = 0, smooth
also at r = 0, where it says that S_u and S_v are parallel (the blow-up of the diagonal; H. Whitney, The singularities
of a smooth n-manifold in (2n - 1)-space, Annals of Mathematics 45, 1944). Where the derivatives of F by m and t are
independent over all of a box, there is one point for each r at most: one curve that runs from a pinch point outward.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.ssi.chart import Chart, elevation, independent, local, restricted
from patchwright.ssi.neighbours import Pairs
from patchwright.ssi.singular_points import Ball

ARCS = 48  # parts of the half turn of t
REACH = 0.06  # of the size: half the distance of p and q at which a curve is led to the pinch point
OUTSIDE = 1.3  # times that: where a curve is looked for
NODES = 9  # radii at which the curve is solved
STEPS = 5  # pieces of the curve inside
NEWTON = 30


@dataclass(frozen=True, slots=True, eq=False)
class Pinch:
    """A pinch point: its parameters in the chart and the angle of the direction that S loses there."""

    chart: Chart
    metric: Array
    uv: Array
    angle: float


def metric_of(chart: Chart) -> Array:
    """(2,) parameter changes that move a point by about the unit length."""
    nets = chart.pieces.nets[..., :3] / chart.pieces.nets[..., 3:]
    speeds = []
    for axis in (0, 1):
        steps = np.linalg.norm(np.diff(nets, axis=1 + axis), axis=3).mean(axis=(1, 2)) * (nets.shape[1 + axis] - 1)
        speeds.append(float((steps / chart.pieces.width[:, axis]).mean()))
    return np.asarray(1.0 / np.maximum(np.array(speeds), 1e-300))


def one_curve(chart: Chart, pairs: Pairs, metric: Array) -> BoolArray:
    """(n,) whether it is proved that the hulls of pairs of neighbours hold at most one curve, which has one point for
    each distance of p and q. Polynomial surfaces only, pairs on one piece and off the border only."""
    out = np.zeros(len(pairs), dtype=bool)
    inner = (pairs.kp == pairs.kq) & ~pairs.shift.any(axis=1)
    hull = pairs.hull
    for axis in (0, 1):
        low, high = chart.breaks[axis][0], chart.breaks[axis][-1]
        if not chart.period[axis]:
            inner &= (hull[:, 2 * axis] > low) & (hull[:, 2 * axis + 1] < high)
    at = np.flatnonzero(inner)
    if chart.pieces.rational or not at.size:
        return out
    k, box = pairs.kp[at], hull[at]
    S = restricted(chart.pieces.nets[k][..., :3], *local(chart.cell(k), box))
    half = 0.5 * (box[:, 1::2] - box[:, ::2])
    scale = (0.5 * metric / half)[:, :, None, None, None]
    p, q = S.shape[1] - 1, S.shape[2] - 1
    first = _raised(p * np.diff(S, axis=1), p, q) * scale[:, 0], _raised(q * np.diff(S, axis=2), p, q) * scale[:, 1]
    uu = _raised(p * (p - 1) * np.diff(S, 2, axis=1), p, q) if p > 1 else 0.0 * S
    vv = _raised(q * (q - 1) * np.diff(S, 2, axis=2), p, q) if q > 1 else 0.0 * S
    uv = _raised(p * q * np.diff(np.diff(S, axis=1), axis=2), p, q)
    second = [uu * scale[:, 0] ** 2, uv * scale[:, 0] * scale[:, 1], vv * scale[:, 1] ** 2]
    Su, Sv, Suu, Suv, Svv = (x.reshape(at.size, -1, 3) for x in (*first, *second))
    open_ = _unclear(Su, Sv)
    none = ~open_.any(axis=1)
    start, width = _arc(open_)
    radius = np.linalg.norm(half / metric, axis=1)
    good = np.flatnonzero((width <= ARCS // 3) & ~none)
    out[at[none]] = True
    if not good.size:
        return out
    step = np.pi / ARCS
    t0, t1 = start[good] * step, (start[good] + width[good]) * step
    mid, spread = 0.5 * (t0 + t1), 0.5 * (t1 - t0)
    families: tuple[list[Array], list[Array], list[Array]] = ([], [], [])
    Su, Sv, Suu, Suv, Svv = (x[good] for x in (Su, Sv, Suu, Suv, Svv))
    for angle, stretch in ((t0, 1.0), (t1, 1.0), (mid, 1.0 / np.cos(spread))):  # a triangle that holds the arc
        c, s = ((stretch * f(angle))[:, None, None] for f in (np.cos, np.sin))
        families[0].append(c * Suu + s * Suv)
        families[1].append(c * Suv + s * Svv)
        turning = c * c * Suv - s * s * Suv + c * s * (Svv - Suu)
        loose = np.linalg.norm(np.ptp(turning, axis=1), axis=1)
        ball = (np.sqrt(3.0) * 0.5 * radius[good] * loose * 2.0)[:, None, None]
        families[2].extend(c * Sv - s * Su + sign * ball * axis for sign in (-1.0, 1.0) for axis in np.eye(3))
    out[at[good]] = independent(families)
    return out


def _raised(nets: Array, p: int, q: int) -> Array:
    """Nets (n, ., ., 3) as those of degree (p, q)."""
    up = [elevation(nets.shape[1 + k] - 1, d) for k, d in ((0, p), (1, q))]
    return np.asarray(np.einsum("ik,nkjc,lj->nilc", up[0], nets, up[1]))


def _unclear(Su: Array, Sv: Array) -> BoolArray:
    """(n, ARCS) the parts of the half turn for which c S_u + s S_v is not proved to stay off zero."""
    n = Su.shape[0]
    out = np.empty((n, ARCS), dtype=bool)
    step = np.pi / ARCS
    for k in range(ARCS):
        c, s = np.cos((k + 0.5) * step), np.sin((k + 0.5) * step)
        along, across = c * Su + s * Sv, c * Sv - s * Su
        way = along.mean(axis=1)
        least = np.einsum("nmc,nc->nm", along, way) * np.cos(0.5 * step)
        spoil = np.abs(np.einsum("nmc,nc->nm", across, way)) * np.sin(0.5 * step)
        out[:, k] = ~((least - spoil) > 1e-12).all(axis=1)
    return out


def _arc(open_: BoolArray) -> tuple[Array, Array]:
    """Start and length of the shortest run, round the half turn, that holds all marked parts."""
    n, k = open_.shape
    start, width = np.zeros(n), np.full(n, k)
    for i in np.flatnonzero(open_.any(axis=1)):
        at = np.flatnonzero(open_[i])
        gaps = np.diff(np.append(at, at[0] + k))
        widest = int(np.argmax(gaps))
        start[i], width[i] = at[(widest + 1) % at.size], k - gaps[widest] + 1
    return start, width


def _jets(chart: Chart, uv: Array) -> Array:
    """(6, 3) S, S_u, S_v, S_uu, S_uv, S_vv at a place of the chart, in its parameters."""
    from patchwright.ssi._tracing_kernel import surface_jets

    at = [np.searchsorted(t, x, "right") - 1 for t, x in zip(chart.breaks, uv, strict=True)]
    i, j = (int(np.clip(k, 0, t.size - 2)) for t, k in zip(chart.breaks, at, strict=True))
    k = i * chart.pieces.shape[1] + j
    width = chart.pieces.width[k]
    jet = surface_jets(chart.pieces.nets[k], ((uv - chart.pieces.low[k]) / width)[None])[0]
    u, v = 1.0 / width
    return np.asarray(jet * np.array([1.0, u, v, u * u, u * v, v * v])[:, None])


def pinches(chart: Chart, pairs: Pairs, metric: Array) -> list[Pinch]:
    """The pinch points in the hulls of pairs, by Newton's method on S_u c + S_v s = 0."""
    out: list[Pinch] = []
    for box in pairs.hull:
        size = box[1::2] - box[::2]
        m = 0.5 * (box[::2] + box[1::2])
        jet = _jets(chart, m)
        t = float(np.arctan2(*np.linalg.svd(jet[1:3].T * metric)[2][1][::-1]))
        for _ in range(NEWTON):
            jet = _jets(chart, np.clip(m, *_domain(chart)))
            e = metric * np.array([np.cos(t), np.sin(t)])
            turned = metric * np.array([-np.sin(t), np.cos(t)])
            J = np.stack((e[0] * jet[3] + e[1] * jet[4], e[0] * jet[4] + e[1] * jet[5], jet[1:3].T @ turned), axis=1)
            step = np.linalg.lstsq(J, -(jet[1:3].T @ e), rcond=None)[0]
            m, t = m + step[:2], t + float(step[2])
            if (np.abs(m - 0.5 * (box[::2] + box[1::2])) > 2.0 * size).any():
                break
            if np.abs(step[:2] / metric).max() < 1e-14:
                break
        inside = ((m >= box[::2] - 0.01 * size) & (m <= box[1::2] + 0.01 * size)).all()
        known = any((np.abs(m - x.uv) <= 1e-6 * metric).all() for x in out)
        if inside and not known and np.linalg.norm(_jets(chart, m)[1:3].T @ e) < 1e-9:
            out.append(Pinch(chart, metric, m, t))
    return out


def _domain(chart: Chart) -> tuple[Array, Array]:
    return np.array([t[0] for t in chart.breaks]), np.array([t[-1] for t in chart.breaks])


def ball_of(pinch: Pinch) -> Ball:
    """The ball round a pinch point in which a curve is led into it by the radius r."""
    chart = pinch.chart
    centre = _jets(chart, pinch.uv)[0]
    at, _ = _solved(pinch, REACH)
    radius = float(np.linalg.norm(at[0] - centre))

    def lead(jets: Array, lengths: Array, which: tuple[int, int]) -> tuple[Array, Array]:
        low, width = (np.array([x[k] for k in which]) for x in (chart.pieces.low, chart.pieces.width))
        p, q = (low[k] + width[k] * jets[-1, 0, 3 + 2 * k : 5 + 2 * k] for k in (0, 1))
        d = 0.5 * (p - q) / pinch.metric
        r = float(np.linalg.norm(d))
        turn = float(np.arctan2(d[1], d[0]))
        flip = 1.0 if np.cos(turn - pinch.angle) > 0.0 else -1.0
        nodes, more = _inside(pinch, r, flip)
        for k in (0, 1):
            nodes[:, :, 3 + 2 * k : 5 + 2 * k] /= width[k]
            nodes[:, 0, 3 + 2 * k : 5 + 2 * k] -= low[k] / width[k]
        nodes[0] = jets[-1]
        return np.concatenate((jets, nodes[1:])), np.concatenate((lengths, more))

    return Ball(centre, radius, "pinch", 0.0, (), lead=lead)


def seed_of(pinch: Pinch) -> Array:
    """(1, ROW) a finding on the curve just outside the ball; none where it is not on the surface."""
    from patchwright.ssi._subdivision_kernel import ROW, TRANSVERSAL

    chart = pinch.chart
    (x, e, m), _ = _solved(pinch, OUTSIDE * REACH)
    row = np.zeros((1, ROW))
    row[0, 0] = TRANSVERSAL
    for side, uv in enumerate((m[:2] + e[:2], m[:2] - e[:2])):
        at = [int(np.searchsorted(t, w, "right")) - 1 for t, w in zip(chart.breaks, uv, strict=True)]
        if any(not 0 <= k < n for k, n in zip(at, chart.pieces.shape, strict=True)):
            return row[:0]
        k = at[0] * chart.pieces.shape[1] + at[1]
        row[0, 1 + side] = k
        row[0, 11 + 2 * side : 13 + 2 * side] = (uv - chart.pieces.low[k]) / chart.pieces.width[k]
    row[0, 15:18] = x
    return row


def _solved(pinch: Pinch, r: float, guess: Array | None = None) -> tuple[Array, Array]:
    """x, p, q at a radius (rows padded to 3), and the unknowns (m, t)."""
    chart, metric = pinch.chart, pinch.metric
    z = np.append(pinch.uv, pinch.angle) if guess is None else guess
    for _ in range(NEWTON):
        e = np.array([np.cos(z[2]), np.sin(z[2])])
        turned = np.array([-e[1], e[0]])
        jp, jq = (_jets(chart, z[:2] + sign * r * metric * e) for sign in (1.0, -1.0))
        F = (jp[0] - jq[0]) / (2.0 * r)
        J = np.column_stack((((jp - jq)[1:3].T / (2.0 * r)), 0.5 * (jp + jq)[1:3].T @ (metric * turned)))
        step = np.linalg.solve(J, -F)
        z = z + step
        if np.abs(step / np.append(metric, 1.0)).max() < 1e-13 / r:
            break
    e = np.array([np.cos(z[2]), np.sin(z[2])]) * metric * r
    x = 0.5 * (_jets(chart, z[:2] + e)[0] + _jets(chart, z[:2] - e)[0])
    return np.array([x, [*e, 0.0], [*z[:2], 0.0]]), z


def _inside(pinch: Pinch, r: float, flip: float) -> tuple[Array, Array]:
    """Jets (STEPS + 1, 3, 7) from the radius r to the pinch point, and the parameter lengths between them.

    x and m are even in the radius, p - m is odd: polynomials in its square through solved points. The parameter is the
    arc length to second order where the curve comes from and runs into the point at a finite rate of the radius.
    """
    radii = r * np.cos(0.5 * np.pi * np.arange(NODES) / NODES)
    rows, z = [], None
    for k in radii:
        row, z = _solved(pinch, float(k), z)
        rows.append([*row[0], *row[2, :2], *(flip * row[1, :2] / k)])
    e = pinch.metric * np.array([np.cos(pinch.angle), np.sin(pinch.angle)])
    rows.append([*_jets(pinch.chart, pinch.uv)[0], *pinch.uv, *(flip * e)])
    share = np.append(radii / r, 0.0) ** 2
    even = np.polynomial.polynomial.polyfit(share, np.array(rows), NODES)  # (NODES + 1, 7) in (radius / r)^2
    powers = np.zeros((2 * NODES + 2, 7))  # x, m in the radius / r, then d
    powers[:-1:2, :5] = even[:, :5]
    powers[1::2, 5:] = even[:, 5:] * r
    full = np.concatenate((powers[:, :3], powers[:, 3:5] + powers[:, 5:], powers[:, 3:5] - powers[:, 5:]), axis=1)
    derivatives = [full, np.polynomial.polynomial.polyder(full, 1), np.polynomial.polynomial.polyder(full, 2)]

    def at(y: Array, order: int) -> Array:
        return np.asarray(np.polynomial.polynomial.polyval(y, derivatives[order])).T

    one = np.ones(1)
    x1, x2 = at(one, 1)[0, :3], at(one, 2)[0, :3]
    rate = -1.0 / float(np.linalg.norm(x1))
    bend = -float(x2 @ x1) * rate**2 / float(x1 @ x1)
    end = (-rate - np.sqrt(rate * rate - 2.0 * bend)) / bend if bend else -1.0 / rate
    s = np.linspace(0.0, end, STEPS + 1)
    y = np.clip(1.0 + rate * s + 0.5 * bend * s * s, 0.0, 1.0)
    y[-1] = 0.0
    speed = (rate + bend * s)[:, None]
    jets = np.stack((at(y, 0), at(y, 1) * speed, at(y, 2) * speed**2 + at(y, 1) * bend), axis=1)
    return jets, np.diff(s)
