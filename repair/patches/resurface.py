"""Resurfacing: a quad layout over a mended triangulation becomes a network of bicubic patches within a tolerance.

The paper's chain (Hamann, Jean, Razdan, section 3) for every quad: shared boundary curves, Coons patch, projection,
gap filling, bicubic approximant; then smooth joins of the whole network and the discrete error. Curves and patches
whose error exceeds the tolerance get twice the pieces, patches only in the direction in which the error changes, and so
do patches along seams that still turn too much; until all is well, the pieces no longer help, or there are
`MOST_CELLS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.tolerance import Tolerance
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.edge_curves import EdgeCurves
from patchwright.repair.patches.edge_fit import VertexShapes, edge_errors, first_curves, fit_edge_curves
from patchwright.repair.patches.fit_error import patch_errors
from patchwright.repair.patches.knife_edges import with_knife_edges
from patchwright.repair.patches.network import PatchNetwork
from patchwright.repair.patches.patch_fit import Target, fit_group
from patchwright.repair.patches.patch_nets import PatchNets, coons_nets, folds, sides
from patchwright.repair.patches.paths_on_surface import on_surface
from patchwright.repair.patches.roughness import Roughness
from patchwright.repair.patches.smooth_joins import STIFFER, join, join_carefully

FIRST_CELLS = 2
CLOSE = 0.25  # of the tolerance: how far a path may stray from the target
MOST_CELLS = 16
LEANING = 4.0  # times: a direction in which the error changes so much less than in the other gets no more pieces
WORTH = 0.8  # twice the pieces must bring the error below this share of what it was, or they count as barren
FINISHING = 2  # rounds more in which what the last joins have moved beyond the tolerance is fitted again
FINISHED = 5000  # patches: of more a join takes minutes, and what was fitted in the rounds before has to do
FEW = 0.005  # of all patches: so few are not worth such a round
DRAWN_OFF = 1.5  # times the error it had or may have: a patch that joining takes farther off is stiffer the next time
PATIENCE = 3  # barren doublings in a row after which a curve or patch is left as it is

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """Nets with the error, its change along u and v, and the gap marks of each patch."""

    nets: PatchNets
    error: Array  # (m,)
    restless: Array  # (m, 2)
    invented: BoolArray  # (m, 8, 8)


def resurface(
    layout: QuadLayout,
    target: Target,
    tolerance: Tolerance,
    *,
    limits: Array | None = None,
    method: str = "smooth",
    noise: float = 0.0,
    progress: Progress | None = None,
) -> PatchNetwork:
    """Fit the network.

    Parameters
    ----------
    layout : quads whose vertices and edge paths lie on the target
    target : the mended triangulation and which of its triangles are invented
    tolerance : `.fit` bounds the distance between patches and data at the error samples (HJR 17)
    limits : (m,) another bound for each patch, a length, or None; an edge keeps the tighter of its patches' bounds
    method : gap filling, see `filling.METHODS`
    noise : scatter of the data
    progress : called with a label and a share in [0, 1]

    Returns
    -------
    PatchNetwork; `deviation` tells the patches that did not reach the tolerance.
    """
    say = progress or (lambda label, share: None)
    allowed = np.full(len(layout.quads), tolerance.fit) if limits is None else limits
    along = np.where(layout.edge_quads >= 0, allowed[layout.edge_quads], np.inf).min(axis=1)
    layout = on_surface(layout, target, CLOSE * along)
    say("fitting patches", 0.0)
    edges = first_curves(layout, target, along, FIRST_CELLS, MOST_CELLS)
    everything = np.arange(len(layout.quads))
    state = _fit(layout, edges, _needed(layout, edges), everything, None, target, method, noise)
    given, layout = layout, with_knife_edges(layout, state.nets, target, allowed)
    if layout is not given:
        edges = fit_edge_curves(layout, target, np.asarray(edges.cells))
        state = _fit(layout, edges, _needed(layout, edges), everything, None, target, method, noise)
    shapes = VertexShapes.of(layout, edges, state.nets, target)
    stiffness: Array | None = None

    def fitted(cells: IntArray) -> EdgeCurves:
        return shapes.settled(layout, fit_edge_curves(layout, target, cells), target, along)

    def joined(state: _State, *, last: bool = False) -> _State:
        nonlocal stiffness
        room = np.maximum(state.error, allowed)
        if last:
            nets, stiffness = join_carefully(layout, state.nets, room, stiffness)
        else:
            nets = join(layout, state.nets, room)
        error, restless = patch_errors(nets, everything, target, state.invented)
        if stiffness is not None:
            stiffness[error > DRAWN_OFF * room] *= STIFFER
        return _State(nets, error, restless, state.invented)

    edges = fitted(shapes.needed_cells(FIRST_CELLS))
    state = _fit(layout, edges, _needed(layout, edges), everything, None, target, method, noise)
    state = _unfolded(layout, edges, state, target, allowed)
    smooth = joined(state)
    rounds = int(np.log2(MOST_CELLS // FIRST_CELLS))
    final = False
    barren_edges = np.zeros(len(layout.edges), dtype=np.int64)
    barren_patches = np.zeros(len(layout.quads), dtype=np.int64)
    edge_error = edge_errors(layout, edges, target)
    rough = Roughness.of(layout, smooth.nets, tolerance)
    most = rounds + (FINISHING if len(layout.quads) <= FINISHED else 0)
    for turn in range(most):
        say("refining patches", (turn + 1) / (most + 1))
        poor = (smooth.error > allowed) & (barren_patches < PATIENCE)
        if turn >= rounds and poor.mean() < FEW:
            break
        finer = (edge_error > along) & (barren_edges < PATIENCE) & (np.asarray(edges.cells) < MOST_CELLS)
        again = finer
        if finer.any():
            cells = np.where(finer, np.asarray(edges.cells) * 2, edges.cells)
            shapes = shapes.refreshed(layout, state.nets)
            again = shapes.depending(layout, finer)
            edges = edges.replaced(fitted(cells), again)
            error = edge_errors(layout, edges, target)
            barren_edges[finer] = np.where(error > WORTH * edge_error, barren_edges + 1, 0)[finer]
            edge_error = error
        double = (poor[:, None] & _worth_halving(smooth.restless, np.asarray(state.nets.cells))) | rough.along
        wanted = np.maximum(np.where(double, 2, 1) * np.asarray(state.nets.cells), _needed(layout, edges))
        wanted = np.where(wanted > MOST_CELLS, state.nets.cells, wanted)
        changed = again[layout.quad_edges].any(axis=1)
        redo = np.flatnonzero(changed | (wanted != state.nets.cells).any(axis=1))
        if not len(redo):
            break
        before = smooth.error
        state = _fit(layout, edges, wanted, redo, state, target, method, noise)
        state = _unfolded(layout, edges, state, target, allowed)
        final = turn + 1 >= rounds
        smooth = joined(state, last=final)
        tried = redo[poor[redo]]
        barren_patches[tried] = np.where(smooth.error > WORTH * before, barren_patches + 1, 0)[tried]
        rough = rough.after(layout, smooth.nets, tolerance)
    say("joining patches", 0.95)
    if not final:
        smooth = joined(state, last=True)
    return PatchNetwork(layout, edges, smooth.nets, smooth.invented, smooth.error)


def _worth_halving(change: Array, cells: IntArray) -> BoolArray:
    """(m, 2) the directions in which more pieces help: along which the distance from the data changes most.

    Where these have all the pieces they may have, the other direction.
    """
    restless = LEANING * change >= change[:, ::-1]
    spent = restless & (cells >= MOST_CELLS)
    return np.asarray(restless | spent[:, ::-1])


def _needed(layout: QuadLayout, edges: EdgeCurves) -> IntArray:
    """(m, 2) the fewest pieces of each patch that carry its sides exactly."""
    own = np.asarray(edges.cells)[layout.quad_edges]
    return np.stack([own[:, [0, 2]].max(axis=1), own[:, [1, 3]].max(axis=1)], axis=1)


def _fit(
    layout: QuadLayout,
    edges: EdgeCurves,
    cells: IntArray,
    which: IntArray,
    old: _State | None,
    target: Target,
    method: str,
    noise: float,
) -> _State:
    """Fit the patches `which`; the others are taken from `old`."""
    groups: list[tuple[IntArray, Array]] = []
    invented = np.zeros((len(layout.quads), 8, 8), dtype=bool) if old is None else old.invented.copy()
    for m, n in np.unique(cells[which], axis=0):
        some = which[(cells[which] == (m, n)).all(axis=1)]
        fitted = fit_group(
            sides(layout, edges, some, (int(m), int(n))), (int(m), int(n)), target, method=method, noise=noise
        )
        groups.append((some, fitted.nets))
        invented[some] = _mark(~fitted.data)
    if old is not None:
        rest = np.setdiff1d(np.arange(len(layout.quads)), which)
        for m, n in np.unique(old.nets.cells[rest], axis=0):
            some = rest[(old.nets.cells[rest] == (m, n)).all(axis=1)]
            groups.append((some, old.nets.nets(some)))
    nets = PatchNets.pack(cells, groups)
    error = np.zeros(len(nets)) if old is None else old.error.copy()
    restless = np.zeros((len(nets), 2)) if old is None else old.restless.copy()
    found = patch_errors(nets, which, target, invented)
    error[which], restless[which] = found[0][which], found[1][which]
    return _State(nets, error, restless, invented)


def _unfolded(layout: QuadLayout, edges: EdgeCurves, state: _State, target: Target, allowed: Array) -> _State:
    """Folded patches give way to the Coons patches of their sides where those fold less and lie as near the data."""
    before = folds(state.nets)
    folded = np.flatnonzero(before > 0.0)
    if not len(folded):
        return state
    cells = np.asarray(state.nets.cells)
    controls = state.nets.controls.copy()
    for m, n in np.unique(cells[folded], axis=0):
        some = folded[(cells[folded] == (m, n)).all(axis=1)]
        rows = state.nets.offsets[some][:, None] + np.arange((m + 3) * (n + 3))
        controls[rows] = coons_nets(*sides(layout, edges, some, (int(m), int(n)))).reshape(len(some), -1, 3)
    coons = PatchNets(state.nets.cells, state.nets.offsets, controls)
    error = state.error.copy()
    error[folded] = patch_errors(coons, folded, target, state.invented)[0][folded]
    worse = (folds(coons) >= before) | (error > np.maximum(state.error, allowed))
    kept = folded[worse[folded]]
    error[kept] = state.error[kept]
    return _State(_merge(coons, state.nets, kept), error, state.restless, state.invented)


def _mark(missing: BoolArray) -> BoolArray:
    """(k, 8, 8) whether any of the points of each cell of an 8 x 8 split is missing."""
    k, m, n = missing.shape
    out = np.zeros((k, 8, 8), dtype=bool)
    for axis_u, axis_v in ((0, 0), (1, 0), (0, 1), (1, 1)):
        i = np.clip((np.arange(m) * 8 - axis_u) // (m - 1), 0, 7)
        j = np.clip((np.arange(n) * 8 - axis_v) // (n - 1), 0, 7)
        patch, a, b = np.nonzero(missing)
        out[patch, i[a], j[b]] = True
    return out


def _merge(new: PatchNets, old: PatchNets, from_old: IntArray) -> PatchNets:
    """`new` with some patches taken from `old` (same sizes)."""
    controls = new.controls.copy()
    for patch in from_old:
        rows = slice(new.offsets[patch], new.offsets[patch + 1])
        controls[rows] = old.controls[rows]
    return PatchNets(new.cells, new.offsets, controls)
