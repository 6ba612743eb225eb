"""Smooth joins: the inner control points of all patches moved together until neighbours have one tangent plane.

Source: Hamann, Jean, Razdan, section 3 (tangent-plane continuity after Faux & Pratt). Departure: instead of one
constant ratio per edge, the slopes of both neighbours over the edge's common tangent plane are made to cancel at Gauss
points, in one sparse least-squares problem for the whole network; neighbours may so differ in their number of pieces,
and the twists at a vertex agree with all its edges at once. Among all smooth networks the one nearest to the fitted
patches is taken, nearness being the mean square of the move over each patch. The boundary rows stay bit for bit.

Limits: between the Gauss points an angle is left that falls with the cell size; it is measured, never assumed. Where
the edges at a vertex contradict each other (`vertex_shapes`) the equations have no solution and the nearest is taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.fair_fit import inner_points, patch_normal
from patchwright.repair.patches.joins import edge_uses, seam_angles, side_normals, smooth_edges
from patchwright.repair.patches.patch_nets import PatchNets, evaluate, folds, normals_of
from patchwright.repair.patches.spline_space import collocation, greville

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

PASSES = 3  # Gauss-Newton steps
FINAL_PASSES = 5  # the same where the result is not fitted again
RELEASES = 4  # times the patches that joining spoils are made stiffer
CREASE = 90.0  # degrees: a seam that turns more is a fold
MOST_ROOMS = 8.0  # a patch that moves farther than so many rooms is spoiled
SITES = 3  # Gauss points in each piece of an edge
ANGLE = 0.1  # degrees left over that count as much as a move by the room a patch has
LEGS = 0.1  # of a patch's legs: the most room it has, whatever the tolerance
STRAY = 3.0  # degrees that a step leaves over, beyond which a seam loses its weight
FOLD = 0.5  # cosine of half the turn beyond which a seam is a fold, which is left
STIFFER = 16.0  # times the stiffness of a patch that joining has spoiled, each time it does


@dataclass(frozen=True, slots=True, eq=False)
class _Ring:
    """The inner control points next to the boundary of patches of one size, the only ones smoothness asks for.

    `i`, `j` (r,) their places among the inner points (M + 1, N + 1); `sides` four arrays of their numbers along each
    side; `cost` (r, r) the mean square of the move of a patch whose other inner points follow as best they can, by
    `lift` ((M + 1) (N + 1), r).
    """

    i: IntArray
    j: IntArray
    sides: tuple[IntArray, ...]
    cost: Array
    lift: Array


@lru_cache(maxsize=64)
def _ring(cells: tuple[int, int]) -> _Ring:
    m, n = cells
    number = -np.ones((m + 1, n + 1), dtype=np.int64)
    number[[0, -1], :] = number[:, [0, -1]] = 0
    i, j = np.nonzero(number == 0)
    number[i, j] = np.arange(len(i))
    on = (number >= 0).reshape(-1)
    inner = inner_points(cells)
    gram = patch_normal(cells, (4 * m + 1, 4 * n + 1))[np.ix_(inner, inner)]
    lift = np.zeros((len(on), len(i)))
    lift[on] = np.eye(len(i))
    cost = gram[on][:, on]
    if (~on).any():
        lift[~on] = -np.linalg.solve(gram[~on][:, ~on], gram[~on][:, on])
        cost = cost + gram[on][:, ~on] @ lift[~on]
    return _Ring(i, j, (number[:, 0], number[-1], number[:, -1], number[0]), 0.5 * (cost + cost.T), lift)


def gauss(cells: int, count: int = SITES) -> tuple[Array, Array]:
    """Gauss points of every piece of [0, 1] and their weights, which sum to one."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    at = (np.arange(cells)[:, None] + 0.5 * (1.0 + nodes)) / cells
    return at.reshape(-1), np.tile(0.5 * weights / cells, cells)


def join(
    layout: QuadLayout, fitted: PatchNets, room: Array, stiffness: Array | None = None, passes: int = PASSES
) -> PatchNets:
    """The patches with smooth seams.

    Parameters
    ----------
    fitted : the patches as fitted, which the result stays near to
    room : (m,) the move of each patch, a length, that is worth `ANGLE`; no more than `LEGS` of its legs
    stiffness : (m,) how many times more than others each patch stays as it was fitted; default 1
    passes : Gauss-Newton steps

    Seams that cannot be made smooth lose their weight from step to step (Cauchy's), so that they do not bend others.
    """
    if not smooth_edges(layout).any():
        return fitted
    sizes = np.zeros(len(fitted), dtype=np.int64)
    for cells, which, _ in fitted.groups():
        sizes[which] = len(_ring(cells).i)
    start = np.concatenate([[0], np.cumsum(sizes)])
    cost = (1.0 if stiffness is None else stiffness) / np.minimum(room, LEGS * _legs(fitted)) ** 2
    nets = fitted
    for turn in range(passes):
        nets = _step(layout, nets, fitted, start, cost, robust=turn > 0)
    return nets


