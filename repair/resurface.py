"""Resurfacing: a quad layout over a mended triangulation becomes a network of bicubic patches within a tolerance.

The paper's chain (Hamann, Jean, Razdan, section 3) for every quad: shared boundary curves, Coons patch, projection,
gap filling, bicubic approximant, discrete error; then one pass of smooth joins. Curves and patches whose error exceeds
the tolerance get twice the pieces, until the tolerance is met, the pieces no longer help, or there are `MOST_CELLS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.tolerance import Tolerance
from patchwright.repair.edge_curves import SAMPLES_PER_CELL, EdgeCurves, fit_edges, resample, with_end_tangents
from patchwright.repair.joins import (
    corner_normals,
    edge_end_normals,
    edge_fields,
    follow_fields,
    seam_angles,
    sector_normals,
    side_normals,
    smooth_edges,
)
from patchwright.repair.network import PatchNetwork
from patchwright.repair.patch_fit import Target, fit_group, samples_for
from patchwright.repair.patch_nets import PatchNets, coons_nets, evaluate, folds, sides
from patchwright.repair.quad_layout import QuadLayout
from patchwright.repair.spline_space import collocation, uniform_collocation
from patchwright.repair.stars import corner_angles, leaving, spread

FIRST_CELLS = 2
MOST_CELLS = 16
JOIN_PASSES = 3  # the field settles where both sides can follow; on aircraft the p90 angle goes 10.7, 2.2, 1.6, 1.3
JOIN_REFINEMENTS = 2  # times the pieces along a seam are doubled for the sake of smoothness
SMOOTH = 0.5  # degrees: seams that turn by no more are smooth enough
MOST_JOINED = 32  # pieces along a seam
WORTH = 0.8  # twice the pieces must bring the error below this share of what it was, or they count as barren
PATIENCE = 2  # barren doublings in a row after which a curve or patch is left as it is

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """Nets with the error and the gap marks of each patch."""

    edges: EdgeCurves
    nets: PatchNets
    error: Array  # (m,)
    invented: BoolArray  # (m, 8, 8)


def resurface(
    layout: QuadLayout,
    target: Target,
    tolerance: Tolerance,
    *,
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
    method : gap filling, see `filling.METHODS`
    noise : scatter of the data
    progress : called with a label and a share in [0, 1]

    Returns
    -------
    PatchNetwork; `deviation` tells the patches that did not reach the tolerance.
    """
    say = progress or (lambda label, share: None)
    edge_cells = np.full(len(layout.edges), FIRST_CELLS, dtype=np.int64)
    patch_cells = np.full((len(layout.quads), 2), FIRST_CELLS, dtype=np.int64)
    say("fitting patches", 0.0)
    edges = _fit_edge_curves(layout, target, edge_cells)
    everything = np.arange(len(layout.quads))
    state = _fit(layout, edges, patch_cells, everything, None, target, method, noise)
    normals = corner_normals(state.nets)
    # a corner counts by the sine of its angle, by which the error of its normal grows
    trust = np.abs(np.sin(np.radians(corner_angles(layout, leaving(edges), normals))))
    sectors = sector_normals(layout, normals, trust)
    ends, free = edge_end_normals(layout, sectors), smooth_edges(layout)

    def aligned(curves: EdgeCurves) -> EdgeCurves:
        flat = with_end_tangents(curves, *ends, np.zeros(len(layout.edges), dtype=bool))
        return spread(layout, flat, sectors, free)

    edges = aligned(edges)
    state = _fit(layout, edges, patch_cells, everything, None, target, method, noise)
    rounds = int(np.log2(MOST_CELLS // FIRST_CELLS))
    barren_edges = np.zeros(len(layout.edges), dtype=np.int64)
    barren_patches = np.zeros(len(layout.quads), dtype=np.int64)
    edge_error = _edge_errors(layout, edges, target)
    for turn in range(rounds):
        say("refining patches", (turn + 1) / (rounds + 1))
        finer = (edge_error > tolerance.fit) & (barren_edges < PATIENCE)
        if finer.any():
            cells = np.where(finer, np.asarray(edges.cells) * 2, edges.cells)
            edges = edges.replaced(aligned(_fit_edge_curves(layout, target, cells)), finer)
            error = _edge_errors(layout, edges, target)
            barren_edges[finer] = np.where(error > WORTH * edge_error, barren_edges + 1, 0)[finer]
            edge_error = error
        changed = finer[layout.quad_edges].any(axis=1)
        poor = (state.error > tolerance.fit) & (barren_patches < PATIENCE)
        if not (changed.any() or poor.any()):
            break
        own = np.asarray(edges.cells)[layout.quad_edges]
        needed = np.stack([own[:, [0, 2]].max(axis=1), own[:, [1, 3]].max(axis=1)], axis=1)
        wanted = np.where(poor[:, None], np.asarray(state.nets.cells) * 2, state.nets.cells)
        redo = np.flatnonzero(changed | poor)
        before = state.error
        state = _fit(layout, edges, np.maximum(wanted, needed), redo, state, target, method, noise)
        barren_patches[redo] = np.where(state.error > WORTH * before, barren_patches + 1, 0)[redo]
    state = _unfolded(layout, state, target, tolerance)
    say("joining patches", 0.95)
    allowed = np.maximum(2.0 * state.error, tolerance.fit)  # position before smoothness
    joined = _joined(layout, state.nets, state.error, sectors, target, allowed, state.invented)
    for _ in range(JOIN_REFINEMENTS):
        cells = _smoother_cells(layout, joined[0], tolerance)
        if (cells == joined[0].cells).all():
            break
        joined = _joined(layout, joined[0].refined(cells), joined[1], sectors, target, allowed, state.invented)
    return PatchNetwork(layout, edges, joined[0], state.invented, joined[1])


def _joined(
    layout: QuadLayout,
    nets: PatchNets,
    error: Array,
    sectors: Array,
    target: Target,
    allowed: Array,
    invented: BoolArray,
) -> tuple[PatchNets, Array]:
    """The nets with smooth seams, and the error of each patch.

    A join that takes a patch farther from its data than `allowed` (m,) is undone for that patch.
    """
    everything = np.arange(len(layout.quads))
    for _ in range(JOIN_PASSES):
        moved = follow_fields(layout, nets, edge_fields(layout, side_normals(layout, nets), sectors))
        found = _patch_errors(layout, moved, everything, target, invented)
        spoiled = np.flatnonzero(found > allowed)
        if len(spoiled):
            moved = _merge(moved, nets, spoiled)
            found[spoiled] = error[spoiled]
        nets, error = moved, found
    return nets, error


def _smoother_cells(layout: QuadLayout, nets: PatchNets, tolerance: Tolerance) -> IntArray:
    """(m, 2) cells of each patch, doubled along its smooth seams that still turn by more than `SMOOTH`.

    Seams that turn like creases are left: no number of pieces makes a fold smooth.
    """
    turned = seam_angles(layout, side_normals(layout, nets))
    rough = smooth_edges(layout) & (turned > SMOOTH) & (turned < tolerance.angle)
    cells = np.array(nets.cells)
    for k in range(4):
        which = rough[layout.quad_edges[:, k]] & (cells[:, k % 2] == nets.cells[:, k % 2])
        cells[which, k % 2] *= 2
    cells[cells > MOST_JOINED] = np.asarray(nets.cells)[cells > MOST_JOINED]
    return cells


def _fit_edge_curves(layout: QuadLayout, target: Target, cells: IntArray) -> EdgeCurves:
    """Curves through the paths; smooth edges' samples are put onto the target, sharp ones follow their crease."""
    free = smooth_edges(layout)
    groups = []
    for own in np.unique(cells):
        which = np.flatnonzero(cells == own)
        count = SAMPLES_PER_CELL * int(own) + 1
        samples = _path_samples(layout, which, count)
        on_surface = free[which]
        inner = samples[on_surface, 1:-1]
        if inner.size:
            samples[on_surface, 1:-1] = target.tree.closest(inner.reshape(-1, 3)).points.reshape(inner.shape)
        groups.append((which, samples))
    return fit_edges(groups, np.asarray(cells))


def _path_samples(layout: QuadLayout, which: IntArray, count: int) -> Array:
    """(k, count, 3) equidistant points on the paths of some edges."""
    lengths = np.diff(layout.path_offsets)[which]
    offsets = np.concatenate([[0], np.cumsum(lengths)])
    rows = np.repeat(layout.path_offsets[which] - offsets[:-1], lengths) + np.arange(offsets[-1])
    return resample(layout.path_points[rows], offsets, count)


def _edge_errors(layout: QuadLayout, edges: EdgeCurves, target: Target) -> Array:
    """(e,) largest distance of each curve from its crease, or from the target where it is smooth."""
    free = smooth_edges(layout)
    out = np.zeros(len(layout.edges))
    for cells, which, controls in edges.groups():
        count = 4 * cells + 1
        mid = (np.arange(count) + 0.5) / count
        points = np.einsum("ai,kid->kad", collocation(cells, mid), controls)
        on_surface = free[which]
        if on_surface.any():
            flat = points[on_surface].reshape(-1, 3)
            out[which[on_surface]] = target.tree.closest(flat).distance.reshape(-1, count).max(axis=1)
        if (~on_surface).any():
            dense = _path_samples(layout, which[~on_surface], 4 * count + 1)
            gap = points[~on_surface][:, :, None] - dense[:, None]
            out[which[~on_surface]] = np.linalg.norm(gap, axis=-1).min(axis=2).max(axis=1)
    return out


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
    error = np.zeros(len(layout.quads)) if old is None else old.error.copy()
    error[which] = _patch_errors(layout, nets, which, target, invented)[which]
    return _State(edges, nets, error, invented)


def _unfolded(layout: QuadLayout, state: _State, target: Target, tolerance: Tolerance) -> _State:
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
        controls[rows] = coons_nets(*sides(layout, state.edges, some, (int(m), int(n)))).reshape(len(some), -1, 3)
    coons = PatchNets(state.nets.cells, state.nets.offsets, controls)
    error = state.error.copy()
    error[folded] = _patch_errors(layout, coons, folded, target, state.invented)[folded]
    worse = (folds(coons) >= before) | (error > np.maximum(state.error, tolerance.fit))
    kept = folded[worse[folded]]
    error[kept] = state.error[kept]
    return _State(state.edges, _merge(coons, state.nets, kept), error, state.invented)


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


def _patch_errors(layout: QuadLayout, nets: PatchNets, which: IntArray, target: Target, invented: BoolArray) -> Array:
    """(m,) largest distance from the data at corners, edge midpoints and centres of the fit's cells (HJR 17).

    Samples on gaps are left out: there is nothing they should be near to.
    """
    out = np.full(len(nets), np.nan)
    for m, n in np.unique(nets.cells[which], axis=0):
        some = which[(nets.cells[which] == (m, n)).all(axis=1)]
        nu, nv = samples_for(int(m)), samples_for(int(n))
        us, vs = np.linspace(0.0, 1.0, 2 * nu + 1), np.linspace(0.0, 1.0, 2 * nv + 1)
        points = evaluate(
            nets.nets(some), uniform_collocation(int(m), 2 * nu + 1), uniform_collocation(int(n), 2 * nv + 1)
        )
        closest = target.tree.closest(points.reshape(-1, 3))
        distance = closest.distance.copy()
        distance[target.invented[closest.triangle]] = 0.0
        distance = distance.reshape(points.shape[:3])
        gap = invented[some][:, np.minimum((us * 8).astype(int), 7)][:, :, np.minimum((vs * 8).astype(int), 7)]
        distance[gap] = 0.0
        out[some] = distance.max(axis=(1, 2))
    return out


def _merge(new: PatchNets, old: PatchNets, from_old: IntArray) -> PatchNets:
    """`new` with some patches taken from `old` (same sizes)."""
    controls = new.controls.copy()
    for patch in from_old:
        rows = slice(new.offsets[patch], new.offsets[patch + 1])
        controls[rows] = old.controls[rows]
    return PatchNets(new.cells, new.offsets, controls)
