"""Arcs: the parts of branches on one pair of Bezier pieces, in the surfaces' own parameters, joined into branches."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.surface import Surface
from patchwright.ssi.bezier_pieces import BezierPieces, Frame
from patchwright.ssi.intersection import CurveKind

ROUND_OFF = 1e-13  # of the size: ends nearer than this meet
SAME = 1e-7  # of the size or the parameter range: ends nearer than this are one point


STOPPED, APART = 1_000_000_000, 1_000_000_001  # ends of arcs that are no singular points


@dataclass(frozen=True, slots=True, eq=False)
class Arc:
    """Jets along a curve: at node i the rows of `jets[i]` are x, uv_a, uv_b (7 numbers) and their first and second
    derivatives by arc length; `lengths[i]` is that of the piece from node i to i + 1.

    `ends` are the numbers of the singular points at which it begins and ends, -1 for none, STOPPED where it could not
    be followed on, APART where the surfaces it touches part; `smooth[i]` tells whether the first derivatives at node i
    are the same on both sides.
    """

    jets: Array
    lengths: Array
    ends: tuple[int, int]
    kind: CurveKind
    closed: bool = False
    smooth: Array | None = None

    def reversed(self) -> Arc:
        """The same run backwards."""
        jets = self.jets[::-1].copy()
        jets[:, 1] *= -1.0
        smooth = None if self.smooth is None else self.smooth[::-1].copy()
        return replace(self, jets=jets, lengths=self.lengths[::-1].copy(), ends=self.ends[::-1], smooth=smooth)


def in_own_parameters(jets: Array, pieces: tuple[BezierPieces, BezierPieces], which: IntArray, frame: Frame) -> Array:
    """Jets (n, 3, 7) of scaled, local ones on pairs of pieces (n, 2) in model units and NURBS parameters."""
    out = jets.copy()
    out[:, 0, :3] = frame.origin + frame.size * jets[:, 0, :3]
    out[:, 2, :3] /= frame.size
    for side, piece in enumerate(pieces):
        at, k = slice(3 + 2 * side, 5 + 2 * side), which[:, side]
        out[:, 0, at] = piece.parameters(k, np.clip(jets[:, 0, at], 0.0, 1.0))
        out[:, 1, at] *= piece.width[k] / frame.size
        out[:, 2, at] *= piece.width[k] / frame.size**2
    return out


def in_analytic_parameters(jets: Array, side: int, surface: Surface, middle: Array) -> Array:
    """The jets with the parameters of the NURBS form replaced by those of the analytic surface itself.

    Both forms share their iso-curves, so each parameter is a function of its own; it is read off along the middle of
    the other, where the surface is regular. `middle` (n, 2) lies inside the spans: derivatives at knots are theirs.
    """
    nurbs = surface.to_nurbs()
    if nurbs is surface:
        return jets
    out = jets.copy()
    place, own_place = _matched(surface, nurbs)
    # an arc lies inside one span: derivatives are one-sided, taken a little inside
    for axis in (0, 1):
        at = 3 + 2 * side + axis
        t = np.clip(jets[:, 0, at], *nurbs.domain[axis])
        other, mine = np.full(t.shape, place[1 - axis]), np.full(t.shape, own_place[1 - axis])
        inner = t + 1e-8 * (middle[:, axis] - t)
        first, second = ((1, 0), (2, 0)) if axis == 0 else ((0, 1), (0, 2))

        def along(s: Surface, values: Array, nu: tuple[int, int], axis: int = axis, other: Array = other) -> Array:
            return s(values, other, nu) if axis == 0 else s(other, values, nu)

        own = t.copy()
        low, high = surface.domain[axis]
        target = along(nurbs, t, (0, 0))
        for _ in range(12):
            r = target - along(surface, own, (0, 0), other=mine)
            d = along(surface, own, first, other=mine)
            step = (r * d).sum(axis=1) / (d * d).sum(axis=1)
            own = np.clip(own + step, low, high)
            if np.abs(step).max() < 1e-15 * max(1.0, abs(high - low)):
                break
        d = along(surface, own, first, other=mine)
        rate = (along(nurbs, inner, first) * d).sum(axis=1) / (d * d).sum(axis=1)
        bend = along(nurbs, inner, second) - along(surface, own, second, other=mine) * rate[:, None] ** 2
        bend = (bend * d).sum(axis=1) / (d * d).sum(axis=1)
        out[:, 0, at] = own
        out[:, 1, at] = rate * jets[:, 1, at]
        out[:, 2, at] = rate * jets[:, 2, at] + bend * jets[:, 1, at] ** 2
    return out


def _matched(surface: Surface, nurbs: Surface) -> tuple[Array, Array]:
    """A regular place in the parameters of the NURBS form and in the surface's own, by Newton's method."""
    low, high = np.array(nurbs.domain).T
    uv = low + np.array([0.47, 0.47]) * (high - low)
    x, own = nurbs(uv[0], uv[1]), uv.copy()
    for _ in range(30):
        J = np.stack((surface(own[0], own[1], (1, 0)), surface(own[0], own[1], (0, 1))), axis=1)
        step = np.linalg.lstsq(J, x - surface(own[0], own[1]), rcond=None)[0]
        own = np.clip(own + step, *np.array(surface.domain).T)
        if np.abs(step).max() < 1e-15 * (1.0 + np.abs(own).max()):
            break
    return uv, own


def without_repeats(arcs: list[Arc], along_border: BoolArray, scale: Array) -> list[Arc]:
    """Arcs that run along a border of their pieces are found on both sides of it: one of each is kept."""
    from scipy.spatial import cKDTree

    if not along_border.any():
        return arcs
    clouds = [samples(a) for a in arcs]
    out = [a for a, flag in zip(arcs, along_border, strict=True) if not flag]
    kept = [x for x, flag in zip(clouds, along_border, strict=True) if not flag]
    flagged = [k for k, flag in enumerate(along_border) if flag]
    for k in sorted(flagged, key=lambda k: -float(arcs[k].lengths.sum())):
        mine = clouds[k]
        if kept:
            cloud = np.concatenate(kept)
            step = float(max(np.linalg.norm(np.diff(x[:, :3], axis=0), axis=1).max() for x in [mine, *kept]))
            far, at = cKDTree(cloud[:, :3]).query(mine[1:-1, :3])
            across = mine[1:-1, :3] - cloud[at, :3]
            tangent = cloud[at, 3:]
            across -= (across * tangent).sum(axis=1)[:, None] * tangent
            if bool(np.all(np.linalg.norm(across, axis=1) < 1e-6 * scale[0])) and bool(np.all(far <= step)):
                continue
        out.append(arcs[k])
        kept.append(mine)
    return out


def samples(arc: Arc) -> Array:
    """(n, 6) points and tangents along an arc."""
    t = np.linspace(0.0, 1.0, 33)[:, None, None]
    L = arc.lengths[None, :, None]
    a, b = arc.jets[None, :-1, :, :3], arc.jets[None, 1:, :, :3]
    h0 = 1.0 - 10.0 * t**3 + 15.0 * t**4 - 6.0 * t**5
    h1 = t - 6.0 * t**3 + 8.0 * t**4 - 3.0 * t**5
    g1 = -4.0 * t**3 + 7.0 * t**4 - 3.0 * t**5
    h2, g2 = 0.5 * (t**2 - 3.0 * t**3 + 3.0 * t**4 - t**5), 0.5 * (t**3 - 2.0 * t**4 + t**5)
    x = h0 * a[:, :, 0] + (1.0 - h0) * b[:, :, 0] + L * (h1 * a[:, :, 1] + g1 * b[:, :, 1])
    x = x + L * L * (h2 * a[:, :, 2] + g2 * b[:, :, 2])
    T = (1.0 - t) * a[:, :, 1] + t * b[:, :, 1]
    return np.concatenate((x, T), axis=2).swapaxes(0, 1).reshape(-1, 6)


def hermite(a: Array, b: Array, L: float, t: float) -> Array:
    """(7,) the quintic Hermite piece of length L between two jets."""
    h0 = 1.0 - 10.0 * t**3 + 15.0 * t**4 - 6.0 * t**5
    h1 = t - 6.0 * t**3 + 8.0 * t**4 - 3.0 * t**5
    h2 = 0.5 * (t**2 - 3.0 * t**3 + 3.0 * t**4 - t**5)
    g1 = -4.0 * t**3 + 7.0 * t**4 - 3.0 * t**5
    g2 = 0.5 * (t**3 - 2.0 * t**4 + t**5)
    return np.asarray(h0 * a[0] + (1.0 - h0) * b[0] + L * (h1 * a[1] + g1 * b[1]) + L * L * (h2 * a[2] + g2 * b[2]))


def joined(arcs: list[Arc], scale: Array) -> list[Arc]:
    """Branches: arcs joined where exactly two free ends share place and parameters.

    They are not joined at singular points, at poles and across the seam of a closed surface, where parameters jump.
    """
    from scipy.spatial import cKDTree

    if not arcs:
        return []
    loops = [a for a in arcs if a.closed]
    open_ = _without_specks([a for a in arcs if not a.closed], scale)
    if not open_:
        return loops
    points = np.array([a.jets[end, 0] / scale for a in open_ for end in (0, -1)])
    free = np.array([a.ends[end] < 0 for a in open_ for end in (0, 1)])
    mate: IntArray = np.full(points.shape[0], -1)
    near = cKDTree(points).query_ball_point(points, SAME, p=np.inf)
    for i, group in enumerate(near):
        others = [j for j in group if j != i and free[j]]
        if free[i] and len(others) == 1:
            back = [j for j in near[others[0]] if j != others[0] and free[j]]
            if back == [i]:
                mate[i] = others[0]
    used = np.zeros(len(open_), dtype=bool)
    out = list(loops)
    order = [k for k in range(2 * len(open_)) if mate[k] < 0] + list(range(2 * len(open_)))
    for start in order:
        if used[start // 2]:
            continue
        chain: list[Arc] = []
        end = start
        while True:
            arc = open_[end // 2]
            used[end // 2] = True
            chain.append(arc if end % 2 == 0 else arc.reversed())
            far = end ^ 1
            after = int(mate[far])
            if after < 0 or used[after // 2]:
                closed = after == start
                break
            end = after
        out.append(_chained(chain, closed, float(scale[0])))
    return out


def _without_specks(arcs: list[Arc], scale: Array) -> list[Arc]:
    """The arcs but those that are too short to tell their ends apart and lie between the ends of others."""
    from scipy.spatial import cKDTree

    speck = np.array([a.ends[0] < 0 and a.ends[1] < 0 and a.lengths.sum() < SAME * scale[0] for a in arcs], dtype=bool)
    if not speck.any() or speck.all():
        return arcs
    ends = np.array([a.jets[[0, -1], 0] / scale for a in arcs])
    far, at = (np.asarray(found) for found in cKDTree(ends[~speck].reshape(-1, 7)).query(ends, p=np.inf))
    spare = speck & (far <= SAME).all(axis=1) & (at[:, 0] != at[:, 1])
    return [a for a, gone in zip(arcs, spare, strict=True) if not gone]


def _chained(chain: list[Arc], closed: bool, size: float) -> Arc:
    """One branch of arcs; where pairs of pieces meet at a corner, a short piece spans what lies on the fourth pair."""
    if len(chain) == 1:
        return replace(chain[0], closed=closed)
    jets, lengths = [chain[0].jets], [chain[0].lengths]
    breaks: list[Array] = [np.ones(chain[0].jets.shape[0])]
    for arc in chain[1:]:
        last, first = jets[-1][-1], arc.jets[0]
        smooth = np.abs(first[1] - last[1]).max() <= 1e-8 * (1.0 + np.abs(last[1]).max())
        breaks[-1][-1] = float(smooth)
        # a joint is stored twice, with a piece of no length between: each side keeps its own derivatives
        lengths += [_between(last, first, size), arc.lengths]
        jets.append(arc.jets)
        breaks.append(np.ones(arc.jets.shape[0]))
        breaks[-1][0] = float(smooth)
    span = _between(jets[-1][-1], jets[0][0], size)
    if closed and span[0] > 0.0:
        lengths.append(span)
        jets.append(jets[0][:1])
        breaks[-1][-1] = 0.0
        breaks.append(np.ones(1))
    ends = (chain[0].ends[0], chain[-1].ends[1])
    return Arc(np.concatenate(jets), np.concatenate(lengths), ends, chain[0].kind, closed, np.concatenate(breaks))


def _between(last: Array, first: Array, size: float) -> Array:
    """(1,) the length of the piece from the end of an arc to the beginning of the next, 0 where they meet."""
    gap = first[0, :3] - last[0, :3]
    return np.array([float(np.linalg.norm(gap)) if gap @ last[1, :3] > ROUND_OFF * size else 0.0])