def join_carefully(
    layout: QuadLayout, fitted: PatchNets, room: Array, stiffness: Array | None = None
) -> tuple[PatchNets, Array]:
    """The patches with smooth seams; those that would be spoiled are kept stiffer and their neighbours follow them.

    Returns the stiffness (m,) too, which the same patches may start with when they are joined again.
    """
    stiffness = np.ones(len(fitted)) if stiffness is None else stiffness.copy()
    nets = join(layout, fitted, room, stiffness, passes=FINAL_PASSES)
    for _ in range(RELEASES):
        worse = spoiled(layout, nets, fitted, room) & (stiffness < STIFFER**RELEASES)
        if not worse.any():
            break
        stiffness[worse] *= STIFFER
        nets = join(layout, fitted, room, stiffness, FINAL_PASSES)
    return nets, stiffness


def _legs(nets: PatchNets) -> Array:
    """(m,) mean distance from the boundary to the inner row of control points."""
    out = np.empty(len(nets))
    for _, which, group in nets.groups():
        rows = (group[:, :, 1] - group[:, :, 0], group[:, :, -2] - group[:, :, -1])
        columns = (group[:, 1] - group[:, 0], group[:, -2] - group[:, -1])
        legs = np.concatenate([*rows, *columns], axis=1)
        out[which] = np.linalg.norm(legs, axis=-1).mean(axis=1)
    return out


def spoiled(layout: QuadLayout, nets: PatchNets, fitted: PatchNets, room: Array) -> BoolArray:
    """(m,) patches that moved farther than `MOST_ROOMS`, or fold more than they were fitted.

    A fold that a patch got for one it had along its seams is no loss.
    """
    away = np.linalg.norm(nets.controls - fitted.controls, axis=1)
    far = np.maximum.reduceat(away, nets.offsets[:-1]) > MOST_ROOMS * room
    seams = np.where(smooth_edges(layout), seam_angles(layout, side_normals(layout, fitted)), 0.0)
    open_ = (seams[layout.quad_edges] < CREASE).all(axis=1)
    return np.asarray(far | (open_ & (folds(nets) > folds(fitted))))


