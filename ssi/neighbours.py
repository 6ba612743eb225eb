"""Neighbouring boxes of a surface (or of two that coincide) told apart: what meets only as neighbours do is explained.

Pairs of boxes that touch in the chart are tested as they are; what the test does not explain is split into quarters.
Children that no longer touch are ordinary pairs, for the subdivision of two surfaces. What is left where the budget or
the least size ends is handed back: folds, cusps and what lies too near them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.ssi.chart import Chart, local, parallel_free, restricted

LEVELS = 40
TOUCH = 1e-9  # of the chart's width: boxes nearer than this touch


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """Pairs of boxes.

    Parameters
    ----------
    p, q : (n, 4) u0 u1 v0 v1 in the chart, q shifted by whole periods beside p
    kp, kq : (n,) the pieces that hold them
    shift : (n, 2) of q
    """

    p: Array
    q: Array
    kp: IntArray
    kq: IntArray
    shift: Array

    def __len__(self) -> int:
        return int(self.kp.size)

    def where(self, mask: BoolArray | IntArray) -> Pairs:
        """The pairs of a mask or an index."""
        return Pairs(self.p[mask], self.q[mask], self.kp[mask], self.kq[mask], self.shift[mask])

    @property
    def hull(self) -> Array:
        """(n, 4) the smallest boxes round both."""
        low, high = np.minimum(self.p, self.q), np.maximum(self.p, self.q)
        return np.stack((low[:, 0], high[:, 1], low[:, 2], high[:, 3]), axis=1)

    @classmethod
    def together(cls, parts: list[Pairs]) -> Pairs:
        """All pairs in one."""
        return cls(
            np.concatenate([x.p for x in parts]),
            np.concatenate([x.q for x in parts]),
            np.concatenate([x.kp for x in parts]),
            np.concatenate([x.kq for x in parts]),
            np.concatenate([x.shift for x in parts]),
        )


def touching(pairs: Pairs, slack: Array) -> BoolArray:
    """(n,) whether the boxes touch in the chart; slack (2,) in its units."""
    p, q = pairs.p, pairs.q
    u = np.maximum(p[:, 0], q[:, 0]) <= np.minimum(p[:, 1], q[:, 1]) + slack[0]
    v = np.maximum(p[:, 2], q[:, 2]) <= np.minimum(p[:, 3], q[:, 3]) + slack[1]
    return np.asarray(u & v)


def told_apart(
    pairs: Pairs,
    explained: Callable[[Pairs], BoolArray],
    stays: Callable[[Pairs], BoolArray],
    least: float,
    budget: int,
    *,
    alone: bool = True,
) -> tuple[Pairs, Pairs]:
    """(far, stuck): pairs that are not neighbours any more, and neighbours that could not be told apart.

    Parameters
    ----------
    explained : which pairs meet only where neighbours do
    stays : which pairs are neighbours
    least : share of the chart below which boxes are not split
    budget : pairs tested
    alone : whether both boxes lie on one surface, so that of a box with itself half the children are enough
    """
    far: list[Pairs] = [pairs.where(np.zeros(0, dtype=np.int64))]
    stuck: list[Pairs] = list(far)
    spent = 0
    for level in range(LEVELS):
        if not len(pairs):
            break
        spent += len(pairs)
        if spent <= budget:
            pairs = pairs.where(~explained(pairs))
        if spent > budget or 0.5**level < least:
            stuck.append(pairs)
            break
        pairs = _quarters(pairs, alone)
        near = stays(pairs)
        far.append(pairs.where(~near))
        pairs = pairs.where(near)
    return Pairs.together(far), Pairs.together(stuck)


def same(pairs: Pairs) -> BoolArray:
    """(n,) which pairs are a box with itself."""
    return np.asarray((pairs.kp == pairs.kq) & (pairs.p == pairs.q).all(axis=1))


def _quarters(pairs: Pairs, alone: bool) -> Pairs:
    """All pairs of quarters, of a box with itself each only once."""
    n = len(pairs)
    children = []
    for box in (pairs.p, pairs.q):
        u, v = 0.5 * (box[:, 0] + box[:, 1]), 0.5 * (box[:, 2] + box[:, 3])
        parts = np.repeat(box[:, None], 4, axis=1)
        parts[:, :2, 1] = parts[:, 2:, 0] = u[:, None]
        parts[:, ::2, 3] = parts[:, 1::2, 2] = v[:, None]
        children.append(parts)
    p = np.repeat(children[0], 4, axis=1).reshape(-1, 4)
    q = np.tile(children[1], (1, 4, 1)).reshape(-1, 4)
    out = Pairs(p, q, np.repeat(pairs.kp, 16), np.repeat(pairs.kq, 16), np.repeat(pairs.shift, 16, axis=0))
    if not alone:  # even the same boxes are of two surfaces
        return out
    first, second = np.tile(np.repeat(np.arange(4), 4), n), np.tile(np.arange(4), 4 * n)
    return out.where(~np.repeat(same(pairs), 16) | (first <= second))


def apart_on(chart: Chart, pairs: Pairs) -> BoolArray:
    """(n,) whether two points of one surface, one in each box, are proved to be apart unless they are one."""
    return parallel_free(*tangents(chart, pairs))


def tangents(chart: Chart, pairs: Pairs) -> tuple[list[Array], list[Array]]:
    """Vectors (n, m, 3) whose cones hold S_u, and S_v, on the hulls of pairs of boxes on neighbouring pieces."""
    hull, none = pairs.hull, np.zeros((len(pairs), 2))
    m = chart.pieces.shape[1]
    rows = [np.divmod(k, m) for k in (pairs.kp, pairs.kq)]
    single = bool((pairs.kp == pairs.kq).all() and not pairs.shift.any())
    parts: tuple[list[Array], list[Array]] = ([], [])
    for a, b in ((0, 0),) if single else ((0, 0), (0, 1), (1, 0), (1, 1)):
        k = rows[a][0] * m + rows[b][1]
        shift = np.stack(((none, pairs.shift)[a][:, 0], (none, pairs.shift)[b][:, 1]), axis=1)
        for axis in (0, 1):
            parts[axis].append(chart.directions(axis, k, hull, shift))
    return parts


def apart_at_pole(chart: Chart, pairs: Pairs) -> BoolArray:
    """(n,) whether boxes at a common pole are proved to share nothing but it: their directions from it are parted."""
    out = np.zeros(len(pairs), dtype=bool)
    for (axis, end), nets in chart.rays.items():
        at = chart.breaks[axis][-end]
        mine = np.flatnonzero(~out & (pairs.p[:, 2 * axis + end] == at) & (pairs.q[:, 2 * axis + end] == at))
        if not mine.size:
            continue
        rays = []
        for k, box, shift in ((pairs.kp, pairs.p, 0.0), (pairs.kq, pairs.q, 1.0)):
            cell = chart.cell(k[mine]) + np.repeat(shift * pairs.shift[mine], 2, axis=1)
            vectors = restricted(nets[_rim(chart, axis, k[mine])], *local(cell, box[mine])).reshape(mine.size, -1, 3)
            rays.append(vectors / np.maximum(np.linalg.norm(vectors, axis=2, keepdims=True), 1e-300))
        between = rays[0].mean(axis=1) - rays[1].mean(axis=1)
        least = np.einsum("nmc,nc->nm", rays[0], between).min(axis=1)
        most = np.einsum("nmc,nc->nm", rays[1], between).max(axis=1)
        out[mine] = (least > 1e-9) & (most < -1e-9)
    return out


def _rim(chart: Chart, axis: int, k: IntArray) -> IntArray:
    """Where pieces at an end of an axis stand along that end."""
    i, j = np.divmod(k, chart.pieces.shape[1])
    return j if axis == 0 else i
