"""The curves of a layout's edges fitted to the geometry, and what they owe to the surface at their ends.

Smooth edges lie on the target and leave their vertices in the tangent planes, opposite ones of regular vertices in one
line; sharp ones follow their crease. What holds at the vertices is found once, from a first fit, and then kept while
curves get more pieces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.layout.resample import resample
from patchwright.repair.patches.crease_lines import along_creases
from patchwright.repair.patches.edge_curves import (
    SAMPLES_PER_CELL,
    EdgeCurves,
    fit_edges,
    with_end_bends,
    with_end_tangents,
    with_tips,
)
from patchwright.repair.patches.joins import edge_end_normals, sector_normals, smooth_edges
from patchwright.repair.patches.leg_room import leg_room
from patchwright.repair.patches.patch_fit import Target
from patchwright.repair.patches.patch_nets import PatchNets
from patchwright.repair.patches.spline_space import collocation, uniform_collocation
from patchwright.repair.patches.stars import leaving, spread
from patchwright.repair.patches.straight import bent_ends, straighten
from patchwright.repair.patches.vertex_shapes import facing, vertex_forms, vertex_normals

FEWEST_SITES = 32  # at which the distance of a smooth curve from the surface is taken
LEAST_LEG = 0.3  # of a leg's length is kept, however far it turned from the direction it owes its vertex


@dataclass(frozen=True, slots=True, eq=False)
class VertexShapes:
    """What the surface is like at the ends of the edges.

    Parameters
    ----------
    sectors : (m, 4, 3) unit normals at the corners, zero at cusps
    tips : (e, 2, 3) unit directions in which each edge leaves its start and its end
    bends : (e, 2) normal curvature of the surface in these directions
    bent : (e, 2) ends of smooth edges that must have that curvature
    """

    sectors: Array
    tips: Array
    bends: Array
    bent: BoolArray

    @classmethod
    def of(cls, layout: QuadLayout, edges: EdgeCurves, nets: PatchNets, target: Target) -> VertexShapes:
        """From a first fit."""
        sectors = vertex_normals(layout, nets, sector_normals(layout, facing(nets, target)), target)
        smooth = smooth_edges(layout)
        none = np.zeros(len(layout.edges), dtype=bool)
        flat = with_end_tangents(edges, *edge_end_normals(layout, sectors), none)
        flat, sectors = along_creases(layout, flat, sectors)
        flat = with_end_tangents(flat, *edge_end_normals(layout, sectors), none)
        open_ = spread(layout, flat, sectors, smooth)
        lined, straight = straighten(layout, open_, smooth, sectors)
        legs = leaving(lined)
        length = np.linalg.norm(legs, axis=-1, keepdims=True)
        tips = np.divide(legs, length, out=np.zeros_like(legs), where=length > 0)
        known = (edge_end_normals(layout, sectors)[0] != 0.0).any(axis=2)
        blank = np.zeros((len(layout.edges), 2))
        return cls(sectors, tips, blank, bent_ends(layout, smooth, straight) & known).refreshed(layout, nets)

    def refreshed(self, layout: QuadLayout, nets: PatchNets) -> VertexShapes:
        """With the curvatures of a finer fit."""
        forms = vertex_forms(layout, nets, self.sectors).reshape(*self.sectors.shape[:2], 9)
        at_ends, _ = edge_end_normals(layout, forms)
        bends = np.einsum("eki,ekij,ekj->ek", self.tips, at_ends.reshape(-1, 2, 3, 3), self.tips)
        return replace(self, bends=bends)

    def depending(self, layout: QuadLayout, finer: BoolArray) -> BoolArray:
        """(e,) the edges of the mask and those that share a vertex with them whose curvatures must agree."""
        touched = np.zeros(len(layout.vertices), dtype=bool)
        touched[layout.edges[finer]] = True
        return np.asarray(finer | (touched[layout.edges] & self.bent).any(axis=1))

    def needed_cells(self, fewest: int) -> IntArray:
        """(e,) pieces below which an edge has no room for what it owes its ends, at least `fewest`."""
        return np.where(self.bent.all(axis=1), np.maximum(fewest, 4), fewest)

    def settled(self, layout: QuadLayout, curves: EdgeCurves, target: Target, most: Array) -> EdgeCurves:
        """The curves with their ends as they owe them and, where smooth, fitted to the target again.

        `most` (e,) is the length each curve may move for the sake of its curvatures; beside slim patches it moves less,
        and legs that are turned are only as long as they have room (`leg_room`).
        """
        controls = curves.controls.copy()
        legs, room = leaving(curves), leg_room(layout, curves)
        aside = np.linalg.norm(np.cross(legs, self.tips), axis=-1)
        size = np.linalg.norm(legs, axis=-1)
        longest = np.divide(room * size, aside, out=np.full_like(room, np.inf), where=aside > 0.0)
        along = np.minimum(np.maximum((legs * self.tips).sum(axis=-1), LEAST_LEG * size), longest)
        first, last = curves.offsets[:-1], curves.offsets[1:] - 1
        controls[first + 1] = controls[first] + along[:, 0, None] * self.tips[:, 0]
        controls[last - 1] = controls[last] + along[:, 1, None] * self.tips[:, 1]
        directed = EdgeCurves(curves.cells, curves.offsets, controls)
        smooth, groups = smooth_edges(layout), []
        for cells, which, points in directed.groups():
            on, some = which[smooth[which]], points[smooth[which]]
            if len(on):
                samples = uniform_collocation(cells, SAMPLES_PER_CELL * cells + 1) @ some
                groups.append((on, target.tree.closest(samples.reshape(-1, 3)).points.reshape(samples.shape)))
        normals, _ = edge_end_normals(layout, self.sectors)
        fitted = with_tips(directed, self.tips, groups, LEAST_LEG, longest)
        return with_end_bends(fitted, normals, self.bends, self.bent, np.minimum(most, room.min(axis=1)))


def fit_edge_curves(layout: QuadLayout, target: Target, cells: IntArray) -> EdgeCurves:
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


def first_curves(layout: QuadLayout, target: Target, most: Array, cells: int, most_cells: int) -> EdgeCurves:
    """Curves with as many pieces, `cells` or twice that and so on, as bring them within `most` (e,) of their course.

    Nothing is asked of their ends: these are the curves from which the surface at the vertices is learnt. A curve that
    `most_cells` do not bring so near keeps the fewest pieces: its path leaps, and more copy the leaps.
    """
    own = np.full(len(layout.edges), cells, dtype=np.int64)
    while True:
        edges = fit_edge_curves(layout, target, own)
        far = edge_errors(layout, edges, target) > most
        finer = far & (own < most_cells)
        if not finer.any():
            return fit_edge_curves(layout, target, np.where(far, cells, own)) if far.any() else edges
        own = np.where(finer, 2 * own, own)


def edge_errors(layout: QuadLayout, edges: EdgeCurves, target: Target) -> Array:
    """(e,) largest distance of each curve from its crease, or from the target where it is smooth."""
    free = smooth_edges(layout)
    out = np.zeros(len(layout.edges))
    for cells, which, controls in edges.groups():
        count = 4 * cells + 1
        on_surface = free[which]
        if on_surface.any():
            many = max(count, FEWEST_SITES)
            flat = _at_middles(controls[on_surface], many).reshape(-1, 3)
            out[which[on_surface]] = target.tree.closest(flat).distance.reshape(-1, many).max(axis=1)
        if (~on_surface).any():
            dense = _path_samples(layout, which[~on_surface], 4 * count + 1)
            gap = _at_middles(controls[~on_surface], count)[:, :, None] - dense[:, None]
            out[which[~on_surface]] = np.linalg.norm(gap, axis=-1).min(axis=2).max(axis=1)
    return out


def _at_middles(controls: Array, count: int) -> Array:
    """(k, count, 3) points in the middles of `count` equal pieces of curves (k, cells + 3, 3)."""
    mid = (np.arange(count) + 0.5) / count
    return np.asarray(np.einsum("ai,kid->kad", collocation(controls.shape[1] - 3, mid), controls))


def _path_samples(layout: QuadLayout, which: IntArray, count: int) -> Array:
    """(k, count, 3) equidistant points on the paths of some edges."""
    lengths = np.diff(layout.path_offsets)[which]
    offsets = np.concatenate([[0], np.cumsum(lengths)])
    rows = np.repeat(layout.path_offsets[which] - offsets[:-1], lengths) + np.arange(offsets[-1])
    return resample(layout.path_points[rows], offsets, count)