def _step(
    layout: QuadLayout, nets: PatchNets, fitted: PatchNets, start: IntArray, cost: Array, *, robust: bool
) -> PatchNets:
    """One Gauss-Newton step; `robust` lets the weight of what cannot be followed fall."""
    from scipy.sparse import block_diag, csc_matrix
    from scipy.sparse.linalg import splu

    groups = [(which, group, _ring(cells)) for cells, which, group in nets.groups()]
    directions, away = np.zeros((int(start[-1]), 3)), np.zeros(int(start[-1]))
    pull = np.zeros(int(start[-1]))
    blocks = [np.empty((0, 0))] * len(nets)
    for which, group, ring in groups:
        rows = start[which][:, None] + np.arange(len(ring.i))
        directions[rows] = _directions(group, ring)
        away[rows] = ((group - fitted.nets(which))[:, 1:-1, 1:-1][:, ring.i, ring.j] * directions[rows]).sum(axis=-1)
        pull[rows] = cost[which, None] * (away[rows] @ ring.cost)
        for patch in which.tolist():
            blocks[patch] = cost[patch] * ring.cost
    matrix, slope = _conditions(layout, nets, groups, start, directions)
    if robust:
        trust = 1.0 / np.hypot(1.0, slope / np.radians(STRAY))
        matrix, slope = matrix.multiply(trust[:, None]).tocsr(), trust * slope
    weight = 1.0 / np.radians(ANGLE) ** 2
    normal = csc_matrix(block_diag(blocks, format="csc") + weight * (matrix.T @ matrix))
    solver = splu(normal, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    move = solver.solve(-weight * (matrix.T @ slope) - pull)
    out = []
    for which, group, ring in groups:
        rows = start[which][:, None] + np.arange(len(ring.i))
        moved = group.copy()
        step = np.einsum("ir,krd->kid", ring.lift, move[rows][..., None] * directions[rows])
        moved[:, 1:-1, 1:-1] += step.reshape(len(group), group.shape[1] - 2, group.shape[2] - 2, 3)
        out.append((which, moved))
    return PatchNets.pack(np.asarray(nets.cells), out)


def _directions(nets: Array, ring: _Ring) -> Array:
    """(k, r, 3) unit normals of the patches where the ring's control points act most.

    One direction for each point: where two sides contradict each other at a corner, points that may go anywhere would
    run off sideways.
    """
    m, n = nets.shape[1] - 3, nets.shape[2] - 3
    u, v = greville(m)[1:-1], greville(n)[1:-1]
    du = evaluate(nets, collocation(m, u, 1), collocation(n, v))
    dv = evaluate(nets, collocation(m, u), collocation(n, v, 1))
    return np.asarray(normals_of(du, dv)[:, ring.i, ring.j])


def _conditions(
    layout: QuadLayout,
    nets: PatchNets,
    groups: list[tuple[IntArray, Array, _Ring]],
    start: IntArray,
    directions: Array,
) -> tuple[csr_matrix, Array]:
    """Rows, one per Gauss point of each smooth edge: the sum of both sides' slopes, as moves change it and as it is.

    They are weighted so that their squares sum to the mean square along each edge.
    """
    from scipy.sparse import coo_matrix

    smooth = smooth_edges(layout)
    along = np.asarray(nets.cells)[:, [0, 1, 0, 1]].reshape(-1)  # of each side 4 q + k
    pieces = along[edge_uses(layout)].max(axis=1)
    counts = np.where(smooth, SITES * pieces, 0)
    first, total = np.cumsum(counts) - counts, int(counts.sum())
    parts = []
    common = np.zeros((total, 3))
    for which, group, ring in groups:
        for k in range(4):
            edge = layout.quad_edges[which, k]
            for fine in np.unique(pieces[edge[smooth[edge]]]):
                some = np.flatnonzero(smooth[edge] & (pieces[edge] == fine))
                side = _side(group[some], k, int(fine))
                row = first[edge[some]][:, None] + np.arange(len(side.weight))
                backward = layout.edge_reversed[which[some], k] != (k >= 2)
                row[backward] = row[backward][:, ::-1]
                np.add.at(common, row, side.normal)
                parts.append((row, side, start[which[some]][:, None] + ring.sides[k]))
    length = np.linalg.norm(common, axis=1, keepdims=True)
    common = np.divide(common, length, out=np.zeros_like(common), where=length > 2.0 * FOLD)
    slope = np.zeros(total)
    values, rows, columns = [], [], []
    for row, side, column in parts:
        normal = common[row]
        weight = side.weight / side.width
        np.add.at(slope, row, (side.leg * normal).sum(axis=-1) * weight)
        change = np.matmul(normal, np.swapaxes(directions[column], 1, 2)) * side.basis * weight[..., None]
        where = np.nonzero(change)
        values.append(change[where])
        rows.append(row[where[0], where[1]])
        columns.append(column[where[0], where[2]])
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return coo_matrix(entries, shape=(total, int(start[-1]))).tocsr(), slope


@dataclass(frozen=True, slots=True, eq=False)
class _Side:
    """One side of k patches at s Gauss points: leg to the inner row, normal (k, s, 3), width of the leg across the side
    (k, s), root of the points' weights (s,), and the inner control points' shares (s, cells + 1)."""

    leg: Array
    normal: Array
    width: Array
    weight: Array
    basis: Array


def _side(nets: Array, k: int, pieces: int) -> _Side:
    row = (nets[:, :, 0], nets[:, -1], nets[:, :, -1], nets[:, 0])[k]
    inner = (nets[:, :, 1], nets[:, -2], nets[:, :, -2], nets[:, 1])[k]
    own = row.shape[1] - 3
    at, weight = gauss(pieces)
    basis = collocation(own, at)
    leg, tangent = basis @ (inner - row), collocation(own, at, 1) @ row
    speed = np.linalg.norm(tangent, axis=-1)
    normal = np.cross(tangent, leg) if k < 2 else np.cross(leg, tangent)
    area = np.linalg.norm(normal, axis=-1)
    width = np.divide(area, speed, out=np.full_like(area, np.inf), where=(speed > 0.0) & (area > 0.0))
    normal = np.divide(normal, area[..., None], out=np.zeros_like(normal), where=area[..., None] > 0.0)
    return _Side(leg, normal, width, np.sqrt(pieces * weight), basis[:, 1:-1])
